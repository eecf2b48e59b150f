"""Drives planned routes over random halls: how often a vehicle arrives, by the pose that it follows and by the planner.

``python scripts/measure/routes.py VEHICLE CHART [MAPS] [FIRST]`` prints a table. Each hall has rooms with walls, doors
with sills, platforms, cables and ice, drawn by seed. A run counts as arrived if the vehicle ends within 8 cm and 3
degrees of the goal.
"""

import argparse
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from math import degrees, hypot, pi, remainder
from pathlib import Path
from random import Random
from typing import Any

import omnistep
from omnistep import ClimbChart, NoRouteError, Route, Scenario

#: Half the hall's width, and its length from the start on [m].
HALF_M, LENGTH_M = 3.0, 7.0
#: Multiples of a cell of the planner [m], so that an edge lies between cells.
CELL_M = 0.05
WALL_M = 0.5
NEAR_M, NEAR_DEG = 0.08, 3.0
#: Poses to follow with, and other planners on the estimated pose.
WAYS = ["estimate", "odometry", "truth", "straight", "all edges free", "all edges walls"]
#: Noise of the sensors as bought.
SENSORS = {
    "sensors.encoder_noise_rad_s": 0.05,
    "sensors.gyro_noise_rad_s": 0.005,
    "sensors.gyro_bias_rad_s": 0.003,
    "sensors.encoder_counts": 4096,
    "sensors.accelerometer_noise_m_s2": 0.05,
    "sensors.accelerometer_bias_m_s2": 0.05,
    "sensors.attitude_bias_rad": 0.003,
    "sensors.attitude_walk_rad_per_sqrt_s": 0.001,
}


def cells(dice: Random, least_m: float, most_m: float) -> float:
    """A random multiple of a cell."""
    return round(dice.uniform(least_m, most_m) / CELL_M) * CELL_M


def hall(seed: int) -> tuple[dict[str, Any], tuple[float, float]]:
    """The keys of a hall's ground, and the goal."""
    dice = Random(seed)
    blocks: list[tuple[list[float], list[float], float]] = []
    # Two rows of walls across the way, each with a door that has a sill.
    for x in (cells(dice, 1.5, 2.2), cells(dice, 4.2, 5.0)):
        door, wide = cells(dice, -1.2, 1.2), cells(dice, 1.3, 1.8)
        blocks.append(([x, x + 0.1], [-HALF_M, door - wide / 2], WALL_M))
        blocks.append(([x, x + 0.1], [door + wide / 2, HALF_M], WALL_M))
        if dice.random() < 0.7:
            blocks.append(
                ([x, x + 0.1], [door - wide / 2, door + wide / 2], dice.choice([0.01, 0.02, 0.03, 0.045, 0.06]))
            )
    # Kerbs along the hall, platforms and cables.
    for _ in range(dice.randint(0, 2)):
        x, y = cells(dice, 2.4, 3.6), cells(dice, -2.5, 1.0)
        height = dice.choice([0.02, 0.03, 0.04, 0.07])
        blocks.append(([x, x + cells(dice, 1.0, 1.6)], [y, y + cells(dice, 1.2, 2.0)], height))
    for _ in range(dice.randint(0, 2)):
        x = cells(dice, 5.4, 6.0)
        blocks.append(([x, x + CELL_M], [-HALF_M, HALF_M], dice.choice([0.008, 0.015])))
    goal = (LENGTH_M, cells(dice, -1.5, 1.5))
    ice = [{"x_m": [3.0, 3.6], "y_m": [-2.0, 2.0], "friction": 0.2}] if dice.random() < 0.3 else []
    keys: dict[str, Any] = {
        "terrain": {"kind": "flat", "friction": 0.7},
        "block": [{"x_m": x, "y_m": y, "height_m": height} for x, y, height in blocks],
    }
    if ice:
        keys["friction_patch"] = ice
    return keys, goal


def blind(chart: ClimbChart, climbs_m: float) -> ClimbChart:
    """A chart that takes every side for one that climbs so much."""
    text = re.sub(r"^(climbs_m|limit_m) = .*$", rf"\1 = {climbs_m}", chart.text, flags=re.MULTILINE)
    return ClimbChart(text)


def route(base: Scenario, goal: tuple[float, float], chart: ClimbChart) -> Route | None:
    """The route, if there is one."""
    try:
        return omnistep.plan_route(base, goal, chart=chart)
    except NoRouteError:
        return None


def straight(base: Scenario, goal: tuple[float, float]) -> Scenario:
    """The straight line to the goal, driven as a route is."""
    follow = {"pose": "estimate", "rest_s": 3.0, "wait": {}}
    command = {"path": [{"x_m": goal[0], "y_m": goal[1], "speed_m_s": 0.3}], "follow": follow}
    return Scenario(base, overrides={"command": command, "duration_s": 40.0})


def driven(scenario: Scenario, goal: tuple[float, float], yaw_rad: float) -> tuple[float, float]:
    """Where a run ends: its distance from the goal [m], and its heading off the last one [deg]."""
    trace = omnistep.run(scenario, progress=False)
    x, y, yaw = (float(trace[name][-1]) for name in ("pose_x_m", "pose_y_m", "pose_yaw_rad"))
    return hypot(x - goal[0], y - goal[1]), abs(degrees(remainder(yaw - yaw_rad, 2.0 * pi)))


def measure(seed: int, vehicle: str, chart_file: str) -> dict[str, Any]:
    """What became of a hall: for each way whether it arrived, or None where there was no route."""
    keys, goal = hall(seed)
    policy = ClimbChart.read(chart_file).policy
    overrides = keys | SENSORS | {"vehicle": vehicle, "control.policy": policy, "physics.engine": "articulated"}
    base = Scenario("flat", overrides=overrides, seed=seed)
    chart = ClimbChart.read(chart_file)
    found: dict[str, Any] = {"seed": seed}
    plans = {
        "estimate": route(base, goal, chart),
        "all edges free": route(base, goal, blind(chart, 0.3)),
        "all edges walls": route(base, goal, blind(chart, 0.0)),
    }
    for way in WAYS:
        if way == "straight":
            scenario, yaw_rad = straight(base, goal), 0.0
        else:
            plan = plans["estimate" if way in ("odometry", "truth") else way]
            if plan is None:
                found[way] = None
                continue
            scenario, yaw_rad = plan.scenario, plan.points[-1].yaw_rad
            if way in ("odometry", "truth"):
                scenario = Scenario(scenario, overrides={"command.follow.pose": way})
        # Every planner alike has half as long again, and a minute, for what waits and tries again.
        scenario = Scenario(scenario, overrides={"duration_s": 1.5 * scenario["duration_s"] + 20.0})
        off_m, off_deg = driven(scenario, goal, yaw_rad)
        found[way] = off_m <= NEAR_M and off_deg <= NEAR_DEG
        found[f"{way} [m]"] = off_m
    return found


def main() -> int:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vehicle")
    parser.add_argument("chart", type=Path)
    parser.add_argument("maps", type=int, nargs="?", default=100)
    parser.add_argument("first", type=int, nargs="?", default=1000)
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.maps)
    with ProcessPoolExecutor() as pool:
        runs = [pool.submit(measure, seed, arguments.vehicle, str(arguments.chart)) for seed in seeds]
        rows = [run.result() for run in runs]
    for row in rows:
        missed = ", ".join(f"{way} {row[f'{way} [m]']:.2f} m" for way in WAYS if row[way] is False)
        print(f"hall {row['seed']}: {missed or 'all that have a route arrive'}")
    print(f"\n| {arguments.vehicle} | routes | arrived |\n| --- | ---: | ---: |")
    for way in WAYS:
        tried = [row[way] for row in rows if row[way] is not None]
        print(f"| {way} | {len(tried)} of {len(rows)} | {sum(tried)} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
