"""The paper's figures from runs, and maps of where a vehicle climbs.

Figure 8 (wheels on dampers) is :func:`wheels`, 9 (the climb from the side) :func:`strip` and :func:`strips`, 10 and 11
(ratios and velocities) :func:`climb` and, side by side, :func:`climbs`; :func:`paper` draws all of them.

Needs matplotlib: ``pip install "omnistep[plot]"``. Every function draws on the axes given, or on a new figure, and
returns the axes it drew on. A policy has the same colour in every figure.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep import _omnistep, _side
from omnistep._axes import (
    dashes,
    given_or_new,
    legend_above,
    not_empty,
    policy_colour,
    pyplot,
    same_limits,
    title,
    wheel_style,
)
from omnistep._climb_map import climb_map
from omnistep._omnistep import Log, Trace, WheelsTrace
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from numpy.typing import NDArray

__all__ = ["climb", "climb_map", "climbs", "paper", "policy_colour", "strip", "strips", "wheels"]

_LETTERS = "abcdefgh"


def climb(trace: Trace, *, wheels: Sequence[str] | None = None, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
    """Draw disturbed ratio, slip ratio and wheel velocity over time: figure 10 (a-c) of the paper, or 11.

    Args:
        trace: a run.
        wheels: names of the wheels to draw; by default a front, a middle and a rear one of those that are driven.
        axes: three axes to draw on; a new figure by default.

    Returns:
        The three axes, (3,): disturbed ratio, slip ratio, velocity [rad/s].

    Raises:
        KeyError: a wheel of that name does not exist.
        ConfigError: not three axes were given, no wheel, or a run without a row.
        ImportError: matplotlib is not there.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> axes = omnistep.plot.climb(trace)
        >>> bool((axes[0].lines[0].get_ydata() == trace["wheel_5_disturbed_ratio"]).all())
        True
    """
    not_empty(trace)
    names = trace.wheel_names
    chosen = [_index(names, name) for name in wheels] if wheels is not None else _front_middle_rear(trace)
    if not chosen:
        raise ConfigError("wheels = [], allowed: at least one name", key="wheels")
    drawn = given_or_new(axes, (3,), size=(8.0, 7.0))
    labels = [f"wheel {names[k]}" for k in chosen]
    if wheels is None and len(chosen) == 3:
        labels = [f"{place} (wheel {names[k]})" for place, k in zip(("front", "middle", "rear"), chosen, strict=True)]
    time = trace["time_s"]
    panels = ("disturbed_ratio", "slip_ratio", "measured_rad_s")
    for ax, signal in zip(drawn, panels, strict=True):
        values = trace.wheels(signal)
        for number, (k, label) in enumerate(zip(chosen, labels, strict=True)):
            # A wheel on the left turns the other way: show every wheel as its reference goes.
            sign = _direction(trace, k) if signal == "measured_rad_s" else 1.0
            ax.plot(time, sign * values[:, k], **wheel_style(number), linewidth=0.9, label=label)
        ax.grid(alpha=0.3)
    reference = trace.wheels("reference_rad_s")[:, chosen[0]] * _direction(trace, chosen[0])
    drawn[2].plot(time, reference, color="0.45", linewidth=1.2, linestyle="--", label="reference", zorder=1.9)
    drawn[0].set_title(title(trace))
    for ax, label in zip(drawn, ("(a) disturbed ratio", "(b) slip ratio", "(c) velocity\n[rad/s]"), strict=True):
        ax.set_ylabel(label)
    drawn[2].set_xlabel("time [s]")
    legend_above(drawn[2], columns=2, room=0.5)
    return drawn


def climbs(
    traces: Iterable[Trace] | Mapping[str, Trace],
    *,
    wheels: Sequence[str] | None = None,
    axes: Sequence[Sequence[Axes]] | NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Draw several runs side by side on the same scales: figures 10 (a-c) and 11 (a-c) of the paper.

    The paper's figure 10 is of its own controller, figure 11 of the general one: here ``synchronised`` and
    ``independent``.

    Args:
        traces: P runs, or what :func:`omnistep.compare` returns.
        wheels: names of the wheels to draw, as for :func:`climb`.
        axes: axes to draw on, (3, P); a new figure by default.

    Returns:
        The axes, (3, P): a row for disturbed ratio, slip ratio and velocity [rad/s], a column a run.

    Raises:
        KeyError: a wheel of that name does not exist.
        ConfigError: there is no run, one is without a row, or the axes are not as many.
        ImportError: matplotlib is not there.

    Example:
        >>> import omnistep
        >>> both = omnistep.compare("flat", policies=["synchronised", "independent"], overrides={"duration_s": 0.5})
        >>> omnistep.plot.climbs(both).shape
        (3, 2)
    """
    several: list[Trace] = _several(traces, Trace)
    drawn = given_or_new(axes, (3, len(several)), size=(1.0 + 4.5 * len(several), 7.0))
    for trace, column in zip(several, drawn.T, strict=True):
        climb(trace, wheels=wheels, axes=column)
    for row in drawn:
        same_limits(row)
        for ax in row[1:]:
            ax.set_ylabel("")
    return drawn


def strip(run: Trace | Log, *, every_s: float = 0.3, ax: Axes | None = None) -> Axes:
    """Draw the climb from the side: figure 9 (a) of the paper, or (b).

    White points are the joint point on the middle wheel at every interval, with a rim in the policy's colour; the
    vehicle is drawn at every third, from its right, the later the lighter: it moves to the right. One wheel of each
    row is shown, and the frames as lines between their axles.

    Args:
        run: a run, or its log.
        every_s: time between two points [s], above 0.
        ax: axes to draw on; a new figure by default.

    Returns:
        The axes.

    Raises:
        ConfigError: the time is not positive, the log has no poses, or the run no row.
        ImportError: matplotlib is not there.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> len(omnistep.plot.strip(trace, every_s=0.1).lines[-1].get_xdata())  # at 0, 0.1, ... 0.5 s
        6
    """
    return _side.draw(run, every_s=every_s, ax=ax, span=_side.span(run))


def strips(
    runs: Iterable[Trace | Log] | Mapping[str, Trace],
    *,
    every_s: float = 0.3,
    axes: Sequence[Axes] | NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Draw several climbs from the side, one below the other on the same scale: figure 9 (a, b) of the paper.

    The paper's (a) is its own controller, (b) the general one: here ``synchronised`` and ``independent``.

    Args:
        runs: P runs, or their logs, or what :func:`omnistep.compare` returns.
        every_s: time between two points [s], above 0.
        axes: P axes to draw on; a new figure by default.

    Returns:
        The axes, (P,).

    Raises:
        ConfigError: there is no run, the axes are not as many, or as :func:`strip`.
        ImportError: matplotlib is not there.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> omnistep.plot.strips([trace, trace])[1].get_title()
        '(b) flat, synchronised'
    """
    several: list[Trace | Log] = _several(runs, Trace, Log)
    spans = [_side.span(run) for run in several]
    span = (min(left for left, _ in spans), max(right for _, right in spans))
    drawn = given_or_new(axes, (len(several),), size=(11.0, 0.4 + 1.75 * len(several)))
    for k, (run, ax) in enumerate(zip(several, drawn, strict=True)):
        _side.draw(run, every_s=every_s, ax=ax, span=span)
        ax.set_title(f"({_letter(k)}) {ax.get_title()}")
    same_limits(drawn)
    for ax in drawn[:-1]:
        ax.set_xlabel("")
    return drawn


def wheels(traces: WheelsTrace | Sequence[WheelsTrace], *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
    """Draw the velocities of wheels A, B and C and the loads on them: figure 8 (a-d) of the paper.

    Args:
        traces: one run of section 3.3 (:func:`omnistep.wheels`), or several under the same loads. A second run of a
            policy has its colour, with other dashes.
        axes: four axes to draw on; a new figure by default.

    Returns:
        The four axes, (4,): velocities [rpm] of A, B and C, loads [N.m.s/rad].

    Raises:
        ConfigError: not four axes were given, no run, or runs under different loads.
        ImportError: matplotlib is not there.

    Example:
        >>> import omnistep
        >>> run = omnistep.wheels("synchronised")
        >>> axes = omnistep.plot.wheels(run)
        >>> bool((axes[1].lines[0].get_ydata() == run.speed_rpm[:, 1]).all())
        True
    """
    several: list[WheelsTrace] = _several(traces, WheelsTrace)
    first = several[0]
    for number, trace in enumerate(several):
        if not np.array_equal(trace.load_n_m_s_rad, first.load_n_m_s_rad):
            message = f"traces[{number}]: other loads than traces[0], allowed: runs under the same loads"
            raise ConfigError(message, key=f"traces[{number}]")
    drawn = given_or_new(axes, (4,), size=(8.0, 8.0))
    highest = max(float(trace.speed_rpm.max()) for trace in several)
    for k, letter in enumerate("ABC"):
        for number, trace in enumerate(several):
            before = [each.policy for each in several[:number]].count(trace.policy)
            label = trace.policy if before == 0 else f"{trace.policy} ({before + 1})"
            # Wider below, so that a line that others cover is seen.
            style = {"color": policy_colour(trace.policy), "linestyle": dashes(before)}
            width = 1.4 + 0.9 * (len(several) - 1 - number)
            drawn[k].plot(trace.t_s, trace.speed_rpm[:, k], **style, linewidth=width, label=label)
        drawn[k].set_ylabel(f"({_letter(k)}) wheel {letter}\n[rpm]")
        drawn[k].set_ylim(-0.04 * max(highest, 1e-3), 1.05 * max(highest, 1e-3))
        drawn[3].plot(first.t_s, first.load_n_m_s_rad[:, k], **wheel_style(k), linewidth=1.4, label=f"load {letter}")
    drawn[3].set_ylabel("(d) load\n[N.m.s/rad]")
    drawn[3].set_ylim(0.0, 1.05 * max(float(first.load_n_m_s_rad.max()), 1e-3))
    drawn[3].set_xlabel("time [s]")
    legend_above(drawn[0], columns=4)
    same_limits(drawn[:3])
    legend_above(drawn[3], columns=3)
    for ax in drawn:
        ax.grid(alpha=0.3)
    return drawn


def paper(
    *,
    proposed: Trace | None = None,
    general: Trace | None = None,
    wheel_runs: Sequence[WheelsTrace] | None = None,
    figure: Figure | SubFigure | None = None,
) -> dict[str, NDArray[Any]]:
    """Draw every figure of the paper that shows a result: 8 (a-d), 9 (a, b), 10 (a-c) and 11 (a-c).

    Args:
        proposed: the run for figures 9 (a) and 10; the built-in step under ``synchronised`` by default.
        general: the run for figures 9 (b) and 11; the built-in step under ``independent`` by default.
        wheel_runs: the runs for figure 8; ``synchronised`` and ``paper``, (12) as printed, by default.
        figure: an empty figure to draw on; a new one of 10 x 15 inches by default.

    Returns:
        The axes by the number of the figure: ``"8"`` (4,), ``"9"`` (2,), ``"10"`` and ``"11"`` (3,).

    Raises:
        ConfigError: as :func:`wheels`, :func:`strips` and :func:`climbs`.
        ImportError: matplotlib is not there.

    Example:
        >>> import omnistep
        >>> run = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> sorted(omnistep.plot.paper(proposed=run, general=run))
        ['10', '11', '8', '9']
    """
    if wheel_runs is None:
        wheel_runs = [_omnistep.wheels("synchronised"), _omnistep.wheels("paper")]
    both = [
        proposed if proposed is not None else _omnistep.run("step", policy="synchronised"),
        general if general is not None else _omnistep.run("step", policy="independent"),
    ]
    if figure is None:
        figure = pyplot().figure(figsize=(10.0, 15.0), layout="constrained")
    parts: Any = figure.subfigures(3, 1, height_ratios=(6.2, 3.4, 6.2))
    top, middle, bottom = parts
    top.suptitle("Figure 8: three wheels on dampers", fontweight="bold")
    middle.suptitle("Figure 9: the climb from the side", fontweight="bold")
    bottom.suptitle("Figure 10 (left) and 11 (right): the climb over time", fontweight="bold")
    sides = climbs(both, axes=bottom.subplots(3, 2, sharex=True))
    return {
        "8": wheels(wheel_runs, axes=top.subplots(4, 1, sharex=True)),
        "9": strips(both, axes=middle.subplots(2, 1, sharex=True)),
        "10": sides[:, 0],
        "11": sides[:, 1],
    }


def _letter(number: int) -> str:
    return _LETTERS[number] if number < len(_LETTERS) else str(number + 1)


def _several(runs: Any, *kinds: type) -> list[Any]:
    """Return one run, or runs in a list or a dictionary, as a list."""
    if isinstance(runs, kinds):
        return [runs]
    several = list(runs.values() if isinstance(runs, Mapping) else runs)
    allowed = " or ".join(kind.__name__ for kind in kinds)
    if not several:
        raise ConfigError(f"runs = [], allowed: at least one {allowed}", key="runs")
    for number, run in enumerate(several):
        if not isinstance(run, kinds):
            raise TypeError(f"runs[{number}]: a {type(run).__name__}, allowed: {allowed}")
    return several


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
