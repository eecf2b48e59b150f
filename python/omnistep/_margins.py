"""Gains of the wheel loops, and their stability margins with the identified delay and lag."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from omnistep._estimates import Floats
from omnistep._omnistep import Controller, Kinematics, Scenario, Vehicle

#: Least margins of a vehicle on the ground, and of a wheel in the air, which shall not swing either.
PHASE_DEG, GAIN_DB, AIR_GAIN_DB = 45.0, 6.0, 3.0
#: Frequencies that are looked at [rad/s].
FREQUENCIES = np.geomspace(1e-1, 1e4, 2000)


@dataclass(frozen=True, kw_only=True)
class Loops:
    """Gains, and their smallest stability margins.

    Attributes:
        kp_n_m_s_rad: k_p [N.m per rad/s].
        ki_n_m_rad: k_i [N.m per rad].
        time_constant_s: time constant of the slowest loop [s], inertia over k_p.
        phase_margin_deg: smallest phase margin of the vehicle on the ground [deg].
        gain_margin_db: smallest gain margin there [dB].
        air_gain_margin_db: gain margin of a wheel in the air [dB].
    """

    kp_n_m_s_rad: float
    ki_n_m_rad: float
    time_constant_s: float
    phase_margin_deg: float
    gain_margin_db: float
    air_gain_margin_db: float

    def __str__(self) -> str:
        return (
            f"kp {self.kp_n_m_s_rad:.4g} N.m.s/rad, ki {self.ki_n_m_rad:.4g} N.m/rad: phase margin"
            f" {self.phase_margin_deg:.0f} deg, gain margin {self.gain_margin_db:.1f} dB,"
            f" of a wheel in the air {self.air_gain_margin_db:.1f} dB"
        )


def margins(
    kp: float, ki: float, *, inertia: float, viscous: float, delay_s: float, lag_s: float
) -> tuple[float, float]:
    """Phase margin [deg] and gain margin [dB] of a loop of kp + ki / s around an inertia behind a delay and a lag."""
    s = 1j * FREQUENCIES
    # The delay turns the phase only: taken apart, phases need no unwrapping.
    plain = (kp * s + ki) / s / (inertia * s + viscous) / (lag_s * s + 1.0)
    size = np.abs(plain)
    phase = np.unwrap(np.angle(plain)) - FREQUENCIES * delay_s
    phase -= 2.0 * pi * np.round((phase[0] + pi / 2) / (2.0 * pi))
    crossing = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))
    phase_margin = min((180.0 + np.degrees(phase[k]) for k in crossing), default=180.0)
    turned = np.flatnonzero((phase[:-1] > -pi) & (phase[1:] <= -pi))
    gain_margin = min((-20.0 * np.log10(size[k]) for k in turned), default=np.inf)
    return float(phase_margin), float(gain_margin)


def loops(
    vehicle: Vehicle, *, period_s: float, matrix: Floats, delay_s: float, lag_s: float, viscous_n_m_s_rad: float
) -> Loops:
    """The derived gains of a vehicle, reduced if its delay and lag require it.

    Args:
        vehicle: the vehicle; its own gains are not used.
        period_s: control period [s].
        matrix: mass matrix, turning wheels included, (3, 3).
        delay_s: from a torque to the measured angle [s]; half a period of holding and half a period of reading are
            added.
        lag_s: time constant of the torque [s].
        viscous_n_m_s_rad: of a wheel.
    """
    map_ = Kinematics(layout=vehicle.layout).inverse_matrix
    inertias = np.sort(np.linalg.eigvals(np.linalg.solve(map_.T @ map_, matrix)).real)
    wheels = vehicle.to_dict()["wheel"]
    air = min(wheel["inertia_kg_m2"] * wheel["gear"] ** 2 for wheel in wheels)
    gear = max(wheel["gear"] for wheel in wheels)
    held = delay_s + period_s

    def of(inertia: float, time: float) -> tuple[float, float]:
        kp = inertias[-1] / time
        return margins(
            kp, kp / (4 * time), inertia=inertia, viscous=viscous_n_m_s_rad * gear**2, delay_s=held, lag_s=lag_s
        )

    time = float(inertias[-1] / derived_kp(vehicle, period_s))
    while True:
        ground, free = [of(inertia, time) for inertia in inertias], of(air, time)
        phase, gain = (min(each[k] for each in ground) for k in (0, 1))
        if (phase >= PHASE_DEG and gain >= GAIN_DB and free[1] >= AIR_GAIN_DB) or time > 100.0:
            break
        time *= 1.05
    kp = float(inertias[-1] / time)
    return Loops(
        kp_n_m_s_rad=kp,
        ki_n_m_rad=kp / (4.0 * time),
        time_constant_s=time,
        phase_margin_deg=phase,
        gain_margin_db=gain,
        air_gain_margin_db=free[1],
    )


def derived_kp(vehicle: Vehicle, period_s: float) -> float:
    """The k_p that the library derives for a vehicle without gains [N.m per rad/s]."""
    bare = Vehicle.from_dict({**vehicle.to_dict(), "gains": None})
    step_s = max(1, round(1e6 * period_s)) / 1e6
    keys = {
        "control.period_s": step_s,
        "physics.timestep_s": step_s,
        "control.policy": "independent",
        "command.vx_m_s": 0.0,
    }
    scenario = Scenario("flat", vehicle=bare, overrides=keys)
    # Slow enough to stay away from every limit: the proportional term over the error is k_p.
    sample = Controller(scenario).step([0.0, 0.0, 0.0], [-1e-6] * len(vehicle.wheel_names))
    return float(sample.p_n_m[0] / 1e-6)
