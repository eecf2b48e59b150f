"""Control and simulation of omni-directional vehicles that climb steps.

>>> import omnistep
>>> trace = omnistep.run("step", policy="synchronised")
>>> trace.outcome.climbed
True
"""

from collections.abc import Iterable, Mapping
from os import PathLike
from typing import Any

from omnistep import plot
from omnistep._omnistep import (
    Desaturated,
    Kinematics,
    Layout,
    Log,
    Outcome,
    Sample,
    Simulation,
    Trace,
    Wheel,
    WheelsTrace,
    __version__,
    discretize,
    moved_by,
    policies,
    read_mcap,
    run,
    scenarios,
    vehicles,
    wheels,
)
from omnistep.ensembles import StudyResult, study, sweep
from omnistep.errors import ConfigError, FilmError, LogError, OmnistepError, SimulationError, StudyError
from omnistep.tuning import TuneResult, tune

__all__ = [
    "ConfigError",
    "Desaturated",
    "FilmError",
    "Kinematics",
    "Layout",
    "Log",
    "LogError",
    "OmnistepError",
    "Outcome",
    "Sample",
    "Simulation",
    "SimulationError",
    "StudyError",
    "StudyResult",
    "Trace",
    "TuneResult",
    "Wheel",
    "WheelsTrace",
    "__version__",
    "compare",
    "discretize",
    "moved_by",
    "plot",
    "policies",
    "read_mcap",
    "run",
    "scenarios",
    "study",
    "sweep",
    "tune",
    "vehicles",
    "wheels",
]


def compare(
    scenario: str | PathLike[str] = "step",
    *,
    policies: Iterable[str] | None = None,
    overrides: Mapping[str, Any] | None = None,
    seed: int | None = None,
) -> dict[str, Trace]:
    """Run a scenario under several coordination policies.

    Args:
        scenario: a built-in name or the path of a .toml file.
        policies: names of policies; all of them by default.
        overrides: keys to replace, as in :func:`run`.
        seed: seed of the scenario's perturbation.

    Returns:
        The trace of each policy by name, in the order given.

    Raises:
        ConfigError: a name, key or value is wrong.
        TypeError: ``policies`` is one string.
        SimulationError: the physics left the finite numbers.
    """
    if isinstance(policies, str):
        raise TypeError(f"policies: the string {policies!r}, allowed: a list of names")
    names = list(policies) if policies is not None else _all_policies()
    return {name: run(scenario, policy=name, overrides=overrides, seed=seed) for name in names}


_all_policies = policies
