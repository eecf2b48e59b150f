"""Draws docs/images/control-step.png: the blocks of one control step, and what belongs to the robot.

python scripts/docs/block_diagram.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

ROOT = Path(__file__).resolve().parents[2]
BODY, RUBBER, ACCENT = "#e4e7ec", "#2b3440", "#c2410c"
WIDE, HIGH = 1.72, 0.94  # of a box
COLUMNS = (0.0, 2.3, 4.6, 6.9)
ROWS = (0.0, 1.75, 3.5)  # from below
ARROW = {"arrowstyle": "-|>", "color": RUBBER, "lw": 1.4, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 14}


def box(axes: Axes, column: int, row: int, text: str, *, ours: bool = True, accent: bool = False) -> None:
    """A block with its text: grey if it is part of the control step, white if it is the robot's."""
    x, y = COLUMNS[column], ROWS[row]
    axes.add_patch(
        FancyBboxPatch(
            (x - WIDE / 2, y - HIGH / 2),
            WIDE,
            HIGH,
            boxstyle="round,pad=0,rounding_size=0.1",
            fc=BODY if ours else "white",
            ec=ACCENT if accent else RUBBER,
            lw=2.2 if accent else 1.2,
        )
    )
    axes.text(x, y, text, ha="center", va="center", size=11, color=RUBBER, linespacing=1.25)


def arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], *, dashed: bool = False) -> None:
    """A signal from one point to another."""
    axes.annotate("", end, start, arrowprops={**ARROW, "linestyle": "--" if dashed else "-"})


def label(axes: Axes, x: float, y: float, text: str) -> None:
    """The name of a signal."""
    axes.text(x, y, text, ha="center", va="center", size=9.5, color=RUBBER, style="italic", linespacing=1.1)


def main() -> None:
    """Draw it."""
    figure, axes = plt.subplots(figsize=(8.6, 5.0), layout="constrained")
    low, middle, high = ROWS
    first, second, third, last = COLUMNS
    box(axes, 0, 2, "command\n$v_x$, $v_y$, yaw rate", ours=False)
    box(axes, 1, 2, "time-out, stops,\nspeed limits")
    box(axes, 2, 2, "inverse\nkinematics")
    box(axes, 3, 2, "one PID loop\nper wheel")
    box(axes, 3, 1, "coordination\n(the policy)", accent=True)
    box(axes, 2, 1, "torque limits\nof the motors")
    box(axes, 1, 1, "bridges\nand motors", ours=False)
    box(axes, 0, 1, "vehicle\non the ground", ours=False)
    box(axes, 0, 0, "encoders", ours=False)
    box(axes, 1, 0, "velocities,\nfault monitor")
    box(axes, 2, 0, "odometry")
    box(axes, 3, 0, "hinge encoders,\ninertial unit", ours=False)
    half, tall = WIDE / 2, HIGH / 2
    for left, right in ((first, second), (second, third), (third, last)):
        arrow(axes, (left + half, high), (right - half, high))
    label(axes, (third + last) / 2, high + 0.68, "reference speed\nof each wheel")
    arrow(axes, (last, high - tall), (last, middle + tall))
    for right, left in ((last, third), (third, second), (second, first)):
        arrow(axes, (right - half, middle), (left + half, middle))
    label(axes, (second + third) / 2, middle + 0.66, "torque\nof each wheel")
    arrow(axes, (first, middle - tall), (first, low + tall))
    arrow(axes, (first + half, low), (second - half, low))
    arrow(axes, (second + half, low), (third - half, low))
    label(axes, third, low - 0.72, "pose and twist")
    # Measured speeds go to the loops and to the coordination.
    gap, enters = (low + middle) / 2, last - 0.45
    axes.plot([second, second, enters], [low + tall, gap, gap], color=RUBBER, lw=1.4, solid_joinstyle="miter")
    arrow(axes, (enters, gap), (enters, middle - tall))
    label(axes, third, gap + 0.2, "measured wheel speeds")
    around = last + half + 0.32
    axes.plot([enters, around, around], [gap, gap, high], color=RUBBER, lw=1.4, solid_joinstyle="miter")
    arrow(axes, (around, high), (last + half, high))
    arrow(axes, (last + 0.45, low + tall), (last + 0.45, middle - tall), dashed=True)
    axes.text(
        first - half,
        low - 1.25,
        "grey: the control step, the same code in simulation and firmware; white: robot, or its simulation\n"
        "dashed: traction control only",
        ha="left",
        va="center",
        size=9.5,
        color=RUBBER,
        linespacing=1.4,
    )
    axes.set(xlim=(first - half - 0.1, around + 0.1), ylim=(low - 1.6, high + 1.05), aspect="equal")
    axes.axis("off")
    figure.savefig(ROOT / "docs/images/control-step.png", dpi=120)


if __name__ == "__main__":
    main()
