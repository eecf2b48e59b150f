"""Polar pictures of climb charts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep._argument_types import of_kind
from omnistep._axes import policy_colour, pyplot
from omnistep.charts import ChartCell, ClimbChart
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.projections.polar import PolarAxes

# Description of an edge's size.
_SIZES = {
    "step": "step up",
    "drop": "step down",
    "sill": "half-round sill",
    "slope": "rise of a slope on 1 m",
    "gap": "width of a gap",
}


def chart(
    charts: ClimbChart | Sequence[ClimbChart],
    *,
    edge: str = "step",
    skew_deg: float = 0.0,
    ax: PolarAxes | None = None,
) -> PolarAxes:
    """Draw climb charts of a vehicle over the direction of travel, forward up and left to the left.

    The area is the size to plan with, the dashed line above it the limit. Each chart has the colour of its policy.

    Args:
        charts: what :func:`omnistep.climb_chart` returned or :meth:`omnistep.ClimbChart.read` read; several of one
            vehicle under different policies are drawn over one another.
        edge: ``step``, ``drop``, ``sill``, ``slope`` or ``gap``.
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
        >>> [round(float(size_mm), 1) for size_mm in ax.lines[0].get_ydata()] == [
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
    for each in drawn:
        _draw(ax, each, edge, skew_deg)
    ax.set_ylim(bottom=0.0)
    ax.set_rlabel_position(-75.0)
    ax.set_thetagrids(range(0, 360, 30), [f"{angle if angle <= 180 else angle - 360}°" for angle in range(0, 360, 30)])
    ax.tick_params(labelsize="small")
    vehicles = ", ".join(dict.fromkeys(each.vehicle for each in drawn))
    ax.set_title(f"{vehicles}: {_SIZES[edge]} [mm]", fontsize="medium")
    ax.legend(fontsize="small", loc="lower left", bbox_to_anchor=(-0.1, -0.1))
    return ax


def _draw(ax: PolarAxes, of: ClimbChart, edge: str, skew_deg: float) -> None:
    """Draw one chart: its sizes to plan with as an area, its limits as a dashed line."""
    cells = [cell for cell in of.cells if cell.edge == edge and cell.skew_deg == skew_deg]
    if not cells:
        skews = {cell.edge: set[float]() for cell in of.cells}
        for cell in of.cells:
            skews[cell.edge].add(cell.skew_deg)
        known = ", ".join(f"{name} at {sorted(angles)}" for name, angles in skews.items())
        message = f"edge = {edge!r}, skew_deg = {skew_deg}: not in the chart, allowed: {known}"
        raise ConfigError(message, key="edge")
    sides, climbs, limits = _around(cells, mirrored=bool(of.keys["mirrored"]))
    colour = policy_colour(of.policy)
    ax.plot(sides, climbs, color=colour, lw=1.4, label=of.policy)
    ax.fill(sides, climbs, color=colour, alpha=0.2, lw=0)
    ax.plot(sides, limits, color=colour, lw=0.8, ls="--")


def _around(cells: Sequence[ChartCell], *, mirrored: bool) -> tuple[Any, Any, Any]:
    """Sides [rad] and sizes [mm] in their order; a closed curve if they cover a full turn."""
    points = {cell.side_deg: (cell.climbs_m, cell.limit_m) for cell in cells}
    if mirrored:
        points |= {-side: sizes for side, sizes in points.items() if 0.0 < side < 180.0}
    sides = sorted(points)
    gaps = np.diff([*sides, sides[0] + 360.0])
    if len(sides) > 2 and gaps.max() <= 15.0:
        sides.append(sides[0] + 360.0)
    sizes = np.array([points[side if side in points else side - 360.0] for side in sides])
    return np.radians(sides), 1000.0 * sizes[:, 0], 1000.0 * sizes[:, 1]
