"""One page of logged runs that any browser opens, without a network."""

import base64
import html
import importlib
import json
import os
from collections.abc import Sequence
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep import _metrics, _run_settings, _scene, _top_view
from omnistep._omnistep import Log, read_mcap
from omnistep._output_files import check_output, write_text

#: Rows a second of the plots: a period of 20 ms is a pixel of an 8 s run on a large screen.
_PLOT_HZ = 50.0
#: Series of the plots, and the signals of :class:`omnistep.Trace` that they show.
_SERIES = {
    "speed": "measured_rad_s",
    "reference": "reference_rad_s",
    "torque": "torque_n_m",
    "lower": "limit_lower_n_m",
    "upper": "limit_upper_n_m",
    "slip": "slip_ratio",
    "disturbed": "disturbed_ratio",
    "load": "force_normal_n",
}
#: Series with peaks of single periods, which would be lost between the rows of the plots.
_PEAKS = ("slip", "load")
#: Standard deviations from the middle of an ellipse of odometry to its rim.
_SIGMAS = 2.0
#: Marks a gap of a line: farther away than any vehicle drives, and exact in single precision.
_GAP = float(2**60)
#: Facts that differ from run to run: they are in the runs' names.
_OF_A_RUN = ("policy", "seed")
#: Metrics without a row in the command's tables.
_MORE = ("required_friction",)
#: Mark of a run whose balls are not a valid model of its wheels, and its meaning; the command uses the same mark.
_BEYOND_BALLS = (
    " *",
    "* Balls are not a valid model of this vehicle's wheels on this ground. Run with physics.wheel_model=rollers.",
)
#: Runs that are shown when the page is opened; the others are chosen by hand.
_SHOWN = 2
#: Height above or below its start from which a vehicle is on an obstacle [m]: it settles by a tenth of a millimetre.
_RISE_M = 0.002
#: Length of an even share of the vehicle's weight as an arrow, over the vehicle's reach.
_SHARE_LONG = 0.35


def page(logs: Sequence[Log]) -> str:
    """Make one HTML page of several runs.

    It contains a player with the runs overlaid, a table of their metrics, plots of wheel speeds with their references,
    torques with their limits, slip, disturbed ratio and load, the paths from above (as :func:`omnistep.plot.path` draws
    them), and one cursor in time for all of them. It holds everything it needs.

    Args:
        logs: runs to show, at least one.

    Returns:
        The page.

    Raises:
        ValueError: there is no run, or one has no message on ``/tf`` or ``/vehicle_state``.
        ImportError: plotly is not installed; install the extra ``view``.
    """
    if not logs:
        raise ValueError("logs = [], allowed: at least one run")
    try:
        get_plotlyjs = importlib.import_module("plotly.offline").get_plotlyjs
    except ImportError as error:
        raise ImportError('omnistep.report needs plotly: pip install "omnistep[view]"') from error
    assets = files("omnistep") / "assets"
    names, runs = _names(logs), [_run(log) for log in logs]
    # Runs of the same vehicle on the same ground share a scene: the scene that shows most of the ground.
    grounds = [_scene.ground_key(log) for log in logs]
    scenes: list[dict[str, Any]] = []
    kept: list[tuple[Any, Any]] = []
    for run, name, key in zip(runs, names, grounds, strict=True):
        scene, run["name"] = run["scene"], name
        found = (scene["bodies"] + scene["wheels"], key)
        if found not in kept:
            kept.append(found)
            scenes.append(scene)
        run["scene"] = kept.index(found)
        if _scene.extent_m(scene["ground"]) > _scene.extent_m(scenes[run["scene"]]["ground"]):
            scenes[run["scene"]]["ground"] = scene["ground"]
    opening = _opening([run["scene"] for run in runs], [_verdict(log) for log in logs])
    about = {key: [signal.heading, signal.explained] for key, signal in _metrics.SIGNALS.items()}
    content = {"runs": runs, "scenes": scenes, "shown": opening, "signals": about}
    data = json.dumps(content, separators=(",", ":"), allow_nan=False)
    shared = {key: value for key, value in _shared(logs).items() if key not in (*_OF_A_RUN, "scenario", "vehicle")}
    settings, differing = _run_settings.of_runs(logs)
    facts = [_run_settings.with_unit(*each) for each in (*settings.items(), *shared.items()) if _is_short(each[1])]
    marked = any(not _is_valid(log) for log in logs)
    script = {
        name: assets.joinpath(name).read_text(encoding="utf-8") for name in ("player.js", "plots.js", "report.js")
    }
    return _PAGE.format(
        title=html.escape(_title(logs)),
        css=assets.joinpath("report.css").read_text(encoding="utf-8"),
        facts=html.escape(", ".join(facts)),
        details="".join(_detail(key, value) for key, value in shared.items() if not _is_short(value)),
        runs="".join(_choice(number, name, log) for number, (name, log) in enumerate(zip(names, logs, strict=True))),
        table=_table(logs, names, differing),
        footnote=f'<p class="footnote">{html.escape(_BEYOND_BALLS[1])}</p>' if marked else "",
        logs="".join(_file(name, log) for name, log in zip(names, logs, strict=True)),
        count=len(logs),
        data=data.replace("<", "\\u003c"),
        plotly=get_plotlyjs(),
        player=script["player.js"],
        js=script["plots.js"] + script["report.js"],
    )


def write(paths: Sequence[str | PathLike[str]], out: str | PathLike[str]) -> None:
    """Write the page of several logs to a file.

    Args:
        paths: MCAP logs.
        out: path of the page; a file of that name is replaced once the page is complete.

    Raises:
        LogError: a log cannot be read.
        ValueError: as in :func:`page`.
        OSError: the page cannot be written.
    """
    logs = [Path(path) for path in paths]
    check_output(Path(out), logs, text=True)
    write_text(Path(out), page([read_mcap(path) for path in logs]), logs)


def _title(logs: Sequence[Log]) -> str:
    """Return what the runs are of: each scenario and vehicle once, the first three by name, and every policy."""
    each = list(dict.fromkeys(f"{log.run.get('scenario', '?')} with {log.run.get('vehicle', '?')}" for log in logs))
    more = f" and {len(each) - 3} more" if len(each) > 3 else ""
    policies = dict.fromkeys(log.run.get("policy", "?") for log in logs)
    return f"{', '.join(each[:3])}{more}: {', '.join(policies)}"


def _opening(scenes: Sequence[int], verdicts: Sequence[str]) -> list[int]:
    """Return the runs that are shown at first: the first one, and the next that differs from it most.

    That is one in the same scene with another verdict, else one in the same scene, else any.
    """
    others = range(1, len(scenes))
    beside = [k for k in others if scenes[k] == scenes[0]]
    differing = [k for k in beside if verdicts[k] != verdicts[0]]
    return [0, *[*differing, *beside, *others][: _SHOWN - 1]]


def _obstacle_s(log: Log) -> float:
    """Return when a run is at its first obstacle [s]: half way up or down, or where it stalls; 0 on level ground."""
    rise_m = np.abs(log.frames["base_link"][:, 2] - log.frames["base_link"][0, 2])
    if rise_m.max() > _RISE_M:
        return float(log.frame_time_s[np.argmax(rise_m >= 0.5 * rise_m.max())])
    stalled = log.outcome.stall_from_s if log.outcome else None
    return float(log.frame_time_s[0]) if stalled is None else float(stalled)


def _is_valid(log: Log) -> bool:
    """Whether the run's wheel model represents the vehicle's wheels."""
    return log.outcome is None or log.outcome.wheel_model_valid


def _is_short(fact: str) -> bool:
    return "\n" not in fact and len(fact) <= 80


def _detail(key: str, fact: str) -> str:
    """Return a fact of many lines, to be opened."""
    return f"<details><summary>{html.escape(key)}</summary><pre tabindex=0>{html.escape(fact)}</pre></details>"


def _shared(logs: Sequence[Log]) -> dict[str, str]:
    """Return what all runs share."""
    keys = sorted({key for log in logs for key in log.run})
    values = {key: {log.run.get(key, "?") for log in logs} for key in keys}
    return {key: next(iter(found)) for key, found in values.items() if len(found) == 1}


def _names(logs: Sequence[Log]) -> list[str]:
    """Return a name for each run: its policy and its differences from the other runs.

    If names coincide, also its settings, seed, file or number.
    """
    shared = _shared(logs)
    differing = [key for key in sorted({key for log in logs for key in log.run}) if key not in (*shared, *_OF_A_RUN)]
    names = [", ".join(log.run.get(key, "?") for key in [*differing, "policy"]) for log in logs]
    names = _with_settings(names, logs)
    for more in (
        [f"seed {log.run.get('seed', '?')}" for log in logs],
        [_file_name(log) for log in logs],
        [str(number) for number in range(1, len(logs) + 1)],
    ):
        same = [k for k, name in enumerate(names) if names.count(name) > 1]
        # Common settings are omitted.
        if len({more[k] for k in same}) > 1:
            names = [f"{name}, {more[k]}" if k in same else name for k, name in enumerate(names)]
    return names


def _with_settings(names: Sequence[str], logs: Sequence[Log]) -> list[str]:
    """Return the names, those of several runs with the settings in which these runs differ."""
    longer = list(names)
    for name in dict.fromkeys(names):
        same = [k for k, each in enumerate(names) if each == name]
        _, differing = _run_settings.of_runs([logs[k] for k in same])
        for place, k in enumerate(same):
            settings = [_run_settings.with_unit(heading, texts[place]) for heading, texts in differing.items()]
            longer[k] = ", ".join([name, *settings])
    return longer


def _choice(number: int, name: str, log: Log) -> str:
    line = '<svg width="26" height="10" aria-hidden="true"><line x1="1" x2="25" y1="5" y2="5"/></svg>'
    box = f'<input type="checkbox" value="{number}">'
    return f'<label class="run" title="{html.escape(_file_name(log))}">{box}{line}{html.escape(name)}</label>'


def _file(name: str, log: Log) -> str:
    """Return a line of the list that stands for the table's row of logs on a narrow screen."""
    return f"<dt>{html.escape(name)}</dt><dd>{html.escape(_file_name(log))}</dd>"


def _file_name(log: Log) -> str:
    """Return the name of a log's file as text; bytes that are not UTF-8 are replaced, because a page is UTF-8."""
    return os.fsencode(log.path.name).decode("utf-8", "replace")


def _verdict(log: Log) -> str:
    """Return the verdict of the run, with a mark if its balls are not a valid model of its wheels."""
    if log.outcome is None:
        return "recorded" if log.recorded else "ended early"
    return log.outcome.verdict + ("" if _is_valid(log) else _BEYOND_BALLS[0])


def _table(logs: Sequence[Log], names: Sequence[str], settings: dict[str, list[str]]) -> str:
    """Return the settings that differ and the metrics as rows, and the runs as columns.

    Metrics that no run has are left out.
    """
    verdicts = [_verdict(log) for log in logs]
    outcomes = [log.outcome._rows() if log.outcome else {} for log in logs]
    heads = "".join(f"<th scope=col><span>{html.escape(name)}</span></th>" for name in names)
    rows = []
    for heading, found in settings.items():
        values = "".join(f"<td>{html.escape(text)}</td>" for text in found)
        rows.append(f'<tr class="setting"><th scope=row>{html.escape(heading)}</th>{values}</tr>')
    for key, metric in _metrics.METRICS.items():
        shown_of = [outcome.get(key, (None, False)) for outcome in outcomes]
        cells = verdicts if key == "verdict" else ["-" if text is None else text for text, _ in shown_of]
        # As the command's tables do, and what they have no row for.
        needed = key == "verdict" or any(shown or (key in _MORE and text is not None) for text, shown in shown_of)
        if not needed:
            continue
        better = {"lower": " \u2193", "zero": " \u21920"}.get(metric.better, "")
        head = (
            f'<button type="button" class="tip" aria-describedby="about-{key}">{html.escape(metric.heading)}</button>'
        )
        about = f'<span hidden id="about-{key}">{html.escape(metric.explained)}</span>'
        arrow = f'<span class="better" aria-hidden="true">{better}</span>'
        values = "".join(f"<td><span>{html.escape(cell)}</span></td>" for cell in cells)
        rows.append(f'<tr class="{key}"><th scope=row>{head}{arrow}{about}</th>{values}</tr>')
    files_ = "".join(f"<td>{html.escape(_file_name(log))}</td>" for log in logs)
    rows.append(f'<tr class="file"><th scope=row>log</th>{files_}</tr>')
    return f"<thead><tr><th scope=col>metric</th>{heads}</tr></thead><tbody>{''.join(rows)}</tbody>"


def _run(log: Log) -> dict[str, Any]:
    trace = log.trace
    if len(trace) == 0 or len(log.frame_time_s) == 0:
        raise ValueError(f"{log.path}: no messages on /vehicle_state or /tf, allowed: a run with both")
    time = trace["time_s"]
    wanted = np.arange(time[0], time[-1] + 0.5 / _PLOT_HZ, 1.0 / _PLOT_HZ)
    rows = np.unique(np.clip(np.searchsorted(time, wanted), 0, len(time) - 1))
    shown = log.scene()
    poses = _scene.poses(log, shown.pop("frames"))
    pushes = _scene.pushes(log, shown, poses, shown["ground"])
    reach = max([0.05, *(_scene.reach_m(poses[0], wheel) for wheel in shown["wheels"])])
    load = np.linalg.norm(pushes[:, :, :3], axis=2).sum(axis=1)
    weight = float(np.median(load)) if len(load) else 0.0
    share = weight / max(len(shown["wheels"]), 1)
    shown["metres_per_newton"] = _SHARE_LONG * reach / share if share > 0.0 else 0.005
    return {
        "wheels": trace.wheel_names,
        "end": float(time[-1]),
        "obstacle": _obstacle_s(log),
        "time": _packed(time[rows]),
        "series": {name: _measured(_shown(name, trace.wheels(signal), rows)) for name, signal in _SERIES.items()},
        "frameTime": _packed(log.frame_time_s),
        "poses": _packed(poses),
        "frames": poses.shape[1],
        "pushes": _packed(pushes),
        "edges": _scene.edges(log.trace),
        "above": _above(log),
        "scene": shown,
    }


def _shown(name: str, values: NDArray[np.float64], rows: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return a signal at some rows; of one that peaks, what is largest from each row to the next."""
    if name not in _PEAKS:
        return np.asarray(values[rows])
    high, low = np.fmax.reduceat(values, rows), np.fmin.reduceat(values, rows)
    return np.where(np.abs(high) >= np.abs(low), high, low)


def _above(log: Log) -> dict[str, Any] | None:
    """Return the top view of the run; None if the log has no odometry."""
    if len(log.odometry["time_s"]) == 0:
        return None
    seen = _top_view.seen(log)
    ellipses = [each for row in seen.rows() if (each := seen.ellipse_m(row, _SIGMAS)) is not None]
    # In one line, with gaps between them: NaN is no JSON, and packed it would be 0.
    gap = np.full((1, 2), _GAP)
    command = None
    if seen.command_m is not None:
        command = _packed(seen.command_m[:: max(1, len(seen.command_m) // 1000)])
    return {
        "time": _packed(seen.time_s),
        "odometry": _packed(seen.odometry_m),
        "truth_time": _packed(seen.truth_time_s),
        "truth": None if seen.truth_m is None else _packed(seen.truth_m),
        "command": command,
        "ellipses": _packed(np.concatenate([part for each in ellipses for part in (each, gap)])) if ellipses else None,
        "sigmas": _SIGMAS,
        "gap": _GAP,
    }


def _packed(values: NDArray[np.float64]) -> str:
    """Return numbers as base64 of little-endian singles, row by row."""
    return _singles(np.nan_to_num(values, nan=0.0, posinf=3e38, neginf=-3e38))


def _measured(values: NDArray[np.float64]) -> str:
    """Return numbers as :func:`_packed`; NaN if nothing was measured or there is no limit."""
    return _singles(np.where(np.isfinite(values), values, np.nan))


def _singles(values: NDArray[np.float64]) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline';
style-src 'unsafe-inline'; img-src data: blob:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{css}</style>
</head>
<body>
<header>
<h1>{title}</h1>
<p>{facts}</p>{details}
<button id="theme" type="button">Dark</button>
</header>
<fieldset class="chips" id="runs"><legend>Runs</legend>{runs}</fieldset>
<p class="note" id="note" role="status" hidden></p>
<div id="scene"></div>
<div class="bar">
<button id="play" type="button">Play</button>
<input id="time" type="range" min="0" max="1" step="0.01" value="0" aria-label="Time">
<span id="clock">0.00 s</span>
<label><span>Playback speed </span><select id="rate" aria-label="Playback speed">
<option value="0.1">0.1&times;</option><option value="0.25">0.25&times;</option><option value="0.5">0.5&times;</option>
<option value="1" selected>1&times;</option><option value="2">2&times;</option></select></label>
</div>
<h2>Metrics</h2>
<div class="wide" tabindex="0" role="region" aria-label="Metrics of the runs">
<table style="--runs: {count}">{table}</table></div>{footnote}
<details class="logs"><summary>Logs</summary><dl>{logs}</dl></details>
<h2>Wheels over time</h2>
<fieldset class="chips" id="wheels"><legend>Wheels</legend></fieldset>
<p class="legend" id="legend"></p>
<div id="panels"></div>
<div id="plots" role="img" aria-label="Wheel speeds, torques, slip, disturbed ratio and loads over time"></div>
<section id="seen">
<h2>Paths from above</h2>
<p class="legend" id="ways"></p>
<div id="above" role="img" aria-label="The paths from above: true position, odometry, command"></div>
</section>
<div id="tip" role="tooltip" hidden></div>
<script type="application/json" id="data">{data}</script>
<script>{plotly}</script>
<script>{player}</script>
<script>{js}</script>
</body>
</html>
"""
