"""Draws the pictures that the documents show, from runs: python scripts/py_figures.py."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import omnistep

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "images"


def main() -> None:
    """Write climb.png, figure8.png, figure10.png and figure11.png."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    synchronised = omnistep.run("step", policy="synchronised")
    omnistep.plot.strip(synchronised).figure.savefig(FOLDER / "climb.png", dpi=110)
    omnistep.plot.climb(synchronised)[0].figure.savefig(FOLDER / "figure10.png", dpi=100)
    independent = omnistep.run("step", policy="independent")
    omnistep.plot.climb(independent)[0].figure.savefig(FOLDER / "figure11.png", dpi=100)
    runs = [omnistep.wheels(policy) for policy in ("synchronised", "paper")]
    omnistep.plot.wheels(runs)[0].figure.savefig(FOLDER / "figure8.png", dpi=100)


if __name__ == "__main__":
    main()
