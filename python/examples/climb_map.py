"""Where do two policies climb? A sweep over torque limit and step height, then a query of its Parquet files.

python climb_map.py [--out FOLDER] [--seeds COUNT]; needs duckdb. Run it again: what is there is not computed again.
"""

import argparse
from pathlib import Path

import duckdb

import omnistep

POINTS = {
    "vehicle.motor.stall_torque_n_m": [1.0, 1.6, 2.2],
    "control.policy": ["independent", "scale_references"],
}
# Heading and phase of the step as a person would place the vehicle: without them every seed is the same run.
PLACED = {"perturbation.yaw_rad": 0.03, "perturbation.start_m": 0.02}

QUERY = """
select control_policy, vehicle_motor_stall_torque_n_m, avg(climbed::int), avg(crossing_s), count(error), count(*)
from read_parquet(?)
group by all
order by all
"""


def main() -> None:
    """Sweep, query, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/climb_example"), help="the folder of results")
    parser.add_argument("--seeds", type=int, default=4, help="runs of each point")
    given = parser.parse_args()
    omnistep.sweep(POINTS, scenario="step", overrides=PLACED, seeds=given.seeds, out=given.out)

    rows = duckdb.execute(QUERY, [str(given.out / "part-*.parquet")]).fetchall()
    print(f"{'policy':<14}{'torque [N.m]':>12}{'climbed':>9}{'crossing [s]':>14}{'failed':>8}{'runs':>6}")
    print("-" * 63)
    for policy, torque_n_m, climbed, crossing_s, failed, runs in rows:
        crossing = "-" if crossing_s is None else f"{crossing_s:.2f}"
        print(f"{policy:<14}{torque_n_m:>12.1f}{climbed:>9.0%}{crossing:>14}{failed:>8}{runs:>6}")


if __name__ == "__main__":
    main()
