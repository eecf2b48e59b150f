"""One page of logged runs that any browser opens, without a network."""

import base64
import html
import importlib
import json
import os
import secrets
from collections.abc import Sequence
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep import _path, meshes
from omnistep._omnistep import Log, read_mcap

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
#: Standard deviations from the middle of an ellipse of odometry to its rim.
_SIGMAS = 2.0
#: Where a line has a gap: further away than any vehicle goes, and exact as a single.
_GAP = float(2**60)
#: Facts that differ from run to run: they are in the table.
_OF_A_RUN = ("policy", "seed")
#: Columns of the table, and how a figure is written.
_FIGURES = {
    "verdict": "{}",
    "crossing_s": "{:.2f}",
    "retries": "{:d}",
    "pitch_peak_deg": "{:.2f}",
    "yaw_error_deg": "{:.1f}",
    "slip_rms": "{:.3f}",
    "disturbed_rms": "{:.3f}",
    "spread_rms": "{:.3f}",
    "linkage_spread": "{:.3f}",
    "heat_n2m2s": "{:.1f}",
    "work_j": "{:.1f}",
    "required_friction": "{:.2f}",
    "final_x_m": "{:.3f}",
    "final_y_m": "{:.3f}",
    "final_yaw_rad": "{:.3f}",
    "odometry_error_m": "{:.4f}",
}
_HEADINGS = {
    "verdict": "verdict",
    "crossing_s": "crossing [s]",
    "retries": "retries",
    "pitch_peak_deg": "pitch [deg]",
    "yaw_error_deg": "yaw [deg]",
    "slip_rms": "slip rms",
    "disturbed_rms": "disturbed rms",
    "spread_rms": "spread rms",
    "linkage_spread": "linkage spread",
    "heat_n2m2s": "heat [N2m2s]",
    "work_j": "work [J]",
    "required_friction": "friction asked for",
    "final_x_m": "x [m]",
    "final_y_m": "y [m]",
    "final_yaw_rad": "heading [rad]",
    "odometry_error_m": "odometry error [m]",
}


def page(logs: Sequence[Log]) -> str:
    """Make one HTML page of several runs.

    It has a table of their figures, a player of each run, its way from above (as :func:`omnistep.plot.path` draws it),
    plots of wheel speeds, torques with their limits, slip, disturbed ratio and load, and one cursor in time for all of
    them. It holds everything it needs.

    Args:
        logs: runs to show, at least one.

    Returns:
        The page.

    Raises:
        ValueError: there is no run, or one has no message on ``/tf`` or ``/vehicle_state``.
        ImportError: plotly is not there; the extra ``view`` brings it.
    """
    if not logs:
        raise ValueError("logs = [], allowed: at least one run")
    try:
        get_plotlyjs = importlib.import_module("plotly.offline").get_plotlyjs
    except ImportError as error:
        raise ImportError('omnistep.report needs plotly: install omnistep with its extra "view"') from error
    assets = files("omnistep") / "assets"
    data = json.dumps({"runs": [_run(log) for log in logs]}, separators=(",", ":"), allow_nan=False)
    shared, differing = _facts(logs)
    return _PAGE.format(
        title=html.escape(_title(logs)),
        css=assets.joinpath("report.css").read_text(encoding="utf-8"),
        facts=html.escape(", ".join(f"{key} {value}" for key, value in shared.items() if key not in _OF_A_RUN)),
        headings="".join(f"<th scope=col>{html.escape(_HEADINGS[key])}</th>" for key in _FIGURES),
        rows="".join(_row(log, differing) for log in logs),
        data=data.replace("<", "\\u003c"),
        plotly=get_plotlyjs(),
        js=assets.joinpath("report.js").read_text(encoding="utf-8"),
    )


def write(paths: Sequence[str | PathLike[str]], out: str | PathLike[str]) -> None:
    """Write the page of several logs to a file.

    Args:
        paths: MCAP logs.
        out: where the page goes; a file of that name is replaced once the page is whole.

    Raises:
        LogError: a log cannot be read.
        ValueError: as :func:`page`.
        OSError: the page cannot be written.
    """
    _replace(Path(out), page([read_mcap(path) for path in paths]))


def _replace(out: Path, text: str) -> None:
    """Write a file aside, under a name that nobody else has, and give it its own when it is whole."""
    if out.exists() and not out.is_file():  # a pipe or a terminal; a folder is refused by its name
        out.write_text(text, encoding="utf-8")
        return
    aside = out.with_name(f"{out.name}.{secrets.token_hex(8)}.part")
    try:
        with aside.open("x", encoding="utf-8") as file:  # follows no link
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        aside.replace(out)
    except BaseException as error:
        aside.unlink(missing_ok=True)
        if isinstance(error, OSError):
            error.filename, error.filename2 = str(out), None
        raise


def _title(logs: Sequence[Log]) -> str:
    """Return what the runs are of: each scenario and vehicle once, the first three of them by name."""
    each = list(dict.fromkeys(f"{log.run.get('scenario', '?')} with {log.run.get('vehicle', '?')}" for log in logs))
    more = f" and {len(each) - 3} more" if len(each) > 3 else ""
    return ", ".join(each[:3]) + more


def _facts(logs: Sequence[Log]) -> tuple[dict[str, str], list[str]]:
    """Return what all runs share, and the keys of what differs from run to run but is not in the table anyway."""
    keys = sorted({key for log in logs for key in log.run})
    values = {key: {log.run.get(key, "?") for log in logs} for key in keys}
    shared = {key: next(iter(found)) for key, found in values.items() if len(found) == 1}
    return shared, [key for key in keys if key not in shared and key not in _OF_A_RUN]


def _row(log: Log, differing: Sequence[str]) -> str:
    outcome: dict[str, Any] = log.outcome.to_dict() if log.outcome is not None else {"verdict": "ended early"}
    name = html.escape(", ".join(log.run.get(key, "?") for key in [*differing, "policy"]))
    cells = "".join(f"<td>{_figure(outcome.get(key), pattern)}</td>" for key, pattern in _FIGURES.items())
    label = html.escape(f"Show {log.path.name}")
    return f'<tr><td><button aria-label="{label}">{name}</button> {html.escape(log.path.name)}</td>{cells}</tr>'


def _figure(value: Any, pattern: str) -> str:
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return "-"
    text = pattern.format(value)
    return html.escape(text.removeprefix("-") if text.strip("-0.") == "" else text)


def _run(log: Log) -> dict[str, Any]:
    trace = log.trace
    if len(trace) == 0 or len(log.frame_time_s) == 0:
        raise ValueError(f"{log.path}: no messages on /vehicle_state or /tf, allowed: a run with both")
    time = trace["time_s"]
    wanted = np.arange(time[0], time[-1] + 0.5 / _PLOT_HZ, 1.0 / _PLOT_HZ)
    rows = np.unique(np.clip(np.searchsorted(time, wanted), 0, len(time) - 1))
    vehicle, ground = meshes.of_urdf(log.urdf), meshes.of_urdf(log.terrain_urdf)
    frames = log.frames
    # A link without a frame stays where the vehicle's base is.
    poses = np.stack([frames.get(name, frames["base_link"]) for name in vehicle.links], axis=1)
    # Ground that is shown: around the way of every wheel and body.
    links = poses[:, :, :2]
    ahead, aside = 0.25, 0.15
    extent = np.array(
        [
            [links[:, :, 0].min() - ahead, links[:, :, 0].max() + ahead],
            [links[:, :, 1].min() - aside, links[:, :, 1].max() + aside],
        ]
    )
    corners = np.clip(ground.vertices_m, [*extent[:, 0], -np.inf], [*extent[:, 1], np.inf])
    # The scene is a little larger than the ground: what is at its borders flickers.
    shown = extent + np.array([-0.02, 0.02])
    height = [float(corners[:, 2].min()) - 0.02, float(max(corners[:, 2].max(), poses[:, :, 2].max()) + 0.35)]
    return {
        "wheels": trace.wheel_names,
        "end": float(time[-1]),
        "time": _packed(time[rows]),
        "series": {name: _packed(trace.wheels(signal)[rows]) for name, signal in _SERIES.items()},
        "frameTime": _packed(log.frame_time_s),
        "poses": _packed(poses),
        "above": _above(log),
        "extent": [*np.round(shown, 3).tolist(), height],
        "mesh": {
            "links": len(vehicle.links),
            "link": vehicle.link.tolist(),
            "vertices": _packed(vehicle.vertices_m),
            "triangles": vehicle.triangles.tolist(),
            "colours": vehicle.colours.tolist(),
        },
        "ground": {
            "vertices": np.round(corners, 4).tolist(),
            "triangles": ground.triangles.tolist(),
            "colours": ground.colours.tolist(),
        },
    }


def _above(log: Log) -> dict[str, Any] | None:
    """Return the run from above; None where the log has no odometry."""
    if len(log.odometry["time_s"]) == 0:
        return None
    seen = _path.seen(log)
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
    finite = np.nan_to_num(values, nan=0.0, posinf=3e38, neginf=-3e38)
    return base64.b64encode(np.ascontiguousarray(finite, dtype="<f4").tobytes()).decode("ascii")


_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{css}</style>
</head>
<body>
<h1>{title}</h1>
<p>{facts}</p>
<div class="wide"><table><thead><tr><th scope=col>run</th>{headings}</tr></thead><tbody>{rows}</tbody></table></div>
<div class="bar">
<button id="play" aria-pressed="false">Play</button>
<input id="time" type="range" min="0" max="1" step="0.01" value="0" aria-label="Time">
<output id="clock" for="time">0.00 s</output>
<label>Speed <select id="rate"><option>0.1</option><option>0.25</option><option>0.5</option><option selected>1</option>
<option>2</option></select></label>
<button id="theme">Dark or light</button>
</div>
<div id="scene" role="img" aria-label="The vehicle on its ground at the cursor's time"></div>
<div id="above" role="img" aria-label="The way from above: truth, odometry with its uncertainty, command"></div>
<div id="plots" role="img" aria-label="Wheel speeds, torques, slip, disturbed ratio and loads over time"></div>
<script type="application/json" id="data">{data}</script>
<script>{plotly}</script>
<script>{js}</script>
</body>
</html>
"""
