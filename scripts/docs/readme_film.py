"""Draws docs/images/climb.gif, the film of the README: two runs on the same ground, one policy above the other.

The runs are made anew. The player of web/player draws them in Chromium without a window, Pillow joins the pictures.
Needs the package with its extra "plot" (which brings Pillow), Chromium and, in tests/viewers, what `npm ci` installs.
"""

import argparse
import json
import subprocess
import tempfile
from importlib.resources import files
from pathlib import Path

import numpy as np
from PIL import Image

import omnistep
from omnistep import _scene

ROOT = Path(__file__).resolve().parents[2]
RUNS = {"independent": "one PID loop per wheel (independent)", "traction": "traction control (traction)"}
SECONDS, FPS = 6.0, 10.0
WIDTH, HEIGHT = 640, 230  # of one run
LIMIT_BYTES = 1 << 20
#: Posts on the ground, which does not move while the camera follows the vehicle [m].
POSTS_AT_M, POST_HALF_M = (-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6), (0.006, 0.006, 0.022)
#: The modes of traction control that are named, with the retry.
MODES = {1: "stuck, backs off", 2: "run-up for retry"}
COLOURS = 40  # flat colours and edges: more are not seen
PAGE = """<!doctype html><meta charset="utf-8"><style>
body { margin: 0; width: %dpx; background: #fff; font: 600 15px system-ui, sans-serif; color: #1c1c22 }
section { position: relative; height: %dpx; border-bottom: 1px solid #d0d0d6; overflow: hidden }
section > div { width: 640px; height: 230px }
p { position: absolute; left: 14px; top: 8px; margin: 0; z-index: 9 }
.outcome { left: auto; right: 14px }
button, .omnistep-player-buttons { display: none }
</style>%s<script>%s</script><script>const DATA = %s; %s</script>"""
SECTION = '<section><div id="scene-%d"></div><p>%s</p><p class="outcome" id="outcome-%d"></p></section>'
SCRIPT = """
const at = (name, k) => document.getElementById(`${name}-${k}`);
const options = { view: "side" };
const players = DATA.runs.map((run, k) => new omnistepPlayer.Player(at("scene", k), run.scene, options));
players.forEach((player) => player.zoom(1.3));
window.showFrame = (k) => DATA.runs.forEach((run, i) => {
  players[i].show([run.states[k]]);
  at("outcome", i).textContent = k >= run.ends ? run.outcome : `${run.modes[k]}${(k / DATA.fps).toFixed(1)} s`;
});
"""


def shown(policy: str, folder: Path) -> dict:
    """Make a run, and return what the page shows of it."""
    log_file = folder / f"{policy}.mcap"
    scenario = omnistep.Scenario("hard_step", overrides={"duration_s": SECONDS + 0.5})
    outcome = omnistep.run(scenario, policy=policy, mcap=log_file).outcome
    log = omnistep.read_mcap(log_file)
    scene = log.scene()
    poses = _scene.poses(log, scene["frames"])
    pushes = _scene.pushes(log, scene, poses, scene["ground"])
    slip = log.trace.wheels("slip_ratio")
    rows = np.clip(np.searchsorted(log.trace["time_s"], log.frame_time_s - 1e-9), 0, len(log.trace) - 1)
    scene["ground"] += [
        {"kind": "box", "half_m": POST_HALF_M, "at_m": [x_m, 0.5, POST_HALF_M[2]], "turn_y_rad": 0.0}
        for x_m in POSTS_AT_M
    ]
    states, modes = [], []
    for time_s in np.arange(0, SECONDS, 1 / FPS):
        k = int(np.argmin(np.abs(log.frame_time_s - time_s)))
        wheels = [
            {"slip": float(s), "push": [push[:3].tolist(), push[3:].tolist()] if push[:3].any() else None}
            for s, push in zip(slip[rows[k]], pushes[k], strict=True)
        ]
        modes.append(_mode(log.trace, int(rows[k])))
        states.append({"poses": poses[k].tolist(), "wheels": wheels})
    climbed_s = _end_of_climb_s(log, outcome)
    return {
        "scene": scene | {"runs": [{"name": policy}], "metres_per_newton": 0.003},
        "states": states,
        "modes": modes,
        "outcome": f"climbed in {outcome.crossing_s:.1f} s" if outcome.climbed else "stalled",
        "ends": round((climbed_s if outcome.climbed else SECONDS - 1) * FPS),
    }


def _mode(trace: omnistep.Trace, row: int) -> str:
    """What traction control does besides driving."""
    if "traction_mode" not in trace:
        return ""
    mode, retry = (int(trace[name][row]) for name in ("traction_mode", "traction_retries"))
    return f"{MODES[mode]} {retry}, " if mode == 2 else f"{MODES[mode]}, " if mode in MODES else ""


def _end_of_climb_s(log: omnistep.Log, outcome: omnistep.Outcome) -> float:
    """When the last wheel is on top [s]: the crossing begins where the front wheels have come to the edge."""
    if not outcome.climbed:
        return float("inf")
    at_m = 0.7 - 0.3 - 0.066  # the edge, less the front row's place and the wheels' radius
    x = log.frames["base_link"][:, 0]
    return float(log.frame_time_s[np.argmax(x > at_m)]) + outcome.crossing_s


def main(out: Path) -> None:
    """Make the runs, draw them, join the pictures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        runs = [shown(policy, folder) for policy in RUNS]
        sections = "".join(SECTION % (k, title, k) for k, title in enumerate(RUNS.values()))
        data = json.dumps({"fps": FPS, "runs": runs}).replace("</", "<\\/")
        player = (files("omnistep") / "assets" / "player.js").read_text("utf-8")
        page = folder / "page.html"
        page.write_text(PAGE % (WIDTH, HEIGHT, sections, player, data, SCRIPT), "utf-8")
        frames = len(runs[0]["states"])
        drawn = [str(each) for each in (page, frames, WIDTH, HEIGHT * len(RUNS), folder)]
        subprocess.run(["node", str(ROOT / "scripts/docs/readme_film.mjs"), *drawn], check=True)
        pictures = [Image.open(folder / f"{k}.png").convert("RGB") for k in range(frames)]
        # One palette for all, or colours would shimmer.
        palette = pictures[frames // 2].quantize(COLOURS, dither=Image.Dither.NONE)
        flat = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
        last = 1500
        durations = [round(1000 / FPS)] * (frames - 1) + [last]
        flat[0].save(out, save_all=True, append_images=flat[1:], duration=durations, loop=0, optimize=False)
    size = out.stat().st_size
    print(f"{out}: {frames} pictures, {size} bytes")
    assert size < LIMIT_BYTES


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    default = ROOT / "docs" / "images" / "climb.gif"
    parser.add_argument("out", nargs="?", type=Path, default=default, help="docs/images/climb.gif by default")
    main(parser.parse_args().out)
