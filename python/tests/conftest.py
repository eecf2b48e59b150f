"""Shared runs: simulated once, read by many tests."""

import signal

import matplotlib
import pytest

import omnistep

matplotlib.use("Agg")
# A shell that runs the tests in the background has them ignore Ctrl-C, and what they start inherits that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def climb() -> omnistep.Trace:
    """The built-in step under `synchronised`."""
    return omnistep.run("step", policy="synchronised")


@pytest.fixture(scope="session")
def general_climb() -> omnistep.Trace:
    """The same under `independent`, the paper's general controller."""
    return omnistep.run("step", policy="independent")


@pytest.fixture(scope="session")
def wheel_runs() -> list[omnistep.WheelsTrace]:
    """Section 3.3 under the law in the paper's words, and under (12) as printed."""
    return [omnistep.wheels("synchronised"), omnistep.wheels("paper")]
