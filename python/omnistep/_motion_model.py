"""Model of a vehicle's motion from wheels, torques and masses on flat ground, in stretches without a wheel reversal.

Everything is an integral, so no noisy signal is differentiated: the twist changes by ``M^-1 A^T`` times the integral
of the torques less friction, and the wheels turn by the integral of that. The quantisation of encoders is then an
independent error of each reading.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep import _plausibility
from omnistep._estimates import Floats, scipy_part
from omnistep._measurement_noise import Noise
from omnistep._omnistep import Kinematics, Vehicle
from omnistep._wheel_logs import WheelLog

Integers = NDArray[np.int64]

#: Readings are averaged over this time: shorter than what moves a vehicle, and few numbers to fit.
BIN_S = 0.02
#: What lasts longer is cut into stretches of about this time, none over 1.5 times as long: long ones tell friction,
#: short ones do not drift. Cut to no more than this, intervals of friction held the truth in 86 % instead of 95 %.
LONG_S = 0.8
SHORTEST_S = 0.15
#: Fewest bins of a stretch: a line goes through two.
FEWEST = 3
#: A wheel stands below this part of the fastest.
STANDS = 0.04
#: A wheel that stands turns by no more than this in a stretch [rad], three counts of 360; else it creeps, and drags.
CREEPS_RAD = 0.05
#: Velocities are smoothed over this time to see which way a wheel turns.
SMOOTH_S = 0.03
#: Left out after a wheel began, stopped or turned round: the smoothed velocity does not know when exactly.
SETTLE_S = 0.03
#: Left out after torques that are not known: three times a long lag.
REMEMBERED_S = 0.15


class Masses:
    """Masses of a vehicle's file, and the mass matrix for other numbers."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        keys = vehicle.to_dict()
        bodies, wheels = keys["body"], keys["wheel"]
        self.gear = np.array([wheel["gear"] for wheel in wheels])
        self.radius = np.array([wheel["radius_m"] for wheel in wheels])
        self.wheel_mass = np.array([wheel["mass_kg"] for wheel in wheels])
        self.body_mass = np.array([body["mass_kg"] for body in bodies])
        self.wheel_inertias = np.array([wheel["inertia_kg_m2"] for wheel in wheels])
        self.wheel_inertia = float(self.wheel_inertias.mean())
        self.wheel_places = np.array([wheel["position_m"] for wheel in wheels])
        self.body_places = np.array([body["com_m"][:2] for body in bodies])
        self.mass = float(self.wheel_mass.sum() + self.body_mass.sum())
        self.centre = (self.wheel_mass @ self.wheel_places + self.body_mass @ self.body_places) / self.mass
        edges = np.array([body["box_m"] for body in bodies])
        self.own = float((self.body_mass * (edges[:, 0] ** 2 + edges[:, 1] ** 2)).sum() / 12.0)
        self.away = float(
            self.wheel_mass @ (self.wheel_places**2).sum(axis=1) + self.body_mass @ (self.body_places**2).sum(axis=1)
        )
        # A wheel is a disc: about the vertical it has half of what it has about its axle.
        self.discs = 0.5 * float(self.wheel_inertias.sum())
        self.yaw_inertia = self.own + self.away + self.discs
        self.map = Kinematics(layout=vehicle.layout).inverse_matrix
        #: From wheels back to the twist.
        self.back = np.linalg.pinv(self.map)
        loads = vehicle.static_loads_n()
        count = len(wheels)
        # As parts of the weight.
        self.share = np.full(count, 1.0 / count) if loads is None else loads / loads.sum()

    def turning(self, wheel_inertia: float) -> Floats:
        """Inertias of the wheels at their actuators [kg.m^2], in the proportions of the file."""
        return np.asarray(self.wheel_inertias * (wheel_inertia / self.wheel_inertia) * self.gear**2)

    def matrix(self, mass: float, yaw_inertia: float, wheel_inertia: float) -> Floats:
        """Mass matrix about the origin, turning wheels included."""
        x, y = self.centre
        rigid = np.array([[mass, 0.0, -mass * y], [0.0, mass, mass * x], [-mass * y, mass * x, yaw_inertia]])
        return np.asarray(rigid + self.map.T @ (self.turning(wheel_inertia)[:, None] * self.map))


@dataclass(frozen=True)
class Stretches:
    """A log, cut into stretches; the bins of all stretches in sequence."""

    log: WheelLog
    #: Are the wheels in the air?
    lifted: bool
    #: Rows of the log at which each bin begins, (B,), and how many rows it has.
    first: Integers
    rows: int
    #: Stretch of each bin, from 0, (B,).
    stretch: Integers
    #: Which way each wheel turns in each stretch: -1, 0 where it stands, 1, (S, N).
    signs: Integers
    #: Part of the log's rows that are in stretches.
    used: float

    def mean(self, series: Floats) -> Floats:
        """Mean of a series over rows in each bin."""
        sums = np.concatenate([np.zeros((1, series.shape[1])), np.cumsum(np.nan_to_num(series), axis=0)])
        return np.asarray((sums[self.first + self.rows] - sums[self.first]) / self.rows)

    def straightened(self, bins: Floats) -> Floats:
        """Less the straight line of each stretch: its start and its initial speed are not known."""
        count = np.bincount(self.stretch)

        def per_stretch(column: Floats) -> Floats:
            return np.asarray(np.bincount(self.stretch, weights=column)[self.stretch])

        late = self.first - per_stretch(self.first.astype(np.float64)) / count[self.stretch]
        spread = per_stretch(late**2)
        columns = [
            column - per_stretch(column) / count[self.stretch] - late * per_stretch(late * column) / spread
            for column in bins.T
        ]
        return np.stack(columns, axis=1)

    def binned(self, rows: Floats) -> Floats:
        """A series over rows, in bins, straightened."""
        return self.straightened(self.mean(rows))


def cut(log: WheelLog, masses: Masses, inputs: Floats, *, lifted: bool) -> Stretches | None:
    """Cut a log into stretches; None where there are none."""
    rows = max(1, round(BIN_S / log.period_s))
    there = np.isfinite(log.measured).all(axis=1) & np.isfinite(inputs).all(axis=1)
    velocity = log.measured
    if not lifted:
        # The motion of the whole: what single wheels read besides is noise or slip.
        velocity = velocity @ masses.back.T @ masses.map.T
    smooth = _smooth(np.nan_to_num(velocity), max(1, round(SMOOTH_S / log.period_s)))
    signs = np.sign(smooth).astype(np.int64)
    fastest = float(np.quantile(np.abs(smooth).max(axis=1), 0.99))
    if fastest == 0.0:
        return None
    signs[np.abs(smooth) < STANDS * fastest] = 0
    turns = np.r_[True, (np.diff(signs, axis=0) != 0).any(axis=1)]
    settle = max(1, round(SETTLE_S / log.period_s))
    near: Any = np.convolve(turns | ~there, np.ones(2 * settle + 1), mode="same") > 0.5
    # After torques that nobody knows: a lag remembers them.
    unknown: Any = ~np.isfinite(inputs).all(axis=1)
    remembered = max(1, round(REMEMBERED_S / log.period_s))
    near |= np.convolve(unknown, np.ones(remembered + 1))[: len(unknown)] > 0.5
    usable = ~near & (signs != 0).any(axis=1)
    angle = np.cumsum(np.nan_to_num(log.measured), axis=0) * log.period_s
    edges = np.flatnonzero(np.diff(np.concatenate([[False], usable, [False]])))
    first, stretch, kept, count = [], [], [], 0
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        bins = (end - begin) // rows
        parts = max(1, round(bins * rows * log.period_s / LONG_S))
        for part in np.array_split(np.arange(bins), parts):
            if len(part) * rows * log.period_s < SHORTEST_S or len(part) < FEWEST:
                continue
            rows_of = slice(begin + rows * part[0], begin + rows * (part[-1] + 1))
            if (np.ptp(angle[rows_of], axis=0)[signs[begin] == 0] > CREEPS_RAD).any():
                continue
            first += list(begin + rows * part)
            stretch += [count] * len(part)
            kept.append(signs[begin])
            count += 1
    if not count:
        return None
    begins = np.array(first, dtype=np.int64)
    return Stretches(
        log=log,
        lifted=lifted,
        first=begins,
        rows=rows,
        stretch=np.array(stretch, dtype=np.int64),
        signs=np.array(kept),
        used=len(begins) * rows / len(log.measured),
    )


def _integral(series: Floats, period: float) -> Floats:
    """Integral up to each row of a signal that is linear between rows."""
    return np.asarray((np.cumsum(series, axis=0) - 0.5 * series) * period)


def _smooth(series: Floats, rows: int) -> Floats:
    window = np.ones(rows) / rows
    return np.stack([np.convolve(column, window, mode="same") for column in series.T], axis=1)


class Motion:
    """Residuals of one log for given parameters."""

    def __init__(self, stretches: Stretches, masses: Masses, inputs: Floats, efficiency: float) -> None:
        self.stretches, self.masses = stretches, masses
        self.period = stretches.log.period_s
        inputs = np.nan_to_num(inputs)
        if efficiency < 1.0:
            driving = inputs * np.nan_to_num(stretches.log.measured) > 0.0
            inputs = inputs * np.where(driving, efficiency, 1.0 / efficiency)
        self.inputs = inputs
        # Integrals at each row of what is held between rows: once, and twice.
        start = np.zeros((1, inputs.shape[1]))
        self.once = np.concatenate([start, np.cumsum(inputs, axis=0)])[:-1] * self.period
        steps = self.once * self.period + 0.5 * self.period**2 * inputs
        self.twice = np.concatenate([start, np.cumsum(steps, axis=0)])[:-1]
        # Readings are of the period that ends with their row, as counts are: their sum is the angle there.
        angle = np.cumsum(np.nan_to_num(stretches.log.measured), axis=0) * self.period
        self.map = np.eye(inputs.shape[1]) if stretches.lifted else masses.map
        self.measured = stretches.binned(angle)
        self.angle = stretches.binned(_integral(angle, self.period))
        clock: Floats = np.arange(len(inputs), dtype=np.float64)[:, None] * self.period
        signs = stretches.signs[stretches.stretch]
        self.turned, self.since = stretches.binned(0.5 * clock**2) * signs, stretches.binned(clock) * signs
        # What all wheels together say of the motion, as angles of the wheels.
        if not stretches.lifted:
            self.measured = self.measured @ masses.back.T @ self.map.T
        #: What makes errors of readings independent: none for errors of angles that are.
        self.noise: Noise | None = None
        self.swerve = None if stretches.lifted else self._swerve()
        self._delayed: tuple[tuple[float, float], tuple[Floats, Floats]] | None = None
        # Stretches with the same wheels at rest move the same way.
        at_rest = stretches.signs == 0
        kinds, kind = np.unique(at_rest, axis=0, return_inverse=True)
        self.kinds = kinds
        self.kind_of = np.asarray(kind).reshape(-1)
        self.kind = self.kind_of[stretches.stretch]

    def residual(self, p: Mapping[str, float]) -> Floats:
        """Measured angles of the wheels less those of the model with these parameters, (B * N,) [rad]."""
        masses, gear = self.masses, self.masses.gear
        torque, pushed = (part * p.get("stall_torque_n_m", 1.0) for part in self._torque(p["delay_s"], p["lag_s"]))
        dry = np.full(len(gear), p["gear_friction_n_m"])
        if not self.stretches.lifted:
            dry = dry + p["rolling_resistance"] * p["mass_kg"] * 9.81 * masses.share * masses.radius
        viscous = self._brake(p)
        matrix = self._matrix(p)
        # The line between two rows is not the angle's course, which bends by the change of the speed: of that the same
        # equation, integrated once, knows between rows too (but for going round, which is slow). On the ground masses
        # are heavy for their motors: the bend of a parabola will do.
        bend = np.full(len(gear), self.period**2 / 12.0)
        if self.stretches.lifted:
            bend = _bend(self.period, viscous / np.diag(matrix))
        speed = self._moves((pushed - self.since * (dry * gear) - self.measured * viscous) @ self.map, matrix)
        force = torque - self.turned * (dry * gear) - (self.angle - bend * speed) * viscous
        force = force @ self.map
        if self.swerve is not None:
            force = force - p["mass_kg"] * self.swerve
        wheels = self._moves(force, matrix)
        left = np.where(self.kinds[self.kind], 0.0, self.measured - wheels)
        return np.asarray((left if self.noise is None else self.noise.whitened(left, self.stretches.stretch)).ravel())

    def _moves(self, force: Floats, matrix: Floats) -> Floats:
        """Rotation of wheels by integrals of forces, (B, N)."""
        wheels = np.zeros_like(self.measured)
        for number, at_rest in enumerate(self.kinds):
            way = _null(self.map[at_rest], self.map.shape[1])
            if not way.shape[1]:
                continue
            move = self.map @ way @ np.linalg.solve(way.T @ matrix @ way, way.T)
            rows = self.kind == number
            # A wheel that stands is held by as much friction as it takes: it says nothing of torque.
            wheels[rows] = force[rows] @ move.T
        return wheels

    def _matrix(self, p: Mapping[str, float]) -> Floats:
        """Masses: of each wheel alone in the air, of the vehicle's twist on the ground."""
        if self.stretches.lifted:
            return np.diag(self.masses.turning(p["wheel_inertia_kg_m2"]))
        return self.masses.matrix(p["mass_kg"], p["yaw_inertia_kg_m2"], p["wheel_inertia_kg_m2"])

    def time_constant_s(self, p: Mapping[str, float]) -> float:
        """Time constant of the fastest motion that the motors drive [s]; infinite without a brake."""
        brake = self.map.T @ np.diag(self._brake(p)) @ self.map
        rate = float(np.linalg.eigvals(np.linalg.solve(self._matrix(p), brake)).real.max())
        return 1.0 / rate if rate > 0.0 else np.inf

    def _brake(self, p: Mapping[str, float]) -> Floats:
        """Torque that friction takes per actuator speed [N.m.s/rad], (N,)."""
        return np.asarray(p["viscous_n_m_s_rad"] * self.masses.gear**2 + p.get("slope_n_m_s_rad", 0.0))

    def doubts(self) -> list[str]:
        """Implausible signs and wheel order of the log, a line each."""
        if self.stretches.lifted:
            return []
        log, vehicle = self.stretches.log, self.masses.vehicle
        doubts = _plausibility.of_wheels(vehicle, log.measured, log.period_s)
        if log.yaw_rate is not None:
            doubts += _plausibility.of_yaw(log.measured @ self.masses.back[2], log.yaw_rate)
        return [f"{log.name}: {doubt}" for doubt in doubts]

    def clusters(self) -> Integers:
        """Stretch of each residual."""
        return np.repeat(self.stretches.stretch, self.inputs.shape[1])

    def redundant(self) -> int:
        """How many of the residuals carry no independent information: start and speed of each stretch are free."""
        ranks = np.array([_null(self.map[kind], self.map.shape[1]).shape[1] for kind in self.kinds])
        bins = np.bincount(self.stretches.stretch)
        return int(self.measured.size - ranks[self.kind_of] @ (bins - 2))

    def _swerve(self) -> Floats:
        """Integral of the force for a kilogram to turn with the vehicle, whose axes rotate."""
        log = self.stretches.log
        twist = np.nan_to_num(log.measured) @ self.masses.back.T
        vx, vy, turn = _smooth(twist, max(1, round(SMOOTH_S / self.period))).T
        x, y = self.masses.centre
        each = [-turn * (vy + turn * x), turn * (vx - turn * y), turn * (x * vx + y * vy)]
        once = np.cumsum(np.stack(each, axis=1), axis=0) * self.period
        return self.stretches.binned(_integral(once, self.period))

    def _torque(self, delay: float, lag: float) -> tuple[Floats, Floats]:
        """Acting torques, integrated twice and once, in bins: held over a period, then delayed, then lagged."""
        if self._delayed is not None and self._delayed[0] == (delay, lag):
            return self._delayed[1]
        rows = len(self.inputs)
        at = np.clip(np.arange(rows) - delay / self.period, 0.0, rows - 1.0)
        row = at.astype(np.int64)
        since = ((at - row) * self.period)[:, None]
        held = self.inputs[row]
        once = self.once[row] + since * held
        twice = self.twice[row] + since * (self.once[row] + 0.5 * since * held)
        if lag > 1e-6:
            # Of x' = (torque - x) / lag the integral of x is that of the torque less lag times x.
            once = once - lag * self._lagging(lag, row, since)
            twice = twice - lag * once
        done = self.stretches.binned(twice), self.stretches.binned(once)
        self._delayed = ((delay, lag), done)
        return done

    def _lagging(self, lag: float, row: Integers, since: Floats) -> Floats:
        keep = float(np.exp(-self.period / lag))
        filtered = scipy_part("signal", "omnistep.identify").lfilter([1.0 - keep], [1.0, -keep], self.inputs, axis=0)
        at = np.concatenate([np.zeros((1, filtered.shape[1])), filtered[:-1]])
        held = self.inputs[row]
        return np.asarray(held + (at[row] - held) * np.exp(-since / lag))


def _bend(period: float, rate: Floats) -> Floats:
    """Integral of an angle over a period less than the trapezoid's, per change of the speed [s^2].

    For a wheel whose speed follows with this rate [1/s]; period^2 / 12 where it is slow.
    """
    part = 0.5 * period * rate
    slow = part < 1e-2
    fast = np.where(slow, 1.0, part)
    return np.where(slow, 1.0 / 3.0, (fast / np.tanh(fast) - 1.0) / fast**2) * (0.5 * period) ** 2


def _null(rows: Floats, columns: int) -> Floats:
    """Twists at which these wheels do not turn, one for each column."""
    if not len(rows):
        return np.eye(columns)
    _, singular, right = np.linalg.svd(rows)
    rank = int((singular > 1e-6 * singular[0]).sum())
    return np.asarray(right[rank:].T)
