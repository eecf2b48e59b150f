"""Parameters of an identification: start value, range, and the drive that would determine each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from omnistep._estimates import Fit, Floats, Parameter, shifts
from omnistep._motion_model import Motion
from omnistep._omnistep import Vehicle
from omnistep._toml_files import unknown_key
from omnistep._vehicle_masses import Masses
from omnistep.errors import ConfigError

#: Start of the search, if not the file's value.
BEGINS = {"delay_s": 0.005, "lag_s": 0.01}
#: Error of a held parameter, to report its effect on the other parameters.
OFF = 0.1
#: The drive that would determine each parameter.
MANOEUVRES = {
    "mass_kg": "accelerate and brake, forward and sideways, or weigh the vehicle: fix mass_kg",
    "yaw_inertia_kg_m2": "turn on the spot, accelerating and braking",
    "wheel_inertia_kg_m2": "turn the wheels in the air (wheels_off_ground), or weigh the vehicle: fix mass_kg",
    "gear_friction_n_m": "coast down, or drive steadily",
    "viscous_n_m_s_rad": "drive steadily at several speeds",
    "rolling_resistance": "also turn the wheels in the air (wheels_off_ground): only there gear friction acts alone",
    "delay_s": "change torques in steps or as a chirp",
    "lag_s": "change torques in steps or as a chirp of up to 10 Hz",
    "stall_torque_n_m": "weigh the vehicle: fix mass_kg; duty cycles alone give only ratios of torque to mass",
    "slope_n_m_s_rad": "drive at several speeds up to the fastest, at full duty",
}


def parameters_of(
    vehicle: Vehicle, masses: Masses, fix: Mapping[str, float], *, duty: bool, motions: Sequence[Motion]
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
        given = fix.get(name)
        if given is not None and not (isinstance(given, int | float) and least <= given <= most):
            raise ConfigError(f"fix: {name} = {given!r}, allowed: {least:.3g} to {most:.3g}", key=name)
        value = start if given is None else float(given)
        return Parameter(
            name=name,
            unit=unit,
            start=value,
            scale=scale,
            lower=least,
            upper=most,
            rank=rank,
            fixed=given is not None,
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
    if unknown := sorted(set(fix) - {p.name for p in parameters}):
        hint = unknown_key(unknown[0], [p.name for p in parameters])
        raise ConfigError(f"fix: {unknown[0]}: {hint}", key=unknown[0])
    in_air = any(motion.stretches.lifted for motion in motions)
    if not in_air and not {"rolling_resistance", "gear_friction_n_m"} & set(fix):
        parameters = [
            replace(p, apart_from="gear_friction_n_m") if p.name == "rolling_resistance" else p for p in parameters
        ]
    if duty and in_air and not {"lag_s", "wheel_inertia_kg_m2"} & set(fix):
        # A wheel that its motor's line brakes follows as a torque that lags does: they cannot be distinguished.
        parameters = [replace(p, apart_from="wheel_inertia_kg_m2") if p.name == "lag_s" else p for p in parameters]
    if duty and ground and not {"mass_kg", "yaw_inertia_kg_m2", "wheel_inertia_kg_m2", "stall_torque_n_m"} & set(fix):
        # Everything may be as many times larger.
        parameters = [replace(p, apart_from="mass_kg") if p.name == "stall_torque_n_m" else p for p in parameters]
    if not ground:
        parameters = [
            replace(p, fixed=True) if p.name in ("mass_kg", "yaw_inertia_kg_m2", "rolling_resistance") else p
            for p in parameters
        ]
    return parameters


def undetermined(residual: Callable[[Floats], Floats], parameters: Sequence[Parameter], found: Fit) -> tuple[str, ...]:
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
