"""Films by Rerun, and its own check of logs: with ``pip install ".[view]"``, in ``make test-full``."""

import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import omnistep
from omnistep import film

pytest.importorskip("rerun", reason="Rerun is an extra: make test-full installs it")
iio = pytest.importorskip("imageio.v3", reason="films are an extra: make test-full installs it")
pytestmark = pytest.mark.filterwarnings("default")  # of programs that are not ours


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "step.mcap"
    omnistep.run("step", overrides={"duration_s": 2.5}, mcap=path)
    return path


@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_a_film_has_a_picture_a_moment_and_the_vehicle_moves_and_no_viewer_stays(log, tmp_path, ending, monkeypatch):
    started = []

    class Recorded(subprocess.Popen):
        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)
            started.append((self.pid, kwargs.get("start_new_session", False)))

    monkeypatch.setattr(film.subprocess, "Popen", Recorded)
    out = tmp_path / f"climb.{ending}"
    film.film(log, out, fps=2.0)
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
        film.film(log, tmp_path / "x.png", at_s=at)
        shutil.move(tmp_path / "x.png", tmp_path / f"{len(list(tmp_path.iterdir()))}.png")
    first, again, later = (iio.imread(tmp_path / f"{k}.png")[:, :, :3].astype(int) for k in (1, 2, 3))
    assert np.abs(again - first).max() <= 30
    assert (np.abs(later - first).max(axis=2) > 30).mean() > 0.005


@pytest.mark.parametrize("scenario", omnistep.scenarios())
def test_rerun_accepts_the_log_of_every_scenario(scenario, tmp_path):
    omnistep.run(scenario, overrides={"duration_s": 1.0}, mcap=tmp_path / "x.mcap")
    program = shutil.which("rerun", path=str(Path(sys.executable).parent))
    said = subprocess.run(
        [program, "mcap", "check", str(tmp_path / "x.mcap")], capture_output=True, text=True, check=False
    )
    assert said.returncode == 0, said.stderr
    lines = [line for line in said.stdout.splitlines() if line.startswith("ok")]
    assert len(lines) == 8, said.stdout
