"""Draws the pictures that the documents show, from runs: python scripts/docs/figures.py [RESULTS].

The map is of the study climb_map, which takes some minutes. RESULTS is the folder of its results, out/climb_map if left
out; the study is run or finished there first.
"""

import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import omnistep

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "images"
#: A wet patch, on which odometry is wrong: the run of docs/drive-a-path.md.
SQUARE = {
    "start.heading_rad": 0.3,
    "friction_patch": [{"x_m": [0.8, 1.2], "y_m": [0.0, 2.0], "friction": 0.1}],
}


def main(results: Path) -> None:
    """Write climb.png, figure-8.png to figure-11.png, climb-map.png and square-path.png."""
    subprocess.run([sys.executable, "-m", "omnistep", "study", "climb_map", "--out", results], check=True)
    FOLDER.mkdir(parents=True, exist_ok=True)
    scale_references = omnistep.run("step", policy="scale_references")
    independent = omnistep.run("step", policy="independent")
    wheels = [omnistep.run_motor_bench(policy) for policy in ("scale_references", "scale_torques")]
    pictures = {
        "climb": omnistep.plot.side_view(omnistep.run("step"), every_s=0.6),
        "figure-8": omnistep.plot.motor_bench(wheels)[0],
        "figure-9": omnistep.plot.side_views([scale_references, independent])[0],
        "figure-10": omnistep.plot.climb(scale_references)[0],
        "figure-11": omnistep.plot.climb(independent)[0],
        "climb-map": omnistep.plot.climb_map(results)[0],
        "square-path": omnistep.plot.path(omnistep.run("square", overrides=SQUARE)),
    }
    for name, ax in pictures.items():
        ax.figure.savefig(FOLDER / f"{name}.png", dpi=90)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else ROOT / "out" / "climb_map")
