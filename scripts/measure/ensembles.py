"""Runs the ensembles of docs/validation.md and writes its tables anew.

Runs that are in out/ensembles already are not run again: delete the folder after a change of the physics or of a law.
From nothing rapier takes half an hour on two cores, articulated two minutes.
"""

import argparse
import json
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "validation.md"
POLICIES = ["independent", "scale_torques", "scale_references", "shared_integral"]
STEPS = {
    "1 ms": "physics.timestep_s=0.001",
    "0.5 ms": "physics.timestep_s=0.0005",
    "0.25 ms": "physics.timestep_s=0.00025",
}
ITERATIONS = {
    "`physics.solver_iterations=4`": "physics.solver_iterations=4",
    "`physics.solver_iterations=16`": "physics.solver_iterations=16",
}
LINES = {
    "as built in": None,
    "`physics.timestep_s=0.000125`": "physics.timestep_s=0.000125",
    "torque limit 1.8 N.m": "vehicle.motor.stall_torque_n_m=1.8",
    "torque limit 1.4 N.m": "vehicle.motor.stall_torque_n_m=1.4",
    "torque limit 1.0 N.m": "vehicle.motor.stall_torque_n_m=1.0",
    "mu 0.9": "terrain.friction=0.9",
    "mu 0.55": "terrain.friction=0.55",
}


def cells(program: Path, engine: str, key: str | None) -> dict[str, dict]:
    """What the study says of each policy, with one key replaced."""
    folder = ROOT / "out" / "ensembles" / engine / re.sub(r"[^\w.]+", "-", key or "built-in")
    keys = [f"physics.engine={engine}", *([key] if key else [])]
    sets = [word for key in keys for word in ("--set", key)]
    command = [program, "study", "ensemble", "--json", "--quiet", "--out", folder, *sets]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert all(row["errors"] == 0 and row["runs"] == 24 for row in rows), rows
    return {row["control_policy"]: row for row in rows}


def table(first: str, lines: dict[str, dict[str, dict]], text) -> str:
    """A table with a column for each policy."""
    head = [f"| {first} | {' | '.join(POLICIES)} |".replace("|  |", "| |"), "|---|---|---|---|---|"]
    rows = [f"| {name} | {' | '.join(text(of[policy]) for policy in POLICIES)} |" for name, of in lines.items()]
    return "\n".join([*head, *rows]) + "\n"


def climbed(cell: dict) -> str:
    """Runs that climbed, and those that were cut off on their way."""
    text = str(round(cell["climbed"] * cell["runs"]))
    return text + (f" ({cell['unfinished']} unfinished)" if cell["unfinished"] else "")


def main() -> None:
    """Run and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    program = ROOT / "target" / "release" / "omnistep"
    parser.add_argument("--engine", choices=["articulated", "rapier"], action="append", help="both if left out")
    parser.add_argument("--program", type=Path, default=program, help="the command built with --features full")
    arguments = parser.parse_args()
    for engine in arguments.engine or ["articulated", "rapier"]:
        write(arguments.program, engine)


def write(program: Path, engine: str) -> None:
    """Run those of an engine and write its tables."""
    chosen = {**LINES, **(ITERATIONS if engine == "rapier" else {})}
    steps = {name: cells(program, engine, key) for name, key in STEPS.items()}
    lines = {name: cells(program, engine, key) for name, key in chosen.items()}
    tables = iter(
        [
            table("step", steps, lambda cell: f"{cell['crossing_s']:.3f}"),
            table("", lines, climbed),
            table("", lines, lambda cell: f"{cell['speed_ratio_std']:.3f}, {cell['torque_squared_n2m2s']:.1f}"),
        ]
    )
    page = PAGE.read_text(encoding="utf-8")
    start = page.index(f"\n### Ensembles with {engine}\n")
    following = re.search(r"^##", page[start + 5 :], flags=re.MULTILINE)
    end = start + 5 + following.start() if following else len(page)
    section, found = re.subn(r"(?:^\|.*\n)+", lambda _: next(tables), page[start:end], count=3, flags=re.MULTILINE)
    assert found == 3, found
    PAGE.write_text(page[:start] + section + page[end:], encoding="utf-8")


if __name__ == "__main__":
    main()
