"""Polar pictures of climb charts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep._argument_types import of_kind
from omnistep._axes import policy_colour, pyplot
from omnistep.charts import ClimbChart
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.projections.polar import PolarAxes
    from numpy.typing import NDArray

# Description of an edge's size.
_SIZES = {
    "step": "step up",
    "drop": "step down",
    "bar": "half-round bar",
    "slope": "rise of a slope on 1 m",
    "gap": "width of a gap",
}
_NAMES = {0.0: " forward", 90.0: "\nleft", 180.0: " back", -90.0: "\nright"}
_WIDEST_DEG = 30.0
# Up to so many sides each has its angle at the rim.
_FEW = 12


def chart(
    charts: ClimbChart | Sequence[ClimbChart],
    *,
    edge: str = "step",
    skew_deg: float = 0.0,
    ax: PolarAxes | None = None,
) -> PolarAxes:
    """Draw climb charts of a vehicle over the direction of travel, forward up and left to the left.

    Each direction of the chart is a sector around it: its radius is the size to plan with, the dashed arc above it the
    limit. A sector is as wide as the step between the directions, at most 30 degrees; there is no value between
    sectors. A direction with its angle but without a sector is not climbed. Each chart has the colour of its policy.

    Args:
        charts: what :func:`omnistep.climb_chart` returned or :meth:`omnistep.ClimbChart.read` read; several of one
            vehicle under different policies are drawn over one another.
        edge: ``step``, ``drop``, ``bar``, ``slope`` or ``gap``.
        skew_deg: direction of travel off the edge's normal [deg], one that the charts contain.
        ax: polar axes of matplotlib; a new figure by default.

    Returns:
        The axes; the radius is the size [mm].

    Raises:
        ConfigError: no chart, one without such a cell, or axes that are not polar.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> omni3 = omnistep.climb_chart("omni3", edges=["step"], sides_deg=[-60.0, 0.0, 60.0])
        >>> ax = omnistep.plot.chart(omni3)
        >>> [round(float(sector.get_height()), 1) for sector in ax.patches] == [
        ...     1000 * cell.climbs_m for cell in omni3.cells
        ... ]
        True
    """
    drawn = [charts] if isinstance(charts, ClimbChart) else list(charts)
    if not drawn:
        raise ConfigError("charts: none, allowed: one or more", key="charts")
    for number, each in enumerate(drawn):
        of_kind(each, f"charts[{number}]", ClimbChart)
    if ax is None:
        made, ax = pyplot().subplots(figsize=(5.0, 5.0), subplot_kw={"projection": "polar"}, layout="constrained")
        del made
    elif getattr(ax, "name", None) != "polar":
        raise ConfigError("ax: not polar, allowed: axes with projection='polar'", key="ax")
    ax.set_theta_zero_location("N")
    limits_mm: dict[float, float] = {}
    for each in drawn:
        for side_deg, limit_mm in _draw(ax, each, edge, skew_deg).items():
            limits_mm[side_deg] = max(limit_mm, limits_mm.get(side_deg, 0.0))
    ax.set_ylim(0.0, 1.08 * max(limits_mm.values()) or 1.0)
    _label(ax, limits_mm)
    vehicles = ", ".join(dict.fromkeys(each.vehicle for each in drawn))
    ax.set_title(f"{vehicles}: {_SIZES[edge]} [mm]", fontsize="large")
    ax.legend(loc="upper right", bbox_to_anchor=(1.08, 0.02))
    return ax


def _draw(ax: PolarAxes, of: ClimbChart, edge: str, skew_deg: float) -> dict[float, float]:
    """Draw one chart: its sizes to plan with as sectors, its limits as dashed arcs; returns the limits by side."""
    cells = [cell for cell in of.cells if cell.edge == edge and cell.skew_deg == skew_deg]
    if not cells:
        skews = {cell.edge: set[float]() for cell in of.cells}
        for cell in of.cells:
            skews[cell.edge].add(cell.skew_deg)
        known = ", ".join(f"{name} at {sorted(angles)}" for name, angles in skews.items())
        message = f"edge = {edge!r}, skew_deg = {skew_deg}: not in the chart, allowed: {known}"
        raise ConfigError(message, key="edge")
    sizes_m = {180.0 - (180.0 - cell.side_deg) % 360.0: (cell.climbs_m, cell.limit_m) for cell in cells}
    if of.keys["mirrored"]:
        sizes_m |= {-side: sizes for side, sizes in sizes_m.items() if 0.0 < side < 180.0}
    sides = sorted(sizes_m)
    climbs, limits = 1000.0 * np.array([sizes_m[side] for side in sides]).T
    width = min(_gaps(sides).min(), _WIDEST_DEG)
    colour = policy_colour(of.policy)
    options: dict[str, Any] = {"facecolor": (colour, 0.25), "edgecolor": colour, "linewidth": 0.6}
    ax.bar(np.radians(sides), climbs, np.radians(width), label=of.policy, **options)
    across = np.append(np.linspace(-0.5, 0.5, 9), np.nan) * width  # the last ends an arc
    arcs = np.radians(np.add.outer(sides, across)).ravel()
    ax.plot(arcs, limits.repeat(across.size), color=colour, lw=1.2, ls=(0.0, (2.0, 1.0)))
    return dict(zip(sides, limits, strict=True))


def _label(ax: PolarAxes, limits_mm: dict[float, float]) -> None:
    """Name the directions, and put the scale between the two sides with the least limits."""
    sides = sorted(limits_mm)
    every = sides if len(sides) <= _FEW else range(-150, 181, 30)
    ax.set_thetalim(0.0, 2.0 * np.pi)
    ax.set_thetagrids([side % 360.0 for side in every], [f"{side:g}°{_NAMES.get(side, '')}" for side in every])
    gaps = _gaps(sides)
    nearer = [max(limits_mm[side], limits_mm[sides[(k + 1) % len(sides)]]) for k, side in enumerate(sides)]
    # Of equal ones the widest, and of those the first to the right.
    best = min(range(len(sides)), key=lambda k: (nearer[k], -gaps[k], sides[k] >= 0.0, sides[k]))
    ax.set_rlabel_position(sides[best] + 0.5 * gaps[best])
    top = ax.get_rmax()
    marks = pyplot().MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(0.0, top)
    ax.set_yticks([mark for mark in marks if 0.0 < mark < 0.9 * top])  # no label on a label of the rim
    for label in ax.get_yticklabels():
        label.set_bbox({"facecolor": "white", "alpha": 0.8, "linewidth": 0.0, "pad": 0.5})
    ax.set_axisbelow(True)


def _gaps(sides_deg: Sequence[float]) -> NDArray[Any]:
    """Angles from each side to the next one counter-clockwise [deg]."""
    return np.diff([*sides_deg, sides_deg[0] + 360.0])
