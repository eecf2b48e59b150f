"""Writes the table of docs/own-robot.md: how often intervals of `omnistep identify` hold the truth, 200 seeds per row.

Some ten minutes on two cores. The exit code is 1 if a share is below 90 %, or above 99 % by more than one log, or where
the mean of a row is above 99 %.
"""

import argparse
import importlib.util
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

import omnistep

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "own-robot.md"
SPEC = importlib.util.spec_from_file_location("wheel_plant", ROOT / "python/tests/wheel_plant.py")
assert SPEC is not None and SPEC.loader is not None
plant = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(plant)

LEAST, MOST = 0.90, 0.99
#: What is identified, and how the table calls it.
NAMES = {
    "mass_kg": "mass",
    "yaw_inertia_kg_m2": "yaw inertia",
    "gear_friction_n_m": "gear friction",
    "viscous_n_m_s_rad": "viscous",
    "delay_s": "delay",
    "lag_s": "lag",
    "slope_n_m_s_rad": "slope",
}
#: Loops of the vehicle, and its top twist.
GAINS = {"kp": 0.3, "ki": 0.8, "top": (0.8, 0.6, 1.6)}
#: The motor of logs of duty cycles; its slope is most of the plant's viscous friction.
STALL_N_M, SLOPE, VISCOUS = 4.0, 0.003, 0.001
#: What is logged, counts per turn, noise on velocities [rad/s].
ROWS = [
    *(("velocities", counts, noise) for noise in (0.0, 0.1, 0.3) for counts in (360, 1024, 4096)),
    *(("angles", counts, 0.3) for counts in (360, 1024, 4096)),
    *(("duty cycles", 360, noise) for noise in (0.0, 0.3)),
]


def truth_of(vehicle: omnistep.Vehicle) -> dict[str, float]:
    """A vehicle that its file does not describe: heavier, with friction, late and lagging."""
    mass, _, yaw = plant.masses(vehicle)
    return {
        "mass_kg": 1.15 * mass,
        "yaw_inertia_kg_m2": 0.9 * yaw,
        "wheel_inertia_kg_m2": float(vehicle["wheel.0.inertia_kg_m2"]),
        "gear_friction_n_m": 0.06,
        "viscous_n_m_s_rad": SLOPE + VISCOUS,
        "delay_s": 0.006,
        "lag_s": 0.03,
    }


def held(case: tuple[str, int, float, int, int]) -> dict[str, tuple[int, int]]:
    """Of some seeds: by parameter how many intervals hold the truth, and how many there are."""
    logged, counts, noise, first, last = case
    vehicle = omnistep.Vehicle("mecanum4")
    truth = truth_of(vehicle)
    seeds = range(first, last)
    logs = plant.logs(vehicle, truth, seeds, counts=counts, noise_rad_s=noise, vary=0.1, **GAINS)
    known = {"wheel_inertia_kg_m2": truth["wheel_inertia_kg_m2"]}
    if logged == "duty cycles":
        known |= {"viscous_n_m_s_rad": VISCOUS, "mass_kg": truth["mass_kg"]}
        truth |= {"slope_n_m_s_rad": SLOPE}
    shares: dict[str, tuple[int, int]] = {}
    for seed, log in zip(seeds, logs, strict=True):
        rng = np.random.default_rng(seed)
        rng.random(4)
        noises = noise * rng.standard_normal((len(log["time_s"]), 4))
        for k, name in enumerate(vehicle.wheel_names):
            if logged == "angles":
                # Of the encoder alone: the noise is on what the controller took.
                counted = log[f"wheel_{name}_measured_rad_s"] - noises[:, k]
                log[f"wheel_{name}_position_rad"] = plant.PERIOD_S * np.cumsum(counted)
            elif logged == "duty cycles":
                log[f"wheel_{name}_duty"] = log.pop(f"wheel_{name}_applied_n_m") / STALL_N_M
        found = omnistep.identify(log, vehicle=vehicle, fix=known, progress=False)
        for each in found.estimates:
            if each.determined and each.name in NAMES:
                inside = each.low <= truth[each.name] <= each.high
                hits, tries = shares.get(each.name, (0, 0))
                shares[each.name] = (hits + inside, tries + 1)
        if logged == "duty cycles":
            assert abs(found["stall_torque_n_m"].value / STALL_N_M - 1.0) < 0.02
    return shares


def table(seeds: int) -> tuple[list[str], bool]:
    """Lines of the table, and whether every share is as it shall be."""
    step = 25
    cases = [(*row, at, min(at + step, seeds)) for row in ROWS for at in range(0, seeds, step)]
    with ProcessPoolExecutor() as pool:
        done = dict(zip(cases, pool.map(held, cases), strict=True))
    lines = [
        f"| logged | counts | noise rad/s | {' | '.join(NAMES.values())} |",
        "|---|---|---|" + "---|" * len(NAMES),
    ]
    good = True
    for row in ROWS:
        cells, row_shares = [], []
        for name in NAMES:
            pairs = [shares[name] for case, shares in done.items() if case[:3] == row and name in shares]
            hits, tries = (sum(pair[k] for pair in pairs) for k in (0, 1))
            share = hits / tries if tries else 0.0
            row_shares += [share] if tries else []
            # In every log, or in none. One log more or less is what a share of 200 does not tell.
            good &= not tries or (LEAST <= share <= MOST + 1.001 / seeds and tries == seeds)
            cells.append(f"{100 * share:.1f} %" if tries else "")
        good &= bool(np.mean(row_shares) <= MOST)
        lines.append(f"| {row[0]} | {row[1]} | {row[2]:g} | {' | '.join(cells)} |")
    return lines, good


def main() -> None:
    """Identify, write, and say whether every share is as it shall be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=200, help="logs of a row")
    parser.add_argument("--check", action="store_true", help="write nothing")
    arguments = parser.parse_args()
    lines, good = table(arguments.seeds)
    print("\n".join(lines))
    if not arguments.check:
        page = PAGE.read_text(encoding="utf-8")
        new = "\n".join(lines) + "\n"
        written, found = re.subn(r"\| logged \|.*\n(?:\|.*\n)*", lambda _: new, page)
        assert found == 1, f"{PAGE}: no table that begins with | logged |"
        PAGE.write_text(written, encoding="utf-8")
    if not good:
        print(f"a share is not within {100 * LEAST:.0f} to {100 * MOST:.0f} %", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
