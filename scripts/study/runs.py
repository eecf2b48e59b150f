"""What the study runs: every run as a row, kept in one Parquet file that goes on from where it stopped."""

import hashlib
import itertools
import json
import multiprocessing
import time
import tomllib
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import pandas as pd
from tqdm import tqdm

import study.measure
import study.safety
import study.situations

ROOT = Path(__file__).resolve().parents[2]
STUDIES = ROOT / "crates" / "omni-config" / "assets" / "studies"
FRICTION, TORQUE, HEIGHT = "terrain.friction", "vehicle.motor.stall_torque_n_m", "terrain.height_m"
POLICIES = ["independent", "scale_torques", "scale_references", "shared_integral", "traction", "traction_runup"]
SLOPE = "vehicle.motor.slope_n_m_s_rad"
NO_LOAD_RAD_S = 15.0  # of motors whose torque falls with the speed: 1 m/s at the rims

KEEP_S = 30.0  # rows are on the disk at least as often
PLACED = {"perturbation.yaw_rad": 0.03, "perturbation.start_m": 0.02}

#: Cells of the harder table that nothing was seen to climb, neither full thrust held at up to 1 m/s nor plain loops.
IMPOSSIBLE = {(0.065, 0.55, 1.4), (0.065, 0.55, 1.8), (0.065, 0.7, 1.4), (0.065, 0.7, 1.8), (0.065, 0.85, 1.4)}
#: Sixteen of the others for the slow engine: every height, every friction, torque limits from 1.0 N.m.
HARD = [
    *[(0.05, mu, torque) for mu in (0.55, 0.7, 0.85) for torque in (1.0, 1.2)],
    *[(0.055, mu, 1.4) for mu in (0.55, 0.7, 0.85)],
    *[(0.06, 0.55, 2.2), (0.06, 0.7, 1.4), (0.06, 0.7, 1.8), (0.06, 0.85, 1.8)],
    *[(0.065, 0.55, 3.0), (0.065, 0.7, 3.0), (0.065, 0.85, 2.2)],
]

NOISE = {"sensors.encoder_noise_rad_s": 0.05, "sensors.gyro_noise_rad_s": 0.01}
GROUNDS = ["half_step", "stairs", "ramp", "rough", "bumps", "ditch", "ice"]
# chugo7: bodies of 1, 6 and 6 kg, wheels of 7 kg in all.
BODIES = [(1.0, (0.0, 0.0, 0.066)), (6.0, (0.18, 0.0, 0.18)), (6.0, (-0.18, 0.0, 0.18))]
WHOLE_KG, WHEELS_KG = 20.0, 7.0


def heavier(part: float) -> dict[str, Any]:
    """The whole vehicle heavier by a part, in its bodies."""
    factor = 1 + part * WHOLE_KG / (WHOLE_KG - WHEELS_KG)
    return {f"vehicle.body.{i}.mass_kg": mass * factor for i, (mass, _) in enumerate(BODIES)}


def shifted(ahead_m: float, up_m: float) -> dict[str, Any]:
    """The centre of mass of the whole vehicle elsewhere, by that of its bodies."""
    factor = WHOLE_KG / (WHOLE_KG - WHEELS_KG)
    return {
        f"vehicle.body.{i}.com_m": [x + ahead_m * factor, y, z + up_m * factor]
        for i, (_, (x, y, z)) in enumerate(BODIES)
    }


PERTURBED: dict[str, dict[str, Any]] = {
    "mass +15 %": heavier(0.15),
    "mass -15 %": heavier(-0.15),
    "centre of mass 2 cm back": shifted(-0.02, 0.0),
    "centre of mass 2 cm forward": shifted(0.02, 0.0),
    "centre of mass 4 cm up": shifted(0.0, 0.04),
    "noise": NOISE,
    "noise, 1 ms delay": NOISE | {"sensors.delay_s": 0.001},
    "noise, 2 ms delay": NOISE | {"sensors.delay_s": 0.002},
    "noise, 2 ms delay, 5 ms lag": NOISE | {"sensors.delay_s": 0.002, "actuators.torque_lag_s": 0.005},
    "gyro bias 0.005 rad/s": {"sensors.gyro_bias_rad_s": 0.005},
    "gyro bias 0.02 rad/s": {"sensors.gyro_bias_rad_s": 0.02},
}
BIASES = [case for case in PERTURBED if case.startswith("gyro")]
#: Counts per turn of the wheels' encoders; as fine as one likes in the grid.
COARSE: dict[str, dict[str, Any]] = {
    f"{counts} counts": {"sensors.encoder_counts": counts} for counts in (4096, 1024, 256, 128, 64, 32)
}
#: The built-in step, met askew: with a lateral as well as a forward command, or with a rotated start pose.
ASKEW: dict[str, dict[str, Any]] = {
    **{f"{vy:g} m/s sideways": {"command.vy_m_s": vy} for vy in (0.05, 0.1, 0.15, 0.2, 0.3)},
    **{f"heading {heading:g} rad": {"start.heading_rad": heading} for heading in (0.05, 0.1, 0.15, 0.2, 0.3)},
}


def study_file(name: str) -> tuple[dict[str, Any], dict[str, list[Any]], list[int]]:
    """Keys of all runs, axes and seeds of a study of the product."""
    study = tomllib.loads((STUDIES / f"{name}.toml").read_text(encoding="utf-8"))
    return study["set"], {axis["key"]: axis["values"] for axis in study["axis"]}, study["seeds"]


def grid_cells() -> list[tuple[float, float, float]]:
    """Height, friction and torque limit of each cell of the grid."""
    _, axes, _ = study_file("traction")
    return [(0.05, mu, torque) for mu in axes[FRICTION] for torque in axes[TORQUE]]


def hard_cells() -> list[tuple[float, float, float]]:
    """Those of the harder table."""
    _, axes, _ = study_file("traction_runup")
    low = [(0.05, mu, torque) for mu in axes[FRICTION] for torque in (1.0, 1.2)]
    return low + list(itertools.product(axes[HEIGHT], axes[FRICTION], axes[TORQUE]))


def step(
    group: str, policies: Iterable[str], cells: Iterable[tuple], seeds: Iterable[int], **more: Any
) -> Iterator[dict]:
    """Runs over the step: a policy's name may end in " without retry"."""
    keys = {"duration_s": 15.0, "stop_when_done": True, **PLACED, **more.pop("keys", {})}
    tags = {"engine": "articulated", "wheels": "ball", "case": ""} | more
    for (height, mu, torque), policy, seed in itertools.product(cells, policies, seeds):
        law, _, without = policy.partition(" without ")
        yield {
            **tags,
            "group": group,
            "scenario": "step",
            "policy": policy,
            "height_m": height,
            "friction": mu,
            "torque_n_m": torque,
            "seed": seed,
            "keys": {
                **keys,
                "control.policy": law,
                **({"control.max_retries": 0} if without else {}),
                "physics.engine": tags["engine"],
                "physics.wheel_model": tags["wheels"],
                HEIGHT: height,
                FRICTION: mu,
                TORQUE: torque,
            },
        }


def grounds(engine: str, policies: list[str], seeds: list[int]) -> Iterator[dict]:
    """Runs over the other built-in grounds, at the torque limit that is built in."""
    for name, policy, seed in itertools.product(GROUNDS, policies, seeds):
        keys = {
            **PLACED,
            "control.policy": policy,
            "physics.engine": engine,
            "duration_s": 15.0,
            "stop_when_done": True,
        }
        if name == "ice":
            keys["duration_s"] = 6.0
        if name == "rough":
            keys["terrain.seed"] = seed
        tags = {"group": "grounds", "case": name, "engine": engine, "wheels": "ball", "scenario": name}
        yield {**tags, "policy": policy, "seed": seed, "keys": keys}


def askew(policies: list[str], seeds: list[int], **tags: Any) -> Iterator[Iterator[dict]]:
    """Runs over the built-in step, met askew."""
    cell = [(0.05, 0.7, 2.0)]
    for case, keys in ASKEW.items():
        yield step("askew", policies, cell, seeds, case=case, keys=keys, **tags)


def planned(short: bool) -> list[dict]:
    """Every run of the study; of the short form one seed, and nothing of the slow engine."""
    _, _, seeds = study_file("traction")
    one, two = seeds[:1], seeds[:2]
    grid, hard = grid_cells(), hard_cells()
    possible = [cell for cell in hard if cell not in IMPOSSIBLE]
    pair, three = ["independent", "traction"], ["independent", "traction", "traction without retry"]
    long, fast, soft = {"duration_s": 30.0}, {"command.vx_m_s": 1.0}, {"physics.contact_damping_ratio": 1.0}
    runs = [
        step("grid", [*POLICIES, "traction without retry"], grid, seeds),
        step("grid", three, grid, seeds, wheels="rollers"),
        step("hard", ["traction_runup", "traction"], hard, seeds, keys=long),
        step("hard", ["independent", "traction_runup without retry"], hard, seeds),
        step("fast", ["independent"], hard, seeds, keys=fast),
        *[
            step("line", ["traction_runup", "traction"], [cell], seeds, keys=long | {SLOPE: cell[2] / NO_LOAD_RAD_S})
            for cell in hard
        ],
        *[step("perturbed", pair, grid, two, case=case, keys=keys) for case, keys in PERTURBED.items()],
        *[step("coarse", pair, grid, two, case=case, keys=keys) for case, keys in COARSE.items()],
        grounds("articulated", [*pair, "traction_runup"], list(range(seeds[0], seeds[0] + 8))),
        step("bouncing", [*pair, "traction_runup"], grid, two, keys=soft),
        step("bouncing hard", ["traction_runup"], possible, one, keys=soft | long),
        step("hard", ["traction_runup"], HARD, one, keys=long, engine="rapier"),
        step("grid", [*three, "scale_torques", "scale_references"], grid, seeds, engine="rapier"),
        *[
            step("perturbed", ["traction"], grid, two, case=case, keys=PERTURBED[case], engine="rapier")
            for case in BIASES
        ],
        grounds("rapier", pair, two),
        *askew(["independent", "scale_references", "traction"], seeds, engine="articulated", wheels="ball"),
        *askew(["independent", "scale_references", "traction"], seeds, engine="articulated", wheels="rollers"),
        *askew(pair, seeds, engine="rapier", wheels="ball"),
        step("grid", pair, grid, seeds, engine="rapier", wheels="rollers"),
        study.situations.situations(),
        study.situations.vehicles(),
        study.safety.planned(range(60 if short else study.safety.DRAWS)),
    ]
    every = list(itertools.chain(*runs))
    firsts = {seeds[0], study.situations.SEEDS[0]}
    quick = [run for run in every if run["engine"] != "rapier"]
    return [run for run in quick if run["seed"] in firsts or run["group"] == "safety"] if short else every


def key(run: dict, build: str) -> str:
    """What tells a run from every other."""
    parts = [build, run["scenario"], run["seed"], run["keys"], run.get("traction")]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:32]


def _tags(run: dict) -> dict[str, Any]:
    """What a run is called."""
    return {name: value for name, value in run.items() if name != "keys"}


def _measured(run: dict) -> dict[str, Any]:
    if run["group"] == "safety":
        return study.safety.measure(run)
    return study.measure.measure(run["scenario"], run["keys"], run["seed"])


def kept(path: Path) -> pd.DataFrame:
    """The rows that are there."""
    return pd.read_parquet(path) if path.is_file() else pd.DataFrame({"key": pd.Series(dtype=str)})


def write(path: Path, rows: pd.DataFrame) -> None:
    """Replace a file whole by whole."""
    growing = path.with_suffix(".growing")
    rows.to_parquet(growing, index=False)
    growing.replace(path)


def complete(path: Path, runs: list[dict], jobs: int) -> pd.DataFrame:
    """Run what is missing, and return a row for each run, in their order."""
    build = study.measure.build()
    keys = [key(run, build) for run in runs]
    rows = {row["key"]: row for row in kept(path).to_dict("records")}
    missing = {each: run for each, run in zip(keys, runs, strict=True) if each not in rows}
    last = time.monotonic()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context) as pool, tqdm(total=len(missing), unit="run") as bar:
        futures = {pool.submit(_measured, run): each for each, run in missing.items()}
        try:
            for future in as_completed(futures):
                each = futures[future]
                rows[each] = {"key": each, "build": build, **_tags(missing[each]), **future.result()}
                bar.update()
                if time.monotonic() - last > KEEP_S:
                    write(path, pd.DataFrame(list(rows.values())))
                    last = time.monotonic()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    # Runs of two groups may be the same run: what it is called is the plan's.
    table = pd.DataFrame([rows[each] | _tags(run) for each, run in zip(keys, runs, strict=True)])
    write(path, table)
    return table
