"""Draws docs/images/mecanum-mounting.png: the two ways to mount mecanum wheels, each from above and from below.

python scripts/docs/mecanum_mounting.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch, Rectangle

ROOT = Path(__file__).resolve().parents[2]
WHEELBASE, TRACK = 0.34, 0.30  # m
LONG, WIDE = 0.15, 0.06  # of a wheel
ROLLERS = 5
BODY, RUBBER, GROUND = "#e4e7ec", "#2b3440", "#c2410c"


def wheel(axes: Axes, ahead: float, left: float, slope: float, colour: str) -> None:
    """A wheel with the rollers that face the reader: lines whose left end is `slope` ahead of their right one."""
    axes.add_patch(Rectangle((-left - WIDE / 2, ahead - LONG / 2), WIDE, LONG, fill=False, ec=RUBBER, lw=1.4))
    for i in range(ROLLERS):
        middle = ahead + (i - (ROLLERS - 1) / 2) * LONG / (ROLLERS + 1)
        dx, dy = 0.4 * WIDE, 0.4 * WIDE * slope
        axes.plot([-left - dx, -left + dx], [middle + dy, middle - dy], color=colour, lw=4, solid_capstyle="round")


def view(axes: Axes, o_from_below: bool, below: bool) -> None:
    """The vehicle, its front at the top."""
    axes.add_patch(
        FancyBboxPatch(
            (-0.09, -0.22), 0.18, 0.44, boxstyle="round,pad=0,rounding_size=0.02", fc=BODY, ec=RUBBER, lw=1.0
        )
    )
    axes.annotate("front", (0, 0.29), (0, 0.12), ha="center", arrowprops={"arrowstyle": "->", "color": RUBBER}, size=10)
    for ahead in (1, -1):
        for left in (1, -1):
            # From above an O shows the upper rollers, an X. Those on the ground slope the other way. Turned over,
            # left is right, and they slope as the upper ones again.
            slope = ahead * left * (1 if o_from_below else -1)
            shown = -left if below else left
            wheel(axes, ahead * WHEELBASE / 2, shown * TRACK / 2, slope, GROUND if below else RUBBER)
    axes.set(xlim=(-0.24, 0.24), ylim=(-0.29, 0.31), aspect="equal")
    axes.axis("off")


def main() -> None:
    """Draw all four."""
    figure, all_axes = plt.subplots(1, 4, figsize=(11, 3.9), layout="constrained")
    for k, axes in enumerate(all_axes):
        view(axes, o_from_below=k < 2, below=k % 2 == 1)
        axes.set_title(["from above: X", "from below: O", "from above: O", "from below: X"][k], size=11)
    figure.text(0.25, -0.03, 'mounting = "O", the usual one', ha="center", size=12, weight="bold")
    figure.text(0.75, -0.03, 'mounting = "X": can hardly turn', ha="center", size=12, weight="bold")
    figure.savefig(ROOT / "docs/images/mecanum-mounting.png", dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    main()
