"""Settings of logged runs as a report shows them."""

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

from omnistep._omnistep import Log, Scenario

#: Settings that a report always shows: heading, and key of the log's scenario.
_ALWAYS = {
    "height [m]": ("terrain", "height_m"),
    "depth [m]": ("terrain", "depth_m"),
    "slope [rad]": ("terrain", "slope_rad"),
    "friction": ("terrain", "friction"),
    "torque limit [N.m]": ("vehicle", "motor", "stall_torque_n_m"),
}
#: Keys of the ground with a separate heading, or equivalent to the scenario's name.
_NAMED = ("kind", *(path[-1] for path in _ALWAYS.values()))
_UNITS = {"_m": "m", "_rad": "rad"}


def of_runs(logs: Sequence[Log]) -> tuple[dict[str, str], dict[str, list[str]]]:
    """Return the settings that all runs share, and those that differ, with a text for each run.

    Other numbers of the ground are listed only if they differ between runs on the same kind of ground. A missing
    setting is "-". A recording was not simulated, so it has no settings.
    """
    scenarios = [{} if log.recorded else tomllib.loads(log.scenario_toml) for log in logs]
    one_kind = len({scenario.get("terrain", {}).get("kind") for scenario in scenarios}) == 1
    each: list[dict[str, str]] = []
    for log, scenario in zip(logs, scenarios, strict=True):
        own = _of(scenario, Scenario.from_toml(log.scenario_toml).wheel_models) if scenario else {}
        each.append(own | (_of_ground(scenario) if one_kind else {}))
    headings = list(dict.fromkeys(heading for settings in each for heading in settings))
    texts = {heading: [settings.get(heading, "-") for settings in each] for heading in headings}
    shared = {heading: found[0] for heading, found in texts.items() if len(set(found)) == 1 and _is_usual(heading)}
    return shared, {heading: found for heading, found in texts.items() if len(set(found)) > 1}


def with_unit(heading: str, text: str) -> str:
    """Return a setting in a line of text.

    >>> from omnistep._run_settings import with_unit
    >>> with_unit("height [m]", "0.05")
    'height 0.05 m'
    >>> with_unit("friction", "0.7")
    'friction 0.7'
    """
    name, _, unit = heading.rstrip("]").partition(" [")
    return " ".join(part for part in (name, text, unit) if part)


def _is_usual(heading: str) -> bool:
    return heading in (*_ALWAYS, "friction patches", "wheel model", "command", "command speed [m/s]")


def _of(scenario: Mapping[str, Any], wheel_models: Sequence[str]) -> dict[str, str]:
    """Return heading and text of each setting of a scenario."""
    settings = {}
    for heading, path in _ALWAYS.items():
        value: Any = scenario
        for key in path:
            value = value.get(key) if isinstance(value, Mapping) else None
        if value is not None:
            settings[heading] = f"{value:.6g}"
    if patches := scenario.get("friction_patch"):
        settings["friction patches"] = ", ".join(f"{patch['friction']:.6g}" for patch in patches)
    models = {"balls" if model == "ball" else model for model in wheel_models}
    settings["wheel model"] = " and ".join(sorted(models))
    command = scenario.get("command", {})
    if "path" in command:
        settings["command"] = f"path {command['path']}" if isinstance(command["path"], str) else "path"
    elif "file" in command:
        settings["command"] = "table"
    else:
        speed = [command.get(key, 0.0) for key in ("vx_m_s", "vy_m_s")]
        settings["command speed [m/s]"] = f"{speed[0]:.6g}" if speed[1] == 0.0 else f"{speed[0]:.6g}, {speed[1]:.6g}"
    return settings


def _of_ground(scenario: Mapping[str, Any]) -> dict[str, str]:
    """Return heading and text of the ground's other numbers."""
    settings = {}
    for key, value in scenario.get("terrain", {}).items():
        if key in _NAMED or isinstance(value, bool) or not isinstance(value, (int, float)):
            continue
        suffix = next((suffix for suffix in _UNITS if key.endswith(suffix)), "")
        name = key.removesuffix(suffix).replace("_", " ")
        name = "obstacle at x" if name == "at" else name
        settings[f"{name} [{_UNITS[suffix]}]" if suffix else name] = f"{value:.6g}"
    return settings
