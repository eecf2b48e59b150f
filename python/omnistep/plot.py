"""The paper's figures from runs, and maps of climbs.

Figure 8 (wheels on dampers) is :func:`motor_bench`, 9 (the climb from the side) :func:`side_view` and
:func:`side_views`, 10 and 11 (ratios and velocities) :func:`climb` and, side by side, :func:`climbs`; :func:`paper`
draws all of them. :func:`path` is the top view of a run, with its odometry, and :func:`omnistep.plot.chart` a
vehicle's climb chart.

The figures need matplotlib (extra ``plot``). Every function draws on the given axes, or on a new figure, and returns
the axes. A policy has the same colour in every figure.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep import _omnistep, _side_view, _top_view
from omnistep._argument_types import names, of_kind, several, trace_of, with_places
from omnistep._axes import (
    dashes,
    given_or_new,
    legend_above,
    policy_colour,
    pyplot,
    same_limits,
    title,
    wheel_style,
)
from omnistep._chart_plot import chart
from omnistep._climb_map import climb_map
from omnistep._ensemble_plot import ensemble
from omnistep._omnistep import Log, MotorBenchTrace, Scenario, Trace
from omnistep._output_files import replaced
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from numpy.typing import NDArray

__all__ = [
    "Sheet",
    "chart",
    "climb",
    "climb_map",
    "climbs",
    "ensemble",
    "motor_bench",
    "paper",
    "path",
    "policy_colour",
    "side_view",
    "side_views",
    "write_side_view",
]

_LETTERS = "abcdefgh"


class Sheet(dict[str, "NDArray[Any]"]):
    """Axes by the number of their figure, all on one sheet of matplotlib.

    Attributes:
        figure: matplotlib's figure that holds all of them.
    """

    def __init__(self, axes: Mapping[str, NDArray[Any]], figure: Figure) -> None:
        """Keep the axes with the figure that holds them."""
        super().__init__(axes)
        self.figure = figure

    def savefig(self, *args: Any, **kwargs: Any) -> None:
        """Write the sheet to a file; arguments are as in matplotlib's ``Figure.savefig``."""
        self.figure.savefig(*args, **kwargs)


def climb(
    trace: Trace | Log, *, wheels: Sequence[str] | None = None, axes: Sequence[Axes] | NDArray[Any] | None = None
) -> NDArray[Any]:
    """Draw disturbed ratio, slip ratio and wheel velocity over time: figure 10 (a-c) of the paper, or 11.

    A dotted line across all three marks each retry of traction control.

    Args:
        trace: a run, or its log.
        wheels: names of the wheels to draw; by default a driven wheel at the front, in the middle and at the rear: with
            two rows a front and a rear one, with one row a right and a left one. The ``trace`` of a log has no wheel
            positions: pass the log.
        axes: three axes to draw on; a new figure by default.

    Returns:
        The three axes, (3,): disturbed ratio, slip ratio, velocity [rad/s].

    Raises:
        KeyError: there is no wheel of that name.
        ConfigError: the number of axes is not three, no wheel was given, or the run has no row.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> axes = omnistep.plot.climb(trace)
        >>> bool((axes[0].lines[0].get_ydata() == trace["wheel_5_disturbed_ratio"]).all())
        True
    """
    run: Trace | Log = of_kind(trace, "trace", Trace, Log)
    trace, known = trace_of(run), trace_of(run).wheel_names
    if wheels is None:
        places = _front_middle_rear(run)
        chosen = [k for _, k in places]
        labels = [f"{place} (wheel {known[k]})" for place, k in places]
    else:
        chosen = [_index(known, name) for name in names(wheels, "wheels")]
        labels = [f"wheel {known[k]}" for k in chosen]
    drawn = given_or_new(axes, (3,), size=(8.0, 7.0))
    time = trace["time_s"]
    panels = ("disturbed_ratio", "slip_ratio", "measured_rad_s")
    for ax, signal in zip(drawn, panels, strict=True):
        values = trace.wheels(signal)
        for number, (k, label) in enumerate(zip(chosen, labels, strict=True)):
            # A wheel on the left turns the other way: show every wheel as its reference goes.
            sign = _direction(trace, k) if signal == "measured_rad_s" else 1.0
            ax.plot(time, sign * values[:, k], **wheel_style(number), linewidth=0.9, label=label)
        ax.grid(alpha=0.3)
    for number, at_s in enumerate(_tries_s(trace)):
        for ax in drawn:
            name = "another try" if number == 0 and ax is drawn[2] else None
            ax.axvline(at_s, color="0.45", linewidth=1.0, linestyle=":", label=name, zorder=1.8)
    reference = trace.wheels("reference_rad_s")[:, chosen[0]] * _direction(trace, chosen[0])
    drawn[2].plot(time, reference, color="0.45", linewidth=1.2, linestyle="--", label="reference", zorder=1.9)
    drawn[0].set_title(title(trace))
    for ax, label in zip(drawn, ("(a) disturbed ratio", "(b) slip ratio", "(c) velocity\n[rad/s]"), strict=True):
        ax.set_ylabel(label)
    drawn[2].set_xlabel("time [s]")
    legend_above(drawn[2], columns=2, room=0.5)
    return drawn


def climbs(
    traces: Trace | Log | Iterable[Trace | Log] | Mapping[str, Trace] | Mapping[str, Log],
    *,
    wheels: Sequence[str] | None = None,
    axes: Sequence[Sequence[Axes]] | NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Draw several runs side by side on the same scales: figures 10 (a-c) and 11 (a-c) of the paper.

    The paper's figure 10 is of its own controller, figure 11 of the general one: here ``scale_references`` and
    ``independent``.

    Args:
        traces: P runs, or their logs, or what :func:`omnistep.compare` returns.
        wheels: names of the wheels to draw, as for :func:`climb`.
        axes: axes to draw on, (3, P); a new figure by default.

    Returns:
        The axes, (3, P): a row each for disturbed ratio, slip ratio and velocity [rad/s], a column for each run.

    Raises:
        KeyError: there is no wheel of that name.
        ConfigError: there is no run, one has no row, or the number of axes does not match.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> both = omnistep.compare("flat", policies=["scale_references", "independent"], overrides={"duration_s": 0.5})
        >>> omnistep.plot.climbs(both).shape
        (3, 2)
    """
    given: list[Trace | Log] = several(traces, "traces", Trace, Log)
    for run in given:  # before there is a figure
        columns = trace_of(run)
        if wheels is None and isinstance(run, Trace):
            with_places(columns)
    drawn = given_or_new(axes, (3, len(given)), size=(1.0 + 4.5 * len(given), 7.0))
    for trace, column in zip(given, drawn.T, strict=True):
        climb(trace, wheels=wheels, axes=column)
    for row in drawn:
        same_limits(row)
        for ax in row[1:]:
            ax.set_ylabel("")
    return drawn


def side_view(run: Trace | Log, *, every_s: float = 0.3, ax: Axes | None = None) -> Axes:
    """Draw the climb from the side: figure 9 (a) of the paper, or (b).

    White points with a rim in the policy's colour are the joint point on the middle wheel at every interval. The
    vehicle is drawn at every third point with the time above, seen from its right; it moves to the right. One wheel
    of each row is shown, and the frames as lines between their axles.

    Args:
        run: a run, or its log.
        every_s: time between two points [s], above 0.
        ax: axes to draw on; a new figure by default.

    Returns:
        The axes.

    Raises:
        ConfigError: the time is not positive, the log has no poses, the run has no row, or it goes around, which
            :func:`path` draws; or it is the ``trace`` of a log, which has no wheel positions: pass the log.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> len(omnistep.plot.side_view(trace, every_s=0.1).lines[-1].get_xdata())  # at 0, 0.1, ... 0.5 s
        6
    """
    of_kind(run, "run", Trace, Log)
    return _side_view.draw(run, every_s=every_s, ax=ax, span=_side_view.span(run))


def side_views(
    runs: Trace | Log | Iterable[Trace | Log] | Mapping[str, Trace] | Mapping[str, Log],
    *,
    every_s: float = 0.3,
    axes: Sequence[Axes] | NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Draw several climbs from the side, stacked on the same scale: figure 9 (a, b) of the paper.

    The paper's (a) is its own controller, (b) the general one: here ``scale_references`` and ``independent``.

    Args:
        runs: P runs, or their logs, or what :func:`omnistep.compare` returns.
        every_s: time between two points [s], above 0.
        axes: P axes to draw on; a new figure by default.

    Returns:
        The axes, (P,).

    Raises:
        ConfigError: there is no run, the number of axes does not match, or as in :func:`side_view`.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> omnistep.plot.side_views([trace, trace])[1].get_title()
        '(b) flat, traction'
    """
    given: list[Trace | Log] = several(runs, "runs", Trace, Log)
    spans = [_side_view.span(run) for run in given]
    span = (min(left for left, _ in spans), max(right for _, right in spans))
    drawn = given_or_new(axes, (len(given),), size=(11.0, 0.4 + 1.75 * len(given)))
    for k, (run, ax) in enumerate(zip(given, drawn, strict=True)):
        _side_view.draw(run, every_s=every_s, ax=ax, span=span)
        ax.set_title(f"({_letter(k)}) {ax.get_title()}")
    same_limits(drawn)
    for ax in drawn[:-1]:
        ax.set_xlabel("")
    return drawn


def write_side_view(log: str | PathLike[str], out: str | PathLike[str], *, every_s: float = 0.3) -> None:
    """Draw a logged run from the side, like figure 9 of the paper.

    Args:
        log: an MCAP log.
        out: the picture: png, svg or pdf.
        every_s: time between two points of the middle joint's path [s].

    Raises:
        LogError: the log cannot be read.
        ValueError: the time is not positive, the run goes around (:func:`path` draws it), or the file name extension is
            not a picture's extension.
        ImportError: matplotlib is not installed; install the extra ``plot``.
    """
    ax = side_view(_omnistep.read_mcap(log), every_s=every_s)
    figure: Any = ax.figure
    with replaced(Path(out), [Path(log)]) as aside:
        figure.savefig(aside, dpi=150)


def path(trace: Trace | Log, *, every_s: float | None = None, sigmas: float = 2.0, ax: Axes | None = None) -> Axes:
    """Draw a run from above: the true positions, the positions by odometry, and the reference path.

    Ellipses around the positions by odometry reach two standard deviations to each side, along their own axes: they
    contain 86 % of a normal distribution. They do not include slip that all wheels share. A thin line joins each of
    them to the true position at that time. A recording without variances has no ellipses.

    Args:
        trace: a run, or its log.
        every_s: time between two ellipses [s], above 0; a tenth of the run by default.
        sigmas: standard deviations from the middle of an ellipse to its rim, above 0; on good ground they are
            millimetres, and a ten times larger value shows their shape.
        ax: axes to draw on; a new figure by default.

    Returns:
        The axes, of equal scales.

    Raises:
        ConfigError: a number is not positive, the log has no ``/odom``, or the run has no row; or it is the ``trace``
            of a log, which has no vehicle positions: pass the log.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run("square", overrides={"duration_s": 2.0})
        >>> ax = omnistep.plot.path(trace)
        >>> [line.get_label().split(",")[0] for line in ax.lines[:3]]
        ['command', 'truth', 'odometry']
    """
    return _top_view.draw(trace, every_s=every_s, sigmas=sigmas, ax=ax)


def motor_bench(
    traces: MotorBenchTrace | Iterable[MotorBenchTrace], *, axes: Sequence[Axes] | NDArray[Any] | None = None
) -> NDArray[Any]:
    """Draw the velocities of wheels A, B and C and the loads on them: figure 8 (a-d) of the paper.

    Args:
        traces: one run of section 3.3 (:func:`omnistep.run_motor_bench`), or several under the same loads. A second
            run of a policy has its colour, with other dashes.
        axes: four axes to draw on; a new figure by default.

    Returns:
        The four axes, (4,): velocities [rpm] of A, B and C, loads [N.m.s/rad].

    Raises:
        ConfigError: the number of axes is not four, there is no run, or runs have different loads.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> run = omnistep.run_motor_bench("scale_references")
        >>> axes = omnistep.plot.motor_bench(run)
        >>> bool((axes[1].lines[0].get_ydata() == run.speed_rpm[:, 1]).all())
        True
    """
    given: list[MotorBenchTrace] = several(traces, "traces", MotorBenchTrace)
    first = given[0]
    for number, trace in enumerate(given):
        if not np.array_equal(trace.load_n_m_s_rad, first.load_n_m_s_rad):
            message = f"traces[{number}]: other loads than traces[0], allowed: runs under the same loads"
            raise ConfigError(message, key=f"traces[{number}]")
    drawn = given_or_new(axes, (4,), size=(8.0, 8.0))
    highest = max(float(trace.speed_rpm.max()) for trace in given)
    for k, letter in enumerate("ABC"):
        for number, trace in enumerate(given):
            before = [each.policy for each in given[:number]].count(trace.policy)
            label = trace.policy if before == 0 else f"{trace.policy} ({before + 1})"
            # Wider below, so that a line that others cover is seen.
            style = {"color": policy_colour(trace.policy), "linestyle": dashes(before)}
            width = 1.4 + 0.9 * (len(given) - 1 - number)
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
    proposed: Trace | Log | None = None,
    general: Trace | Log | None = None,
    wheel_runs: Sequence[MotorBenchTrace] | None = None,
    figure: Figure | SubFigure | None = None,
) -> Sheet:
    """Draw every figure of the paper that shows a result: 8 (a-d), 9 (a, b), 10 (a-c) and 11 (a-c).

    Args:
        proposed: the run for figures 9 (a) and 10, or its log; the built-in step under ``scale_references`` by default.
        general: the run for figures 9 (b) and 11, or its log; the built-in step under ``independent`` by default.
        wheel_runs: the runs for figure 8; ``scale_references`` and ``scale_torques``, (12) as printed, by default.
        figure: an empty figure to draw on; a new one of 10 x 15 inches by default.

    Returns:
        The axes by the number of the figure: ``"8"`` (4,), ``"9"`` (2,), ``"10"`` and ``"11"`` (3,); its method
        ``savefig`` writes the sheet to a file.

    Raises:
        ConfigError: as in :func:`motor_bench`, :func:`side_views` and :func:`climbs`.
        TypeError: an argument of another type.
        ImportError: matplotlib is not installed.

    Example:
        >>> import omnistep
        >>> run = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> sorted(omnistep.plot.paper(proposed=run, general=run))
        ['10', '11', '8', '9']
    """
    for name, run in {"proposed": proposed, "general": general}.items():
        if run is not None:
            _side_view.span(of_kind(run, name, Trace, Log))
    if wheel_runs is not None:
        wheel_runs = several(wheel_runs, "wheel_runs", MotorBenchTrace)
    else:
        wheel_runs = [_omnistep.run_motor_bench("scale_references"), _omnistep.run_motor_bench("scale_torques")]
    both = [
        proposed if proposed is not None else _omnistep.run("step", policy="scale_references"),
        general if general is not None else _omnistep.run("step", policy="independent"),
    ]
    if figure is not None:
        kind = importlib.import_module("matplotlib.figure").FigureBase
        of_kind(figure, "figure", kind, allowed="matplotlib's Figure or SubFigure")
    else:
        figure = pyplot().figure(figsize=(10.0, 15.0), layout="constrained")
    parts: Any = figure.subfigures(3, 1, height_ratios=(6.2, 3.4, 6.2))
    top, middle, bottom = parts
    top.suptitle("Figure 8: three wheels on dampers", fontweight="bold")
    middle.suptitle("Figure 9: the climb from the side", fontweight="bold")
    bottom.suptitle("Figure 10 (left) and 11 (right): the climb over time", fontweight="bold")
    sides = climbs(both, axes=bottom.subplots(3, 2, sharex=True))
    whole: Any = figure.get_figure(root=True)
    for part in parts:
        # A part of a figure cannot be saved alone: calls on a part apply to the whole figure.
        part.savefig = whole.savefig
    drawn = {
        "8": motor_bench(wheel_runs, axes=top.subplots(4, 1, sharex=True)),
        "9": side_views(both, axes=middle.subplots(2, 1, sharex=True)),
        "10": sides[:, 0],
        "11": sides[:, 1],
    }
    return Sheet(drawn, whole)


def _letter(number: int) -> str:
    return _LETTERS[number] if number < len(_LETTERS) else str(number + 1)


def _index(names: list[str], name: str) -> int:
    if name not in names:
        raise KeyError(f"no wheel {name!r}, allowed: {', '.join(names)}")
    return names.index(name)


def _tries_s(trace: Trace) -> NDArray[Any]:
    """Return the times of the retries of traction control [s]; empty without traction control."""
    if "traction_retries" not in trace:
        return np.empty(0)
    return trace["time_s"][np.flatnonzero(np.diff(trace["traction_retries"]) > 0) + 1]


def _direction(trace: Trace, wheel: int) -> float:
    """Return -1.0 for a wheel whose mean reference is negative, else 1.0."""
    return -1.0 if trace.wheels("reference_rad_s")[:, wheel].sum() < 0.0 else 1.0


def _front_middle_rear(run: Trace | Log) -> list[tuple[str, int]]:
    """Choose one driven wheel at the front, in the middle and at the rear; of two in one row the right one.

    No wheel is chosen twice: two rows have no middle, and from a single row a right and a left wheel are chosen.
    """
    trace = trace_of(run)
    reference = np.abs(trace.wheels("reference_rad_s")).max(axis=0)
    driven = np.flatnonzero(reference > 0.5 * reference.max()) if reference.max() > 0 else np.arange(reference.size)
    if isinstance(run, Log):  # its columns have no places; the vehicle that it holds does
        layout = Scenario.from_toml(run.scenario_toml).vehicle.layout
        x, y = np.array([layout.wheels[k].position_m for k in driven]).T
    else:
        x, y = with_places(trace).wheels("x_m")[0, driven], trace.wheels("y_m")[0, driven]
        cos, sin = np.cos(trace["pose_yaw_rad"][0]), np.sin(trace["pose_yaw_rad"][0])
        x, y = cos * x + sin * y, cos * y - sin * x
    # Wheels less than 2 cm apart along x are one row (docs/columns.md).
    order = np.argsort(x)
    row = np.zeros(x.size, dtype=int)
    row[order] = np.cumsum(np.diff(x[order], prepend=x[order][0]) >= 0.02)
    if row.max() == 0:
        sides = {"right": int(driven[np.argmin(y)]), "left": int(driven[np.argmax(y)])}
        return list(sides.items())[: len(set(sides.values()))]
    places = {"front": (x.max(), row == row.max()), "rear": (x.min(), row == 0)}
    if row.max() > 1:
        between = (row > 0) & (row < row.max())
        places = {"front": places["front"], "middle": (0.5 * (x.max() + x.min()), between), "rear": places["rear"]}
    # lexsort: nearest to the position, then rightmost; wheels of another row last.
    nearest = {name: np.lexsort((y, np.abs(x - at).round(3), ~within))[0] for name, (at, within) in places.items()}
    return [(name, int(driven[k])) for name, k in nearest.items()]
