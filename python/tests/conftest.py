"""Shared runs: simulated once, read by many tests."""

import matplotlib
import pytest

import omnistep

matplotlib.use("Agg")


@pytest.fixture(scope="session")
def climb() -> omnistep.Trace:
    """The built-in step under `synchronised`."""
    return omnistep.run("step", policy="synchronised")
