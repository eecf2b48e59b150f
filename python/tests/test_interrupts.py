"""Ctrl-C ends long calls, and progress is visible."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import omnistep
import omnistep.gym
from omnistep import _omnistep


@pytest.fixture(autouse=True)
def interrupts():
    """Python's own answer to Ctrl-C, also where the tests run in the background and it was switched off."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "flat.mcap"
    omnistep.run("flat", overrides={"duration_s": 10.0}, mcap=path)
    return path


def environments():
    envs = omnistep.gym.DriveVectorEnv(200, frame_skip=1000, threads=1)
    envs.reset(seed=0)
    for _ in range(4):
        envs.step(np.zeros(envs.action_space.shape, np.float32))


HOUR = {"duration_s": 3600.0}
LONG = {
    "run": lambda folder: omnistep.run("flat", overrides=HOUR, mcap=folder / "x.mcap"),
    "run on rollers": lambda folder: omnistep.run("flat", overrides={**HOUR, "physics.wheel_model": "rollers"}),
    "compare": lambda folder: omnistep.compare("flat", overrides=HOUR),
    "controller": lambda folder: omnistep.Controller("flat", policy="scale_references").step(
        [0.3, 0.0, 0.0], np.zeros((20_000_000, 7))
    ),
    "pid": lambda folder: omnistep.Pid(kp_n_m_s_rad=1.0, period_s=0.1).step(1.0, np.zeros(100_000_000)),
    "environments": lambda folder: environments(),
}


@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_stops_a_call_within_a_fraction_of_a_second_and_leaves_nothing(name, tmp_path):
    pressed = []

    def press():
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.5, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        LONG[name](tmp_path)
    # A look is due every few milliseconds, on rollers every tenth of a second (benches/python.py measures it); two
    # seconds allow for a busy machine, and the call would have gone on for much longer.
    assert time.monotonic() - pressed[0] < 2.0
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_stops_the_reading_of_a_log_at_the_next_look(log):
    parts = []

    def press(part):
        parts.append(part)
        if len(parts) == 2:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        _omnistep.read_mcap(log, on_progress=press)
    assert len(parts) == 2 and parts[1] < 0.5


@pytest.mark.parametrize("call", ["run", "read"])
def test_progress_of_a_call_grows_from_0_to_1(call, log):
    parts = []
    if call == "run":
        _omnistep.run("flat", overrides={"duration_s": 0.64}, on_progress=parts.append)
        assert parts == pytest.approx(np.arange(1, 11) / 10, abs=1e-9)  # every 64 of 640 control periods
    else:
        _omnistep.read_mcap(log, on_progress=parts.append)
        assert len(parts) > 4 and parts[-1] == 1.0
    assert parts == sorted(parts) and 0.0 < parts[0] <= 1.0


def test_what_a_watcher_raises_ends_the_call_and_comes_out(log):
    def refuse(part):
        raise LookupError(part)

    for call in (
        lambda: _omnistep.run("flat", on_progress=refuse),
        lambda: _omnistep.read_mcap(log, on_progress=refuse),
    ):
        with pytest.raises(LookupError):
            call()


def test_a_bar_is_shown_for_long_calls_unless_switched_off(capsys, monkeypatch):
    monkeypatch.setattr("omnistep._progress.SHORT_S", 0.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    omnistep.run("flat", overrides={"duration_s": 0.5})
    assert "run:" in capsys.readouterr().err
    omnistep.run("flat", overrides={"duration_s": 0.5}, progress=False)
    monkeypatch.setattr("omnistep._progress.SHORT_S", 1.0)
    omnistep.run("flat", overrides={"duration_s": 0.1})  # over within a second
    monkeypatch.undo()
    monkeypatch.setattr("omnistep._progress.SHORT_S", 0.0)
    omnistep.run("flat", overrides={"duration_s": 0.5})  # into a file or a pipe
    assert capsys.readouterr().err == ""
