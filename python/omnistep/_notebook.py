"""Methods that compiled classes get for notebooks when the package is imported; their code is loaded by their use."""

from __future__ import annotations

from omnistep._omnistep import ClimbLimits, Log, Outcome, Scenario, Trace, Vehicle

TYPE_CHECKING = False  # as in __init__.py
if TYPE_CHECKING:
    from typing import Any

    from omnistep._played import PlayerFrame


def show(self: Trace | Log, *, height_px: int = 420) -> PlayerFrame:
    from omnistep import _played

    return _played.frame_of(self, height_px=height_px)


def attach() -> None:
    """Give the compiled classes what a notebook asks them for."""
    shown = {Outcome: "outcome_html", Trace: "trace_html", Vehicle: "vehicle_html", Scenario: "scenario_html"}
    for kind, made_by in {**shown, ClimbLimits: "limits_html", Log: "log_html"}.items():
        kind._repr_html_ = _method(made_by)  # type: ignore[attr-defined]
    show.__doc__ = _SHOW
    Trace.show = Log.show = show  # type: ignore[method-assign]


def _method(made_by: str) -> Any:
    def _repr_html_(self: Any) -> str:
        from omnistep import _html

        return str(getattr(_html, made_by)(self))

    return _repr_html_


_SHOW = """The run in the player of reports, in a notebook.

Args:
    height_px: height of the frame, 100 to 4000.

Returns:
    A frame that needs no network. Poses are shown at 50 moments a second, or at fewer if the run is long.

Raises:
    ConfigError: the run has no row or no poses; or it is the ``trace`` of a log: pass the log.
"""
