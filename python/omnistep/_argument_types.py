"""Type checks of the arguments of figures, before anything is drawn."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from typing import Any

from omnistep._omnistep import Log, Trace, shortened
from omnistep.errors import ConfigError


def of_kind(given: Any, name: str, *kinds: type, allowed: str = "") -> Any:
    """Return an argument of one of these types; reject any other type by the argument's name."""
    if not isinstance(given, kinds):
        hint = " (omnistep.read_mcap reads one)" if Log in kinds and isinstance(given, str | PathLike) else ""
        raise TypeError(f"{name}: {_what(given)}, allowed: {allowed or _names(kinds)}{hint}")
    return given


def no_others(function: Callable[..., Any], others: Mapping[str, Any]) -> None:
    """Refuse keyword arguments that a function does not have, and say where keys of a scenario go."""
    for name, value in others.items():
        known = [each for each in inspect.signature(function).parameters if each != "others"]
        near = "".join(f" (did you mean {each}?)" for each in difflib.get_close_matches(name, known, 1))
        message = f"{function.__name__}: no argument {name}{near}, allowed: {', '.join(known)}"
        where = f"; keys of the scenario go into overrides={{{name!r}: {value!r}}}"
        raise TypeError(shortened(message) + ("" if near else shortened(where)))


def several(given: Any, name: str, *kinds: type) -> list[Any]:
    """Return one of these types, or some in a list or a dictionary, as a list with at least one."""
    if isinstance(given, kinds):
        return [given]
    if isinstance(given, str | bytes | Trace) or not isinstance(given, Iterable):
        of_kind(given, name, *kinds, allowed=f"{_names(kinds)}, one or a list or dictionary of them")
    keyed = given.items() if isinstance(given, Mapping) else enumerate(given)
    found = [of_kind(each, f"{name}[{key!r}]", *kinds) for key, each in keyed]
    if not found:
        raise ConfigError(f"{name} = [], allowed: at least one {_names(kinds)}", key=name)
    return found


def names(given: Any, name: str) -> list[str]:
    """Return a list of names with at least one."""
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        raise TypeError(f"{name}: {_what(given)}, allowed: a list of names")
    found = list(given)
    if not found:
        raise ConfigError(f"{name} = [], allowed: at least one name", key=name)
    return found


def trace_of(run: Trace | Log) -> Trace:
    """Return the columns of a run or of its log, with at least one row."""
    trace = run.trace if isinstance(run, Log) else run
    if len(trace) == 0:  # as of a log without /vehicle_state
        message = f"{trace.scenario}, {trace.policy}: an empty run, allowed: at least one control period"
        raise ConfigError(message, key="trace")
    return trace


def with_places(trace: Trace) -> Trace:
    """Reject the trace of a log, which has no wheel positions."""
    if "x_m" not in trace.wheel_signals:
        message = f"{trace.scenario}, {trace.policy}: the trace of a log, which lacks the wheels' places x_m, "
        message += "allowed: the Log itself"
        raise ConfigError(message, key="trace")
    return trace


def _what(given: Any) -> str:
    if given is None:
        return "None"
    return f"the string {given!r}" if isinstance(given, str) else f"a {type(given).__name__}"


def _names(kinds: tuple[type, ...]) -> str:
    return " or ".join(kind.__name__ for kind in kinds)
