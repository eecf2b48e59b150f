"""Makes and checks the climb charts of all built-in vehicles.

    .venv/bin/python scripts/measure/climb_charts.py [charts|check|engines ...]

Charts are kept in out/charts, and a run that was stopped goes on there. Without arguments it does all three:

- `charts`: every vehicle under `traction` and `independent`; prints CPU seconds.
- `check`: each cell with a size above 0 is run from 20 fresh starts; at least 19 of them have to climb.
- `engines`: ten cells are run from five starts with both engines and in MuJoCo, and in each they have to climb.

It ends with exit code 1 if a cell fails.
"""

import os
import random
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import omnistep
import omnistep.mujoco
from omnistep._omnistep import ChartRuns

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "out" / "charts"
POLICIES = ["traction", "independent"]
FRESH, ENOUGH = 20, 19
#: Of both engines: vehicle and side, chosen before anything was run.
TEN = [
    ("mecanum4", 0.0),
    ("mecanum4", 90.0),
    ("mecanum4", 180.0),
    ("chugo7", 0.0),
    ("chugo7", 30.0),
    ("chugo7", 150.0),
    ("omni3", 30.0),
    ("omni3", 90.0),
    ("rocker_bogie6", 15.0),
    ("rocker_bogie6", 180.0),
]


def path(vehicle: str, policy: str) -> Path:
    """The file of a chart."""
    return FOLDER / f"chart-{vehicle}-{policy}.toml"


def charts() -> None:
    """Make what is missing of every chart."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for vehicle in omnistep.list_vehicles():
        for policy in POLICIES:
            before = time.process_time()
            made = omnistep.climb_chart(vehicle, policy=policy, out=path(vehicle, policy), resume=True)
            print(
                f"{vehicle} under {policy}: {len(made.cells)} cells, {time.process_time() - before:.0f} CPU s",
                flush=True,
            )


def runs_of(chart: omnistep.ClimbChart, **overrides: Any) -> ChartRuns:
    """What makes the scenarios of a chart's runs."""
    return ChartRuns(
        chart.vehicle,
        policy=chart.policy,
        edges=["step"],
        sides_deg=[0.0],
        skews_deg=[0.0],
        friction=chart.friction,
        speed_m_s=chart.speed_m_s,
        margin=chart.margin,
        starts=3,
        overrides=overrides,
    )


def verdict(text: str, run: Callable[..., omnistep.Trace] = omnistep.run) -> str:
    """A run's verdict, `turned` where it climbs turned by more than the chart allows."""
    try:
        outcome = run(omnistep.Scenario.from_toml(text), progress=False).outcome
    except omnistep.SimulationError:
        return "diverged"
    climbed = outcome.verdict == "climbed"
    return outcome.verdict if not climbed or abs(outcome.yaw_error_deg) < 20.0 else "turned"


def climbs(text: str) -> bool:
    """Does a run climb, turned by less than the chart allows?"""
    return verdict(text) == "climbed"


def in_mujoco(text: str) -> str:
    """The verdict of the same run with MuJoCo's physics."""
    return verdict(text, omnistep.mujoco.run)


def fresh(runs: ChartRuns, cell: Any, count: int, seed: str) -> list[str]:
    """Scenarios of a cell from random starts."""
    chosen = random.Random(seed)
    return [
        runs.scenario(
            cell.edge,
            cell.climbs_m,
            cell.side_deg,
            skew_deg=cell.skew_deg,
            x_m=-0.06 * chosen.random(),
            heading_deg=chosen.uniform(-1.0, 1.0),
        )
        for _ in range(count)
    ]


def check() -> bool:
    """Every cell of every chart from fresh starts."""
    good = True
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for vehicle in omnistep.list_vehicles():
            for policy in POLICIES:
                chart = omnistep.ClimbChart.read(path(vehicle, policy))
                runs = runs_of(chart)
                cells = [cell for cell in chart.cells if cell.climbs_m > 0.0]
                jobs = [fresh(runs, cell, FRESH, f"{vehicle} {policy} {cell[:3]}") for cell in cells]
                done = list(pool.map(climbs, [text for texts in jobs for text in texts], chunksize=FRESH // 4))
                counts = [sum(done[FRESH * k : FRESH * (k + 1)]) for k in range(len(cells))]
                few = [(cell, n) for cell, n in zip(cells, counts, strict=True) if n < ENOUGH]
                above = [
                    cell
                    for cell in cells
                    if any(
                        cell.limit_m > bound for bound in (cell.clearance_m, cell.climb_limits_m) if bound is not None
                    )
                ]
                good = good and not few and not above
                print(
                    f"{vehicle} under {policy}: {sum(done)} of {len(done)} runs of {len(cells)} cells climbed",
                    flush=True,
                )
                for cell, n in few:
                    print(f"  {n} of {FRESH}: {cell}", flush=True)
                for cell in above:
                    print(f"  beyond a bound: {cell}", flush=True)
    return good


def engines() -> bool:
    """Ten cells with both engines and in MuJoCo."""
    good = True
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for vehicle, side_deg in TEN:
            chart = omnistep.ClimbChart.read(path(vehicle, "traction"))
            (cell,) = (cell for cell in chart.cells if (cell.edge, cell.side_deg) == ("step", side_deg))
            print(f"{vehicle} at {side_deg} deg, {1000 * cell.climbs_m:.1f} mm, of 5:", end="")
            for engine in ("articulated", "rapier", "mujoco"):
                runs = runs_of(chart, **({} if engine == "mujoco" else {"physics.engine": engine}))
                texts = fresh(runs, cell, 5, f"{vehicle} {side_deg}")
                ended = list(pool.map(in_mujoco if engine == "mujoco" else verdict, texts))
                others = sorted(set(ended) - {"climbed"})
                print(
                    f" {engine} {ended.count('climbed')}", *others and [f"({', '.join(others)})"], end=",", flush=True
                )
                good = good and not others
            print(flush=True)
    return good


if __name__ == "__main__":
    asked = sys.argv[1:] or ["charts", "check", "engines"]
    results = [{"charts": charts, "check": check, "engines": engines}[each]() for each in asked]
    sys.exit(any(result is False for result in results))
