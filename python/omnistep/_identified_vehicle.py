"""A vehicle file with the numbers of an identification."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnistep._omnistep import Vehicle
from omnistep._vehicle_masses import Masses


def vehicle_with(
    vehicle: Vehicle, masses: Masses, p: Mapping[str, float], *, duty: bool
) -> tuple[Vehicle, tuple[str, ...]]:
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
                x, y, z = body["inertia_box_m"]
                body["inertia_box_m"] = [x * stretch, y * stretch, z]
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
