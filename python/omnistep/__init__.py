"""Control and simulation of omni-directional vehicles that climb steps.

>>> import omnistep
>>> trace = omnistep.run("step", policy="synchronised")
>>> trace.outcome.climbed
True
"""

from omnistep import plot
from omnistep._omnistep import (
    Controller,
    ControlSample,
    Desaturated,
    Kinematics,
    Layout,
    Log,
    Observation,
    Odometry,
    Outcome,
    Pid,
    PidSample,
    Sample,
    Scenario,
    Simulation,
    Trace,
    Vehicle,
    Wheel,
    WheelsTrace,
    __version__,
    discretize,
    moved_by,
    policies,
    scenarios,
    vehicles,
    wheels,
)
from omnistep.ensembles import StudyResult, study, sweep
from omnistep.errors import ConfigError, FilmError, LogError, OmnistepError, SimulationError, StudyError
from omnistep.own_policy import Policy, PolicyInfo
from omnistep.runs import compare, read_mcap, run
from omnistep.tuning import TuneResult, tune

__all__ = [
    "ConfigError",
    "ControlSample",
    "Controller",
    "Desaturated",
    "FilmError",
    "Kinematics",
    "Layout",
    "Log",
    "LogError",
    "Observation",
    "Odometry",
    "OmnistepError",
    "Outcome",
    "Pid",
    "PidSample",
    "Policy",
    "PolicyInfo",
    "Sample",
    "Scenario",
    "Simulation",
    "SimulationError",
    "StudyError",
    "StudyResult",
    "Trace",
    "TuneResult",
    "Vehicle",
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
