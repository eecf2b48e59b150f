"""Side view of a climb, with the vehicle and its ground."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from omnistep._argument_types import of_kind, trace_of, with_places
from omnistep._axes import policy_colour, pyplot, title
from omnistep._omnistep import Log, Trace
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

# Ground shown before the first wheel's centre and after the last one's [m].
_MARGIN_M = 0.15
# Room for the time above a vehicle, as a part of the picture's width.
_LABEL = 0.05


def span(run: Trace | Log) -> tuple[float, float]:
    """Return the world's x from a little before the run to a little after it [m].

    Raises:
        ConfigError: the vehicle drives around, so that from the side it would cover itself.
    """
    x = _centres(run)[2]
    _check_way(run)
    return float(x.min()) - _MARGIN_M, float(x.max()) + _MARGIN_M


def draw(run: Trace | Log, *, every_s: float, ax: Axes | None, span: tuple[float, float]) -> Axes:
    """Draw a climb over that span of the ground [m]; see :func:`omnistep.plot.side_view`."""
    of_kind(every_s, "every_s", float, int, np.number, allowed="a number")
    if not (isfinite(every_s) and every_s > 0.0):
        raise ConfigError(f"every_s = {every_s}, allowed: > 0 [s]", key="every_s")
    trace, time, x, z = _centres(run)
    plt = pyplot()
    if ax is None:
        ax = plt.subplots(figsize=(11, 2.3), layout="constrained")[1]
    of_kind(ax, "ax", plt.Axes, allowed="matplotlib's Axes")
    _ground(ax, trace, *span)
    # The first row at or after each multiple of the interval; a nanosecond is far below any control period.
    rows = np.flatnonzero(np.diff(np.floor((time + 1e-9) / every_s), prepend=-1.0) > 0.0)
    middle = int(np.argmin(np.abs(x[0] - x[0].mean())))
    side = _one_a_row(x[0])
    drawings = rows[::3]
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.8, len(drawings)))
    lines: list[tuple[float, int]] = []
    for row, colour in zip(drawings, colours, strict=True):
        for k in side:
            circle = plt.Circle((x[row, k], z[row, k]), trace.wheel_radius_m[k], facecolor=(*colour[:3], 0.12))
            circle.set_edgecolor(colour)
            ax.add_patch(circle)
        order = side[np.argsort(x[row, side])]
        ax.plot(x[row, order], z[row, order], color=colour, linewidth=2.5, solid_capstyle="round")
        # A run that comes back has times above others: what is too near is one line higher.
        here, line = float(x[row, side].mean()), 0
        while any(line == other and abs(here - there) < _LABEL * (span[1] - span[0]) for there, other in lines):
            line += 1
        lines.append((here, line))
        top = float(np.max(z[row, side] + trace.wheel_radius_m[side]))
        ax.annotate(
            f"{time[row]:.1f} s",
            (here, top),
            xytext=(0, 2 + 12 * line),
            textcoords="offset points",
            color=colour,
            ha="center",
            va="bottom",
        )
    ax.plot(
        x[rows, middle],
        z[rows, middle],
        linestyle="none",
        marker="o",
        markersize=5,
        markerfacecolor="white",
        markeredgecolor=policy_colour(trace.policy),
        markeredgewidth=1.4,
        label=f"{_marked(run)} {trace.wheel_names[middle]}, every {every_s:g} s",
        zorder=5,
    )
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("z [m]")
    ax.set_title(title(trace))
    ax.set_ylim(-0.03, float(z.max()) + 2.5 * float(trace.wheel_radius_m.max()))
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, fontsize="small", frameon=False)
    return ax


def _check_way(run: Trace | Log) -> None:
    """Refuse a run that goes around: aside as well as ahead and back, which retries at an obstacle do not."""
    if isinstance(run, Trace):
        way = np.stack([run["pose_x_m"], run["pose_y_m"]], axis=1)
    else:
        way = run.frames["base_link"][:, :2]
    along, aside = np.ptp(way, axis=0)
    there_and_back = float(np.abs(np.diff(way[:, 0])).sum())
    if aside > 0.5 * along and there_and_back > 1.5 * along + 0.1:
        found = f"{there_and_back:.1f} m to and fro along x, {aside:.1f} m along y"
        message = f"run: {found}, allowed: a drive along x; omnistep.plot.path draws it from above"
        raise ConfigError(message, key="run")


def _centres(run: Trace | Log) -> tuple[Trace, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the run, times [s], (T,), and x and z of the wheels' centres then [m], (T, N)."""
    if isinstance(run, Trace):
        with_places(trace_of(run))
        return run, run["time_s"], run.wheels("x_m"), run.wheels("z_m")
    trace, time = run.trace, run.frame_time_s
    if len(time) == 0:
        raise ConfigError(f"{run.path}: no messages on /tf, allowed: a run with poses", file=str(run.path))
    centres = np.stack([run.frames[f"wheel_{name}"][:, :3] for name in trace.wheel_names], axis=1)
    return trace, time, centres[:, :, 0], centres[:, :, 2]


def _marked(run: Trace | Log) -> str:
    """Return what the points mark: a joint, or on a rigid vehicle the centre of a wheel."""
    if isinstance(run, Trace):
        jointed = any(name.startswith("hinge_") for name in run.names)
    else:
        own = {"base_link", "odom", *(f"wheel_{name}" for name in run.trace.wheel_names)}
        jointed = bool(set(run.frames) - own)
    return "joint on wheel" if jointed else "centre of wheel"


def _one_a_row(x: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return one wheel of each transverse row: the first of those within a millimetre of each other."""
    return np.unique(np.round(x, 3), return_index=True)[1]


def _ground(ax: Axes, trace: Trace, left: float, right: float) -> None:
    # Twice as fine as a pixel of a large picture: risers look upright.
    x = np.linspace(left, right, 4001)
    z = trace.ground_m(x)
    outline = (x, z)
    ax.fill_between(*outline, y2=float(z.min()) - 0.03, color="0.8")
    ax.plot(*outline, color="0.3", linewidth=1.2)
    ax.set_xlim(left, right)
