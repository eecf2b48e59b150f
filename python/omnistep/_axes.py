"""Functions that all figures share: the import of matplotlib, axes, colours and legends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from omnistep._argument_types import of_kind
from omnistep.errors import ConfigError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from omnistep._omnistep import Trace

# Okabe and Ito's colours: also distinguishable for colour-blind readers. A policy has the same colour in every figure,
# and nothing else has this colour.
_POLICIES = {
    "independent": "#CC79A7",
    "scale_torques": "#D55E00",
    "scale_references": "#0072B2",
    "shared_integral": "#009E73",
    "traction_runup": "#F0E442",
    "traction": "#6B4C00",
}
_OTHER_POLICY = "0.4"
# Wheels and loads use the remaining colours, from the fourth on with different dashes.
_WHEELS = ("#000000", "#E69F00", "#56B4E9")
_DASHES = ("-", "--", ":", "-.")


def policy_colour(policy: str) -> str:
    """Return the colour of a policy, the same in every figure.

    Args:
        policy: a name of :func:`omnistep.list_policies`; any other is grey.

    Returns:
        A colour of matplotlib: ``#RRGGBB``, or a level of grey.

    Example:
        >>> import omnistep
        >>> len({omnistep.plot.policy_colour(policy) for policy in omnistep.list_policies()})
        6
    """
    return _POLICIES.get(policy, _OTHER_POLICY)


def wheel_style(number: int) -> dict[str, str]:
    """Return colour and dashes of the first, second, ... wheel drawn."""
    dashes = _DASHES[number // len(_WHEELS) % len(_DASHES)]
    return {"color": _WHEELS[number % len(_WHEELS)], "linestyle": dashes}


def dashes(number: int) -> str:
    """Return the dashes of the first, second, ... line of one colour."""
    return _DASHES[number % len(_DASHES)]


def pyplot() -> Any:
    """Return ``matplotlib.pyplot``."""
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError('omnistep.plot needs matplotlib: pip install "omnistep[plot]"') from error
    return plt


def figure(rows: int, columns: int, **options: Any) -> tuple[Any, NDArray[Any]]:
    """Return a figure of its own, not of ``matplotlib.pyplot``, with rows for lines over time, and its axes."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError('plot needs matplotlib: pip install "omnistep[plot]"') from error
    made = Figure(figsize=(10.0, 1.9 * rows), layout="constrained")
    return made, made.subplots(rows, columns, squeeze=False, **options)


def recorded_and_simulated(ax: Any, time_s: NDArray[Any], recorded: NDArray[Any], simulated: NDArray[Any]) -> None:
    """Draw what was simulated over what was recorded."""
    ax.plot(time_s, recorded, color="0.6", lw=1.0, label="recorded")
    ax.plot(time_s, simulated, color="tab:blue", lw=1.0, label="simulated")
    ax.grid(visible=True, alpha=0.3)


def given_or_new(
    axes: Any, shape: tuple[int, ...], *, size: tuple[float, float], share_y: bool | str = False
) -> NDArray[Any]:
    """Return the given axes in this shape, or the axes of a new figure of this size [inch]."""
    if axes is None:
        rows, columns = shape if len(shape) == 2 else (shape[0], 1)
        options = {"sharex": True, "sharey": share_y, "figsize": size, "layout": "constrained", "squeeze": False}
        return np.asarray(pyplot().subplots(rows, columns, **options)[1]).reshape(shape)
    given = np.asarray(axes, dtype=object)
    for number, each in enumerate(given.ravel()):
        of_kind(each, f"axes[{number}]" if given.shape else "axes", pyplot().Axes, allowed="matplotlib's Axes")
    if given.size != np.prod(shape):
        raise ConfigError(f"axes = {given.size} axes, allowed: {' x '.join(map(str, shape))}", key="axes")
    return given.reshape(shape)


def same_limits(axes: Sequence[Axes] | NDArray[Any]) -> None:
    """Give all axes the y limits that contain what each of them shows."""
    limits = np.array([ax.get_ylim() for ax in axes])
    for ax in axes:
        ax.set_ylim(limits[:, 0].min(), limits[:, 1].max())


def legend_above(ax: Axes, *, columns: int, room: float = 0.35) -> None:
    """Make room above the lines, that share of their height, and put the legend there."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + room * (high - low))
    ax.legend(loc="upper center", fontsize="small", ncols=columns)


def title(trace: Trace) -> str:
    """Return the title of a run: its scenario and policy."""
    return f"{trace.scenario}, {trace.policy}"
