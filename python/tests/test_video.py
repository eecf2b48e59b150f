"""Videos by Rerun, and its own check of logs: with ``pip install ".[view]"``, in ``make test-full``."""

import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import omnistep
from omnistep import video
from omnistep.__main__ import main

pytest.importorskip("rerun", reason="Rerun is an extra: make test-full installs it")
iio = pytest.importorskip("imageio.v3", reason="videos are an extra: make test-full installs it")
pytestmark = pytest.mark.filterwarnings("default")  # of programs that are not ours


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "step.mcap"
    omnistep.run("step", overrides={"duration_s": 2.5}, mcap=path)
    return path


@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_a_video_has_a_picture_a_moment_and_the_vehicle_moves_and_no_viewer_stays(log, tmp_path, ending, monkeypatch):
    started = []

    class Recorded(subprocess.Popen):
        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)
            started.append((self.pid, kwargs.get("start_new_session", False)))

    monkeypatch.setattr(video.subprocess, "Popen", Recorded)
    out = tmp_path / f"climb.{ending}"
    video.write(log, out, fps=2.0)
    monkeypatch.undo()
    pictures = np.asarray(iio.imread(out))
    assert pictures.shape[0] == 5 and pictures.shape[1] > 500 and pictures.shape[2] > 1000
    # The vehicle is some hundredths of the picture, and goes ahead by its length.
    changed = np.abs(pictures[-1].astype(int) - pictures[0].astype(int)).max(axis=2) > 30
    assert 0.005 < changed.mean() < 0.3
    # The viewer is a script that starts another program: both are in a session of their own, and nothing else is.
    (session,) = [pid for pid, own_session in started if own_session]
    late = time.monotonic() + 10.0
    while (alive := alive_in(session)) and time.monotonic() < late:
        time.sleep(0.1)
    assert alive == []


def alive_in(session):
    """Lines of ps about processes of a session that have not ended."""
    shown = subprocess.run(["ps", "-s", str(session), "-o", "stat=,args="], capture_output=True, text=True, check=False)
    return [line for line in shown.stdout.splitlines() if not line.startswith("Z")]


def test_a_picture_is_of_its_moment(log, tmp_path):
    for at in (0.5, 0.5, 2.0):
        video.write(log, tmp_path / "x.png", at_s=at)
        shutil.move(tmp_path / "x.png", tmp_path / f"{len(list(tmp_path.iterdir()))}.png")
    first, again, later = (iio.imread(tmp_path / f"{k}.png")[:, :, :3].astype(int) for k in (1, 2, 3))
    assert np.abs(again - first).max() <= 30
    assert (np.abs(later - first).max(axis=2) > 30).mean() > 0.005


VIEWER = """#!{python}
import sys, time
time.sleep({after})
said = "thread 'main' panicked at 'Failed to get render context'", "stack backtrace:", "Report bugs: https://example.org"
print(*said, sep="\\n", file=sys.stderr)
sys.exit(102)
"""


@pytest.mark.parametrize("ending", ["before it answers", "after it answered", "while a picture is made"])
def test_a_viewer_that_cannot_draw_is_one_line_and_exit_code_1_whenever_it_ends(
    log, tmp_path, ending, monkeypatch, capsys
):
    program = tmp_path / "rerun"
    program.write_text(VIEWER.format(python=sys.executable, after=0.0 if ending == "before it answers" else 1.5))
    program.chmod(0o755)
    monkeypatch.setattr(video.shutil, "which", lambda *_, **__: str(program))

    class Client:
        def get_state(self):
            if ending == "before it answers":
                raise ConnectionError("connection refused")

    def shots(*_):
        with video._viewer():
            # What Rerun's client and its recording raise of a viewer that goes.
            raise {"after it answered": RuntimeError, "while a picture is made": ConnectionError}[ending](
                "transport error"
            )
            yield

    client = type("ViewerClient", (), {"connect": staticmethod(lambda _: Client())})
    monkeypatch.setattr(video, "_extra", lambda _: type("Module", (), {"ViewerClient": client}))
    monkeypatch.setattr(video, "_shots", shots)
    monkeypatch.setattr(sys, "argv", ["omnistep", "video", str(log), "-o", str(tmp_path / "x.png")])
    assert main() == 1
    said = capsys.readouterr().err
    assert (
        said.count("\n") == 1 and "mesa-vulkan-drivers" in said and said.startswith("error: Rerun's viewer has nothing")
    )
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize(("vehicle", "at_s"), [("chugo7", None), ("omni3", None), ("mecanum4", 0.4)])
def test_the_eye_of_a_picture_holds_the_vehicle_and_little_else(tmp_path, vehicle, at_s):
    omnistep.run("flat", overrides={"duration_s": 0.8, "vehicle": vehicle}, mcap=tmp_path / "x.mcap")
    log = omnistep.read_mcap(tmp_path / "x.mcap")
    times = log.frame_time_s
    moments = [float(times[len(times) // 2]) if at_s is None else at_s]
    position, target = video._eye(log, moments)
    row = int(np.searchsorted(times, moments[0]))
    away = (position - target) / np.linalg.norm(position - target)
    across = np.cross([0.0, 0.0, 1.0], away) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], away))
    shown = []
    for poses in log.frames.values():
        way = poses[row, :3] - position
        shown.append(abs(way @ across) / -(way @ away) / (1.7 * np.tan(np.deg2rad(55.0) / 2.0)))
    # Centres of wheels from edge to edge of a quarter to all of half the width; rims are further out.
    assert 0.25 < max(shown) < 1.0


@pytest.mark.parametrize("scenario", omnistep.list_scenarios())
def test_rerun_accepts_the_log_of_every_scenario(scenario, tmp_path):
    omnistep.run(scenario, overrides={"duration_s": 1.0}, mcap=tmp_path / "x.mcap")
    program = shutil.which("rerun", path=str(Path(sys.executable).parent))
    said = subprocess.run(
        [program, "mcap", "check", str(tmp_path / "x.mcap")], capture_output=True, text=True, check=False
    )
    assert said.returncode == 0, said.stderr
    lines = [line for line in said.stdout.splitlines() if line.startswith("ok")]
    assert len(lines) == 8, said.stdout
