"""Pictures and the table of mistakes of docs/mujoco.md.

    MUJOCO_GL=egl python scripts/mujoco/page.py pictures   # needs Debian's libegl1 and libegl-mesa0, or a graphics card
    python scripts/mujoco/page.py mistakes                 # some ten minutes

Each mistake is one line of the exported file done otherwise, with the same vehicle and controller.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import mujoco
import numpy as np

import omnistep
import omnistep.mujoco

matplotlib.use("Agg")
import matplotlib.pyplot as plt

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
VEHICLES = {"omni3": 0.58, "mecanum4": 0.85, "chugo7": 0.98, "rocker_bogie6": 0.98}
ELLIPSOID, CAPSULE, MESH = (mujoco.mjtGeom.mjGEOM_ELLIPSOID, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_MESH)


def picture(vehicle: str, distance_m: float) -> None:
    """The vehicle as MuJoCo has it, half of its rollers in another colour so that they can be distinguished."""
    model = omnistep.mujoco.load(omnistep.Scenario("flat", vehicle=vehicle))
    for shape in range(model.ngeom):
        name = model.body(model.geom_bodyid[shape]).name
        if "_roller_" in name and int(name.rsplit("_", 1)[1]) % 2:
            model.geom_rgba[shape] = (0.75, 0.72, 0.66, 1.0)
        elif model.geom_type[shape] == mujoco.mjtGeom.mjGEOM_BOX:
            model.geom_rgba[shape, 3] = 0.25
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.5, 0.5
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = (0.0, 0.0, 0.07), distance_m, 130.0, -28.0
    with mujoco.Renderer(model, 600, 960) as renderer:
        renderer.update_scene(data, camera)
        plt.imsave(IMAGES / f"mujoco-{vehicle}.png", renderer.render())


def rollers(spec: Any) -> list[Any]:
    """The bodies of all rollers."""
    return [body for body in spec.bodies if "_roller_" in body.name]


def reach(model: Any, shape: int, sine: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """How far a roller's shape reaches at an angle of this sine to the plane across its axis [m]."""
    cosine, size = np.sqrt(1.0 - sine**2), model.geom_size[shape]
    if model.geom_type[shape] == ELLIPSOID:
        return np.hypot(size[0] * sine, size[1] * cosine)
    if model.geom_type[shape] == CAPSULE:
        return size[0] + size[1] * sine
    mesh = model.geom_dataid[shape]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    points = model.mesh_vert[first : first + count].astype(float)
    axis = np.argmax(np.ptp(points, axis=0))
    out = (axis + 1) % 3
    return np.max(np.outer(points[:, axis], sine) + np.outer(points[:, out], cosine), axis=0)


def outline(model: Any, pitch_m: float, turn: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Height of chugo7's wheel 4 over a plane, turned by an angle of one roller's part [m]."""
    body = model.body("wheel_4_roller_0").id
    shapes = [i for i in range(model.ngeom) if model.geom_bodyid[i] == body]
    return pitch_m * np.cos(turn) + np.max([reach(model, i, np.abs(np.sin(turn))) for i in shapes], axis=0)


def one_ellipsoid(spec: Any) -> None:
    """The ellipsoid that osculates the rim in the roller's middle."""
    for body in rollers(spec):
        radius, pitch = 0.006, 0.06
        for extra in body.geoms[1:]:
            spec.delete(extra)
        body.geoms[0].size = [math.sqrt(radius * (pitch + radius)), radius, radius]


def capsules(spec: Any) -> None:
    """A capsule as long as the roller."""
    half = 0.0149
    for body in rollers(spec):
        for extra in body.geoms[1:]:
            spec.delete(extra)
        shape = body.geoms[0]
        shape.type, shape.size = CAPSULE, [0.006, half - 0.006, 0.0]
        shape.quat = [math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0]


def spheres(spec: Any) -> None:
    """One ball per roller, as omni wheels are often modelled."""
    for body in rollers(spec):
        for extra in body.geoms[1:]:
            spec.delete(extra)
        body.geoms[0].type, body.geoms[0].size = mujoco.mjtGeom.mjGEOM_SPHERE, [0.006, 0.0, 0.0]


def polyhedra(spec: Any) -> None:
    """A barrel of 24 slices with 48 corners each."""
    radius, rim, half = 0.006, 0.066, 0.0149
    along = np.linspace(-half, half, 25)
    thick = rim - np.hypot(rim - radius, along)
    around = 2.0 * np.pi * np.arange(48) / 48
    points = [(x, r * math.cos(t), r * math.sin(t)) for x, r in zip(along, thick, strict=True) for t in around]
    spec.add_mesh(name="barrel", uservert=np.array(points).ravel())
    for body in rollers(spec):
        for extra in body.geoms[1:]:
            spec.delete(extra)
        body.geoms[0].type, body.geoms[0].meshname = MESH, "barrel"


def of_contacts(**values: Any) -> Callable[[Any], None]:
    """Other parameters of all contacts."""

    def change(spec: Any) -> None:
        for body in rollers(spec):
            for shape in body.geoms:
                for key, value in values.items():
                    setattr(shape, key, value)

    return change


def of_options(**values: Any) -> Callable[[Any], None]:
    """Other options."""

    def change(spec: Any) -> None:
        for key, value in values.items():
            setattr(spec.option, key, value)

    return change


def braked(damping: float) -> Callable[[Any], None]:
    """Bearings with damping [N.m.s/rad]."""

    def change(spec: Any) -> None:
        for body in rollers(spec):
            body.joints[0].damping[0] = damping

    return change


def cylinders(spec: Any) -> None:
    """No rollers: a rim of the wheel's radius, with the friction that a roller's contact has."""
    for hub in [body for body in spec.bodies if body.name.startswith("wheel_") and "_roller_" not in body.name]:
        for roller in hub.bodies:
            for shape in roller.geoms:
                shape.contype = 0
        first = hub.bodies[0].geoms[0]
        rim = hub.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.066, 0.008, 0.0], mass=0.0)
        rim.quat = [math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0]
        rim.contype, rim.conaffinity, rim.priority, rim.condim = 1, 0, 1, 3
        rim.friction, rim.solref, rim.solimp = [0.7, 0.0, 0.0], first.solref, first.solimp


CHANGES: dict[str, tuple[Callable[[Any], None], dict[str, Any]]] = {
    "as exported": (lambda _: None, {}),
    "wheels are cylinders, without rollers": (cylinders, {}),
    "one sphere per roller": (spheres, {}),
    "one capsule per roller": (capsules, {}),
    "one ellipsoid per roller": (one_ellipsoid, {}),
    "`solref` and `solimp` left at MuJoCo's default": (
        of_contacts(solref=[0.02, 1.0], solimp=[0.9, 0.95, 0.001, 0.5, 2.0]),
        {},
    ),
    '`solref="0.001 1"`: as hard as the step allows': (
        of_contacts(solref=[0.001, 1.0], solimp=[0.95, 0.99, 0.0002, 0.5, 2.0]),
        {},
    ),
    "`condim` 6 with MuJoCo's default torsion and rolling friction": (
        of_contacts(condim=6, friction=[0.7, 0.005, 0.0001]),
        {},
    ),
    "`impratio` 1 and a pyramidal cone": (of_options(impratio=1.0, cone=mujoco.mjtCone.mjCONE_PYRAMIDAL), {}),
    "bearings with a damping of 1e-3 N.m.s/rad": (braked(1e-3), {}),
    "one polyhedron of 24 x 48 facets per roller": (polyhedra, {}),
    "a time step of 1 ms": (lambda _: None, {"physics.timestep_s": 0.001}),
    "a time step of 2 ms": (lambda _: None, {"physics.timestep_s": 0.002, "control.period_s": 0.002}),
}


def changed(scenario: omnistep.Scenario, change: Callable[[Any], None]) -> Any:
    """The scenario's model with a change."""
    spec = mujoco.MjSpec.from_string(scenario.mjcf())
    change(spec)
    return spec.compile()


def mistakes(starts: int) -> None:
    """Prints what each change makes of flat driving and of the climb."""
    print(f"| changed | forward, lateral, yaw | climbs of {starts} at 2 N.m, 1.4 N.m |\n|---|---|---|")
    for label, (change, keys) in CHANGES.items():
        off = []
        for axis, (name, value) in enumerate((("vx_m_s", 0.3), ("vy_m_s", 0.3), ("wz_rad_s", 0.5))):
            command = {"command.vx_m_s": 0.0, f"command.{name}": value, "duration_s": 2.0}
            scenario = omnistep.Scenario("flat", policy="independent", overrides={**keys, **command})
            trace = omnistep.mujoco.run(scenario, model=changed(scenario, change), progress=False)
            column = ("twist_vx_m_s", "twist_vy_m_s", "twist_wz_rad_s")[axis]
            off.append(100.0 * (np.mean(trace[column][3 * len(trace) // 4 :]) / value - 1.0))
        climbs = []
        for torque in (2.0, 1.4):
            times = []
            for seed in range(starts):
                more = {
                    "vehicle.motor.stall_torque_n_m": torque,
                    "stop_when_done": True,
                    "perturbation.yaw_rad": 0.03,
                    "perturbation.start_m": 0.02,
                }
                scenario = omnistep.Scenario("step", policy="independent", overrides={**keys, **more}, seed=seed)
                try:
                    outcome = omnistep.mujoco.run(scenario, model=changed(scenario, change), progress=False).outcome
                except omnistep.SimulationError:
                    continue
                times += [] if outcome.crossing_s is None else [outcome.crossing_s]
            climbs.append(f"{len(times)}" + (f" ({np.mean(times):.2f} s)" if times else ""))
        print(f"| {label} | {off[0]:+.2f}, {off[1]:+.2f}, {off[2]:+.2f} % | {', '.join(climbs)} |", flush=True)


def barrel(turn: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The same height over the barrel of the vehicle file: a crown that is part of the rim, and rounded edges [m]."""
    said = subprocess.run([sys.executable, "-m", "omnistep", "wheel-ripple", "--json"], capture_output=True, check=True)
    half, rim, radius = 0.5 * json.loads(said.stdout.splitlines()[0])["roller_length_m"], 0.066, 0.006
    edge = 0.05 * radius
    sine = np.abs(np.sin(turn))
    cosine = np.sqrt(1.0 - sine**2)
    # Where a circle of the rim's radius, less the edge, about a point beyond the axis touches; at most at the end.
    along = np.minimum((rim - edge) * sine, half - edge)
    away = np.sqrt((rim - edge) ** 2 - along**2) - (rim - radius)
    return (rim - radius) * np.cos(turn) + along * sine + away * cosine + edge


def shapes() -> None:
    """Draws how far wheels of different rollers are from round."""
    scenario = omnistep.Scenario("flat")
    turn = np.linspace(-math.pi / 12, math.pi / 12, 401)
    figure, ax = plt.subplots(figsize=(8.0, 3.6), layout="constrained")
    cases = (
        ("three ellipsoids, as exported", lambda _: None, "tab:green"),
        ("one ellipsoid", one_ellipsoid, "tab:orange"),
        ("capsule: up to 660 um above", capsules, "tab:red"),
        ("polyhedron, 24 x 48 facets", polyhedra, "tab:blue"),
    )
    for label, change, colour in cases:
        height = outline(changed(scenario, change), 0.06, turn)
        ax.plot(np.degrees(turn), 1e6 * (height - 0.066), label=label, color=colour)
    ax.plot(np.degrees(turn), 1e6 * (barrel(turn) - 0.066), color="black", linestyle=":", label="the vehicle's barrels")
    ax.axhspan(-14.0, 0.0, color="0.85", zorder=0, label="what a contact gives under 22 N: 14 um")
    ax.set(
        xlabel="turn of the wheel from the roller's middle [deg]",
        ylabel="axle above or below 66 mm [um]",
        ylim=(-320, 60),
    )
    ax.legend(loc="lower center", fontsize="small")
    figure.savefig(IMAGES / "mujoco-rollers.png", dpi=110)


def climb() -> None:
    """Draws the same climb here and there."""
    keys = {"stop_when_done": True}
    ours = omnistep.run(
        "step",
        policy="independent",
        overrides={**keys, "physics.engine": "articulated", "physics.wheel_model": "rollers"},
        progress=False,
    )
    theirs = omnistep.mujoco.run("step", policy="independent", overrides=keys, progress=False)
    figure, (low, high) = plt.subplots(2, 1, figsize=(8.0, 4.8), sharex=True, layout="constrained")
    for trace, label, style in ((ours, "articulated engine", "-"), (theirs, "MuJoCo", "--")):
        time = trace["time_s"]
        for body, colour in (("front", "tab:blue"), ("rear", "tab:orange")):
            low.plot(time, np.degrees(trace[f"body_{body}_nose_up_rad"]), style, color=colour, label=f"{body}, {label}")
        high.plot(time, trace["pose_x_m"], style, color="tab:green", label=label)
    low.set_ylabel("nose up [deg]")
    high.set(xlabel="time [s]", ylabel="x of the middle [m]")
    low.legend(fontsize="small", ncols=2)
    high.legend(fontsize="small")
    figure.savefig(IMAGES / "mujoco-climb.png", dpi=110)


def main() -> None:
    """Draws the pictures, or prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["pictures", "mistakes"])
    parser.add_argument("--starts", type=int, default=1, help="starts of each climb")
    args = parser.parse_args()
    if args.what == "mistakes":
        mistakes(args.starts)
        return
    shapes()
    climb()
    for vehicle, distance_m in VEHICLES.items():
        picture(vehicle, distance_m)


if __name__ == "__main__":
    main()
