"""A vehicle on wheels whose rollers are bodies, in MuJoCo: an independent judge of omnistep's two wheel models.

Development only; see compare.py. Bodies, wheels, motor and gains are those of the vehicle file, lengths of rollers what
`omnistep ripple` prints; each roller is a mesh of its barrel. Rigid vehicles only, without hinges. The law is
`independent`: each wheel its own PI loop, its torque limited by the motor's line.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import mujoco
import numpy as np

PERIOD_S, STEP_S = 1e-3, 2.5e-4
SLICES, AROUND = 24, 48  # of a barrel: facets of 0.03 mm at most on a roller of 15 mm
CLEAR_M = 0.005  # how much lower than its place a wheel that is up may be, as in the program


def barrel(radius: float, half: float, rim: float, cos: float) -> list[float]:
    """Vertices of a roller whose axis is x: the hull of balls that touch the rim from inside."""
    points: list[float] = []
    for along in np.linspace(-half, half, SLICES + 1):
        thick = rim - math.hypot(rim - radius, cos * along)
        for k in range(AROUND):
            turn = 2.0 * math.pi * k / AROUND
            points += [along, thick * math.cos(turn), thick * math.sin(turn)]
    return points


def wheel_xml(i: int, wheel: dict[str, Any], size: dict[str, Any], rows: int, count: int) -> str:
    """A wheel: a hub on its axle and rollers on bearings, three tenths of its mass as in the program."""
    r, mass, inertia = wheel["radius_m"], wheel["mass_kg"], wheel["inertia_kg_m2"]
    gamma = wheel.get("roller_angle_rad", 0.0)
    rho, half = size["roller_radius_m"], 0.5 * size["roller_length_m"]
    pitch, number = r - rho, rows * count
    each = 0.3 * mass / number
    axial, across = 0.5 * each * rho**2, each * (rho**2 / 4 + half**2 / 3)
    of_rollers = number * (each * pitch**2 + axial * math.sin(gamma) ** 2 + across * math.cos(gamma) ** 2)
    if of_rollers > 0.8 * inertia:
        each, axial, across = (0.8 * inertia / of_rollers * v for v in (each, axial, across))
        of_rollers = 0.8 * inertia
    about = inertia - of_rollers
    hub = mass - number * each
    # The wheel's frame: x rolling direction, y axle, z up.
    dx, dy = wheel["rolling_direction"]
    x, y = wheel["position_m"]
    text = f'<body name="w{i}" pos="{x} {y} {r}" euler="0 0 {math.atan2(dy, dx)}">'
    text += f'<joint name="j{i}" axis="0 1 0"/>'
    text += f'<inertial pos="0 0 0" mass="{hub}" diaginertia="{about / 2 + 1e-9} {about + 1e-9} {about / 2 + 1e-9}"/>'
    for row, k in itertools.product(range(rows), range(count)):
        angle = 2.0 * math.pi * (k + 0.5 * row) / count
        along = (row - 0.5 * (rows - 1)) * size["row_gap_m"]
        sin, cos = math.sin(angle), math.cos(angle)
        axis = np.array([math.cos(gamma) * cos, math.sin(gamma), -math.cos(gamma) * sin])
        out = np.array([-sin, 0.0, -cos])
        place = pitch * out + np.array([0.0, along, 0.0])
        frame = " ".join(f"{v:.12g}" for v in (*axis, *np.cross(out, axis)))
        text += f'<body pos="{place[0]:.12g} {place[1]:.12g} {place[2]:.12g}" xyaxes="{frame}"><joint axis="1 0 0"/>'
        text += f'<inertial pos="0 0 0" mass="{each}" diaginertia="{axial} {across} {across}"/>'
        text += '<geom type="mesh" mesh="barrel" contype="1" conaffinity="0"/></body>'
    return text + "</body>"


def model(vehicle: dict[str, Any], size: dict[str, Any], at_m: float, height: float, friction: float) -> Any:
    """The vehicle before a step, as a MuJoCo model with hard contacts: 1 ms, critically damped."""
    first = vehicle["wheel"][0]
    cos = math.cos(first.get("roller_angle_rad", 0.0))
    vertices = barrel(size["roller_radius_m"], 0.5 * size["roller_length_m"], first["radius_m"], cos)
    body = vehicle["body"][0]
    a, b, c = (edge**2 for edge in body["box_m"])
    inertia = " ".join(str(v * body["mass_kg"] / 12.0) for v in (b + c, a + c, a + b))
    com = " ".join(map(str, body["com_m"]))
    wheels = "".join(wheel_xml(i, w, size, size["rows"], size["count"]) for i, w in enumerate(vehicle["wheel"]))
    ground = f'contype="0" conaffinity="1" friction="{friction} 0 0"'
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{STEP_S}" gravity="0 0 -9.81" cone="elliptic" impratio="10"
          integrator="implicitfast" iterations="100" tolerance="1e-10"/>
  <default>
    <geom condim="3" friction="{friction} 0 0" solref="0.001 1" solimp="0.95 0.99 0.0002"/>
  </default>
  <asset><mesh name="barrel" vertex="{" ".join(f"{v:.9g}" for v in vertices)}"/></asset>
  <worldbody>
    <geom type="box" size="6 6 0.5" pos="0 0 -0.5" {ground}/>
    <geom type="box" size="3 6 0.5" pos="{at_m + 3} 0 {height - 0.5}" {ground}/>
    <body name="base">
      <freejoint/>
      <inertial pos="{com}" mass="{body["mass_kg"]}" diaginertia="{inertia}"/>
      {wheels}
    </body>
  </worldbody>
</mujoco>""")


def climb(
    mj: Any, vehicle: dict[str, Any], command: dict[str, float], start: tuple[float, float], duration_s: float
) -> float:
    """Time from where the foremost wheel reaches the step to where all stand beyond it [s]; NaN where they never do.

    `command` holds speed, ramp_s, heading, at_m, height, stall; `start` is what place and heading are off.
    """
    data = mujoco.MjData(mj)
    heading = command["heading"] + start[1]
    data.qpos[0] = start[0]
    data.qpos[3:7] = math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)
    mujoco.mj_forward(mj, data)
    wheels = vehicle["wheel"]
    spins = [int(mj.joint(f"j{i}").dofadr[0]) for i in range(len(wheels))]
    hubs = [mj.body(f"w{i}").id for i in range(len(wheels))]
    radii = np.array([w["radius_m"] for w in wheels])
    height = command["height"]
    reach = np.sqrt(radii**2 - np.maximum(radii - height, 0.0) ** 2)
    integral = np.zeros(len(wheels))
    gains, slope, stall = vehicle["gains"], vehicle["motor"]["slope_n_m_s_rad"], command["stall"]
    reached = math.nan
    for period in range(round(duration_s / PERIOD_S)):
        time_s = period * PERIOD_S
        turned = data.body("base").xmat.reshape(3, 3)
        yaw = math.atan2(turned[1, 0], turned[0, 0])
        speed = command["speed"] * min(1.0, time_s / command["ramp_s"])
        v = np.array([speed * math.cos(yaw), -speed * math.sin(yaw)])
        for i, wheel in enumerate(wheels):
            gamma = wheel.get("roller_angle_rad", 0.0)
            d = np.array(wheel["rolling_direction"]) / np.linalg.norm(wheel["rolling_direction"])
            push = math.cos(gamma) * d + math.sin(gamma) * np.array([-d[1], d[0]])
            measured = data.qvel[spins[i]]
            error = float(push @ v) / (wheel["radius_m"] * math.cos(gamma)) - measured
            integral[i] += gains["ki_n_m_rad"] * error * PERIOD_S
            asked = gains["kp_n_m_s_rad"] * error + integral[i]
            most = max(0.0, stall - slope * abs(measured)) if asked * measured > 0 else stall
            data.qfrc_applied[spins[i]] = min(max(asked, -most), most)
        for _ in range(round(PERIOD_S / STEP_S)):
            mujoco.mj_step(mj, data)
        centres = data.xpos[hubs]
        if not np.all(np.isfinite(centres)):
            raise ArithmeticError("MuJoCo diverged")
        if math.isnan(reached) and bool(np.any(centres[:, 0] + reach >= command["at_m"])):
            reached = time_s
        if bool(np.all(centres[:, 0] >= command["at_m"]) and np.all(centres[:, 2] >= height + radii - CLEAR_M)):
            return time_s - reached
    return math.nan
