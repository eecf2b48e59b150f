"""A run for calibration, prepared for odometry: its wheel rotations and its final pose."""

from __future__ import annotations

from math import atan2, cos, sin
from typing import Any

import numpy as np

from omnistep._calibration_runs import CalibrationRun
from omnistep._estimates import Floats
from omnistep._omnistep import Kinematics, Odometry
from omnistep._wheel_logs import WheelLog, spans
from omnistep.errors import ConfigError

#: Parts of a run in which wheels are compared with each other.
PARTS = 20
#: Odometry is stepped at this rate; a twist may change less in that time than matters.
STEP_S = 0.02
#: Longest gap in a log that is bridged.
GAP_S = 0.1
#: A gyro's bias is its mean over at least this time at rest.
REST_S = 0.5
#: A vehicle stands still while no wheel turns faster than this fraction of its highest speed, averaged over this time,
#: because noise and counts exceed it for moments.
STANDS, STANDS_OVER_S = 0.04, 0.2


class Drive:
    """One run, prepared for odometry."""

    def __init__(self, run: CalibrationRun, log: WheelLog, where: str) -> None:
        self.run, self.where = run, where
        positions = whole_positions(log, where)
        self.yaw = _turned(log, positions, where) if run.gyro else run.end_yaw_rad
        self.positions = thinned(positions, log.period_s)
        ends = np.linspace(0, len(self.positions) - 1, PARTS + 1).astype(int)
        self.parts = np.diff(self.positions[ends], axis=0)

    @property
    def way_rad(self) -> float:
        """How far the fastest actuator turned in all [rad]."""
        return float(np.abs(self.parts).max(axis=1).sum())

    @property
    def distance_m(self) -> float:
        """How far from its start it was measured to end [m]."""
        run = self.run
        return float(run.distance_m if run.distance_m is not None else np.hypot(run.end_x_m or 0.0, run.end_y_m or 0.0))

    def end(self, kinematics: Kinematics) -> tuple[float, float, float]:
        """Final pose by odometry: x, y [m], yaw [rad]."""
        return end_of(self.positions, kinematics)

    def errors(self, kinematics: Kinematics) -> tuple[list[float], list[float]]:
        """Odometry less the measurement: positions [m], headings [rad]."""
        x, y, yaw = self.end(kinematics)
        run, places, turns = self.run, [], []
        if run.end_x_m is not None:
            places.append(x - run.end_x_m)
        if run.end_y_m is not None:
            places.append(y - run.end_y_m)
        if run.distance_m is not None:
            places.append(np.hypot(x, y) - run.distance_m)
        if self.yaw is not None:
            turns.append(atan2(sin(yaw - self.yaw), cos(yaw - self.yaw)))
        return places, turns


def name_of(run: CalibrationRun, index: int, log: WheelLog) -> str:
    """How messages name a run."""
    return f"run[{index}]" if log.name == "data" else f"run[{index}] ({log.name})"


def part_of(log: WheelLog, run: CalibrationRun, where: str) -> tuple[WheelLog, int]:
    """The rows of a log that are a run, and the number of the first."""
    length = len(log.measured) * log.period_s
    first = 0 if run.from_s is None else round(run.from_s / log.period_s)
    last = len(log.measured) if run.until_s is None else min(len(log.measured), round(run.until_s / log.period_s) + 1)
    if last - first < 2:
        raise ConfigError(
            f"{where}.from_s = {run.from_s or 0.0:g}, allowed: less than the log's {length:.4g} s, and than until_s",
            key="from_s",
        )

    return log.rows(first, last), first


def end_of(positions: Floats, kinematics: Kinematics) -> tuple[float, float, float]:
    """Final pose of a drive by odometry: x, y [m], yaw [rad]."""
    odometry = Odometry(kinematics=kinematics, period_s=STEP_S)
    odometry.step_positions(positions)
    x, y, yaw = odometry.pose
    return float(x), float(y), float(yaw)


def thinned(positions: Floats, period_s: float) -> Floats:
    """Angles at the rate of odometry, the first and the last among them."""
    every = max(1, round(STEP_S / period_s))
    return np.asarray(positions[np.unique(np.r_[np.arange(0, len(positions), every), len(positions) - 1])])


def whole_positions(log: WheelLog, where: str) -> Floats:
    """Angles of the actuators from the first row on [rad], short gaps bridged."""
    rows = log.measured if log.positions is None else log.positions
    longest = _longest_gap(np.isnan(rows).any(axis=1)) * log.period_s
    if longest > GAP_S:
        raise ConfigError(f"{where}: {longest:.3g} s without encoders, allowed: gaps up to {GAP_S} s", key="log")
    whole = np.flatnonzero(~np.isnan(rows).any(axis=1))
    if not len(whole):
        raise ConfigError(f"{where}: no row has every encoder, allowed: at least two", key="log")
    first, last = whole[0], whole[-1]
    rates = rows if log.positions is None else np.diff(rows, axis=0)
    fastest = np.nanmax(np.abs(rates), initial=0.0)
    for ends, edge in ((rates[:first], "starts"), (rates[last + (log.positions is None) :], "ends")):
        # What is known of the wheels there must stand.
        known = np.isfinite(ends)
        mean = np.abs(np.where(known, ends, 0.0).sum(axis=0)) / np.maximum(known.sum(axis=0), 1)
        if mean.max(initial=0.0) > STANDS * fastest:
            raise ConfigError(
                f"{where}: it {edge} without an encoder while it moves, allowed: logs that have every wheel then",
                key="log",
            )
    rows = rows[first : last + 1].copy()
    at = np.arange(len(rows))
    for wheel in rows.T:
        there = ~np.isnan(wheel)
        wheel[~there] = np.interp(at[~there], at[there], wheel[there])
    if log.positions is not None:
        return np.asarray(rows - rows[0], dtype=np.float64)
    # A reading is of the period that ends with its row, or of its end: the same sum where it stands at both ends.
    return np.asarray(np.cumsum(rows, axis=0) * log.period_s, dtype=np.float64)


def _longest_gap(missing: Any) -> int:
    return max((end - begin for begin, end in spans(missing)), default=0)


def _turned(log: WheelLog, positions: Floats, where: str) -> float:
    """Rotation by the gyro [rad]; its bias is its mean while the wheels are at rest at the start."""
    if log.yaw_rate is None:
        raise ConfigError(f"{where}: no column gyro_rad_s, allowed: a column of yaw rates [rad/s]", key="gyro")
    rate = log.yaw_rate
    missing = np.isnan(rate)
    if missing.all():
        raise ConfigError(f"{where}: gyro_rad_s has no number, allowed: yaw rates [rad/s]", key="gyro")
    if _longest_gap(missing) * log.period_s > GAP_S:
        raise ConfigError(f"{where}: gyro_rad_s has gaps, allowed: gaps up to {GAP_S} s", key="gyro")
    at = np.arange(len(rate))
    rate = np.interp(at, at[~missing], rate[~missing])
    rest = _rest(positions, max(1, round(STANDS_OVER_S / log.period_s)))
    if rest * log.period_s < REST_S:
        raise ConfigError(
            f"{where}: the wheels stand {rest * log.period_s:.2g} s at its start, allowed: at least {REST_S} s, for the"
            " zero of gyro_rad_s",
            key="gyro",
        )
    return float((rate - rate[:rest].mean()).sum() * log.period_s)


def _rest(positions: Floats, rows: int) -> int:
    """Number of rows before a wheel turns."""
    turned = np.abs(positions[rows:] - positions[:-rows]).max(axis=1, initial=0.0)
    moves = np.flatnonzero(turned > STANDS * np.max(turned, initial=0.0))
    return int(moves[0]) if len(moves) else len(positions)
