"""Map of the climbs of a study over two of its axes."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep import _omnistep
from omnistep._axes import given_or_new, pyplot
from omnistep._columns import columns
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

# Endings of names and their units (docs/units.md), the longest first.
_UNITS = {
    "_n2m2s": "N^2.m^2.s",
    "_n_m_s_rad": "N.m.s/rad",
    "_n_m_rad": "N.m/rad",
    "_rad_s": "rad/s",
    "_kg_m2": "kg.m^2",
    "_n_m": "N.m",
    "_m_s": "m/s",
    "_rad": "rad",
    "_deg": "deg",
    "_kg": "kg",
    "_hz": "Hz",
    "_ns": "ns",
    "_m": "m",
    "_s": "s",
    "_n": "N",
}
_IN_A_ROW = 2


def climb_map(
    rows: str | PathLike[str] | Any,
    *,
    x: str = "vehicle.motor.stall_torque_n_m",
    y: str = "terrain.height_m",
    panel: str | None = "control.policy",
    axes: Sequence[Axes] | NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Draw the share of a study's runs that climbed over two of its axes, one panel per policy.

    Every cell shows the number of climbs and of runs, as in ``omnistep study``, and for several runs the 95 % Wilson
    score interval of the rate. Its colour is the share, dark for none and light for all. Runs that ``duration_s`` ended
    are not stalls: the cell shows the number of unfinished runs as a grey hatched fraction, and its colour is the rate
    over the finished runs. Runs that failed are not counted; the cell shows their number. Runs that differ in other
    keys than x, y and panel, such as the seed, are counted together.

    Args:
        rows: what :func:`omnistep.run_study` or :func:`omnistep.sweep` returned, the folder that they or
            ``omnistep study`` wrote, a Parquet file, a table of polars, pandas, pyarrow or duckdb, or a list of
            dictionaries; with a column ``climbed``, ``error`` if runs may have failed, and ``verdict`` if some may be
            unfinished. Files need pyarrow, polars or duckdb.
        x: key or column along x; numbers or names.
        y: key or column along y.
        panel: key or column that has one panel for each value; None for one panel.
        axes: axes to draw on, as many as panels; a new figure by default.

    Returns:
        The axes, (P,), in the order of the panels' values; policies in the order of :func:`omnistep.list_policies`.

    Raises:
        ConfigError: no rows, a column is missing or has an empty cell, or the number of axes differs from the number of
            panels.
        ImportError: matplotlib or a Parquet reader is not installed.

    Example:
        >>> import omnistep
        >>> rows = [{"height_m": h, "torque_n_m": t, "climbed": t > 10 * h} for h in (0.1, 0.2) for t in (0.5, 1.5)]
        >>> (ax,) = omnistep.plot.climb_map(rows, x="torque_n_m", y="height_m", panel=None)
        >>> [text.get_text() for text in ax.texts]  # lowest row first
        ['0/1', '1/1', '0/1', '0/1']
    """
    wanted = {name.replace(".", "_"): key for key, name in {"x": x, "y": y, "panel": panel}.items() if name is not None}
    if len(wanted) != (2 if panel is None else 3):
        raise ConfigError(f"x = {x!r}, y = {y!r}, panel = {panel!r}: allowed: a different column for each", key="x")
    found = columns(rows, wanted | {"climbed": "rows"}, optional=["error", "verdict"])
    for name, argument in wanted.items():
        if None in found[name]:
            message = f"rows[{found[name].index(None)}]: no {name}, allowed: a value in every row"
            raise ConfigError(message, key=argument)
    along_x, along_y, in_panel = (
        found[name.replace(".", "_")] if name is not None else [""] * len(found["climbed"]) for name in (x, y, panel)
    )
    columns_x, rows_y, panels = in_order(along_x), in_order(along_y), in_order(in_panel)
    shape = (len(panels), len(rows_y), len(columns_x))
    climbed, counted, failed, unfinished = (np.zeros(shape, dtype=int) for _ in range(4))
    errors = found.get("error", [None] * len(found["climbed"]))
    verdicts = found.get("verdict", [None] * len(found["climbed"]))
    for number, outcome in enumerate(found["climbed"]):
        cell = panels.index(in_panel[number]), rows_y.index(along_y[number]), columns_x.index(along_x[number])
        if errors[number] is not None or outcome is None:
            failed[cell] += 1
        elif outcome in (0, 1):
            climbed[cell] += int(outcome)
            counted[cell] += 1
            unfinished[cell] += int(verdicts[number] == "unfinished")
        else:
            message = f"rows[{number}]: climbed = {outcome!r}, allowed: true, false or none"
            raise ConfigError(message, key="climbed")

    drawn = _panels(axes, len(panels), width=0.75 * len(columns_x), height=0.55 * len(rows_y))
    for ax, name, *counts in zip(drawn, panels, climbed, counted, failed, unfinished, strict=True):
        _draw(ax, *counts)
        ax.set_xticks(np.arange(len(columns_x)) + 0.5, [value_text(value) for value in columns_x])
        ax.set_yticks(np.arange(len(rows_y)) + 0.5, [value_text(value) for value in rows_y])
        ax.set_title(": ".join(filter(None, (value_text(name), "climbed / runs"))), fontsize="medium")
        ax.set_xlabel(axis_label(x))
        ax.set_ylabel(axis_label(y))
    if axes is None:
        for number, ax in enumerate(drawn):
            last_in_column = number + _IN_A_ROW >= len(drawn)
            ax.set_xlabel(ax.get_xlabel() if last_in_column else "")
            ax.set_ylabel(ax.get_ylabel() if number % _IN_A_ROW == 0 else "")
    return drawn


def _panels(axes: Any, count: int, *, width: float, height: float) -> NDArray[Any]:
    if axes is not None:
        return given_or_new(axes, (count,), size=(0.0, 0.0))
    across = min(count, _IN_A_ROW)
    down = -(-count // across)
    size = (0.8 + across * max(width, 2.8), down * (0.9 + max(height, 1.2)))  # wide enough for a label
    every = given_or_new(None, (down, across), size=size, share_y=True).ravel()
    for ax in every[count:]:
        ax.remove()
    for ax in every[
        max(count - across, 0) : count
    ]:  # also where there is no panel below, as there is none to share with
        ax.tick_params(labelbottom=True)
    return every[:count]


def _draw(
    ax: Axes, climbed: NDArray[Any], counted: NDArray[Any], failed: NDArray[Any], unfinished: NDArray[Any]
) -> None:
    known = counted - unfinished
    share = np.ma.masked_array(climbed / np.maximum(known, 1), mask=known == 0)
    colours = pyplot().get_cmap("cividis")
    ax.set_facecolor("0.9")  # where nothing was measured
    ax.pcolormesh(share, cmap=colours, vmin=0.0, vmax=1.0, edgecolors="white", linewidth=1.0)
    for row, column in np.ndindex(share.shape):
        none = counted[row, column] == 0
        text = "-" if none else f"{climbed[row, column]}/{counted[row, column]}"
        interval = _omnistep.wilson(int(climbed[row, column]), int(counted[row, column]))
        if counted[row, column] > 1 and interval is not None:
            low, high = interval
            text += f"\n{100 * low:.0f}-{100 * high:.0f} %"
        if unfinished[row, column]:
            text += f"\n{unfinished[row, column]} unfinished"
        if failed[row, column]:
            text += f"\n{failed[row, column]} failed"
        dark = known[row, column] > 0 and share[row, column] < 0.5
        label = ax.text(column + 0.5, row + 0.5, text, ha="center", va="center", fontsize="small")
        label.set_color("white" if dark else "black")
        if unfinished[row, column]:
            _hatch(ax, row, column, unfinished[row, column] / counted[row, column])
            label.set(color="black", fontsize="x-small")
            label.set_bbox({"facecolor": "white", "alpha": 0.8, "linewidth": 0.0, "pad": 1.0})


def _hatch(ax: Axes, row: int, column: int, part: float) -> None:
    """Hatch that part of a cell, from below, for runs without a result."""
    cover = pyplot().Rectangle((column, row), 1.0, part, facecolor="0.92", edgecolor="0.6", hatch="///", linewidth=0.0)
    ax.add_patch(cover)


def in_order(values: Sequence[Any]) -> list[Any]:
    """Return each value once: numbers by size, policies as `omnistep.list_policies`, other names alphabetically."""
    each = set(values)
    if all(isinstance(value, int | float) for value in each):
        return sorted(each)
    known = _omnistep.list_policies()
    return sorted(each, key=lambda value: (known.index(value) if value in known else len(known), str(value)))


def value_text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def axis_label(name: str) -> str:
    """Return a column's name with its unit in brackets."""
    words = name.replace(".", "_")
    for ending, unit in _UNITS.items():
        if words.endswith(ending):
            words = f"{words.removesuffix(ending)} [{unit}]"
            break
    return fill(words.replace("_", " "), width=34)
