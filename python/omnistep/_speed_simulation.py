"""Wheel speeds that follow from a log's torques and identified numbers alone, next to the logged speeds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from omnistep._axes import figure, recorded_and_simulated
from omnistep._estimates import Floats
from omnistep._motion_model import Motion, lagging
from omnistep._stretches import SMOOTH_S, smooth

#: A step of the simulation is at most this part of the time in which the vehicle follows its motors, and at most a row.
STEP = 0.04
#: Steps of a row are no more than this.
MOST_STEPS = 20
#: Dry friction is steep below this speed [rad/s].
CREEP_RAD_S = 0.02
#: Speeds are compared as means over this time [s], so that single counts do not matter.
OVER_S = 0.1


@dataclass(frozen=True)
class SpeedSimulation:
    """Speeds of wheels in logs, and simulated from their torques or duty cycles; NaN if unknown.

    Attributes:
        names: the logs.
        wheels: the wheels.
        time_s: times of each log [s], (T,).
        recorded: speeds of the wheels' actuators by each log [rad/s], (T, N), as means over 0.1 s.
        simulated: speeds of the simulation, which starts with the log's speeds and uses no later reading.
        off: root mean square of all differences, as a fraction of the root mean square of the recorded speeds.
    """

    names: tuple[str, ...]
    wheels: tuple[str, ...]
    time_s: tuple[Floats, ...]
    recorded: tuple[Floats, ...]
    simulated: tuple[Floats, ...]
    off: float

    def __str__(self) -> str:
        return f"simulated with these numbers the log's speeds are off by {100 * self.off:.2g} %"

    def plot(self) -> Any:
        """Draw both over each other, wheel by wheel.

        Returns:
            A matplotlib figure.

        Raises:
            ImportError: matplotlib is not installed: install the extra ``plot``.
        """
        made, axes = figure(len(self.wheels), len(self.names), sharex="col", sharey=True)
        for column, time_s in enumerate(self.time_s):
            for number, wheel in enumerate(self.wheels):
                ax, lines = axes[number, column], (self.recorded[column], self.simulated[column])
                recorded_and_simulated(ax, time_s, *(each[:, number] for each in lines))
                if column == 0:
                    ax.set_ylabel(f"{wheel} [rad/s]")
            axes[0, column].set_title(self.names[column], fontsize="medium")
            axes[-1, column].set_xlabel("time [s]")
        axes[0, 0].legend(loc="upper right", fontsize="small", ncols=2)
        made.suptitle(str(self), fontsize="medium")
        return made


def simulated(motions: Sequence[Motion], p: Mapping[str, float]) -> SpeedSimulation:
    """Simulate every log with these parameters."""
    recorded: list[Floats] = []
    again: list[Floats] = []
    for motion in motions:
        rows = max(1, round(OVER_S / motion.period))
        known = motion.known[:, None]
        speeds = _speeds(motion, p)
        recorded.append(_means(np.where(known, motion.stretches.log.measured, np.nan), rows))
        again.append(_means(speeds, rows))
    size = np.concatenate([each.ravel() for each in recorded])
    off = np.concatenate([each.ravel() for each in again]) - size
    there = np.isfinite(off)
    logs = [motion.stretches.log for motion in motions]
    return SpeedSimulation(
        names=tuple(log.name for log in logs),
        wheels=tuple(motions[0].masses.vehicle.wheel_names),
        time_s=tuple(log.period_s * np.arange(len(log.measured), dtype=np.float64) for log in logs),
        recorded=tuple(recorded),
        simulated=tuple(again),
        off=float(np.sqrt(np.mean(off[there] ** 2) / np.mean(size[there] ** 2))) if there.any() else math.nan,
    )


def _means(speeds: Floats, rows: int) -> Floats:
    return np.asarray(smooth(speeds, rows) / smooth(np.ones((len(speeds), 1)), rows))


def _speeds(motion: Motion, p: Mapping[str, float]) -> Floats:
    """Mean speeds of actuators over the periods that end with each row [rad/s], (T, N); NaN if torques are unknown.

    Implicit steps of Euler's: friction stops a wheel and does not push it back.
    """
    parts = min(MOST_STEPS, max(1, math.ceil(motion.period / (STEP * motion.time_constant_s(p)))))
    step = motion.period / parts
    torque, braked = _inputs(motion, p, parts)
    turns, back, matrix = motion.map, np.linalg.pinv(motion.map), motion.mass_matrix(p)
    dry, viscous = motion.dry(p), motion.friction(p)
    slope = p.get("slope_n_m_s_rad", 0.0)
    begins = smooth(np.nan_to_num(motion.stretches.log.measured), max(1, round(SMOOTH_S / motion.period)))
    speeds = np.full(begins.shape, np.nan)
    moves: Floats | None = None
    for row in range(1, len(begins)):
        if not (motion.known[row] and motion.known[row - 1]):
            moves = None
            continue
        if moves is None:
            moves = back @ begins[row - 1]
        wheels, turned = turns @ moves, np.zeros(len(turns))
        for part in range((row - 1) * parts, row * parts):
            brake = viscous + slope * braked[part] + dry / np.maximum(np.abs(wheels), CREEP_RAD_S)
            force = torque[part] @ turns - motion.swerving(moves, p)
            resists = matrix + (step * turns.T * brake) @ turns
            moves = np.linalg.solve(resists, matrix @ moves + step * force)
            wheels = turns @ moves
            turned = turned + wheels
        speeds[row] = turned / parts
    return speeds


def _inputs(motion: Motion, p: Mapping[str, float], parts: int) -> tuple[Floats, Floats]:
    """Torques that act, and the parts of the motors' lines that brake, in each step of each period but the last."""
    rows = len(motion.inputs)
    at = np.arange((rows - 1) * parts + 1) / parts - p["delay_s"] / motion.period
    number = np.arange(rows + 1)

    def held(series: Floats) -> Floats:
        """Means over steps of a signal that is held between rows."""
        sums = np.concatenate([np.zeros((1, series.shape[1])), np.cumsum(series, axis=0)])
        return parts * np.stack([np.diff(np.interp(at, number, column)) for column in sums.T], axis=1)

    torque = p.get("stall_torque_n_m", 1.0) * held(motion.inputs)
    if p["lag_s"] > 1e-6:
        torque = lagging(torque, motion.period / parts / p["lag_s"])
    return torque, held(motion.driven) if motion.coasts else np.ones_like(torque)
