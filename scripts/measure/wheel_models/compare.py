"""Balls, rollers and MuJoCo's rollers over a step: the tables of docs/validation.md, drawn again from a study file.

    pip install ".[mujoco]"        # without it the third column is left out
    cargo build --release --features full
    python scripts/measure/wheel_models/compare.py scripts/measure/wheel_models/step_mecanum4.toml

The study is run by the program (started again, it goes on), then its points once more in MuJoCo, with the same seeds. A
cell holds how many of the runs climbed and their mean crossing time [s]: balls, rollers, MuJoCo.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import json
import math
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import omnistep.mujoco

HEADING, HEIGHT, STALL = "start.heading_rad", "terrain.height_m", "vehicle.motor.stall_torque_n_m"


def simulated(study: Path, program: str, out: Path, jobs: int) -> dict[tuple[Any, ...], str]:
    """Cells of the study by heading, stall torque, height and wheel model, as the program runs it."""
    command = [program, "study", str(study), "--json", "--quiet", "--out", str(out), "--jobs", str(jobs)]
    lines = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    cells = {}
    for cell in map(json.loads, lines):
        key = tuple(cell[axis.replace(".", "_")] for axis in (HEADING, STALL, HEIGHT, "physics.wheel_model"))
        cells[key] = shown(round(cell["climbed"] * cell["runs"]), cell["crossing_s"])
    return cells


def judged(path: Path, study: dict[str, Any], point: dict[str, Any]) -> str:
    """A cell in MuJoCo."""
    keys = {**study["set"], **point, "stop_when_done": True}
    vehicle = keys.pop("vehicle")
    own = path.parent / vehicle
    scenario = omnistep.Scenario(study["scenario"], vehicle=own if own.is_file() else vehicle)
    runs = (omnistep.mujoco.run(scenario, overrides=keys, seed=seed, progress=False) for seed in range(study["seeds"]))
    times = [run.outcome.crossing_s for run in runs if run.outcome.climbed]
    return shown(len(times), sum(times) / len(times) if times else None)


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
    ours = simulated(args.study, args.program, args.out or Path("out") / study["name"], args.jobs)
    axes = {axis["key"]: axis["values"] for axis in study["axis"]}
    judge = importlib.util.find_spec("mujoco") is not None
    print("| heading | torque limit | " + " | ".join(f"{100 * h:g} cm" for h in axes[HEIGHT]) + " |")
    print("|---|---|" + "---|" * len(axes[HEIGHT]))
    for heading, stall in itertools.product(axes[HEADING], axes[STALL]):
        cells = []
        for height in axes[HEIGHT]:
            parts = [ours[heading, stall, height, wheels] for wheels in ("ball", "rollers")]
            point = {HEADING: heading, STALL: stall, HEIGHT: height}
            parts += [judged(args.study, study, point)] if judge else []
            cells.append(", ".join(parts))
        print(f"| {math.degrees(heading):.0f} deg | {stall} N.m | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
