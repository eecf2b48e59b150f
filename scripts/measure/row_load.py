"""Draws docs/images/row-load.png: how a row shares its load, and what that does to a climb.

Runs the study scripts/measure/row_load.toml with the program: a minute.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[2]
ROW_N = 3 * 21.58  # what the front row carries at rest (`omnistep check`)


def main() -> None:
    """Run and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    program = ROOT / "target" / "release" / "omnistep"
    parser.add_argument("--program", type=Path, default=program, help="the command built with --features full")
    program = parser.parse_args().program
    with tempfile.TemporaryDirectory() as results:  # a new folder: results that are there are not computed again
        command = [program, "study", ROOT / "scripts/measure/row_load.toml", "--json", "--quiet", "--out", results]
        said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    cells = [json.loads(line) for line in said.splitlines()]
    assert all(cell["errors"] == 0 for cell in cells), cells
    figure = Figure(figsize=(6.4, 3.4), dpi=110, layout="constrained")
    ax = figure.subplots()
    for friction, colour in ((0.5, "#D55E00"), (0.55, "#0072B2"), (0.6, "#009E73")):
        line = sorted(
            (cell for cell in cells if cell["terrain_friction"] == friction),
            key=lambda cell: cell["vehicle_wheel_5_preload_n"],
        )
        # Two thirds of a preload go to the wheel that has it.
        shares = [(ROW_N / 3.0 + cell["vehicle_wheel_5_preload_n"] / 1.5) / ROW_N for cell in line]
        rates = [cell["climbed"] for cell in line]
        bars = [[abs(cell["climbed"] - cell[end]) for cell in line] for end in ("climbed_low", "climbed_high")]
        ax.errorbar(shares, rates, bars, color=colour, marker="o", ms=4, lw=1.2, capsize=3, label=f"mu {friction}")
    ax.set(
        xlabel="share of the front row's load on its transverse wheel, at rest", ylabel="part of 24 starts that climbed"
    )
    ax.set_ylim(-0.03, 1.03)
    ax.grid(alpha=0.3)
    ax.legend()
    figure.savefig(ROOT / "docs/images/row-load.png")


if __name__ == "__main__":
    main()
