"""Our simulation and MuJoCo side by side: the figures of docs/mujoco.md, and whether they are within their gates.

    python scripts/mujoco/gate.py          # loads, acceleration, twists, crossings: some minutes
    python scripts/mujoco/gate.py --map    # and the 60 cells of the study `engines`, three starts each

Both simulate every roller, ours with the articulated engine. The exit code is 1 where a gate is missed.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tomllib
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import omnistep
import omnistep.mujoco

STUDY = Path(__file__).resolve().parents[2] / "crates/omni-config/assets/studies/engines.toml"
VEHICLES = ("omni3", "mecanum4", "chugo7", "rocker_bogie6")
OURS = {"physics.engine": "articulated", "physics.wheel_model": "rollers"}
AHEAD, SIDEWAYS, ABOUT = (0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.5)
LOAD_N, ACCELERATION, TWIST, CROSSING, AGREEMENT = 0.01, 0.005, 0.001, 0.03, 0.95
#: Where much slides MuJoCo is another model: its friction lifts what slides, by friction times slip times damper over
#: spring of the contact (docs/mujoco.md). So these have bounds of their own, which are what was measured, rounded up.
#: About the vertical one of two rollers of a wheel, apart along its axle, slides whenever both touch: 0.26 %.
SLIDING, SLIDING_TWIST = (("omni3", ABOUT),), 0.003
#: `scale_references` slows all wheels down for one that spins: 3.6 % at a friction of 0.7. With 0.9 little spins.
SPINNING, SPINNING_CROSSING, GRIP = ("scale_references",), 0.045, 0.9

Keys = dict[str, Any]
Run = Callable[[Keys, Any], omnistep.Trace]


def ours(scenario: str, keys: Keys, policy: Any = None) -> omnistep.Trace:
    """A run of the articulated engine on rollers."""
    return omnistep.run(scenario, policy=policy, overrides={**keys, **OURS}, progress=False)


def theirs(scenario: str, keys: Keys, policy: Any = None) -> omnistep.Trace:
    """The same in MuJoCo."""
    return omnistep.mujoco.run(scenario, policy=policy, overrides=keys, progress=False)


def loads_n(run: Callable[..., omnistep.Trace], vehicle: str) -> list[float]:
    """Load of each row of wheels at rest [N]: the mean from 0.5 s to 1 s, when the contacts have settled."""
    keys = {"vehicle": vehicle, "duration_s": 1.0, "command.vx_m_s": 0.0}
    trace = run("flat", keys, lambda seen: np.zeros_like(seen.wheels_rad_s))
    rows = [name for name in trace.names if name.startswith("row_")]
    return [float(np.mean(trace[row][500:])) for row in rows]


def torques_ahead(vehicle: str) -> np.ndarray[Any, Any]:
    """Torques that push ahead with six tenths of what friction holds under a wheel's mean load [N.m].

    Less would say more of what rollers take, some tenths of a newton (docs/validation.md), than of masses; with more,
    wheels begin to slide.
    """
    scenario = omnistep.Scenario("flat", vehicle=vehicle)
    keys = scenario.vehicle.to_dict()
    mass = sum(part["mass_kg"] for part in (*keys["body"], *keys["wheel"]))
    asked = omnistep.PolicyInfo.of(scenario).kinematics.inverse_matrix[:, 0]
    held = scenario["terrain.friction"] * mass * 9.81 / len(keys["wheel"]) * keys["wheel"][0]["radius_m"]
    return 0.6 * held * np.round(asked / np.max(np.abs(asked)), 6)


def acceleration_m_s2(run: Callable[..., omnistep.Trace], vehicle: str) -> float:
    """Mean acceleration over a quarter of a second under constant torques, from 0.05 s on [m/s^2]."""
    torques = torques_ahead(vehicle)
    trace = run("flat", {"vehicle": vehicle, "duration_s": 0.3}, lambda _: torques)
    speed = trace["twist_vx_m_s"]
    return float((speed[299] - speed[49]) / 0.25)


def twist(run: Callable[..., omnistep.Trace], vehicle: str, command: tuple[float, float, float]) -> float:
    """The commanded component of the twist that a vehicle settles at [m/s, rad/s].

    It swings as one roller after the other carries a wheel, of `omni3` in yaw by 5 %. So the mean is over as many whole
    pitches of rollers as the fastest wheel turns in the last three of five seconds.
    """
    keys = {"vehicle": vehicle, "duration_s": 5.0}
    keys |= {f"command.{name}": value for name, value in zip(("vx_m_s", "vy_m_s", "wz_rad_s"), command, strict=True)}
    trace = run("flat", keys, "independent")
    along = int(np.argmax(np.abs(command)))
    name = ("twist_vx_m_s", "twist_vy_m_s", "twist_wz_rad_s")[along]
    time = trace["time_s"]
    # Readings are of a period's start, twists of its end.
    rates = np.abs(trace.wheels("measured_rad_s"))
    fastest = int(np.argmax(rates[2000:].mean(axis=0)))
    turned = np.concatenate((np.cumsum(rates[1:, fastest] * 1e-3), [np.nan]))
    rollers = omnistep.Scenario("flat", vehicle=vehicle)["vehicle.rollers"]
    pitch = 2.0 * np.pi / (rollers["count"] * rollers.get("rows", 1))
    pitches = np.floor((turned[4998] - turned[2000]) / pitch)
    way = np.cumsum(trace[name]) * 1e-3
    end = np.interp(turned[2000] + pitches * pitch, turned[:4999], time[:4999])
    return float((np.interp(end, time, way) - way[2000]) / (end - time[2000]))


def climb(run: Callable[..., omnistep.Trace], keys: Keys) -> tuple[str, float | None]:
    """Verdict and crossing time of a climb."""
    try:
        outcome = run("step", keys).outcome
    except omnistep.SimulationError:
        return "diverged", None
    return outcome.verdict, outcome.crossing_s


def crossings(run: Callable[..., omnistep.Trace], policy: str, seeds: int, friction: float) -> list[float]:
    """Crossing times of the built-in step with starts as of the study, of those that climb [s]."""
    base = {
        "control.policy": policy,
        "terrain.friction": friction,
        "stop_when_done": True,
        "perturbation.yaw_rad": 0.03,
        "perturbation.start_m": 0.02,
    }
    ends = [climb(run, {**base, "seed": seed}) for seed in range(seeds)]
    return [time for _, time in ends if time is not None]


def interval(times: list[float]) -> str:
    """The mean, twice its standard error, and of how many."""
    error = np.std(times, ddof=1) / len(times) ** 0.5
    return f"{np.mean(times):.3f} +- {2.0 * error:.3f} s ({len(times)} climb)"


def cells() -> Iterator[Keys]:
    """The cells of the study, without the axis of engines."""
    study = tomllib.loads(STUDY.read_text(encoding="utf-8"))
    axes = [axis for axis in study["axis"] if axis["key"] != "physics.engine"]
    for values in itertools.product(*(axis["values"] for axis in axes)):
        yield dict(study["set"]) | dict(zip((axis["key"] for axis in axes), values, strict=True))


def judged(task: tuple[str, Keys]) -> tuple[str, float | None]:
    """One run of the map, in a process of its own."""
    side, keys = task
    return climb(ours if side == "ours" else theirs, keys)


def compared(title: str, rows: list[tuple[str, float, float]], gate: float, unit: str, *, absolute: bool) -> bool:
    """Prints figures side by side; says whether all differ by no more than the gate."""
    print(f"\n| {title} | ours | MuJoCo | off by |\n|---|---|---|---|")
    worst = 0.0
    for name, mine, other in rows:
        off = abs(other - mine) if absolute else abs(other / mine - 1.0)
        worst = max(worst, off)
        shown = f"{off:.4f} {unit}" if absolute else f"{100 * off:.3f} %"
        print(f"| {name} | {mine:.5g} | {other:.5g} | {shown} |")
    bound = f"{gate} {unit}" if absolute else f"{100 * gate:g} %"
    held = worst <= gate
    print(f"\n{title}: {'within' if held else 'NOT within'} {bound}", flush=True)
    return held


def map_agrees(jobs: int, kept: Path | None) -> bool:
    """Runs the map; prints where the two end differently, and whether unanimous cells agree."""
    seeds = tomllib.loads(STUDY.read_text(encoding="utf-8"))["seeds"]
    grid = list(cells())
    tasks = [(side, {**keys, "seed": seed}) for side in ("ours", "theirs") for keys in grid for seed in range(seeds)]
    with ProcessPoolExecutor(jobs) as pool:
        ends = list(pool.map(judged, tasks))
    if kept:
        kept.write_text(json.dumps([[*task, *end] for task, end in zip(tasks, ends, strict=True)]), encoding="utf-8")
    per = len(grid) * seeds
    unanimous = agree = 0
    ratios = []
    print("\n| torque, height, mu | ours | MuJoCo |\n|---|---|---|")
    for cell, keys in enumerate(grid):
        mine, other = (ends[at : at + seeds] for at in (cell * seeds, per + cell * seeds))
        sides = [[verdict == "climbed" for verdict, _ in side] for side in (mine, other)]
        if all(len(set(side)) == 1 for side in sides):
            unanimous += 1
            agree += sides[0] == sides[1]
        means = [[time for _, time in side if time is not None] for side in (mine, other)]
        if all(len(times) == seeds for times in means):
            ratios.append(np.mean(means[1]) / np.mean(means[0]))
        if sides[0] != sides[1]:
            of = ("vehicle.motor.stall_torque_n_m", "terrain.height_m", "terrain.friction")
            words = [
                f"{sum(side)} of {seeds}" + (f" ({np.mean(times):.2f} s)" if times else "")
                for side, times in zip(sides, means, strict=True)
            ]
            print(f"| {keys[of[0]]} N.m, {100 * keys[of[1]]:g} cm, {keys[of[2]]} | {' | '.join(words)} |")
    off = 100 * (np.array(ratios) - 1.0)
    print(f"\nWhere all climb in both ({len(ratios)} cells), MuJoCo's crossings take {off.mean():+.1f} % on average,")
    print(f"from {off.min():+.1f} to {off.max():+.1f} %.")
    held = agree >= AGREEMENT * unanimous
    print(f"Of {len(grid)} cells {unanimous} are unanimous in both; {agree} of these agree,")
    words = "within" if held else "NOT within"
    print(f"{100 * agree / unanimous:.1f} %: {words} the gate of {100 * AGREEMENT:g} %", flush=True)
    return held


def main() -> None:
    """Prints every figure; fails where one is beyond its gate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--map", action="store_true", help="run the map of 60 cells too")
    parser.add_argument("--only-map", action="store_true", help="run the map alone")
    parser.add_argument("--jobs", type=int, default=2, help="runs of the map at a time")
    parser.add_argument("--keep", type=Path, help="file for the map's runs, as JSON")
    parser.add_argument("--seeds", type=int, default=8, help="starts of each policy's crossings")
    args = parser.parse_args()
    held = []
    if not args.only_map:
        rows = [
            (f"{vehicle}, row {i + 1}", mine, other)
            for vehicle in VEHICLES
            for i, (mine, other) in enumerate(zip(loads_n(ours, vehicle), loads_n(theirs, vehicle), strict=True))
        ]
        held.append(compared("load at rest [N]", rows, LOAD_N, "N", absolute=True))
        rows = [(vehicle, acceleration_m_s2(ours, vehicle), acceleration_m_s2(theirs, vehicle)) for vehicle in VEHICLES]
        held.append(compared("acceleration [m/s^2]", rows, ACCELERATION, "", absolute=False))
        pairs = [(vehicle, command) for vehicle in VEHICLES for command in (AHEAD, SIDEWAYS, ABOUT)]
        for title, chosen, gate in (
            ("twist", [pair for pair in pairs if pair not in SLIDING], TWIST),
            ("twist while rollers slide", list(SLIDING), SLIDING_TWIST),
        ):
            rows = [
                (f"{vehicle}, {command}", twist(ours, vehicle, command), twist(theirs, vehicle, command))
                for vehicle, command in chosen
            ]
            held.append(compared(title, rows, gate, "", absolute=False))
        for title, policies, friction, gate in (
            ("crossing time [s]", ("traction", "independent"), 0.7, CROSSING),
            ("crossing time while wheels spin [s]", SPINNING, 0.7, SPINNING_CROSSING),
            (f"the same at a friction of {GRIP} [s]", SPINNING, GRIP, CROSSING),
        ):
            rows = []
            for policy in policies:
                mine, other = (crossings(run, policy, args.seeds, friction) for run in (ours, theirs))
                held.append(len(mine) == len(other) == args.seeds)
                print(f"\n{policy}, {args.seeds} starts: ours {interval(mine)}, MuJoCo {interval(other)}")
                rows.append((policy, float(np.mean(mine)), float(np.mean(other))))
            held.append(compared(title, rows, gate, "", absolute=False))
    if args.map or args.only_map:
        held.append(map_agrees(args.jobs, args.keep))
    sys.exit(not all(held))


if __name__ == "__main__":
    main()
