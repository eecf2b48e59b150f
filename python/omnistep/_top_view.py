"""Top view of a run: true position, odometry with its uncertainty, and reference path."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from omnistep._argument_types import of_kind, trace_of
from omnistep._axes import pyplot, title
from omnistep._omnistep import Log, Trace
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

# Colours of Okabe and Ito that no policy uses.
_TRUTH, _ODOMETRY, _COMMAND = "#000000", "#E69F00", "0.45"
# Ellipses of a run unless a time is given.
_ELLIPSES = 10
_VARIANCES = ("odom_var_x_m2", "odom_cov_xy_m2", "odom_var_y_m2")
# Variance in a log if the uncertainty of odometry is unknown [m^2]; earlier logs used 0.
_UNKNOWN_M2 = 1e6
# Corners of one.
_CORNERS = 48


@dataclass(frozen=True)
class Seen:
    """Top view of a run.

    Attributes:
        trace: its columns.
        time_s: times of odometry [s], (T,).
        odometry_m: x and y by odometry [m], (T, 2).
        variances_m2: variance of x, covariance of x and y, variance of y [m^2], (T, 3); None if unknown.
        truth_time_s: times of the truth [s], (S,); they may differ from the times of odometry.
        truth_m: true x and y at these times [m], (S, 2); None if a log has none.
        command_m: x and y of the reference path [m], (K, 2); None without one.
    """

    trace: Trace
    time_s: NDArray[np.float64]
    odometry_m: NDArray[np.float64]
    variances_m2: NDArray[np.float64] | None
    truth_time_s: NDArray[np.float64]
    truth_m: NDArray[np.float64] | None
    command_m: NDArray[np.float64] | None

    def rows(self, every_s: float | None = None) -> NDArray[np.intp]:
        """Return the first row at or after each multiple of an interval, by default of a tenth of the run."""
        if every_s is None:
            every_s = float(self.time_s[-1]) / _ELLIPSES
        # A nanosecond is far below any control period.
        passed = np.floor((self.time_s + 1e-9) / max(every_s, 1e-9))
        return np.flatnonzero(np.diff(passed, prepend=passed[0]) > 0.0)

    def true_m(self, row: int) -> NDArray[np.float64] | None:
        """Return the true position at a time of odometry [m], (2,): interpolated between two times of the truth."""
        time_s = self.time_s[row]
        if self.truth_m is None or not self.truth_time_s[0] <= time_s <= self.truth_time_s[-1]:
            return None
        return np.array([np.interp(time_s, self.truth_time_s, column) for column in self.truth_m.T])

    def ellipse_m(self, row: int, sigmas: float) -> NDArray[np.float64] | None:
        """Return corners of the ellipse of that many standard deviations around a place by odometry [m], (C, 2)."""
        if self.variances_m2 is None:
            return None
        xx, xy, yy = self.variances_m2[row]
        variances, axes = np.linalg.eigh([[xx, xy], [xy, yy]])
        turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
        # Rounding may leave a variance of nothing just below zero.
        half = sigmas * np.sqrt(np.maximum(variances, 0.0))
        corners: NDArray[np.float64] = np.stack([np.cos(turn), np.sin(turn)], axis=1) * half @ axes.T
        corners += self.odometry_m[row]
        return corners


def seen(run: Trace | Log) -> Seen:
    """Return the top view of a run, or of its log.

    Raises:
        ConfigError: the log has no odometry, or the run has no row; or it is the ``trace`` of a log, which has neither
            position: pass the log.
    """
    trace = trace_of(run)
    if isinstance(run, Log):
        odometry, truth = run.odometry, run.ground_truth
        if len(odometry["time_s"]) == 0:
            raise ConfigError(f"{run.path}: no messages on /odom, allowed: a run with odometry", file=str(run.path))
        # Of a real vehicle it may be unknown.
        places = _columns(truth, "pose_x_m", "pose_y_m") if len(truth["time_s"]) else None
    else:
        lacks = [name for name in ("odom_x_m", *_VARIANCES, "pose_x_m") if name not in trace]
        if lacks:
            message = (
                f"{trace.scenario}, {trace.policy}: the trace of a log, which lacks {lacks[0]}, allowed: the Log itself"
            )
            raise ConfigError(message, key="trace")
        odometry = truth = trace.columns()
        places = _columns(odometry, "pose_x_m", "pose_y_m")
    variances_m2 = _columns(odometry, *_VARIANCES)
    unstated = not variances_m2.any() or bool((variances_m2[:, [0, 2]] >= _UNKNOWN_M2).all())
    return Seen(
        trace=trace,
        time_s=odometry["time_s"],
        odometry_m=_columns(odometry, "odom_x_m", "odom_y_m"),
        variances_m2=None if isinstance(run, Log) and run.recorded and unstated else variances_m2,
        truth_time_s=truth["time_s"],
        truth_m=places,
        command_m=np.stack([trace["path_x_m"], trace["path_y_m"]], axis=1) if "path_x_m" in trace else None,
    )


def draw(run: Trace | Log, *, every_s: float | None, sigmas: float, ax: Axes | None) -> Axes:
    """Draw a run from above; see :func:`omnistep.plot.path`."""
    of_kind(run, "trace", Trace, Log)
    for name, value, unit in (("every_s", every_s, " [s]"), ("sigmas", sigmas, "")):
        if value is None and name == "every_s":
            continue
        of_kind(value, name, float, int, np.number, allowed="a number")
        if value is None or not (isfinite(value) and value > 0.0):
            raise ConfigError(f"{name} = {value}, allowed: > 0{unit}", key=name)
    shown = seen(run)
    plt = pyplot()
    if ax is None:
        ax = plt.subplots(figsize=(6.4, 6.0), layout="constrained")[1]
    of_kind(ax, "ax", plt.Axes, allowed="matplotlib's Axes")
    if shown.command_m is not None:
        ax.plot(*shown.command_m.T, color=_COMMAND, linewidth=3.0, alpha=0.5, label="command", zorder=1.5)
    rows, label = shown.rows(every_s), "odometry"
    if shown.truth_m is not None:
        ax.plot(*shown.truth_m.T, color=_TRUTH, linewidth=1.4, label="truth", zorder=2.0)
        # The last time at which both are known.
        last = int(np.searchsorted(shown.time_s, shown.truth_time_s[-1], side="right")) - 1
        at_last = shown.true_m(last) if last >= 0 else None
        if at_last is not None:
            when = "at the end" if last == len(shown.time_s) - 1 else f"at {shown.time_s[last]:.2f} s"
            label += f", {_length(float(np.hypot(*(shown.odometry_m[last] - at_last))))} off {when}"
    ax.plot(*shown.odometry_m.T, color=_ODOMETRY, linewidth=1.4, linestyle="--", label=label, zorder=2.2)
    for number, row in enumerate(rows):
        corners, there = shown.ellipse_m(row, sigmas), shown.true_m(row)
        if corners is not None:
            entry = f"{sigmas:g} standard deviations" if number == 0 else None
            ax.fill(*corners.T, facecolor=_ODOMETRY, alpha=0.25, zorder=1.8)
            ax.plot(*corners.T, color=_ODOMETRY, linewidth=0.8, label=entry, zorder=2.1)
        if there is not None:
            # Which place in truth belongs to which by odometry.
            ends = np.stack([there, shown.odometry_m[row]])
            ax.plot(*ends.T, color=_TRUTH, linewidth=0.7, marker=".", markersize=4, zorder=2.3)
    ax.plot(
        *shown.odometry_m[0], marker="o", markerfacecolor="white", markeredgecolor=_TRUTH, linestyle="none", zorder=3
    )
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.08)
    ax.grid(alpha=0.3)
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.set_title(title(shown.trace))
    ax.legend(loc="best", fontsize="small")
    return ax


def _columns(columns: dict[str, NDArray[np.float64]], *names: str) -> NDArray[np.float64]:
    return np.stack([columns[name] for name in names], axis=1)


def _length(metres: float) -> str:
    return f"{1e3 * metres:.2g} mm" if metres < 0.0995 else f"{metres:.2f} m"
