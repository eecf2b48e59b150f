"""What drives the simulation of a log: commands, torques, the wheels' twist, duty cycles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from omnistep._motion_model import ZERO_DUTY
from omnistep._omnistep import Log, Scenario, Trace, Vehicle
from omnistep._recorded_command import AXES, held
from omnistep._wheel_logs import ZERO_DUTY_FACT
from omnistep.errors import ConfigError
from omnistep.recordings import estimated

Floats = NDArray[np.float64]
#: Inputs that may drive a simulation.
BYS: tuple[Literal["commands", "torques", "wheels", "duty"], ...] = ("commands", "torques", "wheels", "duty")
#: Columns of each, in the order of messages.
COLUMNS = {
    "commands": "commands (asked_*)",
    "torques": "torques of every wheel (torque_n_m or applied_n_m)",
    "wheels": "velocity of every wheel (measured_rad_s)",
    "duty": "duty cycles of every wheel (commanded_duty_*)",
}


def twists_of(trace: Trace, of: str) -> Floats:
    """Columns of a twist, (T, 3)."""
    return np.column_stack([trace[f"{of}_{axis}"] for axis in AXES])


def inputs_of(recorded: Trace, vehicle: Vehicle, by: str) -> tuple[Floats, int, bool]:
    """A vehicle's simulation inputs in every period, the number of unknown ones, and whether torques were measured."""
    given = _given(recorded, vehicle, by)
    if given is None:
        others = [each for each in BYS if _given(recorded, vehicle, each) is not None]
        allowed = ", ".join(f"{each} (--{each})" for each in others) or "a log of a drive"
        raise ConfigError(f"by = {by!r}: the log has no {COLUMNS[by]}, allowed: {allowed}", key="by")
    acted = by == "torques" and _known(np.asarray(recorded.wheels("torque_n_m"))) is not None
    return *held(given), acted


def _given(recorded: Trace, vehicle: Vehicle, by: str) -> Floats | None:
    """Columns of an input in a log, if it has any."""
    if by == "commands":
        return _known(twists_of(recorded, "asked"))
    if by == "wheels":
        # With the radii and lever arms of the vehicle that is simulated, not of the log's.
        return _known(estimated(vehicle, np.asarray(recorded.wheels("measured_rad_s"))))
    if by == "duty":
        names = [f"commanded_duty_{name}" for name in recorded.wheel_names]
        there = all(name in recorded for name in names)
        return _known(np.column_stack([recorded[name] for name in names])) if there else None
    # One kind throughout: if the applied torques are unknown, the commanded torques are no substitute.
    acted, commanded = (_known(np.asarray(recorded.wheels(signal))) for signal in ("torque_n_m", "applied_n_m"))
    return commanded if acted is None else acted


def _known(columns: Floats) -> Floats | None:
    return columns if np.isfinite(columns).all(axis=1).any() else None


def torque_line(scenario: Scenario, log: Log) -> Callable[[Floats, Floats], Floats]:
    """The motors' torques [N.m] for duty cycles at velocities [rad/s], (N,) each."""
    vehicle = scenario.vehicle
    stall, no_load = float(vehicle["motor.stall_torque_n_m"]), vehicle.no_load_rad_s
    slope = stall / no_load if no_load else 0.0
    coasts = log.run.get(ZERO_DUTY_FACT) == "coast"

    def torques(duty: Floats, speed_rad_s: Floats) -> Floats:
        driven = stall * duty - slope * speed_rad_s
        return np.where(np.abs(duty) < ZERO_DUTY, 0.0, driven) if coasts else driven

    return torques
