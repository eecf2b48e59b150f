"""Runs the study of traction control, judges it, and writes docs/study.md and its gates: scripts/study.sh [--check].

Some forty minutes on two cores, most of it rapier's rollers and the draws of the safety table. Results are in
out/study, a file a build; runs that are there are not run again. Exit code 1 if a gate fails.
"""

import argparse
import sys
from pathlib import Path

import pandas as pd

import study.figures
import study.gates
import study.measure
import study.page
import study.runs
import study.safety

OUT = study.runs.ROOT / "out" / "study"
ON_DAMPERS = ["independent", "scale_torques", "scale_references", "traction", "traction_runup"]


def judged(rows: pd.DataFrame, dampers: pd.DataFrame) -> list[study.gates.Gate]:
    """Every gate, in the order of the page."""
    _, _, seeds = study.runs.study_file("traction")
    possible = [cell for cell in study.runs.hard_cells() if cell not in study.runs.IMPOSSIBLE]
    gates = []
    for wheels in ("ball", "rollers"):
        for engine in ("articulated", "rapier"):
            gates += study.gates.grid(rows, engine, wheels)
    gates += study.gates.perturbed(rows, study.runs.PERTURBED, "articulated")
    gates += study.gates.perturbed(rows, study.runs.BIASES, "rapier")
    gates += study.gates.grounds(rows, study.runs.GROUNDS, "articulated", study.gates.GROUND_RUNS)
    gates += study.gates.grounds(rows, study.runs.GROUNDS, "rapier", 2)
    gates += study.gates.runup(rows, possible, study.runs.HARD, len(seeds))
    gates += study.gates.situations(rows) + study.gates.vehicles(rows) + study.gates.safety(rows, study.safety.DRAWS)
    return [*gates, *study.gates.bouncing(rows), *study.gates.on_dampers(dampers)]


def on_dampers(out: Path) -> None:
    """Run section 3.3, some seconds, and keep its metrics and speeds."""
    found = [study.measure.on_dampers(policy) for policy in ON_DAMPERS]
    study.runs.write(out / "dampers.parquet", pd.DataFrame([metrics for metrics, _ in found]))
    speeds = [pd.DataFrame(columns).assign(policy=metrics["policy"]) for metrics, columns in found]
    study.runs.write(out / "speeds.parquet", pd.concat(speeds, ignore_index=True))


def main() -> int:
    """Run, judge, write; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument(
        "--short", action="store_true", help="one seed, articulated: to try it; judges and writes nothing"
    )
    parser.add_argument("--check", action="store_true", help="run nothing: judge, write and draw from out/study")
    arguments = parser.parse_args()
    out = OUT.with_name("study-short") if arguments.short else OUT
    out.mkdir(parents=True, exist_ok=True)
    # Of each build a file of its own: hours of runs are not lost where something is built or edited.
    file = out / f"runs-{study.measure.build()}.parquet"
    if arguments.check:
        rows = study.runs.kept(file)
        if rows.empty:
            print(f"{file}: no results, make study computes them", file=sys.stderr)
            return 1
    else:
        rows = study.runs.complete(file, study.runs.planned(arguments.short), arguments.jobs)
        on_dampers(out)
    if arguments.short:
        print(rows.groupby(["group", "wheels", "policy"])["climbed"].agg(["size", "sum"]).to_string())
        return 0
    dampers, speeds = (pd.read_parquet(out / f"{name}.parquet") for name in ("dampers", "speeds"))
    gates = judged(rows, dampers)
    study.runs.write(out / "gates.parquet", pd.DataFrame([vars(gate) | {"verdict": gate.verdict} for gate in gates]))
    for gate in gates:
        print(f"{gate.verdict:8}  {gate.group}; {gate.name}; {gate.demand or 'no requirement'}; {gate.measured}")
    study.page.write(rows, dampers, gates)
    study.figures.draw(rows, speeds)
    failed = sum(gate.held is False for gate in gates)
    print(f"{failed} of {sum(gate.held is not None for gate in gates)} gates failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
