"""Writes what docs/robots.md holds between its markers.

    python scripts/docs/robots_page.py list      # from the robots' files, at once
    python scripts/docs/robots_page.py climbs    # from simulations, some twenty minutes of one core

What a robot climbs is the last height of a grid, a tenth of its wheels' radius apart, before the first at which not all
seeds climb. The speed is half of what its file allows.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import omnistep

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "robots.md"
FILES = ROOT / "crates" / "omnistep" / "assets" / "robots"
BLOCK = re.compile(r"(<!-- robots: (\w+) -->\n)(.*?)(<!-- end of robots -->)", re.DOTALL)
POLICIES = ("independent", "traction")
SEEDS = (1, 2, 3)
#: Where the vehicle starts differs by seed: turned by this [rad], ahead or behind by that [m]; standard deviations.
PLACED = {"perturbation.yaw_rad": 0.03, "perturbation.start_m": 0.02}
#: Top speed [m/s] as the maker states it, and where; the others' makers state it where it could not be looked up.
SPEED = {"ridgeback": "1.1 (user manual)", "osr": "1.75 (README)"}
#: What the maker says of steps.
STEPS = {"ridgeback": "ground clearance 18 mm", "osr": "305 mm, with its own wheels"}


def names() -> list[str]:
    """The robots in the order of the command `omnistep list`."""
    source = (ROOT / "crates/omnistep/src/robots.rs").read_text(encoding="utf-8")
    return re.findall(r"assets/robots/(\w+)\.toml", source)


def vehicle(name: str) -> omnistep.Vehicle:
    """The vehicle of a robot's file."""
    return omnistep.Vehicle(FILES / f"{name}.toml")


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table of Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def listed() -> str:
    """The robots' wheels, masses and speeds."""
    rows = []
    for name in names():
        robot = vehicle(name)
        wheels = robot.to_dict()["wheel"]
        kind = "mecanum" if any(wheel["roller_angle_rad"] for wheel in wheels) else "omni"
        forward = omnistep.Kinematics(layout=robot.layout).inverse([1.0, 0.0, 0.0])
        speed_m_s = robot.no_load_rad_s / max(abs(forward))
        millimetres = 2000 * wheels[0]["radius_m"]
        rows.append(
            [
                f"`{name}`",
                f"{len(wheels)} {kind}, {millimetres:.0f} mm",
                f"{robot.mass_kg:.1f}",
                f"{speed_m_s:.2f}",
                SPEED.get(name, "-"),
            ]
        )
    return table(["robot", "wheels, diameter", "mass [kg]", "motors reach [m/s]", "maker states [m/s]"], rows)


def lifted_mm(name: str, most_mm: int) -> str:
    """The highest step of whole millimetres of which `omnistep check --step` does not warn."""

    def check(height_mm: int) -> subprocess.CompletedProcess[str]:
        arguments = ["check", str(FILES / f"{name}.toml"), "--step", str(height_mm / 1e3)]
        command = [sys.executable, "-m", "omnistep", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    if "no bound for this vehicle" in check(1).stdout:
        return "no bound"
    # Between a height that the motors lift the wheels on and one that they do not: a higher step needs more torque.
    low_mm, high_mm = 0, most_mm
    while high_mm - low_mm > 1:
        middle_mm = (low_mm + high_mm) // 2
        if re.search("^warning: .*: step of ", check(middle_mm).stderr, re.MULTILINE):
            high_mm = middle_mm
        else:
            low_mm = middle_mm
    return f"{low_mm} mm" if low_mm else "none"


def heights_mm(robot: omnistep.Vehicle) -> list[int]:
    """The heights of steps that a robot is to climb: tenths of its wheels' radius [mm]."""
    return [round(tenth * 100 * robot["wheel.0.radius_m"]) for tenth in range(1, 11)]


def climbs(robot: omnistep.Vehicle, policy: str, speed_m_s: float, height_m: float) -> bool:
    """Whether the robot climbs a step of that height, whatever the seed."""
    keys = {
        "terrain.height_m": height_m,
        "terrain.start_x_m": 1.0,
        "command.vx_m_s": speed_m_s,
        # Long enough for the nine attempts of traction control, of some five seconds each.
        "duration_s": 45.0 + 3.0 / speed_m_s,
        "stop_when_done": True,
        "physics.engine": "articulated",
        "physics.wheel_model": "rollers",
    }
    scenario = omnistep.Scenario("step", vehicle=robot, overrides=keys | PLACED)
    return all(omnistep.run(scenario, policy=policy, seed=seed, progress=False).outcome.climbed for seed in SEEDS)


def climbed() -> str:
    """What each robot climbs."""
    rows = []
    for name in names():
        robot = vehicle(name)
        grid_mm = heights_mm(robot)
        speed_m_s = robot["limits.vx_m_s"] / 2
        highest = []
        for policy in POLICIES:
            last_mm = 0
            for height_mm in grid_mm:
                if not climbs(robot, policy, speed_m_s, height_mm / 1e3):
                    break
                last_mm = height_mm
            highest.append(f"{last_mm} mm" if last_mm else f"below {grid_mm[0]} mm")
        torque = lifted_mm(name, grid_mm[-1])
        rows.append([f"`{name}`", f"{speed_m_s:.2g}", torque, *highest, STEPS.get(name, "-")])
        print(*rows[-1], sep="\t", flush=True)
    return table(["robot", "speed [m/s]", "`check --step`", *(f"`{policy}`" for policy in POLICIES), "maker"], rows)


def block(page: str, name: str) -> str:
    """What the page holds between the markers of that name."""
    return next(text for _, found, text, _ in BLOCK.findall(page) if found == name).rstrip()


def write(name: str, text: str) -> None:
    """Replace what the page holds between the markers of that name."""

    def filled(found: re.Match[str]) -> str:
        return f"{found[1]}{text}\n{found[4]}" if found[2] == name else found[0]

    PAGE.write_text(BLOCK.sub(filled, PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    makes = {"list": listed, "climbs": climbed}
    if len(sys.argv) != 2 or sys.argv[1] not in makes:
        sys.exit("usage: python scripts/docs/robots_page.py list | climbs")
    write(sys.argv[1], makes[sys.argv[1]]())
