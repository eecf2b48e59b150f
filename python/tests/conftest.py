"""Shared runs: simulated once, read by many tests."""

import matplotlib
import pytest

import omnistep

matplotlib.use("Agg")


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
