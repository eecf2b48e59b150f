"""Draws chugo7-wheels.png, the numbers of the seven wheels, and ball-at-edge.png, two wheel models at a riser.

python scripts/docs/vehicle_drawings.py

Positions, directions and radii are those of the vehicle file.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "images"
VEHICLE = ROOT / "crates" / "omni-config" / "assets" / "vehicles" / "chugo7.toml"
BODY, RUBBER, GROUND, ACCENT = "#e4e7ec", "#2b3440", "#c7ccd4", "#c2410c"
RIM_WIDTH_M = 0.05
#: The built-in step.
STEP_M = 0.05


def wheels() -> list[dict[str, Any]]:
    """The wheels of the vehicle file."""
    found: list[dict[str, Any]] = tomllib.loads(VEHICLE.read_text(encoding="utf-8"))["wheel"]
    return found


def numbers() -> plt.Figure:
    """The vehicle from above, forward is up: wheel numbers and rolling directions."""
    figure, axes = plt.subplots(figsize=(6.4, 6.0), layout="constrained")
    for low, height, name in ((-0.40, 0.36, "rear body"), (0.04, 0.36, "front body")):
        axes.add_patch(Rectangle((-0.17, low), 0.34, height, fc=BODY, ec="none"))
        axes.text(-0.16, low + (0.02 if low > 0 else height - 0.05), name, ha="left", color=RUBBER)
    for wheel in wheels():
        (x, y), radius = wheel["position_m"], wheel["radius_m"]
        along = np.array(wheel["rolling_direction"])
        size = np.where(np.abs(along) > 0.5, 2 * radius, RIM_WIDTH_M)  # along x, along y
        corner = (-y - size[1] / 2, x - size[0] / 2)
        axes.add_patch(Rectangle(corner, size[1], size[0], fc="white", ec=RUBBER, lw=1.6))
        axes.text(-y, x, wheel["name"], ha="center", va="center", size=14, weight="bold", color=RUBBER)
        start, end = (np.array([-y, x]) + np.array([-along[1], along[0]]) * part for part in (0.075, 0.135))
        axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": ACCENT, "lw": 1.8})
    for x, text in ((0.30, "front row\nx = +R1"), (0.0, "middle row\njoint point"), (-0.30, "rear row\nx = -R1")):
        axes.text(0.40, x, text, ha="left", va="center", color=RUBBER)
    axes.annotate("forward, x", (-0.40, 0.16), (-0.40, -0.02), ha="center", arrowprops={"arrowstyle": "->"})
    axes.text(0, -0.53, "orange: motion of the vehicle that positive rotation causes", ha="center", color=ACCENT)
    axes.set(xlim=(-0.5, 0.62), ylim=(-0.56, 0.48), aspect="equal")
    axes.axis("off")
    return figure


def _ground(axes: Axes) -> None:
    axes.add_patch(Rectangle((-0.20, -0.03), 0.34, 0.03, fc=GROUND, ec="none"))
    axes.add_patch(Rectangle((0.0, -0.03), 0.14, 0.03 + STEP_M, fc=GROUND, ec="none"))
    axes.plot([-0.20, 0, 0, 0.14], [0, 0, STEP_M, STEP_M], color=RUBBER, lw=1.4)
    axes.set(xlim=(-0.20, 0.14), ylim=(-0.03, 0.19), aspect="equal")
    axes.axis("off")


def _force(axes: Axes, at: tuple[float, float], towards: tuple[float, float]) -> None:
    direction = np.subtract(towards, at) / np.hypot(*np.subtract(towards, at))
    style = {"arrowstyle": "-|>", "color": ACCENT, "lw": 2.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", np.add(at, 0.05 * direction), at, arrowprops=style, zorder=6)
    axes.plot(*at, "o", color=ACCENT, ms=5, zorder=7)


def edge() -> plt.Figure:
    """A transverse wheel at the riser, along its axle: a ball of its radius, and its lowest roller."""
    transverse = next(wheel for wheel in wheels() if wheel["contact"]["kind"] == "roller")
    radius, roller = transverse["radius_m"], transverse["contact"]["radius_m"]
    figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.7), layout="constrained")
    for axes in panels:
        _ground(axes)
        axes.annotate("", (-0.145, 0.17), (-0.19, 0.17), arrowprops={"arrowstyle": "->", "color": RUBBER})
        axes.text(-0.14, 0.17, "travel, along the axle", va="center", color=RUBBER)
    x = -float(np.sqrt(radius**2 - (radius - STEP_M) ** 2))
    panels[0].add_patch(Circle((x, radius), radius, fc=BODY, ec=RUBBER, lw=1.6))
    panels[0].plot([x - 0.085, x + 0.085], [radius, radius], color=RUBBER, lw=1.0, ls="-.")
    _force(panels[0], (0.0, STEP_M), (x, radius))
    panels[0].set_title(f"ball of the wheel's radius, {1000 * radius:.0f} mm: the contact is on the edge")
    panels[1].add_patch(
        Rectangle((-2 * roller, roller), 2 * roller, 2 * (radius - roller), fc="white", ec=RUBBER, lw=1.2)
    )
    for z in (roller, 2 * radius - roller):
        panels[1].add_patch(Circle((-roller, z), roller, fc=BODY, ec=RUBBER, lw=1.6))
    panels[1].plot([-roller - 0.085, -roller + 0.085], [radius, radius], color=RUBBER, lw=1.0, ls="-.")
    _force(panels[1], (0.0, roller), (-roller, roller))
    panels[1].set_title(f"roller of {1000 * roller:.0f} mm: the contact is on the riser")
    for axes in panels:
        axes.title.set_fontsize(10)
    figure.supxlabel(
        "orange: normal of the contact; dash-dotted: axle; the step is 50 mm high", fontsize=9, color=RUBBER
    )
    return figure


def main() -> None:
    """Write both pictures."""
    for name, figure in {"chugo7-wheels": numbers(), "ball-at-edge": edge()}.items():
        figure.savefig(FOLDER / f"{name}.png", dpi=90)


if __name__ == "__main__":
    main()
