"""The player of a report with one run, as a frame of a page that needs no network."""

from __future__ import annotations

import base64
import html
import json
import tempfile
import zlib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep import _scene
from omnistep._argument_types import trace_of, with_places
from omnistep._omnistep import Log, Scenario, Trace, read_mcap, write_recording
from omnistep.errors import ConfigError

_Floats = NDArray[np.float64]

#: Numbers of poses and forces that a page holds at most: 2 MB before they are packed. Longer runs have fewer moments.
_MOST_NUMBERS = 500_000
#: Moments a second at most: those of a log.
_HZ = 50.0
#: Length of an even share of the vehicle's weight as an arrow, over the vehicle's reach.
_SHARE_LONG = 0.35


class PlayerFrame:
    """A run in the player of reports, which a notebook shows in a frame: what ``show`` of a run returns.

    The page in it fetches nothing. It has the player, and poses and forces at 50 moments a second, or at fewer if the
    run is long: 2 MB at most, packed to a few hundred kB.

    Example:
        >>> import omnistep
        >>> frame = omnistep.run("flat", overrides={"duration_s": 0.5}).show()
        >>> frame.page.count("https://"), len(frame.page) < 1_000_000
        (0, True)
    """

    def __init__(self, page: str, title: str, height_px: int) -> None:
        """Keep a page, its title and the height of its frame."""
        #: The page, which is complete.
        self.page = page
        #: Scenario, vehicle and policy of the run.
        self.title = title
        #: Height of the frame [px].
        self.height_px = height_px

    def _repr_html_(self) -> str:
        # The page is kept from everything else: it has scripts of its own and no origin.
        return (
            f'<iframe title="{html.escape(self.title)}" sandbox="allow-scripts" width="100%" height="{self.height_px}"'
            f' style="border:0" srcdoc="{html.escape(self.page)}"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<omnistep.PlayerFrame of {self.title}: a notebook shows it>"


def frame_of(run: Trace | Log, *, height_px: int) -> PlayerFrame:
    """Return the player of a run.

    Raises:
        ConfigError: the height is not 100 to 4000, or the run has no poses.
    """
    if isinstance(height_px, bool) or not isinstance(height_px, int) or not 100 <= height_px <= 4000:
        raise ConfigError(f"height_px = {height_px!r}, allowed: 100 to 4000", key="height_px")
    trace = trace_of(run)
    if isinstance(run, Log):
        if len(run.frame_time_s) == 0:
            raise ConfigError(f"{run.path}: no messages on /tf, allowed: a run with poses", file=str(run.path))
        scene = run.scene()
        played: Any = run
        vehicle = run.run.get("vehicle", "?")
    else:
        with_places(trace)
        played, scene = _Played.of(trace)
        vehicle = trace.vehicle
    title = f"{trace.scenario} with {vehicle}: {trace.policy}"
    return PlayerFrame(_page(played, scene, title), title, height_px)


class _Played:
    """A trace as a log has it: times and poses of its frames."""

    def __init__(self, trace: Trace, time_s: _Floats, frames: dict[str, _Floats]) -> None:
        self.trace = trace
        self.frame_time_s = time_s
        self.frames = frames

    @classmethod
    def of(cls, trace: Trace) -> tuple[_Played, dict[str, Any]]:
        """Return the poses of a trace and its scene."""
        scenario = Scenario.from_toml(trace.__reduce__()[1][0])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.mcap"
            write_recording(path, scenario, {name: np.zeros(1) for name in _columns(trace)}, {}, "")
            scene = read_mcap(path).scene()
        time = trace["time_s"]
        wanted = np.arange(time[0], time[-1] + 0.5 / _HZ, 1.0 / _HZ)
        rows = np.unique(np.clip(np.searchsorted(time, wanted - 1e-9), 0, len(time) - 1))
        base = np.stack([trace[f"pose_{axis}_m"][rows] for axis in "xyz"], axis=1)
        turn = np.stack([trace[f"pose_{part}"][rows] for part in ("qx", "qy", "qz", "qw")], axis=1)
        bodies = _bodies(scenario, trace, rows, base, turn)
        root = next(iter(bodies))
        frames = {"base_link": np.concatenate(bodies[root], axis=1)}
        for hinge in scenario.vehicle.to_dict()["hinge"]:
            at, way = bodies[hinge["child"]]
            anchor = at + _turned(way, np.array(hinge["anchor_m"]))
            frames[hinge["child"]] = np.concatenate([anchor, way], axis=1)
        places = [trace.wheels(f"{axis}_m")[rows] for axis in "xyz"]
        spun = _spun_rad(scenario, trace)[rows]
        for k, (name, wheel) in enumerate(zip(trace.wheel_names, scenario.vehicle.to_dict()["wheel"], strict=True)):
            axle = next(np.array(each["axle"]) for each in scene["wheels"] if each["name"] == name)
            way = _after(bodies[wheel["body"]][1], _about(axle, spun[:, k]))
            frames[f"wheel_{name}"] = np.concatenate([np.stack([place[:, k] for place in places], axis=1), way], axis=1)
        return cls(trace, time[rows], frames), scene


def _columns(trace: Trace) -> list[str]:
    return [f"wheel_{name}_measured_rad_s" for name in trace.wheel_names]


def _spun_rad(scenario: Scenario, trace: Trace) -> _Floats:
    """Return how far each wheel has turned about its axle [rad], (T, N)."""
    factor = np.array([(-1.0 if wheel.reversed else 1.0) / wheel.gear for wheel in scenario.vehicle.layout.wheels])
    speed = np.nan_to_num(trace.wheels("measured_rad_s")) * factor
    turned: _Floats = np.cumsum(speed * np.gradient(trace["time_s"])[:, None], axis=0) if len(trace) > 1 else 0 * speed
    return turned


def _bodies(
    scenario: Scenario, trace: Trace, rows: NDArray[np.intp], base: _Floats, turn: _Floats
) -> dict[str, tuple[_Floats, _Floats]]:
    """Return where the vehicle's origin is on each body [m] and how the body is turned, the base first."""
    keys = scenario.vehicle.to_dict()
    children = {hinge["child"] for hinge in keys["hinge"]}
    (root,) = [body["name"] for body in keys["body"] if body["name"] not in children]
    found = {root: (base, turn)}
    left = list(keys["hinge"])
    while left:
        for hinge in [each for each in left if each["parent"] in found]:
            at, way = found[hinge["parent"]]
            anchor = np.array(hinge["anchor_m"])
            turned = _after(way, _about(np.array(hinge["axis"]), trace[f"hinge_{hinge['name']}_angle_rad"][rows]))
            found[hinge["child"]] = (at + _turned(way, anchor) - _turned(turned, anchor), turned)
            left.remove(hinge)
    return found


def _about(axis: _Floats, angle_rad: _Floats) -> _Floats:
    """Return the quaternions of turns about an axis, (T, 4)."""
    half = 0.5 * angle_rad[:, None]
    return np.concatenate([np.sin(half) * axis / np.linalg.norm(axis), np.cos(half)], axis=1)


def _after(first: _Floats, second: _Floats) -> _Floats:
    """Return the quaternions of turns in turned frames, (T, 4)."""
    u, w, v, s = first[:, :3], first[:, 3:], second[:, :3], second[:, 3:]
    return np.concatenate([w * v + s * u + np.cross(u, v), w * s - np.sum(u * v, axis=1, keepdims=True)], axis=1)


def _turned(turn: _Floats, vector: _Floats) -> _Floats:
    """Turn a vector by quaternions, (T, 3)."""
    u, w = turn[:, :3], turn[:, 3:]
    return vector + 2.0 * np.cross(u, np.cross(u, vector) + w * vector)


def _page(run: Any, scene: dict[str, Any], title: str) -> str:
    poses = _scene.poses(run, scene.pop("frames"))
    pushes = _scene.pushes(run, scene, poses, scene["ground"])
    load = np.linalg.norm(pushes[:, :, :3], axis=2).sum(axis=1)
    reach = max([0.05, *(_scene.reach_m(poses[0], wheel) for wheel in scene["wheels"])])
    share = float(np.median(load)) / max(len(scene["wheels"]), 1)
    scene["metres_per_newton"] = _SHARE_LONG * reach / share if share > 0.0 else 0.005
    scene["runs"] = [{"name": run.trace.policy}]
    time = run.frame_time_s
    every = -(-(poses.size + pushes.size) // _MOST_NUMBERS)
    kept = np.unique(np.append(np.arange(0, len(time), max(every, 1)), len(time) - 1))
    columns = [run.trace.wheel_names.index(wheel["name"]) for wheel in scene["wheels"]]
    rows = np.clip(np.searchsorted(run.trace["time_s"], time[kept] - 1e-9), 0, len(run.trace) - 1)
    slips = run.trace.wheels("slip_ratio")[rows][:, columns]
    content = {
        "scene": scene,
        "frames": poses.shape[1],
        "time": _packed(time[kept]),
        "poses": _packed(poses[kept]),
        "pushes": _packed(pushes[kept]),
        "slips": _packed(slips),
        "edges": _scene.edges(run.trace),
    }
    player = (files("omnistep") / "assets" / "player.js").read_text(encoding="utf-8")
    return _PAGE.format(
        title=html.escape(title),
        player=_deflated(player),
        data=_deflated(json.dumps(content, separators=(",", ":"), allow_nan=False)),
    )


def _packed(values: _Floats | Sequence[float]) -> str:
    """Return numbers as base64 of little-endian singles, row by row; 0 where there is none."""
    singles = np.ascontiguousarray(np.nan_to_num(values, nan=0.0, posinf=3e38, neginf=-3e38), dtype="<f4")
    return base64.b64encode(singles.tobytes()).decode("ascii")


def _deflated(text: str) -> str:
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")


_PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline';
style-src 'unsafe-inline'; img-src data: blob:">
<title>{title}</title><style>
html, body {{ margin: 0; height: 100%; font: 14px system-ui, sans-serif; background: Canvas; color: CanvasText;
color-scheme: light dark; }}
body {{ display: flex; flex-direction: column; }}
#scene {{ flex: 1; min-height: 0; }}
#bar {{ display: flex; gap: 8px; align-items: center; padding: 6px; }}
#time {{ flex: 1; }}
</style></head><body><div id="scene"></div>
<div id="bar"><button id="play" type="button">Play</button>
<input id="time" type="range" min="0" step="0.01" value="0" aria-label="Time"><span id="clock">0.00 s</span></div>
<script>
"use strict";
const inflated = (text) => new Response(new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]).stream()
  .pipeThrough(new DecompressionStream("deflate"))).text();
const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
(async () => {{
  const script = document.createElement("script");
  script.textContent = await inflated("{player}");
  document.body.append(script);
  const data = JSON.parse(await inflated("{data}")), byId = (id) => document.getElementById(id);
  const [time, poses, pushes, slips] = ["time", "poses", "pushes", "slips"].map((key) => floats(data[key]));
  const dark = matchMedia("(prefers-color-scheme: dark)").matches, wheels = data.scene.wheels.length;
  const player = new omnistepPlayer.Player(byId("scene"), data.scene, {{ dark }}), last = time.length - 1;
  const path = new Float32Array(3 * time.length);
  path.forEach((_, at) => {{ path[at] = poses[7 * Math.floor(at / 3) * data.frames + at % 3]; }});
  const [slider, play] = [byId("time"), byId("play")], [start, end] = [time[0], time[last]];
  Object.assign(slider, {{ min: start, max: end, value: start }});
  let now = start, playing = false, before = 0;
  const show = () => {{
    let row = 0;
    while (row < last && time[row + 1] <= now + 1e-6) row += 1;
    const part = (values, size, at) => Array.from(values.subarray(size * at, size * (at + 1)));
    const wheel = (_, k) => {{
      const six = part(pushes, 6, row * wheels + k), force = six.slice(0, 3);
      return {{ slip: slips[row * wheels + k], push: Math.hypot(...force) > 0 ? [force, six.slice(3)] : null }};
    }};
    player.show([{{
      poses: Array.from({{ length: data.frames }}, (_, frame) => part(poses, 7, row * data.frames + frame)),
      wheels: Array.from({{ length: wheels }}, wheel), path_m: path, path_points: row + 1,
      edges: data.edges.filter(([at]) => at <= now + 1e-6).map(([, ...edge]) => edge),
    }}]);
    slider.value = String(now);
    byId("clock").textContent = `${{now.toFixed(2)}} s`;
  }};
  const step = (at) => {{
    if (!playing) return;
    now = Math.min(now + (at - before) / 1000, end);
    before = at;
    if (now >= end) set(false);
    show();
    requestAnimationFrame(step);
  }};
  const set = (on) => {{
    playing = on;
    play.textContent = on ? "Pause" : "Play";
    if (on) {{
      if (now >= end) now = start;
      before = performance.now();
      requestAnimationFrame(step);
    }}
  }};
  play.addEventListener("click", () => set(!playing));
  slider.addEventListener("input", () => {{ now = Number(slider.value); show(); }});
  show();
}})();
</script></body></html>
"""
