"""Draws the block diagrams of the overview: control-step.png and file-to-firmware.png in docs/images.

python scripts/docs/block_diagrams.py
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
    """A block with its text: grey if it is omnistep's, white if it is the user's."""
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


def control_step() -> None:
    """Draw the blocks of one control step, and what belongs to the robot."""
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


def file_to_firmware() -> None:
    """Draw the way from a file to firmware, and from a robot's recording back to the file."""
    figure, axes = plt.subplots(figsize=(8.6, 5.0), layout="constrained")
    low, middle, high = ROWS
    first, second, third, last = COLUMNS
    half, tall = WIDE / 2, HIGH / 2
    box(axes, 0, 2, "vehicle file,\nscenario file", ours=False, accent=True)
    box(axes, 1, 2, "simulation")
    box(axes, 2, 2, "log (MCAP)")
    box(axes, 3, 2, "report, plots,\nany MCAP viewer")
    box(axes, 1, 1, "constants\nin Rust or C")
    box(axes, 2, 1, "your firmware\nwith omni-core", ours=False)
    box(axes, 3, 1, "robot", ours=False)
    box(axes, 3, 0, "recording\n(CSV, ROS bag)", ours=False)
    box(axes, 2, 0, "log (MCAP)")
    box(axes, 1, 0, "measured radii,\nmasses, friction")
    across = (((first, second), high, "run"), ((second, third), high, ""), ((third, last), high, "report"))
    across += (((second, third), middle, "build"), ((third, last), middle, "flash"))
    for (left, right), row, name in across:
        arrow(axes, (left + half, row), (right - half, row))
        label(axes, (left + right) / 2, row + 0.22, name)
    # From the file down to the constants.
    axes.plot([first, first], [high - tall, middle], color=RUBBER, lw=1.4)
    arrow(axes, (first, middle), (second - half, middle))
    label(axes, (first + second) / 2 - 0.2, middle + 0.25, "export")
    arrow(axes, (last, middle - tall), (last, low + tall))
    for right, left, name in ((last, third, "import"), (third, second, "calibrate,\nidentify")):
        arrow(axes, (right - half, low), (left + half, low))
        label(axes, (left + right) / 2, low + (0.22 if name == "import" else 0.7), name)
    # And back to the file.
    edge = first - half + 0.3
    axes.plot([second - half, edge], [low, low], color=RUBBER, lw=1.4)
    arrow(axes, (edge, low), (edge, high - tall))
    axes.text(
        first - half,
        low - 0.95,
        "grey: from omnistep; white: yours; in italics: what you run",
        ha="left",
        va="center",
        size=9.5,
        color=RUBBER,
    )
    axes.set(xlim=(first - half - 0.1, last + half + 0.1), ylim=(low - 1.2, high + 1.0), aspect="equal")
    axes.axis("off")
    figure.savefig(ROOT / "docs/images/file-to-firmware.png", dpi=120)


if __name__ == "__main__":
    control_step()
    file_to_firmware()
