"""Masses, friction, delay and lag of a vehicle from logs of its wheels' torques and velocities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any

import numpy as np

from omnistep._estimates import Estimate, Fit, Floats, Parameter, at_bounds, estimates, fit, shifts, table
from omnistep._margins import Loops, loops
from omnistep._measurement_noise import likely
from omnistep._motion_model import SHORTEST_S, Masses, Motion, cut
from omnistep._omnistep import Log, Trace, Vehicle
from omnistep._toml_files import unknown_key
from omnistep._wheel_logs import LogLike, read
from omnistep.errors import ConfigError

NEEDED_BY = "omnistep.identify"

#: Where the search begins, if not at the file's.
BEGINS = {"delay_s": 0.005, "lag_s": 0.01}
#: What a held parameter may be off by, to say what that does to the others.
OFF = 0.1
#: With fewer rows than this in a wheel's time constant, counts blur how it follows its motor.
FEW = 10.0
#: What would tell each parameter.
MANOEUVRES = {
    "mass_kg": "accelerate and brake, forward and sideways, or weigh the vehicle: known mass_kg",
    "yaw_inertia_kg_m2": "turn on the spot, accelerating and braking",
    "wheel_inertia_kg_m2": "accelerate and brake the wheels in the air (lifted), or weigh the vehicle: known mass_kg",
    "gear_friction_n_m": "coast down, or drive steadily",
    "viscous_n_m_s_rad": "drive steadily at several speeds",
    "rolling_resistance": "also turn the wheels in the air (lifted): only there gear friction acts alone",
    "delay_s": "change torques in steps or as a chirp",
    "lag_s": "change torques in steps or as a chirp of up to 10 Hz",
    "stall_torque_n_m": "weigh the vehicle: known mass_kg; duty cycles alone give only ratios of torque to mass",
    "slope_n_m_s_rad": "drive at several speeds up to the fastest, at full duty",
}
NO_DUTY = (
    "this log cannot tell slope_n_m_s_rad and stall_torque_n_m: its torques are commanded ones, which do not show"
    " the motor's line; log wheel_NAME_duty (-1 to 1) instead of torques and drive up to the fastest speed"
)


@dataclass(frozen=True, kw_only=True)
class Identification:
    """Result of :func:`identify`.

    Attributes:
        estimates: the parameters.
        cannot_tell: parameters that the logs do not determine, and the manoeuvre that would; a line each.
        vehicle: the vehicle with the estimates, and gains for them. A vehicle file has no rolling resistance, so
            ``motor.gear_friction_n_m`` includes it.
        loops: the gains, with their margins.
        overrides: delay and lag as keys of a scenario, for a simulation with the estimates.
        residual_rad: residual of the wheels' angles, root mean square [rad].
        used: part of the logs' rows that could be used.
    """

    estimates: tuple[Estimate, ...]
    cannot_tell: tuple[str, ...]
    vehicle: Vehicle = field(repr=False)
    loops: Loops
    overrides: dict[str, Any]
    residual_rad: float
    used: float

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
        return "\n".join([table(self.estimates), left, f"gains: {self.loops}", *self.cannot_tell])


def identify(
    data: LogLike | Sequence[LogLike],
    *,
    vehicle: str | PathLike[str] | Vehicle,
    lifted: LogLike | Sequence[LogLike] = (),
    known: Mapping[str, float] | None = None,
) -> Identification:
    """Find masses, friction, delay and lag from logs of torques and velocities on flat ground, with intervals.

    The model assumes that the wheels roll without slip, and that the vehicle moves by its file's geometry. The twist
    changes by the torques, with delay and lag, less friction. This is integrated over stretches of 0.15 to 1.2 s
    without a wheel reversal, and compared with the readings by least squares. Errors of readings are whole counts and a
    random walk, the sum of noise on velocities; the residuals show the share of each (restricted maximum likelihood). A
    controller reacts to such errors, but later: with the right weights of past readings they cause no bias. Intervals
    are those of least squares, combined with the scatter between whole stretches. Parameters that the logs do not
    determine keep the values of the file, and are named.

    A delay of readings and a delay of torques have the same effect: ``delay_s`` is their sum, for readings that are
    counts over the period that ends with their row. For instantaneous readings it is half a period less.

    Args:
        data: logs of drives on flat ground: traces, logs, paths, or arrays by name, with columns ``time_s`` and, for
            the actuator of every wheel, ``wheel_NAME_position_rad`` or ``wheel_NAME_measured_rad_s``, and
            ``wheel_NAME_applied_n_m`` (as commanded) or ``wheel_NAME_duty`` (-1 to 1). A row's torque is held until the
            next row.
        vehicle: the vehicle as far as it is known: a built-in name, the path of a .toml file or a :class:`Vehicle`.
        lifted: logs with all wheels in the air.
        known: values that were measured otherwise, ``{"mass_kg": 3.2}``.

    Raises:
        ConfigError: a column is missing, the logs are too short or have no motion, or a number is out of range.
        LogError: a log cannot be read.
        ImportError: SciPy, or pyarrow for a CSV or Parquet file, is not installed; install the extra ``identify``.

    >>> import omnistep
    >>> truth = omnistep.Vehicle("mecanum4", overrides={"body.0.mass_kg": 26.0})
    >>> scenario = omnistep.Scenario("flat", vehicle=truth, overrides={
    ...     "physics.engine": "articulated", "duration_s": 4.0, "command.vx_m_s": 0.5, "command.then": [
    ...         {"at_s": 2.0, "vx_m_s": 0.0, "vy_m_s": 0.5, "wz_rad_s": 0.5, "ramp_s": 0.5}]})
    >>> found = omnistep.identify(omnistep.run(scenario), vehicle="mecanum4", known={"wheel_inertia_kg_m2": 0.0035})
    >>> round(found["mass_kg"].value, 1)
    30.0
    """
    guess = Vehicle(vehicle)
    masses = Masses(guess)
    logs = [(each, False) for each in _listed(data)] + [(each, True) for each in _listed(lifted)]
    if not logs:
        raise ConfigError("data: empty, allowed: at least one log", key="data")
    motions, kinds = [], set()
    for log, in_air in logs:
        rows = read(log, guess)
        inputs = rows.torques if rows.torques is not None else rows.duty
        kinds.add("torque" if rows.torques is not None else "duty")
        if inputs is None:
            key = f"wheel_{guess.wheel_names[0]}_applied_n_m"
            raise ConfigError(
                f"{rows.name}: no torque in {key}, allowed: wheel_NAME_applied_n_m or wheel_NAME_duty of every wheel"
                " ([commanded_torques] or [duty] of an import's map)",
                key=key,
                file=rows.name,
            )
        stretches = cut(rows, masses, inputs, lifted=in_air)
        if stretches is None:
            raise ConfigError(
                f"{rows.name}: no {SHORTEST_S} s in which the wheels keep turning one way, allowed: a log of a drive",
                key="data",
                file=rows.name,
            )
        motions.append(Motion(stretches, masses, inputs, guess["motor.efficiency"]))
    if len(kinds) > 1:
        raise ConfigError("data: logs with torques and logs with duty cycles, allowed: one kind", key="data")
    duty = kinds == {"duty"}
    parameters = _parameters(guess, masses, known or {}, duty=duty, motions=motions)
    names = [p.name for p in parameters]

    def residual(x: Floats) -> Floats:
        values = dict(zip(names, x, strict=True))
        return np.concatenate([motion.residual(values) for motion in motions])

    # Without any delay or lag the two look the same: the search begins elsewhere.
    begin = np.array([p.start if p.known else BEGINS.get(p.name, p.start) for p in parameters])
    found = _search(residual, parameters, motions, begin)
    _hear(motions, found.residual)
    bounds = np.array([(p.lower, p.upper) for p in parameters]).T
    begin = np.where(found.free & (found.x > bounds[0]) & (found.x < bounds[1]), found.x, begin)
    found = _search(residual, parameters, motions, begin)
    values = dict(zip(names, (float(x) for x in found.x), strict=True))
    parts = estimates(parameters, found, needed_by=NEEDED_BY)
    built, notes = _built(guess, masses, values, duty=duty)
    matrix = masses.matrix(values["mass_kg"], values["yaw_inertia_kg_m2"], values["wheel_inertia_kg_m2"])
    period = motions[0].period
    gains = loops(
        built,
        period_s=period,
        matrix=matrix,
        delay_s=values["delay_s"],
        lag_s=values["lag_s"],
        viscous_n_m_s_rad=values["viscous_n_m_s_rad"],
    )
    return Identification(
        estimates=parts,
        cannot_tell=(
            *dict.fromkeys(doubt for motion in motions for doubt in motion.doubts()),
            *_cannot_tell(residual, parameters, found),
            *(_too_fast(motions, values) if duty else ()),
            *at_bounds(parameters, found),
            *notes,
            *(() if duty else (NO_DUTY,)),
        ),
        vehicle=built.replace(
            {"gains": {"kp_n_m_s_rad": gains.kp_n_m_s_rad, "ki_n_m_rad": gains.ki_n_m_rad, "kd_n_m_s2_rad": 0.0}}
        ),
        loops=gains,
        overrides={
            "actuators.torque_lag_s": values["lag_s"],
            "sensors.delay_us": max(0, round(values["delay_s"] / period)) * round(1e6 * period),
        },
        residual_rad=float(np.sqrt(np.mean(found.residual**2))),
        used=float(np.mean([motion.stretches.used for motion in motions])),
    )


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
    if driven <= 2 * SHORTEST_S * int(found.free.sum()):
        raise ConfigError(
            f"{driven:.2g} s of driving for {int(found.free.sum())} parameters, allowed: more than"
            f" {2 * SHORTEST_S:g} s for each; drive longer",
            key="data",
        )
    return found


def _hear(motions: Sequence[Motion], residual: Floats) -> None:
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


def _parameters(
    vehicle: Vehicle, masses: Masses, known: Mapping[str, float], *, duty: bool, motions: Sequence[Motion]
) -> list[Parameter]:
    motor = vehicle.to_dict()["motor"]
    stall, end = motor["stall_torque_n_m"], vehicle.no_load_rad_s
    slope = stall / end if end else 0.0
    wheel_stall = stall / float(masses.gear.mean())
    speed = max(float(np.abs(np.nan_to_num(m.stretches.log.measured)).max()) for m in motions)
    period = motions[0].period
    ground = not all(motion.stretches.lifted for motion in motions)

    def of(
        name: str, unit: str, start: float, scale: float, most: float, rank: int = 0, least: float = 0.0
    ) -> Parameter:
        given = known.get(name)
        if given is not None and not (isinstance(given, int | float) and least <= given <= most):
            raise ConfigError(f"known: {name} = {given!r}, allowed: {least:.3g} to {most:.3g}", key=name)
        value = start if given is None else float(given)
        return Parameter(
            name=name,
            unit=unit,
            start=value,
            scale=scale,
            lower=least,
            upper=most,
            rank=rank,
            known=given is not None,
            file=start,
        )

    mass, yaw, wheel = masses.mass, masses.yaw_inertia, masses.wheel_inertia
    friction = 0.1 * wheel_stall
    rolling = 9.81 * mass * float((masses.share * masses.radius).mean())
    parameters = [
        of("mass_kg", "kg", mass, mass, 20 * mass, 1, 0.05 * mass),
        of("yaw_inertia_kg_m2", "kg.m2", yaw, yaw, 50 * yaw, 1, 0.02 * yaw),
        of("wheel_inertia_kg_m2", "kg.m2", wheel, wheel, 50 * wheel, 3, 0.02 * wheel),
        of("gear_friction_n_m", "N.m", motor["gear_friction_n_m"], friction, 10 * wheel_stall),
        of("viscous_n_m_s_rad", "N.m.s/rad", motor["viscous_n_m_s_rad"], friction / speed, 10 * wheel_stall / speed, 2),
        of("rolling_resistance", "", 0.0, friction / rolling, 1.0, 4),
        of("delay_s", "s", 0.0, 0.01, 0.5, 0, -period),
        of("lag_s", "s", 0.0, 0.02, 1.0, 1),
    ]
    if duty:
        parameters += [
            of("stall_torque_n_m", "N.m", stall, stall, 20 * stall, 5, 0.02 * stall),
            of("slope_n_m_s_rad", "N.m.s/rad", slope, slope or friction / speed, 20 * (slope or stall / speed), 1),
        ]
    if unknown := sorted(set(known) - {p.name for p in parameters}):
        hint = unknown_key(unknown[0], [p.name for p in parameters])
        raise ConfigError(f"known: {unknown[0]}: {hint}", key=unknown[0])
    in_air = any(motion.stretches.lifted for motion in motions)
    if not in_air and not {"rolling_resistance", "gear_friction_n_m"} & set(known):
        parameters = [
            replace(p, apart_from="gear_friction_n_m") if p.name == "rolling_resistance" else p for p in parameters
        ]
    if duty and in_air and not {"lag_s", "wheel_inertia_kg_m2"} & set(known):
        # A wheel that its motor's line brakes follows as a torque that lags does: which is which, nothing tells.
        parameters = [replace(p, apart_from="wheel_inertia_kg_m2") if p.name == "lag_s" else p for p in parameters]
    if not ground:
        parameters = [
            replace(p, known=True) if p.name in ("mass_kg", "yaw_inertia_kg_m2", "rolling_resistance") else p
            for p in parameters
        ]
    return parameters


def _cannot_tell(residual: Callable[[Floats], Floats], parameters: Sequence[Parameter], found: Fit) -> tuple[str, ...]:
    said = []
    for k, others in found.together.items():
        parameter = parameters[k]
        with_others = f" apart from {', '.join(parameters[other].name for other in others)}" if others else ""
        held = f"held at {parameter.start:.4g} {parameter.unit}".rstrip()
        moved = shifts(residual, parameters, found, k, OFF)
        if moved and parameter.start:
            which = ", ".join(f"{name} by {100 * part:+.2g} %" for name, part in moved.items())
            held += f", which the intervals assume to be exact: {100 * OFF:.0f} % more of it changes {which}"
        said.append(f"this log cannot tell {parameter.name}{with_others}; {held}; {MANOEUVRES[parameter.name]}")
    return tuple(said)


def _too_fast(motions: Sequence[Motion], p: Mapping[str, float]) -> tuple[str, ...]:
    """Report where the motion follows the motors within few periods of the log, so that counts hide it."""
    for motion in motions:
        constant_s = motion.time_constant_s(p)
        if constant_s < FEW * motion.period:
            what = (
                "a wheel in the air follows its motor" if motion.stretches.lifted else "the vehicle follows its motors"
            )
            return (
                f"results may be off by several of their intervals, delay_s, lag_s and inertias most: {what} within"
                f" {constant_s:.2g} s, and the log has a row every {motion.period:.2g} s; log every"
                f" {constant_s / FEW:.1g} s, or torques instead of duty cycles",
            )
    return ()


def _built(vehicle: Vehicle, masses: Masses, p: Mapping[str, float], *, duty: bool) -> tuple[Vehicle, tuple[str, ...]]:
    """The vehicle with these numbers, and the values that its file cannot hold."""
    keys = vehicle.to_dict()
    notes: list[str] = []
    bodies = p["mass_kg"] - float(masses.wheel_mass.sum())
    if bodies <= 0.0:
        notes.append(f"the file's masses are kept: its wheels alone weigh more than the {p['mass_kg']:.4g} kg found")
    else:
        part = bodies / float(masses.body_mass.sum())
        for body in keys["body"]:
            body["mass_kg"] *= part
        on_bodies = float(masses.body_mass @ (masses.body_places**2).sum(axis=1))
        discs = masses.discs * p["wheel_inertia_kg_m2"] / masses.wheel_inertia
        own = p["yaw_inertia_kg_m2"] - discs - (masses.away + (part - 1.0) * on_bodies)
        if own <= 0.0:
            notes.append(
                "the file's boxes are kept: with these masses at their positions the yaw inertia is more than the"
                f" {p['yaw_inertia_kg_m2']:.4g} kg.m2 found"
            )
        else:
            stretch = float(np.sqrt(own / (masses.own * part)))
            for body in keys["body"]:
                x, y, z = body["box_m"]
                body["box_m"] = [x * stretch, y * stretch, z]
    for wheel in keys["wheel"]:
        wheel["inertia_kg_m2"] *= p["wheel_inertia_kg_m2"] / masses.wheel_inertia
    motor = keys["motor"]
    rolling = p["rolling_resistance"] * p["mass_kg"] * 9.81 * float((masses.share * masses.radius).mean())
    motor["gear_friction_n_m"] = p["gear_friction_n_m"] + rolling
    motor["viscous_n_m_s_rad"] = p["viscous_n_m_s_rad"]
    if duty:
        motor["stall_torque_n_m"] = p["stall_torque_n_m"]
        motor["slope_n_m_s_rad"] = p["slope_n_m_s_rad"]
        motor["no_load_rpm"] = motor["no_load_rad_s"] = None
    return Vehicle.from_dict(keys), tuple(notes)
