"""Balls, rollers and MuJoCo's rollers over a step: the tables of docs/physics.md, drawn again from a study file.

    pip install mujoco numpy        # in an environment of its own; without them the third column is left out
    cargo build --release
    python scripts/wheel_models/compare.py scripts/wheel_models/step_mecanum4.toml

The study is run by the program (started again, it goes on), then its points once more in MuJoCo, with as many starts
each. A cell holds how many of the runs climbed and their mean crossing time [s]: balls, rollers, MuJoCo.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import random
import subprocess
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ASSETS = ROOT / "crates/omni-config/assets"
HEADING, HEIGHT, STALL = "start.heading_rad", "terrain.height_m", "vehicle.motor.stall_torque_n_m"


def vehicle_of(study: Path, program: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The vehicle of a study, with gains, and the lengths of its rollers."""
    name = tomllib.loads(study.read_text())["set"]["vehicle"]
    path = study.parent / name if name.endswith(".toml") else ASSETS / f"vehicles/{name}.toml"
    said = subprocess.run([program, "ripple", str(path), "--json"], check=True, capture_output=True, text=True).stdout
    vehicle = tomllib.loads(path.read_text())
    if "gains" not in vehicle:
        text = subprocess.run(
            [program, "constants", "flat", "--set", f"vehicle={path}", "--language", "c"],
            check=True,
            capture_output=True,
            text=True,
        ).stderr
        numbers = (
            text.split(": kp ", 1)[1].replace(",", "").split()
        )  # "kp 0.0158 N.m.s/rad, ki 0.0395 N.m/rad, from ..."
        vehicle["gains"] = {"kp_n_m_s_rad": float(numbers[0]), "ki_n_m_rad": float(numbers[3])}
    return vehicle, json.loads(said.splitlines()[0])


def simulated(study: Path, program: str, out: Path, jobs: int) -> dict[tuple[Any, ...], str]:
    """Cells of the study by heading, stall torque, height and wheel model, as the program runs it."""
    command = [program, "study", str(study), "--json", "--quiet", "--out", str(out), "--jobs", str(jobs)]
    lines = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    cells = {}
    for cell in map(json.loads, lines):
        key = tuple(cell[axis.replace(".", "_")] for axis in (HEADING, STALL, HEIGHT, "physics.wheel_model"))
        cells[key] = shown(round(cell["climbed"] * cell["runs"]), cell["crossing_s"])
    return cells


def judged(
    study: dict[str, Any], vehicle: dict[str, Any], size: dict[str, Any], heading: float, stall: float, height: float
) -> str:
    """A cell in MuJoCo."""
    from mujoco_rollers import climb, model

    of = study["set"]
    scenario = tomllib.loads((ASSETS / "scenarios/step.toml").read_text())
    at_m = of["terrain.at_m"]
    command = {
        "speed": of.get("command.vx_m_s", scenario["command"]["vx_m_s"]),
        "ramp_s": scenario["command"]["ramp_s"],
    }
    command |= {"heading": heading, "at_m": at_m, "height": height, "stall": stall}
    mj = model(vehicle, size, at_m, height, of.get("terrain.friction", scenario["terrain"]["friction"]))
    times = []
    for seed in range(study["seeds"]):
        rng = random.Random(seed)
        off = [rng.uniform(-of[key], of[key]) for key in ("perturbation.start_m", "perturbation.yaw_rad")]
        times.append(climb(mj, vehicle, command, (off[0], off[1]), of["duration_s"]))
    up = [time for time in times if not math.isnan(time)]
    return shown(len(up), sum(up) / len(up) if up else None)


def shown(climbed: int, crossing_s: float | None) -> str:
    """Runs that climbed, and their mean crossing time."""
    return f"{climbed}" if crossing_s is None else f"{climbed} ({crossing_s:.2f})"


def main() -> None:
    """Prints one Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path)
    parser.add_argument("--program", default="target/release/omnistep")
    parser.add_argument("--out", type=Path, help="folder of the study's results")
    parser.add_argument("--jobs", type=int, default=1, help="runs of the study at a time")
    args = parser.parse_args()
    study = tomllib.loads(args.study.read_text())
    vehicle, size = vehicle_of(args.study, args.program)
    ours = simulated(args.study, args.program, args.out or Path("out") / study["name"], args.jobs)
    axes = {axis["key"]: axis["values"] for axis in study["axis"]}
    try:
        import mujoco as _  # noqa: F401 - only whether it is there
    except ImportError:
        judge = False
    else:
        judge = True
    print("| heading | torque limit | " + " | ".join(f"{100 * h:g} cm" for h in axes[HEIGHT]) + " |")
    print("|---|---|" + "---|" * len(axes[HEIGHT]))
    for heading, stall in itertools.product(axes[HEADING], axes[STALL]):
        cells = []
        for height in axes[HEIGHT]:
            parts = [ours[heading, stall, height, wheels] for wheels in ("ball", "rollers")]
            parts += [judged(study, vehicle, size, heading, stall, height)] if judge else []
            cells.append(", ".join(parts))
        print(f"| {math.degrees(heading):.0f} deg | {stall} N.m | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
