"""Model of a vehicle's motion from wheels, torques and masses on flat ground, in stretches without a wheel reversal.

Everything is an integral, so no noisy signal is differentiated: the twist changes by ``M^-1 A^T`` times the integral
of the torques less friction, and the wheels turn by the integral of that. The quantisation of encoders is then an
independent error of each reading.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from omnistep import _gyro_doubts, _plausibility
from omnistep._estimates import Floats, scipy_part
from omnistep._measurement_noise import Noise
from omnistep._stretches import SMOOTH_S, Integers, Stretches, integral, smooth
from omnistep._vehicle_masses import Masses

#: Delays and lags whose torques are kept: derivatives go to one and back.
KEPT = 4
#: Duty cycles below this are zero: nothing but rounding.
ZERO_DUTY = 1e-9


class Motion:
    """Residuals of one log for given parameters."""

    def __init__(
        self,
        stretches: Stretches,
        masses: Masses,
        inputs: Floats,
        efficiency: float,
        *,
        coasts: bool = False,
        chops: bool = False,
    ) -> None:
        self.stretches, self.masses = stretches, masses
        self.period = stretches.log.period_s
        #: Rows in which torques and speeds of all wheels are known.
        both = np.concatenate([inputs, stretches.log.measured], axis=1)
        self.known: NDArray[np.bool_] = np.asarray(np.isfinite(both).all(axis=1))
        inputs = np.nan_to_num(inputs)
        #: At a duty cycle of zero the bridge is open: no torque, and no braking by the motor either.
        #: A chopping bridge is also open in the remaining part of each PWM period: a motor brakes for that part of it
        #: that is driven.
        self.coasts = coasts or chops
        self.driven = np.abs(inputs) if chops else _driven(inputs)
        if efficiency < 1.0:
            driving = inputs * np.nan_to_num(stretches.log.measured) > 0.0
            inputs = inputs * np.where(driving, efficiency, 1.0 / efficiency)
        self.inputs = inputs
        # Single and double integrals, at each row, of a signal that is held between rows.
        start = np.zeros((1, inputs.shape[1]))
        self.once = np.concatenate([start, np.cumsum(inputs, axis=0)])[:-1] * self.period
        steps = self.once * self.period + 0.5 * self.period**2 * inputs
        self.twice = np.concatenate([start, np.cumsum(steps, axis=0)])[:-1]
        # Readings are of the period that ends with their row, as counts are: their sum is the angle there.
        angle = np.cumsum(np.nan_to_num(stretches.log.measured), axis=0) * self.period
        self.map = np.eye(inputs.shape[1]) if stretches.lifted else masses.map
        #: Speeds of the wheels, on the ground those of the motion of the whole.
        self.speeds = stretches.log.measured
        self.measured = stretches.binned(angle)
        self.angle = stretches.binned(integral(angle, self.period))
        clock: Floats = np.arange(len(inputs), dtype=np.float64)[:, None] * self.period
        signs = stretches.signs[stretches.stretch]
        self.turned, self.since = stretches.binned(0.5 * clock**2) * signs, stretches.binned(clock) * signs
        # The motion from all wheels together, as angles of the wheels.
        if not stretches.lifted:
            self.measured = self.measured @ masses.back.T @ self.map.T
            self.speeds = self.speeds @ masses.back.T @ self.map.T
        #: Transformation that makes errors of readings independent: none if errors of angles already are.
        self.noise: Noise | None = None
        self.swerve = None if stretches.lifted else self._swerve()
        self._shifted = lru_cache(maxsize=KEPT)(self._shift)
        self._lagged = lru_cache(maxsize=KEPT)(self._lag)
        self._braked = lru_cache(maxsize=KEPT)(self._brake_while_driven)
        # Stretches with the same wheels at rest move the same way.
        at_rest = stretches.signs == 0
        kinds, kind = np.unique(at_rest, axis=0, return_inverse=True)
        self.kinds = kinds
        self.ways = [_null(self.map[kind], self.map.shape[1]) for kind in kinds]
        self.kind_of = np.asarray(kind).reshape(-1)
        self.kind = self.kind_of[stretches.stretch]

    def residual(self, p: Mapping[str, float]) -> Floats:
        """Measured angles of the wheels minus the model's angles with these parameters, (B * N,) [rad]."""
        masses = self.masses
        torque, pushed = (part * p.get("stall_torque_n_m", 1.0) for part in self._torque(p["delay_s"], p["lag_s"]))
        dry = self.dry(p)
        viscous, slope = self.friction(p), p.get("slope_n_m_s_rad", 0.0)
        matrix = self.mass_matrix(p)
        # The line between two rows is not the angle's course, which bends by the change of the speed: of that the same
        # equation, integrated once, knows between rows too (but for going round, which is slow). On the ground masses
        # are heavy for their motors: the bend of a parabola will do.
        bend = np.full(len(masses.gear), self.period**2 / 12.0)
        if self.stretches.lifted:
            bend = _bend(self.period, (viscous + slope) / np.diag(matrix))
        once, twice = self.measured * viscous, self.angle * viscous
        part: Floats | float = 1.0
        if self.coasts:
            braked, braked_angle, part = self._while_driven(p["delay_s"])
            once, twice = once + braked * slope, twice + braked_angle * slope
        else:
            once, twice = once + self.measured * slope, twice + self.angle * slope
        moves = self._moves(matrix)
        speed = self._moved((pushed - self.since * dry - once) @ self.map, moves)
        force = torque - self.turned * dry - twice + bend * speed * (viscous + part * slope)
        force = force @ self.map
        if self.swerve is not None:
            force = force - p["mass_kg"] * self.swerve
        wheels = self._moved(force, moves)
        left = np.where(self.kinds[self.kind], 0.0, self.measured - wheels)
        return np.asarray((left if self.noise is None else self.noise.whitened(left, self.stretches.stretch)).ravel())

    def _moves(self, matrix: Floats) -> list[Floats]:
        """Rotation of wheels by an integral of force, for each kind of stretch.

        A wheel at rest is held by static friction of any size, so that it yields no information about torque.
        """
        return [
            self.map @ way @ np.linalg.solve(way.T @ matrix @ way, way.T)
            if way.shape[1]
            else np.zeros((len(self.map), len(matrix)))
            for way in self.ways
        ]

    def _moved(self, force: Floats, moves: list[Floats]) -> Floats:
        """Rotation of wheels by integrals of forces, (B, N)."""
        wheels = np.zeros_like(self.measured)
        for number, move in enumerate(moves):
            rows = self.kind == number
            wheels[rows] = force[rows] @ move.T
        return wheels

    def mass_matrix(self, p: Mapping[str, float]) -> Floats:
        """Masses: of each wheel alone in the air, of the vehicle's twist on the ground."""
        if self.stretches.lifted:
            return np.diag(self.masses.turning(p["wheel_inertia_kg_m2"]))
        return self.masses.matrix(p["mass_kg"], p["yaw_inertia_kg_m2"], p["wheel_inertia_kg_m2"])

    def time_constant_s(self, p: Mapping[str, float]) -> float:
        """Time constant of the fastest motion that the motors drive [s]; infinite without a brake."""
        brake = self.map.T @ np.diag(self._brake(p)) @ self.map
        rate = float(np.linalg.eigvals(np.linalg.solve(self.mass_matrix(p), brake)).real.max())
        return 1.0 / rate if rate > 0.0 else np.inf

    def dry(self, p: Mapping[str, float]) -> Floats:
        """Dry friction at the actuators [N.m], (N,)."""
        masses = self.masses
        dry = np.full(len(masses.gear), p["gear_friction_n_m"])
        if not self.stretches.lifted:
            dry = dry + p["rolling_resistance"] * p["mass_kg"] * 9.81 * masses.share * masses.radius
        return np.asarray(dry * masses.gear)

    def friction(self, p: Mapping[str, float]) -> Floats:
        """Friction torque per actuator speed [N.m.s/rad], (N,)."""
        return np.asarray(p["viscous_n_m_s_rad"] * self.masses.gear**2)

    def _brake(self, p: Mapping[str, float]) -> Floats:
        """The same of friction and the motors' lines."""
        return self.friction(p) + p.get("slope_n_m_s_rad", 0.0)

    def doubts(self) -> list[str]:
        """Implausible signs and wheel order of the log, one line each."""
        if self.stretches.lifted:
            return []
        log, vehicle = self.stretches.log, self.masses.vehicle
        doubts = _plausibility.of_wheels(vehicle, log.measured, log.period_s)
        if log.yaw_rate is not None:
            doubts += _gyro_doubts.of_yaw(log.measured @ self.masses.back[2], log.yaw_rate, log.period_s)
        return [f"{log.name}: {doubt}" for doubt in doubts]

    def clusters(self) -> Integers:
        """Stretch of each residual."""
        return np.repeat(self.stretches.stretch, self.inputs.shape[1])

    def redundant(self) -> int:
        """How many of the residuals carry no independent information: start and speed of each stretch are free."""
        ranks = np.array([way.shape[1] for way in self.ways])
        bins = np.bincount(self.stretches.stretch)
        return int(self.measured.size - ranks[self.kind_of] @ (bins - 2))

    def swerving(self, moves: Floats, p: Mapping[str, float]) -> Floats:
        """Force to turn the masses with the vehicle, whose axes rotate, at twists (3,) or (T, 3); none in the air."""
        if self.stretches.lifted:
            return np.zeros_like(moves)
        vx, vy, turn = moves.T
        x, y = self.masses.centre
        each = [-turn * (vy + turn * x), turn * (vx - turn * y), turn * (x * vx + y * vy)]
        return p["mass_kg"] * np.array(each).T

    def _swerve(self) -> Floats:
        """Integral of that force for a kilogram."""
        twist = np.nan_to_num(self.stretches.log.measured) @ self.masses.back.T
        moves = smooth(twist, max(1, round(SMOOTH_S / self.period)))
        once = np.cumsum(self.swerving(moves, {"mass_kg": 1.0}), axis=0) * self.period
        return self.stretches.binned(integral(once, self.period))

    def _torque(self, delay: float, lag: float) -> tuple[Floats, Floats]:
        """Acting torques, integrated twice and once, in bins: held over a period, then delayed, then lagged."""
        rows, since = self._rows_late(delay)
        held, once, twice = self._shifted(rows)
        twice = twice + since * (once + 0.5 * since * held)
        once = once + since * held
        if lag > 1e-6:
            # Of x' = (torque - x) / lag the integral of x is the integral of the torque minus lag times x.
            slow = held + (self._lagged(lag, rows) - held) * np.exp(-since / lag)
            once = once - lag * slow
            twice = twice - lag * once
        return twice, once

    def _rows_late(self, delay: float) -> tuple[int, float]:
        """A delay as whole rows, and the time after the start of that row."""
        rows = int(np.ceil(delay / self.period))
        return rows, rows * self.period - delay

    def _shift(self, rows: int) -> tuple[Floats, Floats, Floats]:
        """Torques this many rows earlier and their two integrals, in bins."""
        held, once, twice = (self.stretches.binned(_late(each, rows)) for each in (self.inputs, self.once, self.twice))
        return held, once, twice

    def _lag(self, lag: float, rows: int) -> Floats:
        """Lagging torques at the beginning of rows, this many rows earlier, in bins."""
        filtered = lagging(self.inputs, self.period / lag)
        at = np.concatenate([np.zeros((1, filtered.shape[1])), filtered[:-1]])
        return self.stretches.binned(_late(at, rows))

    def _while_driven(self, delay: float) -> tuple[Floats, Floats, Floats]:
        """Angles while bridges drive, their integrals, and the fraction of each bin in which bridges drive."""
        rows, since = self._rows_late(delay)
        part = since / self.period
        # The period that ends with a row is partly of the command before the last one.
        first, second = self._braked(rows + 1), self._braked(rows)
        angle, integrated, driven = ((1.0 - part) * a + part * b for a, b in zip(first, second, strict=True))
        return angle, integrated, driven

    def _brake_while_driven(self, rows: int) -> tuple[Floats, Floats, Floats]:
        """The same for a delay of whole rows, less one."""
        driven = _late(self.driven, rows)
        angle = np.cumsum(np.nan_to_num(self.stretches.log.measured) * driven, axis=0) * self.period
        binned = self.stretches.binned
        return binned(angle), binned(integral(angle, self.period)), self.stretches.mean(driven)


def _driven(duty: Floats) -> Floats:
    """Part of each row in which a bridge drives, (T, N): none at zero duty.

    A row between zero and more duty is the mean over a period in which it changed.
    """
    size = np.pad(np.abs(duty), ((1, 1), (0, 0)), mode="edge")
    before, here, after = size[:-2], size[1:-1], size[2:]
    other = np.where(before <= ZERO_DUTY, after, np.where(after <= ZERO_DUTY, before, here))
    part = here / np.maximum(np.maximum(other, here), ZERO_DUTY)
    return np.asarray(np.where(here > ZERO_DUTY, part, 0.0))


def lagging(series: Floats, step: float) -> Floats:
    """What follows a series with a lag, from rest; ``step`` is the distance of rows in lags.

    Each row is a mean of the row before and the series: equations with two diagonals.
    """
    keep = float(np.exp(-step))
    diagonals = np.array([np.ones(len(series)), np.full(len(series), -keep)])
    solve = scipy_part("linalg", "omnistep.identify").solve_banded
    return np.asarray(solve((1, 0), diagonals, (1.0 - keep) * series, overwrite_ab=True, check_finite=False))


def _late(series: Floats, rows: int) -> Floats:
    """A series this many rows earlier; its ends go on."""
    at = np.clip(np.arange(len(series)) - rows, 0, len(series) - 1)
    return np.asarray(series[at])


def _bend(period: float, rate: Floats) -> Floats:
    """Integral of an angle over a period less than the trapezoid's, per change of the speed [s^2].

    For a wheel whose speed follows with this rate [1/s]; period^2 / 12 if it is slow.
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
