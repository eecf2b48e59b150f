"""Shared runs: simulated once, read by many tests."""

import importlib.util
import os
import signal
from pathlib import Path

import matplotlib
import pytest

import omnistep

matplotlib.use("Agg")
# A shell that runs the tests in the background has them ignore Ctrl-C, and what they start inherits that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def climb() -> omnistep.Trace:
    """The built-in step under `scale_references`."""
    return omnistep.run("step", policy="scale_references")


@pytest.fixture(scope="session")
def general_climb() -> omnistep.Trace:
    """The same under `independent`, the paper's general controller."""
    return omnistep.run("step", policy="independent")


@pytest.fixture(scope="session")
def wheel_runs() -> list[omnistep.MotorBenchTrace]:
    """Section 3.3 under the law in the paper's words, and under (12) as printed."""
    return [omnistep.run_motor_bench("scale_references"), omnistep.run_motor_bench("scale_torques")]


def beside(name):
    """A module beside this."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def coverage():
    """Of how many seeds intervals are looked at, and between which shares of them the truth has to lie within.

    `make test-full` takes 200 (COVERAGE_SEEDS), of which 90 to 99 % pass for 95. Of 40, fewer than 34 are one case
    of 300.
    """
    seeds = int(os.environ.get("COVERAGE_SEEDS", "40"))
    return seeds, (0.90, 0.99) if seeds >= 200 else (0.85, 1.0)


@pytest.fixture(scope="session")
def recorded():
    """The module that makes a robot's log of a run."""
    return beside("recorded")


@pytest.fixture(scope="session")
def robots():
    """The module that has URDFs of robots."""
    return beside("urdf_robots")


@pytest.fixture(scope="session")
def hobby_plant():
    """The module that has robots with hobby bridges."""
    return beside("hobby_plant")


@pytest.fixture(scope="session")
def pose_plant():
    """The module that has a mecanum vehicle below motion capture."""
    return beside("pose_plant")


@pytest.fixture(scope="session")
def curve() -> omnistep.Trace:
    """Two seconds of a vehicle of three wheels in a curve."""
    return omnistep.run("flat", overrides={"duration_s": 2.0, "vehicle": "omni3", "command.wz_rad_s": 0.3})
