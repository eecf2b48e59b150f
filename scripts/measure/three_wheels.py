"""Counts how often robots of three wheels climb, under plain PID and under traction control, by side and height.

    .venv/bin/python scripts/measure/three_wheels.py

The starts are none on which the law was tuned. It ends with exit code 1 if traction control climbs less often than
plain PID in a cell. A quarter of an hour of one core.
"""

import math
import sys
from pathlib import Path

import omnistep

ROBOTS = Path(__file__).resolve().parents[2] / "crates" / "omnistep" / "assets" / "robots"
POLICIES = ["independent", "traction"]
#: Sides that lead [degrees], heights [mm].
CELLS = {
    "omni3": ([0, 30, 60, 90], [18, 20, 22, 24, 26]),
    str(ROBOTS / "lekiwi.toml"): ([0, 30, 45, 60], [5, 8, 11, 14]),
    str(ROBOTS / "robotino.toml"): ([0, 30, 60, 90], [10, 14, 18, 22]),
}
#: How far ahead [m], and how far off its heading [degrees].
STARTS = [(-0.03, 2.0), (-0.05, -1.0), (-0.01, -2.2), (-0.075, 0.7)]


def climbs(vehicle: str, policy: str, side_deg: float, height_mm: float) -> int:
    """How many of the starts climb."""
    side = math.radians(side_deg)
    keys = {
        "vehicle": vehicle,
        "control.policy": policy,
        "physics.engine": "articulated",
        "physics.wheel_model": "rollers",
        "terrain.friction": 0.7,
        "terrain.height_m": height_mm / 1000.0,
        "command.frame": "body",
        "command.vx_m_s": 0.3 * math.cos(side),
        "command.vy_m_s": 0.3 * math.sin(side),
        "duration_s": 25.0,
        "stop_when_done": True,
    }
    count = 0
    for ahead_m, off_deg in STARTS:
        start = {"start.x_m": ahead_m, "start.heading_rad": math.radians(off_deg - side_deg)}
        count += omnistep.run("step", overrides={**keys, **start}, progress=False).outcome.verdict == "climbed"
    return count


def main() -> int:
    """Print a line for each side, and the sums."""
    sums, fewer = [0, 0], 0
    for vehicle, (sides, heights) in CELLS.items():
        for side in sides:
            cells = [[climbs(vehicle, policy, side, height) for policy in POLICIES] for height in heights]
            line = ", ".join(f"{mm} mm {plain}/{ours}" for mm, (plain, ours) in zip(heights, cells, strict=True))
            print(f"{Path(vehicle).stem} side {side}: {line}", flush=True)
            sums = [sum(column) for column in zip(sums, *cells, strict=True)]
            fewer += sum(ours < plain for plain, ours in cells)
    print(f"{' and '.join(POLICIES)} climb {sums[0]} and {sums[1]}; fewer climbs in {fewer} cells")
    return int(fewer > 0)


if __name__ == "__main__":
    sys.exit(main())
