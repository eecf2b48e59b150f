"""Control and simulation of omni-directional vehicles that climb steps.

>>> import omnistep
>>> trace = omnistep.run("step", policy="scale_references")
>>> trace.outcome.climbed
True
"""

import importlib

from omnistep._notebook import attach
from omnistep._omnistep import (
    ClimbLimits,
    CommandShaper,
    Controller,
    ControlSample,
    DcMotor,
    Desaturated,
    EncoderCounter,
    Estimator,
    Follow,
    HolonomicFollower,
    Kinematics,
    Layout,
    Log,
    MotorBenchTrace,
    MotorDuty,
    Observation,
    Odometry,
    Outcome,
    Pid,
    PidSample,
    Sample,
    Scenario,
    ShapedCommands,
    Simulation,
    Trace,
    Trajectory,
    TrajectoryPlanner,
    TrajectorySample,
    Vehicle,
    VelocityEstimator,
    Waypoint,
    Wheel,
    __version__,
    at_point,
    climb_limits,
    discretize,
    disturbed_ratio,
    from_point,
    list_policies,
    list_scenarios,
    list_vehicles,
    moved_by,
    reference_factor,
    run_motor_bench,
    shape_error,
    slip_ratio,
    speed_ratio_std,
    to_body,
    to_world,
    torque_duty,
    torque_factor,
    torque_range,
)
from omnistep.errors import (
    ConfigError,
    LogError,
    NoRouteError,
    OmnistepError,
    SimulationError,
    StudyError,
    VideoError,
)

TYPE_CHECKING = False  # to type checkers it is true; typing itself takes milliseconds to load
if TYPE_CHECKING:
    from omnistep import plot
    from omnistep._calibration_runs import CalibrationRun
    from omnistep._comparison import Comparison
    from omnistep._played import PlayerFrame
    from omnistep.calibration import Calibration, calibrate
    from omnistep.charts import ChartCell, ClimbChart, climb_chart
    from omnistep.ensembles import StudyResult, run_study, sweep
    from omnistep.identification import Identification, identify
    from omnistep.own_policy import Policy, PolicyInfo
    from omnistep.recordings import ImportedSignal, ImportSummary, import_log
    from omnistep.resimulation import Difference, Resimulation, resimulate
    from omnistep.routes import Crossing, Route, RoutePoint, plan_route
    from omnistep.runs import compare, read_mcap, run
    from omnistep.tuning import TuneResult, tune

attach()
del attach

#: Modules that are loaded when one of these names, or the module itself, is first used. NumPy is loaded by them, too:
#: the console script needs none of it for most commands.
_LATER = {
    "_calibration_runs": "CalibrationRun",
    "_comparison": "Comparison",
    "_played": "PlayerFrame",
    "calibration": "Calibration calibrate",
    "charts": "ChartCell ClimbChart climb_chart",
    "ensembles": "StudyResult run_study sweep",
    "identification": "Identification identify",
    "own_policy": "Policy PolicyInfo",
    "recordings": "ImportedSignal ImportSummary import_log",
    "resimulation": "Difference Resimulation resimulate",
    "routes": "Crossing Route RoutePoint plan_route",
    "runs": "compare read_mcap run",
    "tuning": "TuneResult tune",
    "plot": "",
}

if not TYPE_CHECKING:  # a type checker would take any name for one of the package

    def __getattr__(name: str) -> object:
        """Load a module when it is first used (PEP 562)."""
        for module, names in _LATER.items():
            if name in (module, *names.split()):
                loaded = importlib.import_module(f"omnistep.{module}")
                return globals().setdefault(name, loaded if name == module else getattr(loaded, name))
        raise AttributeError(f"module 'omnistep' has no attribute {name!r}")

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})


__all__ = [
    "Calibration",
    "CalibrationRun",
    "ChartCell",
    "ClimbChart",
    "ClimbLimits",
    "CommandShaper",
    "Comparison",
    "ConfigError",
    "ControlSample",
    "Controller",
    "Crossing",
    "DcMotor",
    "Desaturated",
    "Difference",
    "EncoderCounter",
    "Estimator",
    "Follow",
    "HolonomicFollower",
    "Identification",
    "ImportSummary",
    "ImportedSignal",
    "Kinematics",
    "Layout",
    "Log",
    "LogError",
    "MotorBenchTrace",
    "MotorDuty",
    "NoRouteError",
    "Observation",
    "Odometry",
    "OmnistepError",
    "Outcome",
    "Pid",
    "PidSample",
    "PlayerFrame",
    "Policy",
    "PolicyInfo",
    "Resimulation",
    "Route",
    "RoutePoint",
    "Sample",
    "Scenario",
    "ShapedCommands",
    "Simulation",
    "SimulationError",
    "StudyError",
    "StudyResult",
    "Trace",
    "Trajectory",
    "TrajectoryPlanner",
    "TrajectorySample",
    "TuneResult",
    "Vehicle",
    "VelocityEstimator",
    "VideoError",
    "Waypoint",
    "Wheel",
    "__version__",
    "at_point",
    "calibrate",
    "climb_chart",
    "climb_limits",
    "compare",
    "discretize",
    "disturbed_ratio",
    "from_point",
    "identify",
    "import_log",
    "list_policies",
    "list_scenarios",
    "list_vehicles",
    "moved_by",
    "plan_route",
    "plot",
    "read_mcap",
    "reference_factor",
    "resimulate",
    "run",
    "run_motor_bench",
    "run_study",
    "shape_error",
    "slip_ratio",
    "speed_ratio_std",
    "sweep",
    "to_body",
    "to_world",
    "torque_duty",
    "torque_factor",
    "torque_range",
    "tune",
]
