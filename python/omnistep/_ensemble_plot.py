"""Figures of a study with the uncertainty that its number of runs leaves."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep._axes import given_or_new, policy_colour, pyplot
from omnistep._climb_map import axis_label, in_order, value_text
from omnistep._columns import columns
from omnistep._omnistep import list_policies, mean_interval, wilson
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_MARKS = "osD^v<>P"
_IN_A_ROW = 4
_LETTERS = 44  # that fit below an axis, side by side
_ROOM = 0.6  # of the way between two values, for lines side by side


def ensemble(
    rows: str | PathLike[str] | Any,
    metrics: Sequence[str] = ("climbed", "crossing_s"),
    *,
    x: str = "control.policy",
    lines: str | None = None,
    axes: Sequence[Axes] | NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Draw means of a study's metrics over one of its axes, with whiskers of their 95 % intervals.

    Whiskers are Wilson score intervals for booleans such as ``climbed``, and Student's t intervals for means of two
    runs or more; a single run has none. Two values with overlapping whiskers may still differ significantly if both
    have the same starts: :meth:`omnistep.StudyResult.paired` compares these pairs. Runs that failed are not counted,
    nor are those in which a metric was not measured; runs that differ in anything but x and lines are counted together.

    Args:
        rows: what :func:`omnistep.run_study` or :func:`omnistep.sweep` returned, or anything else that
            :func:`omnistep.plot.climb_map` accepts.
        metrics: columns of numbers, or of yes and no; one axes for each.
        x: key or column along x; numbers or names.
        lines: key or column that has one line for each value; None for one line.
        axes: axes to draw on, as many as metrics; a new figure by default.

    Returns:
        The axes, (F,), in the order of the metrics.

    Raises:
        ConfigError: no rows, a column is missing, a metric is text, or the axes are not as many as metrics.
        ImportError: matplotlib or a Parquet reader is not installed.

    Example:
        >>> import omnistep
        >>> rows = [{"control_policy": "scale_torques", "seed": seed, "climbed": seed > 0} for seed in range(4)]
        >>> (ax,) = omnistep.plot.ensemble(rows, ["climbed"])
        >>> bars = ax.collections[0].get_segments()[0]
        >>> [round(float(y), 2) for _, y in bars]  # three of four
        [0.3, 0.95]
    """
    names = {name.replace(".", "_"): argument for argument, name in (("x", x), ("lines", lines)) if name is not None}
    found = columns(rows, names | dict.fromkeys(metrics, "metrics"), optional=["error"])
    along = found[x.replace(".", "_")]
    line_of = found[lines.replace(".", "_")] if lines is not None else [""] * len(along)
    errors = found.get("error", [None] * len(along))
    values, each = in_order(along), in_order(line_of)
    numbers = all(isinstance(value, int | float) for value in values)
    drawn = given_or_new(axes, (len(metrics),), size=(4.8, 0.6 + 2.2 * len(metrics)))
    for ax, metric in zip(drawn, metrics, strict=True):
        for number, line in enumerate(each):
            of_line = [
                [
                    measured
                    for measured, here, there, error in zip(found[metric], along, line_of, errors, strict=True)
                    if (here, there, error) == (value, line, None) and measured is not None
                ]
                for value in values
            ]
            places = np.array(values, dtype=float) if numbers else np.arange(len(values), dtype=float)
            step = float(np.min(np.diff(places))) if len(places) > 1 else 1.0
            places += _ROOM * step * ((number + 0.5) / len(each) - 0.5)
            _draw(ax, metric, places, of_line, line, number, [value_text(value) for value in values])
        ax.set_xticks(values if numbers else np.arange(len(values)), [value_text(value) for value in values])
        if len(values) * max(len(value_text(value)) for value in values) > _LETTERS:
            ax.tick_params(axis="x", labelrotation=20)
        if not numbers:
            ax.set_xlim(-0.6, len(values) - 0.4)
        if all(isinstance(measured, bool | None) for measured in found[metric]):
            ax.set_ylim(-0.05, 1.05)
        ax.set_ylabel(axis_label(metric))
        ax.grid(axis="y", alpha=0.3)
    drawn[-1].set_xlabel(axis_label(x))
    if lines is not None:
        above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": min(len(each), _IN_A_ROW)}
        drawn[0].legend(fontsize="small", title=axis_label(lines), title_fontsize="small", **above)
    return drawn


def _draw(
    ax: Axes, metric: str, places: NDArray[Any], measured: list[list[Any]], line: Any, number: int, names: list[str]
) -> None:
    """Draw a line of points with whiskers; points of policies have the policies' colours, and no line joins names."""
    points = [_point(metric, of_value) for of_value in measured]
    for place, name, point in zip(places, names, points, strict=True):
        if point is None:
            continue
        mean, (low, high) = point
        policy = next((policy for policy in (str(line), name) if policy in list_policies()), None)
        colour = (
            policy_colour(policy) if policy else pyplot().rcParams["axes.prop_cycle"].by_key()["color"][number % 10]
        )
        whisker = [[max(mean - low, 0.0)], [max(high - mean, 0.0)]]
        first = place == places[next(k for k, other in enumerate(points) if other is not None)]
        ax.errorbar(
            [place], [mean], whisker, color=colour, marker=_MARKS[number % len(_MARKS)], ms=4, lw=1.2, capsize=3,
            label=str(value_text(line)) if first else None,
        )  # fmt: skip


def _point(metric: str, measured: list[Any]) -> tuple[float, tuple[float, float]] | None:
    """Return mean and interval; None if nothing was measured."""
    if any(isinstance(value, str) for value in measured):
        raise ConfigError(f"metrics: {metric} is text, allowed: numbers or booleans", key="metrics")
    if not measured:
        return None
    if all(isinstance(value, bool) for value in measured):
        yes, runs = sum(measured), len(measured)
        return yes / runs, wilson(yes, runs) or (0.0, 1.0)
    mean, interval = mean_interval([float(value) for value in measured]) or (float("nan"), None)
    return mean, interval or (mean, mean)
