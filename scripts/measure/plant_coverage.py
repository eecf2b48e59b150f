"""Prints how often 95 % intervals hold the truth, of plants unlike the simulator.

200 logs per row: recorded poses and ends by hand for `omnistep calibrate`, hobby bridges for `omnistep identify`; the
plants are those of python/tests. Some twenty minutes on two cores. The exit code is 1 if a share is below 90 %.
"""

import argparse
import importlib.util
import sys
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import ModuleType

import numpy as np

import omnistep

ROOT = Path(__file__).resolve().parents[2]
LEAST = 0.90


def plant(name: str) -> ModuleType:
    """A plant of the tests."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "python/tests" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def poses(seed: int, lasts_s: float = 0.3, sideways: float = 1.0) -> dict[str, bool]:
    """Whether each interval of a calibration from recorded poses holds the truth; one that is withheld does not."""
    pose_plant, delay_s = plant("pose_plant"), 0.01 * (seed % 6)
    log = pose_plant.driven(np.random.default_rng(seed), lasts_s=lasts_s, delay_s=delay_s, sideways=sideways)
    found = omnistep.calibrate([omnistep.CalibrationRun(log=log, pose=True)], vehicle="mecanum4")
    truth = {"all.radius": pose_plant.RADIUS_M / 0.076, "all.lever": pose_plant.LEVER_M / 0.45}
    if sideways != 1.0:
        truth["all.sideways"] = sideways
    for key, value in zip(("x_m", "y_m", "yaw_rad"), pose_plant.PLATE, strict=True):
        truth[f"run[0].plate_{key}"] = value
    truth["run[0].delay_s"] = delay_s
    names = {name: name.removeprefix("run[0].") for name in truth}
    return {
        names[name]: bool(found[name].determined and found[name].low <= value <= found[name].high)
        for name, value in truth.items()
    }


def lasting(seed: int) -> dict[str, bool]:
    """The same where slip lasts as long as a piece."""
    return poses(seed, 3.0)


def slipping(seed: int) -> dict[str, bool]:
    """The same of a vehicle that goes 92 % as far sideways as its wheels say."""
    return poses(seed, sideways=0.92)


#: Ahead, back, aside and around, as with a tape: twists, and how long.
BY_HAND = [[(sign * 0.4, 0, 0, 5)] for sign in (1, -1, 1)] + [[(0, sign * 0.4, 0, 5)] for sign in (1, -1, 1)]
BY_HAND += [[(0, 0, sign, 12)] for sign in (1, -1)]


def by_hand(seed: int) -> dict[str, bool]:
    """The same of eight runs with ends measured by hand, in which each wheel slips by 0.5 % all the way."""
    runs, rng, drawn = [], np.random.default_rng(seed), omnistep.Vehicle("mecanum4")
    radius, lever = 1 + 0.02 * rng.standard_normal(), 1 + 0.03 * rng.standard_normal()
    keys = {}
    for k, wheel in enumerate(drawn.layout.wheels):
        keys[f"wheel.{k}.radius_m"] = radius * wheel.radius_m
        keys[f"wheel.{k}.position_m"] = list(lever * np.array(wheel.position_m))
    real = drawn.replace(keys)
    for parts in BY_HAND:
        log, (x_m, y_m, yaw_rad) = plant("test_calibrate").drive(real, parts, rng, counts=1024)
        for name in drawn.wheel_names:
            log[f"wheel_{name}_position_rad"] = log[f"wheel_{name}_position_rad"] * (1 + 0.005 * rng.standard_normal())
        runs.append(omnistep.CalibrationRun(log=log, end_x_m=x_m, end_y_m=y_m, end_yaw_rad=yaw_rad))
    found = omnistep.calibrate(runs, vehicle=drawn)
    truth = {"all.radius": radius, "all.lever": lever}
    return {
        name: bool(found[name].determined and found[name].low <= value <= found[name].high)
        for name, value in truth.items()
    }


def bridge(seed: int, zero: str) -> dict[str, bool]:
    """The same of an identification from PWM; an interval that is withheld holds nothing."""
    hobby = plant("hobby_plant")
    known = {name: hobby.TRUTH[name] for name in ("mass_kg", "wheel_inertia_kg_m2")}
    with tempfile.TemporaryDirectory() as folder:
        log = hobby.written(Path(folder), seed, zero)
        found = omnistep.identify(log, vehicle=hobby.file(), fix=known, progress=False)
    names = ("stall_torque_n_m", "slope_n_m_s_rad", "gear_friction_n_m", "yaw_inertia_kg_m2")
    return {name: bool(found[name].low <= hobby.TRUTH[name] <= found[name].high) for name in names}


def braking(seed: int) -> dict[str, bool]:
    """A bridge that brakes at zero duty."""
    return bridge(seed, "brake")


def coasting(seed: int) -> dict[str, bool]:
    """A bridge that coasts."""
    return bridge(seed, "coast")


ROWS = {
    "poses, 210 counts, 3 % slip": poses,
    "poses, slip that lasts 3 s": lasting,
    "poses, 92 % sideways": slipping,
    "eight runs by hand, 0.5 % slip": by_hand,
    "PWM, braking": braking,
    "PWM, coasting": coasting,
}


def main() -> None:
    """Run, print, and say whether every share is as it shall be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=200, help="logs of a row")
    parser.add_argument("--jobs", type=int, default=None, help="processes; one a core by default")
    arguments = parser.parse_args()
    good = True
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for name, case in ROWS.items():
            held: Counter[str] = Counter()
            for each in pool.map(case, range(arguments.seeds), chunksize=4):
                held.update(each)
            shares = {key: count / arguments.seeds for key, count in held.items()}
            good &= min(shares.values()) >= LEAST
            print(f"{name}: {', '.join(f'`{key}` {100 * share:.1f} %' for key, share in shares.items())}", flush=True)
    if not good:
        print(f"a share is below {100 * LEAST:.0f} %", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
