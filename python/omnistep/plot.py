"""Figures like the paper's: 8 (wheels on dampers), 9 (a strip of the climb), 10 and 11 (ratios and velocities).

Needs matplotlib: ``pip install "omnistep[plot]"``. Every function draws on the axes given, or on a new figure, and
returns the axes it drew on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep._omnistep import Log

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from omnistep._omnistep import Trace, WheelsTrace

__all__ = ["climb", "strip", "wheels"]

# Okabe and Ito: told apart by colour-blind readers too.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")


def climb(trace: Trace, *, wheels: Sequence[str] | None = None, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
    """Draw disturbed ratio, slip ratio and wheel velocity over time, like figures 10 and 11 of the paper.

    Args:
        trace: a run.
        wheels: names of the wheels to draw; by default a front, a middle and a rear one of those that are driven.
        axes: three axes to draw on; a new figure by default.

    Returns:
        The three axes, (3,): disturbed ratio, slip ratio, velocity [rad/s].

    Raises:
        KeyError: a wheel of that name does not exist.
        ValueError: not three axes were given.
    """
    drawn = _axes(axes, 3, height=7.0)
    names = trace.wheel_names
    chosen = [_index(names, name) for name in wheels] if wheels is not None else _front_middle_rear(trace)
    labels = [f"wheel {names[k]}" for k in chosen]
    if wheels is None and len(chosen) == 3:
        labels = [f"{place} (wheel {names[k]})" for place, k in zip(("front", "middle", "rear"), chosen, strict=True)]
    time = trace["time_s"]
    panels = ("disturbed_ratio", "slip_ratio", "measured_rad_s")
    for ax, signal in zip(drawn, panels, strict=True):
        values = trace.wheels(signal)
        for k, label, colour in zip(chosen, labels, _COLOURS * len(chosen), strict=False):
            # A wheel on the left turns the other way: show every wheel as its reference goes.
            sign = _direction(trace, k) if signal == "measured_rad_s" else 1.0
            ax.plot(time, sign * values[:, k], color=colour, linewidth=0.9, label=label)
        ax.grid(alpha=0.3)
    reference = trace.wheels("reference_rad_s")[:, chosen[0]] * _direction(trace, chosen[0])
    drawn[2].plot(time, reference, color="black", linewidth=0.9, linestyle="--", label="reference")
    drawn[0].set_title(f"{trace.scenario}, {trace.policy}")
    for ax, label in zip(drawn, ("disturbed ratio", "slip ratio", "velocity [rad/s]"), strict=True):
        ax.set_ylabel(label)
    drawn[2].set_xlabel("time [s]")
    drawn[2].legend(loc="best", fontsize="small", ncols=2)
    return drawn


def strip(run: Trace | Log, *, every_s: float = 0.3, ax: Axes | None = None) -> Axes:
    """Draw the climb from the side, like figure 9 of the paper.

    White points are the joint point on the middle wheel at every interval; the vehicle is drawn at every third, from
    its right: it moves to the right. One wheel of each row is shown, and the frames as lines between their axles.

    Args:
        run: a run, or its log.
        every_s: time between two points [s].
        ax: axes to draw on; a new figure by default.

    Returns:
        The axes.

    Raises:
        ValueError: the time is not positive, or the log has no poses.
    """
    if not every_s > 0.0:
        raise ValueError(f"every_s = {every_s}, allowed: > 0 [s]")
    plt = _pyplot()
    if ax is None:
        ax = plt.subplots(figsize=(11, 2.3), layout="constrained")[1]
    if isinstance(run, Log):
        trace, time = run.trace, run.frame_time_s
        if len(time) == 0:
            raise ValueError(f"{run.path}: no messages on /tf, allowed: a run with poses")
        centres = np.stack([run.frames[f"wheel_{name}"][:, :3] for name in trace.wheel_names], axis=1)
        x, z = centres[:, :, 0], centres[:, :, 2]
    else:
        trace, time = run, run["time_s"]
        x, z = run.wheels("x_m"), run.wheels("z_m")
    _ground(ax, trace, float(x.min()) - 0.15, float(x.max()) + 0.15)
    rows = np.searchsorted(time, np.arange(0.0, time[-1] + 1e-9, every_s))
    rows = np.unique(np.clip(rows, 0, len(time) - 1))
    middle = int(np.argmin(np.abs(x[0] - x[0].mean())))
    side = _one_a_row(x[0])
    drawings = rows[::3]
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(drawings)))
    for row, colour in zip(drawings, colours, strict=True):
        for k in side:
            circle = plt.Circle((x[row, k], z[row, k]), trace.wheel_radius_m[k], facecolor=(*colour[:3], 0.12))
            circle.set_edgecolor(colour)
            ax.add_patch(circle)
        order = side[np.argsort(x[row, side])]
        ax.plot(x[row, order], z[row, order], color=colour, linewidth=2.5, solid_capstyle="round")
    ax.plot(
        x[rows, middle],
        z[rows, middle],
        linestyle="none",
        marker="o",
        markersize=5,
        markerfacecolor="white",
        markeredgecolor="black",
        label=f"joint on wheel {trace.wheel_names[middle]}, every {every_s:g} s",
        zorder=5,
    )
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("z [m]")
    ax.set_title(f"{trace.scenario}, {trace.policy}")
    ax.set_ylim(-0.03, float(z.max()) + 2.5 * float(trace.wheel_radius_m.max()))
    ax.legend(loc="upper left", fontsize="small")
    return ax


def wheels(traces: WheelsTrace | Sequence[WheelsTrace], *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
    """Draw the velocities of wheels A, B and C and the loads on them, like figure 8 of the paper.

    Args:
        traces: one run of section 3.3, or several to compare.
        axes: four axes to draw on; a new figure by default.

    Returns:
        The four axes, (4,): velocities [rpm] of A, B and C, loads [N.m.s/rad].

    Raises:
        ValueError: not four axes were given, or no trace.
    """
    several = list(traces) if isinstance(traces, Sequence) else [traces]
    if not several:
        raise ValueError("traces = [], allowed: at least one run")
    drawn = _axes(axes, 4, height=8.0)
    for k, (panel, letter) in enumerate(zip("abc", "ABC", strict=True)):
        for trace, colour in zip(several, _COLOURS * len(several), strict=False):
            drawn[k].plot(trace.t_s, trace.speed_rpm[:, k], color=colour, linewidth=1.1, label=trace.policy)
        drawn[k].set_ylabel(f"({panel}) wheel {letter} [rpm]")
        drawn[k].set_ylim(bottom=0.0)
        loads = several[0].load_n_m_s_rad[:, k]
        drawn[3].plot(several[0].t_s, loads, color=_COLOURS[k], linewidth=1.1, label=f"load {letter}")
    drawn[3].set_ylabel("(d) load [N.m.s/rad]")
    drawn[3].set_ylim(0.0, 1.35 * max(float(several[0].load_n_m_s_rad.max()), 1e-3))  # room for the legend
    drawn[3].set_xlabel("time [s]")
    drawn[0].legend(loc="lower left", fontsize="small", ncols=3)
    drawn[3].legend(loc="upper left", fontsize="small", ncols=3)
    for ax in drawn:
        ax.grid(alpha=0.3)
    return drawn


def _pyplot() -> Any:
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError('omnistep.plot needs matplotlib: pip install "omnistep[plot]"') from error
    return plt


def _axes(axes: Sequence[Axes] | None, count: int, *, height: float) -> NDArray[Any]:
    if axes is None:
        figure = _pyplot().subplots(count, 1, sharex=True, figsize=(8.0, height), layout="constrained")
        return np.asarray(figure[1])
    given = np.asarray(axes).ravel()
    if given.size != count:
        raise ValueError(f"axes = {given.size} axes, allowed: {count}")
    return given


def _index(names: list[str], name: str) -> int:
    if name not in names:
        raise KeyError(f"no wheel {name!r}, allowed: {', '.join(names)}")
    return names.index(name)


def _direction(trace: Trace, wheel: int) -> float:
    """Return -1.0 for a wheel whose reference is negative on the whole, else 1.0."""
    return -1.0 if trace.wheels("reference_rad_s")[:, wheel].sum() < 0.0 else 1.0


def _front_middle_rear(trace: Trace) -> list[int]:
    """Choose one driven wheel at the front, in the middle and at the rear; of two side by side the right one."""
    reference = np.abs(trace.wheels("reference_rad_s")).max(axis=0)
    driven = np.flatnonzero(reference > 0.5 * reference.max()) if reference.max() > 0 else np.arange(reference.size)
    x, y = trace.wheels("x_m")[0, driven], trace.wheels("y_m")[0, driven]
    places = (x.max(), 0.5 * (x.max() + x.min()), x.min())
    return [int(driven[np.lexsort((y, np.abs(x - place).round(3)))[0]]) for place in places]


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
