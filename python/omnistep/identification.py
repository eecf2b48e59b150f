"""Masses, friction, delay and lag of a vehicle from logs of its wheels' torques and velocities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np

from omnistep._blas_threads import one_thread
from omnistep._estimates import (
    CHECK,
    Estimate,
    Fit,
    Floats,
    Parameter,
    at_bounds,
    estimates,
    fit,
    table,
    withheld,
)
from omnistep._identification_doubts import NO_DUTY, Noises, bent_line, far_off, noises, refuting, too_fast
from omnistep._identified_parameters import BEGINS, parameters_of, undetermined
from omnistep._identified_vehicle import vehicle_with
from omnistep._margins import Loops, loops
from omnistep._measurement_noise import likely
from omnistep._motion_model import ZERO_DUTY, Motion
from omnistep._omnistep import Log, Trace, Vehicle
from omnistep._progress import bar
from omnistep._speed_simulation import SpeedSimulation, simulated
from omnistep._stretches import SHORTEST_S, STANDS, cut
from omnistep._vehicle_masses import Masses
from omnistep._wheel_logs import ZERO_DUTIES, LogLike, WheelLog, read
from omnistep.errors import ConfigError

NEEDED_BY = "omnistep.identify"

#: The state of a bridge at zero duty matters if the duty cycle is zero in this fraction of the rows in which a wheel
#: turns.
AT_ZERO = 0.01
#: Two behaviours of a bridge fit about equally if their errors differ by less than this factor.
ALIKE = 1.2
#: Speeds with a larger relative error than this may come from bridges that coast within each PWM period.
LINE = 0.05
#: The way of these bridges, for `Problem.solve`.
CHOPS = "chops"
#: Evaluations after which most searches have ended.
USUAL = 300


@dataclass(frozen=True, kw_only=True)
class Identification:
    """Result of :func:`identify`.

    Attributes:
        estimates: the parameters.
        undetermined: parameters that the logs do not determine, and the motion that would; one line each. Logs that
            were cut off come first.
        vehicle: the vehicle with the estimates, and gains for them. A vehicle file has no rolling resistance, so
            ``motor.gear_friction_n_m`` includes it.
        simulation: the wheels' speeds, simulated from the logs' torques or duty cycles with the estimates.
        zero_duty: state of the bridges at a duty cycle of zero: ``brake`` or ``coast``; None for torques.
        noises: the noise of the wheels' speeds that the fit needs, and that they show.
        loops: the gains, with their margins.
        overrides: delay and lag as keys of a scenario, for a simulation with the estimates.
        residual_rad: residual of the wheels' angles, root mean square [rad].
        used: part of the logs' rows that could be used.
        doubted: reason why the numbers should not be used: the residuals refute the model, or a number ended at a bound
            of its range. Otherwise empty.
    """

    estimates: tuple[Estimate, ...]
    undetermined: tuple[str, ...]
    vehicle: Vehicle = field(repr=False)
    simulation: SpeedSimulation = field(repr=False)
    zero_duty: str | None
    noises: Noises
    loops: Loops
    overrides: dict[str, Any]
    residual_rad: float
    used: float
    doubted: str = ""

    def __getitem__(self, name: str) -> Estimate:
        for each in self.estimates:
            if each.name == name:
                return each
        raise KeyError(f"{name}, allowed: {', '.join(each.name for each in self.estimates)}")

    def table(self) -> str:
        """The estimates, the gains and the undetermined parameters, as text."""
        left = (
            f"angles remaining: {self.residual_rad:.3g} rad (root mean square), of {100 * self.used:.0f} % of the rows"
        )
        return "\n".join(
            [
                table(self.estimates),
                left,
                str(self.noises),
                str(self.simulation),
                f"gains: {self.loops}",
                *self.undetermined,
            ]
        )


def identify(
    data: LogLike | Sequence[LogLike],
    *,
    vehicle: str | PathLike[str] | Vehicle,
    wheels_off_ground: LogLike | Sequence[LogLike] = (),
    fix: Mapping[str, float] | None = None,
    zero_duty: str | None = None,
    progress: bool = True,
) -> Identification:
    """Find masses, friction, delay and lag from logs of torques and velocities on flat ground, with intervals.

    The model assumes that the wheels roll without slip, and that the vehicle moves by its file's geometry. The twist
    changes by the torques, with delay and lag, less friction. This is integrated over stretches of 0.15 to 1.2 s
    without a wheel reversal, and compared with the readings by least squares. Errors of readings are whole counts and a
    random walk, the sum of noise on velocities; the residuals show the share of each (restricted maximum likelihood). A
    controller reacts to such errors, but later: with the right weights of past readings they cause no bias. Intervals
    come from least squares, combined with the scatter between whole stretches. Parameters that the logs do not
    determine keep the values of the file, and are named. No interval is reported if the residuals contradict the model.

    A bridge brakes or coasts at a duty cycle of zero: coasting, a motor neither drives nor brakes. If it is not known,
    both are tried.

    A delay of readings and a delay of torques have the same effect: ``delay_s`` is their sum, for readings that are
    counts over the period that ends with their row. For instantaneous readings it is half a period less.

    Args:
        data: logs of drives on flat ground: traces, logs, paths, or arrays by name, with columns ``time_s`` and, for
            the actuator of every wheel, ``wheel_NAME_position_rad`` or ``wheel_NAME_measured_rad_s``, and
            ``wheel_NAME_applied_n_m`` (as commanded) or ``wheel_NAME_duty`` (-1 to 1). A row's torque is held until the
            next row.
        vehicle: the vehicle as far as it is known: a built-in name, the path of a .toml file or a :class:`Vehicle`.
        wheels_off_ground: logs with all wheels in the air.
        fix: values that were measured otherwise, ``{"mass_kg": 3.2}``; they are not estimated.
        zero_duty: what the bridges do at a duty cycle of zero, instead of what the logs say
            (``[duty] zero`` of an import's map).
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.

    Raises:
        ConfigError: a column is missing, the logs are too short or have no motion, or a number is out of range.
        LogError: a log cannot be read.
        ImportError: SciPy, or pyarrow for a CSV or Parquet file, is not installed; install the extra ``identify``.

    >>> import omnistep
    >>> truth = omnistep.Vehicle("mecanum4", overrides={"body.0.mass_kg": 26.0})
    >>> scenario = omnistep.Scenario("flat", vehicle=truth, overrides={
    ...     "physics.engine": "articulated", "duration_s": 4.0, "command.vx_m_s": 0.5, "command.then": [
    ...         {"at_s": 2.0, "vx_m_s": 0.0, "vy_m_s": 0.5, "wz_rad_s": 0.5, "ramp_s": 0.5}]})
    >>> found = omnistep.identify(omnistep.run(scenario), vehicle="mecanum4", fix={"wheel_inertia_kg_m2": 0.0035})
    >>> round(found["mass_kg"].value)
    30
    """
    guess = Vehicle(vehicle)
    if zero_duty is not None and zero_duty not in ZERO_DUTIES:
        raise ConfigError(f'zero_duty: {zero_duty!r}, allowed: "brake" or "coast"', key="zero_duty")
    logs = [(read(each, guess), False) for each in _listed(data)]
    logs += [(read(each, guess), True) for each in _listed(wheels_off_ground)]
    if not logs:
        raise ConfigError("data: empty, allowed: at least one log", key="data")
    problem = Problem(guess, logs, fix or {}, zero_duty)
    tried = problem.ways()
    answers: list[Answer] = []
    with one_thread(NEEDED_BY):
        with bar("identify", shown=progress) as show:
            for way in tried:
                answers.append(problem.solve(way, lambda part: show((len(answers) + part) / len(tried))))
        best = _better(answers)
        bent = ""
        if problem.duty and best.simulation.off > LINE:
            with bar("identify: other bridges", shown=progress) as show:
                others = (problem.solve(way, show, stated=False) for way in problem.not_stated())
                lines = [best.simulation.off, *(each.simulation.off for each in others)]
                if min(lines) > LINE:
                    bent = bent_line(lines, problem.solve(CHOPS, show, stated=False).simulation.off)
        return _identification(problem, best, answers, bent)


@dataclass(frozen=True)
class Answer:
    """What fits the logs best, for one behaviour of the bridges at zero duty."""

    zero: str | None
    motions: Sequence[Motion]
    parameters: Sequence[Parameter]
    residual: Callable[[Floats], Floats]
    found: Fit
    values: Mapping[str, float]
    simulation: SpeedSimulation


class Problem:
    """Logs of a vehicle, and its known parameters."""

    def __init__(
        self,
        guess: Vehicle,
        logs: Sequence[tuple[WheelLog, bool]],
        fix: Mapping[str, float],
        zero_duty: str | None,
    ) -> None:
        self.guess, self.logs, self.fix, self.zero_duty = guess, logs, fix, zero_duty
        self.masses = Masses(guess)
        for log, _ in logs:
            if log.torques is None and log.duty is None:
                key = f"wheel_{guess.wheel_names[0]}_applied_n_m"
                raise ConfigError(
                    f"{log.name}: no torque in {key}, allowed: wheel_NAME_applied_n_m or wheel_NAME_duty of every wheel"
                    " ([commanded_torques] or [duty] of an import's map)",
                    key=key,
                    file=log.name,
                )
        kinds = {log.torques is None for log, _ in logs}
        if len(kinds) > 1:
            raise ConfigError("data: logs with torques and logs with duty cycles, allowed: one kind", key="data")
        self.duty = kinds == {True}

    def ways(self) -> list[str | None]:
        """What bridges may do at zero duty, as far as that matters and is not known."""
        if not self.duty:
            return [None]
        given = {self.zero_duty or log.zero_duty for log, _ in self.logs}
        if None not in given:
            return [given.pop()]
        matters = any(_part_at_zero(log) > AT_ZERO for log, _ in self.logs if log.zero_duty is None)
        return ["brake", "coast"] if matters else ["brake"]

    def not_stated(self) -> list[str]:
        """What bridges may do at zero duty other than was stated."""
        given = {self.zero_duty or log.zero_duty for log, _ in self.logs}
        return [] if None in given else [way for way in ZERO_DUTIES if way not in given]

    def solve(self, way: str | None, progress: Callable[[float], None], *, stated: bool = True) -> Answer:
        """The best-fitting parameters, for the stated behaviour of the bridges or, if unstated, for the tried one."""
        motions = [
            self._motion(log, in_air, (self.zero_duty or log.zero_duty or way) if stated else way)
            for log, in_air in self.logs
        ]
        parameters = parameters_of(self.guess, self.masses, self.fix, duty=self.duty, motions=motions)
        names = [p.name for p in parameters]
        evaluations = 0

        def residual(x: Floats) -> Floats:
            nonlocal evaluations
            evaluations += 1
            progress(0.9 * evaluations / (evaluations + USUAL))
            values = dict(zip(names, x, strict=True))
            return np.concatenate([motion.residual(values) for motion in motions])

        # Without any delay or lag the two are indistinguishable, so that the search begins elsewhere.
        begin = np.array([p.start if p.fixed else BEGINS.get(p.name, p.start) for p in parameters])
        found = _search(residual, parameters, motions, begin)
        _estimate_noise(motions, found.residual)
        bounds = np.array([(p.lower, p.upper) for p in parameters]).T
        begin = np.where(found.free & (found.x > bounds[0]) & (found.x < bounds[1]), found.x, begin)
        found = _search(residual, parameters, motions, begin)
        values = dict(zip(names, (float(x) for x in found.x), strict=True))
        simulation = simulated(motions, values)
        progress(1.0)
        return Answer(way, motions, parameters, residual, found, values, simulation)

    def _motion(self, log: WheelLog, in_air: bool, way: str | None) -> Motion:
        inputs = log.duty if self.duty else log.torques
        assert inputs is not None
        stretches = cut(log, self.masses, inputs, lifted=in_air)
        if stretches is None:
            raise ConfigError(
                f"{log.name}: no {SHORTEST_S} s in which the wheels keep turning one way, allowed: a log of a drive",
                key="data",
                file=log.name,
            )
        efficiency, coasts = self.guess["motor.efficiency"], self.duty and way == "coast"
        return Motion(stretches, self.masses, inputs, efficiency, coasts=coasts, chops=way == CHOPS)


def _part_at_zero(log: WheelLog) -> float:
    """Part of the rows with a turning wheel in which its duty cycle is zero."""
    assert log.duty is not None
    speed = np.abs(np.nan_to_num(log.measured))
    turns = speed > STANDS * np.quantile(speed, 0.99)
    return float(np.mean(np.abs(log.duty[turns]) < ZERO_DUTY)) if turns.any() else 0.0


def _identification(problem: Problem, best: Answer, answers: Sequence[Answer], bent: str) -> Identification:
    motions, parameters, found, values = best.motions, best.parameters, best.found, best.values
    built, notes = vehicle_with(problem.guess, problem.masses, values, duty=problem.duty)
    period = motions[0].period
    gains = loops(
        built,
        period_s=period,
        matrix=problem.masses.matrix(values["mass_kg"], values["yaw_inertia_kg_m2"], values["wheel_inertia_kg_m2"]),
        delay_s=values["delay_s"],
        lag_s=values["lag_s"],
        viscous_n_m_s_rad=values["viscous_n_m_s_rad"],
    )
    parts = estimates(parameters, found, needed_by=NEEDED_BY)
    noise = noises(motions, found.residual)
    refuted = bent or refuting(noise, best.simulation)
    bounds = at_bounds(parameters, found)
    return Identification(
        estimates=withheld(parts) if refuted else parts,
        undetermined=(
            *dict.fromkeys(log.cut_off for log, _ in problem.logs if log.cut_off),
            *dict.fromkeys(doubt for motion in motions for doubt in motion.doubts()),
            *([f"no interval is given: {refuted}"] if refuted else []),
            *([] if bent else _which_way(best, answers)),
            *far_off(parts),
            *undetermined(best.residual, parameters, found),
            *(too_fast(motions, values) if problem.duty else ()),
            *(f"{each}, which distorts the others; {CHECK}" for each in bounds),
            *notes,
            *(() if problem.duty else (NO_DUTY,)),
        ),
        vehicle=built.replace(
            {"gains": {"kp_n_m_s_rad": gains.kp_n_m_s_rad, "ki_n_m_rad": gains.ki_n_m_rad, "kd_n_m_s2_rad": 0.0}}
        ),
        simulation=best.simulation,
        zero_duty=best.zero,
        noises=noise,
        loops=gains,
        overrides={
            "actuators.torque_lag_s": values["lag_s"],
            "sensors.delay_s": max(0, round(values["delay_s"] / period)) * round(1e6 * period) / 1e6,
        },
        residual_rad=float(np.sqrt(np.mean(found.residual**2))),
        used=float(np.mean([motion.stretches.used for motion in motions])),
        doubted=next((reason.split(";")[0] for reason in (refuted, *bounds) if reason), ""),
    )


def _better(answers: Sequence[Answer]) -> Answer:
    """The first, unless the second fits clearly better: bridges that coast fit braking ones too, as friction."""
    first, *others = answers
    return others[0] if others and first.simulation.off > ALIKE * others[0].simulation.off else first


def _which_way(best: Answer, answers: Sequence[Answer]) -> list[str]:
    """Report the likely behaviour of the bridges at zero duty, if both were tried."""
    others = [answer for answer in answers if answer is not best]
    if not others:
        return []
    off, other = (f"{100 * answer.simulation.off:.2g} %" for answer in (best, others[0]))
    said = f'zero duty: "{best.zero}" leaves the speeds off by {off}, "{others[0].zero}" by {other}'
    if others[0].simulation.off < ALIKE * best.simulation.off:
        return [f'{said}, about equally; results are those of "{best.zero}": give the right one ([duty] zero)']
    return [f'{said}; results are those of "{best.zero}": give it ([duty] zero)']


def _search(
    residual: Callable[[Floats], Floats], parameters: Sequence[Parameter], motions: Sequence[Motion], begin: Floats
) -> Fit:
    stretches = [motion.clusters() for motion in motions]
    offsets = np.cumsum([0, *(int(each[-1]) + 1 for each in stretches[:-1])])
    found = fit(
        residual,
        parameters,
        needed_by=NEEDED_BY,
        begin=begin,
        clusters=np.concatenate([each + offset for each, offset in zip(stretches, offsets, strict=True)]),
        redundant=sum(motion.redundant() for motion in motions),
    )
    driven = sum(len(motion.measured) * motion.stretches.rows * motion.period for motion in motions)
    searched = sum(not (p.fixed or p.apart_from) for p in parameters)
    if driven <= 2 * SHORTEST_S * searched:
        raise ConfigError(
            f"{driven:.2g} s of driving for {searched} parameters, allowed: more than"
            f" {2 * SHORTEST_S:g} s for each; drive longer",
            key="data",
        )
    return found


def _estimate_noise(motions: Sequence[Motion], residual: Floats) -> None:
    """Estimate the measurement noise along stretches from the residuals: logs of one kind together."""
    ends = np.cumsum([0, *(motion.measured.size for motion in motions)])
    kinds: dict[tuple[int, float, bool], list[tuple[Motion, Floats]]] = {}
    for motion, begin, end in zip(motions, ends[:-1], ends[1:], strict=True):
        kind = (motion.stretches.rows, motion.period, motion.stretches.lifted)
        kinds.setdefault(kind, []).append((motion, residual[begin:end].reshape(motion.measured.shape)))
    for (rows, _, _), alike in kinds.items():
        noise = likely([(left, motion.stretches.stretch) for motion, left in alike], rows, NEEDED_BY)
        for motion, _ in alike:
            motion.noise = noise


def _listed(data: Any) -> list[Any]:
    if isinstance(data, str | PathLike | Mapping | Trace | Log):
        return [data]
    return list(data)
