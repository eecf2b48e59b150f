"""The compiled part of omnistep."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from omnistep._played import PlayerFrame
from omnistep.own_policy import Packed, PolicyLike

_Floats: TypeAlias = NDArray[np.float64]
_Bools: TypeAlias = NDArray[np.bool_]
_Integers: TypeAlias = NDArray[np.int64]
_Row: TypeAlias = Sequence[float] | NDArray[np.floating[Any] | np.integer[Any]]
_Rows: TypeAlias = _Row | Sequence[_Row]
_Array: TypeAlias = _Rows | Sequence[_Rows]

__all__ = [
    "ChartRuns",
    "ClimbLimits",
    "CommandShaper",
    "ControlSample",
    "Controller",
    "DcMotor",
    "Desaturated",
    "EncoderCounter",
    "Episodes",
    "Estimator",
    "Follow",
    "HolonomicFollower",
    "Kinematics",
    "Layout",
    "Log",
    "MotorBenchTrace",
    "MotorDuty",
    "Observation",
    "Odometry",
    "Outcome",
    "Pid",
    "PidSample",
    "Plan",
    "Rows",
    "Sample",
    "Scenario",
    "ShapedCommands",
    "Simulation",
    "Store",
    "Trace",
    "Trajectory",
    "TrajectoryPlanner",
    "TrajectorySample",
    "Vehicle",
    "VelocityEstimator",
    "Waypoint",
    "Wheel",
    "__version__",
    "at_point",
    "cli",
    "climb_limits",
    "compute_batch",
    "damage",
    "did_you_mean_file",
    "discretize",
    "disturbed_ratio",
    "drive_route",
    "from_point",
    "list_policies",
    "list_scenarios",
    "list_vehicles",
    "mean_interval",
    "metrics",
    "moved_by",
    "plan_route",
    "policy_name",
    "read_mcap",
    "recover",
    "reference_factor",
    "run",
    "run_external",
    "run_motor_bench",
    "shape_error",
    "shortened",
    "slip_ratio",
    "speed_ratio_std",
    "to_body",
    "to_world",
    "torque_duty",
    "torque_factor",
    "torque_range",
    "wilson",
    "write_recording",
]

__version__: str

def run(
    scenario: str | PathLike[str] | Scenario = ...,
    *,
    policy: PolicyLike | None = None,
    overrides: Mapping[str, Any] | None = None,
    seed: int | None = None,
    mcap: str | PathLike[str] | None = None,
    on_progress: Callable[[float], object] | None = None,
) -> Trace:
    """Run a scenario from start to end: :func:`omnistep.run` without a progress bar.

    Args:
        scenario: a built-in name, a path or a :class:`Scenario`.
        policy: as in :func:`omnistep.run`.
        overrides: as in :func:`omnistep.run`.
        seed: as in :func:`omnistep.run`.
        mcap: as in :func:`omnistep.run`.
        on_progress: called with the completed part, 0 to 1, every few milliseconds; an exception in it ends the run.
    """

def run_external(
    physics: object,
    scenario: str | PathLike[str] | Scenario,
    *,
    policy: PolicyLike | None = None,
    on_progress: Callable[[float], object] | None = None,
) -> Trace:
    """Run a scenario from start to end on a physics engine that Python steps, for :func:`omnistep.mujoco.run`.

    Args:
        physics: an object with ``start(x_m, yaw_rad)``; ``step(torques_n_m, dampers_n_m_s_rad, holds_n_m)``, which
            returns angles and rates of the axles, (2N,), and contacts, (C, 10): wheel, force, normal, position; and
            ``observe()``, which returns (5 + 13 B + 2 H + 6 N,): kinetic and potential energy, momentum; for each body
            position, quaternion x, y, z, w, velocity and rate; for each hinge angle and rate; for each wheel position
            and velocity of its centre. ``FloatingPointError`` means that the state is not finite.
        scenario: a built-in name, a path or a :class:`Scenario`.
        policy: as in :func:`omnistep.run`.
        on_progress: called with the completed part, 0 to 1, every few milliseconds; an exception in it ends the run.
    """

def run_motor_bench(
    policy: str = "scale_references",
    *,
    overrides: Mapping[str, Any] | None = None,
    experiment: str | PathLike[str] = ...,
) -> MotorBenchTrace:
    """Run section 3.3 of the paper: three motors on dampers, torque limited by eq. (13).

    Args:
        policy: ``independent``, ``scale_torques`` or ``scale_references``.
        overrides: keys of the experiment and their new values: ``{"friction_n_m_s_rad": 2e-4}``.
        experiment: the built-in ``motor_bench``, the default, or the path of a .toml file.

    Returns:
        One row every 0.1 s, or every control period if that is longer.

    Raises:
        ConfigError: a name, key or value is wrong.

    Example:
        >>> import omnistep
        >>> trace = omnistep.run_motor_bench("scale_references")
        >>> trace.speed_rpm.shape, float(trace.t_s[-1])
        ((651, 3), 65.0)
    """

def climb_limits(
    scenario: str | PathLike[str] | Scenario = ..., *, overrides: Mapping[str, Any] | None = None
) -> ClimbLimits:
    """Least torque and run-up for the step of a scenario, from the balance of forces, without a simulation.

    The torque is the stall torque of the scenario's motors. The speed is the fastest forward command, and every row of
    wheels is assumed to meet the edge at this speed. docs/derivations.md, Minimum torque and run-up of a climb, lists
    the assumptions.

    Args:
        scenario: a built-in name (see :func:`list_scenarios`), the path of a .toml file or a :class:`Scenario`; the
            step by default.
        overrides: keys to replace, as in :func:`omnistep.run`.

    Returns:
        Torque and run-up that each row of wheels needs, and whether the vehicle reaches them.

    Raises:
        ConfigError: a name, key or value is wrong; the ground is not a plain step with one friction, met head-on; or
            the vehicle is not two frames on one transverse hinge with three rows of wheels.

    Example:
        >>> import omnistep
        >>> limits = omnistep.climb_limits("step", overrides={"vehicle.motor.stall_torque_n_m": 1.4})
        >>> limits.least_torque_n_m.round(1)  # the rear row climbs with a run-up or not at all
        array([1.3, 2.5, inf])
        >>> limits.verdicts, limits.possible, limits.decisive
        (['torque', 'run_up', 'run_up'], True, 'middle')
    """

def list_policies() -> list[str]:
    """Names of the coordination policies.

    Example:
        >>> import omnistep
        >>> omnistep.list_policies()
        ['independent', 'scale_torques', 'scale_references', 'shared_integral', 'traction_runup', 'traction']
    """

def list_scenarios() -> list[str]:
    """Names of the built-in scenarios.

    Example:
        >>> import omnistep
        >>> "step" in omnistep.list_scenarios()
        True
    """

def list_vehicles() -> list[str]:
    """Names of the built-in vehicles.

    Example:
        >>> import omnistep
        >>> omnistep.list_vehicles()
        ['chugo7', 'omni3', 'mecanum4', 'rocker_bogie6']
    """

def cli(argv: Sequence[str]) -> int:
    """Run the command line ``argv`` (the program's name first); return the exit code."""

def discretize(twists: _Rows, *, dt_s: float) -> _Floats:
    """Twists that, held for a period, reach the end of a straight line along the given twists.

    A vehicle that turns while it moves drifts off the commanded line. This function corrects commands that are held for
    a period.

    Args:
        twists: body twists (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3).
        dt_s: the period [s], above 0. The turn within it should stay below one revolution.

    Returns:
        Body twists in the shape of ``twists``; wz is kept.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.

    Example:
        >>> import math, omnistep
        >>> held = omnistep.discretize([1.0, 0.0, math.pi], dt_s=0.5)  # a quarter of a turn while going straight ahead
        >>> end = omnistep.moved_by([0.0, 0.0, 0.0], 0.5 * held)
        >>> end.round(9).tolist()
        [0.5, 0.0, 1.570796327]
    """

def at_point(twists: _Rows, point_m: _Row, /) -> _Floats:
    """Twists of a point of the body: its velocity along the body's axes, and the yaw rate.

    Args:
        twists: body twists of the origin (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3).
        point_m: the point (x forward, y left) from the origin [m], (2,).

    Returns:
        Twists in the shape of ``twists``.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> omnistep.at_point([0.1, 0.0, 2.0], [0.5, 0.0]).tolist()  # half a metre ahead: swings to the left
        [0.1, 1.0, 2.0]
    """

def from_point(twists: _Rows, point_m: _Row, /) -> _Floats:
    """Twists of the origin from the twists of a point of the body: commands for another centre of rotation.

    Undoes :func:`at_point`.

    Args:
        twists: twists of the point, along the body's axes (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3).
        point_m: the point (x forward, y left) from the origin [m], (2,).

    Returns:
        Body twists in the shape of ``twists``.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> omnistep.from_point([0.0, 0.0, 2.0], [0.5, 0.0]).tolist()  # turn about a point ahead, which stands still
        [0.0, -1.0, 2.0]
    """

def to_world(twists: _Rows, yaw_rad: float | _Row, /) -> _Floats:
    """Body twists along the world's axes, for a vehicle with this yaw: field-oriented from robot-oriented.

    Args:
        twists: body twists (vx [m/s] forward, vy [m/s] left, wz [rad/s]), (3,) or (T, 3).
        yaw_rad: heading [rad], counter-clockwise from the world's x, a number or (T,).

    Returns:
        Twists (vx along the world's x, vy along its y, wz) in the shape of ``twists``.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.

    Example:
        >>> import math, omnistep
        >>> omnistep.to_world([0.3, 0.1, 0.5], math.pi / 2).round(9).tolist()  # facing left
        [-0.1, 0.3, 0.5]
    """

def to_body(twists: _Rows, yaw_rad: float | _Row, /) -> _Floats:
    """Twists along the world's axes as body twists: commands for a vehicle with this yaw.

    Undoes :func:`to_world`.

    Args:
        twists: twists (vx [m/s] along the world's x, vy [m/s] along its y, wz [rad/s]), (3,) or (T, 3).
        yaw_rad: heading [rad], counter-clockwise from the world's x, a number or (T,).

    Returns:
        Body twists in the shape of ``twists``.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.

    Example:
        >>> import math, omnistep
        >>> omnistep.to_body([0.0, 0.3, 0.0], math.pi / 2).round(9).tolist()  # along the world's y, facing there
        [0.3, 0.0, 0.0]
    """

def disturbed_ratio(
    reference_rad_s: float | _Row, velocity_rad_s: float | _Row, *, floor_rad_s: float = 0.1, literal: bool = False
) -> _Floats:
    """Relative speed error of wheels: eq. (14) of the paper, in a form that is defined at rest.

    ``(reference - velocity) / max(|reference|, |velocity|, floor)``, with the sign inverted if the reference is below 0
    (the velocity, if the reference is 0): positive if the wheel lags, forwards and backwards; within -2 to 2.

    Args:
        reference_rad_s: reference [rad/s], a number or (T,).
        velocity_rad_s: measured velocity [rad/s], likewise.
        floor_rad_s: speed [rad/s] under which a difference counts as noise, above 0.
        literal: eq. (14) as printed, over the velocity: infinite or not a number at rest.

    Returns:
        Ratios [-], () or (T,).

    Raises:
        ConfigError: the lengths differ, or the floor is not above 0.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> omnistep.disturbed_ratio([10.0, -10.0, 0.0], [8.0, -8.0, 0.0]).tolist()
        [0.2, 0.2, 0.0]
        >>> omnistep.disturbed_ratio(10.0, 8.0, literal=True).item()
        0.25
    """

def slip_ratio(
    rim_m_s: float | _Row, along_m_s: float | _Row, *, floor_m_s: float = 0.01, literal: bool = False
) -> _Floats:
    """How far wheels slip: eq. (15) of the paper, in a form that is defined at rest.

    ``(rim - along) / max(|rim|, |along|, floor)``, with the other sign where the rim's speed is below 0
    (``along``, where the rim's is 0): positive where the wheel spins faster than it moves, forwards and backwards;
    within -2 to 2.

    Args:
        rim_m_s: radius times the wheel's velocity against the world [m/s], a number or (T,).
        along_m_s: velocity of the wheel's centre along the push [m/s], likewise.
        floor_m_s: speed [m/s] under which a difference counts as noise, above 0.
        literal: eq. (15) as printed, over the rim's speed: infinite or not a number at rest.

    Returns:
        Ratios [-], () or (T,).

    Raises:
        ConfigError: the lengths differ, or the floor is not above 0.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> omnistep.slip_ratio([0.5, -0.5, 0.3], [0.375, -0.375, 0.0]).tolist()  # the last spins on the spot
        [0.25, 0.25, 1.0]
    """

def shape_error(reference_rad_s: _Rows, velocity_rad_s: _Rows, /) -> _Floats:
    """The part of the wheels' velocities that no common factor on the references explains.

    Args:
        reference_rad_s: references [rad/s], (N,) or (T, N) of 3 to 8 wheels.
        velocity_rad_s: measured velocities [rad/s], in that shape, or (N,).

    Returns:
        Velocities [rad/s] in the shape of the references; zero where all wheels slow down together.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> omnistep.shape_error([4.0, -4.0, 0.0], [3.0, -1.0, 0.0]).tolist()
        [1.0, 1.0, 0.0]
    """

def speed_ratio_std(reference_rad_s: _Rows, velocity_rad_s: _Rows, *, floor_rad_s: float = 0.1) -> _Floats:
    """Standard deviation of velocity over reference, over the wheels that have a reference: 0 if they keep together.

    Args:
        reference_rad_s: references [rad/s], (N,) or (T, N) of 3 to 8 wheels.
        velocity_rad_s: measured velocities [rad/s], in that shape, or (N,).
        floor_rad_s: wheels with a smaller reference [rad/s] are ignored; above 0.

    Returns:
        Standard deviations [-], () or (T,).

    Raises:
        ConfigError: a shape is wrong, a number is not finite, or the floor is not above 0.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> omnistep.speed_ratio_std([4.0, -4.0, 0.0], [4.0, -2.0, 0.3]).item()
        0.25
    """

def torque_range(
    velocity_rad_s: float | _Row, *, stall_torque_n_m: float, slope_n_m_s_rad: float = 0.0
) -> tuple[_Floats, _Floats]:
    """Torque range of a motor at a velocity, eq. (13) of the paper: a line that falls with the speed.

    Args:
        velocity_rad_s: velocity of the actuator [rad/s], a number or (T,).
        stall_torque_n_m: torque at rest [N.m], above 0.
        slope_n_m_s_rad: torque lost per speed [N.m per rad/s], 0 or more; 0 is a constant limit.

    Returns:
        Lowest (0 or less) and highest (0 or more) torque [N.m], each () or (T,).

    Raises:
        ConfigError: a torque or slope is out of range.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> lower, upper = omnistep.torque_range([0.0, 10.0], stall_torque_n_m=2.0, slope_n_m_s_rad=0.1)
        >>> upper.tolist()
        [2.0, 1.0]
    """

def torque_factor(requested_n_m: _Rows, *, lower_n_m: _Rows, upper_n_m: _Rows) -> _Floats:
    """The common factor of eqs. (11) and (12) of the paper: the largest that brings every torque within its limits.

    Args:
        requested_n_m: requested torques [N.m], (N,) or (T, N) of 3 to 8 wheels.
        lower_n_m: lowest torques [N.m], each 0 or less, in that shape, or (N,).
        upper_n_m: highest torques [N.m], each 0 or more, in that shape, or (N,).

    Returns:
        Factors, 0 to 1, () or (T,).

    Raises:
        ConfigError: a shape is wrong, a number is not finite, or a range lacks 0.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> limits = {"lower_n_m": [-0.2, -0.2, -0.2], "upper_n_m": [0.2, 0.2, 0.2]}
        >>> omnistep.torque_factor([0.1, -0.4, 0.2], **limits).item()
        0.5
    """

def reference_factor(
    requested_n_m: _Rows, slopes_n_m: _Rows, *, lower_n_m: _Rows, upper_n_m: _Rows, floor: float = 0.0
) -> _Floats:
    """The common factor on the references of ``scale_references``: the largest with which no torque meets its limit.

    Args:
        requested_n_m: torques for the whole references [N.m], (N,) or (T, N) of 3 to 8 wheels.
        slopes_n_m: the part of these that is proportional to the reference [N.m], in that shape, or (N,).
        lower_n_m: lowest torques [N.m], each 0 or less, in that shape, or (N,).
        upper_n_m: highest torques [N.m], each 0 or more, in that shape, or (N,).
        floor: the smallest factor, 0 to 1.

    Returns:
        Factors, ``floor`` to 1, () or (T,).

    Raises:
        ConfigError: a shape is wrong, a number is not finite, a range lacks 0, or the floor is out of range.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> limits = {"lower_n_m": [-1.0, -1.0, -1.0], "upper_n_m": [1.0, 1.0, 1.0]}
        >>> omnistep.reference_factor([2.5, -0.2, 0.0], [3.0, -0.4, 0.0], **limits).item()
        0.5
    """

def moved_by(poses: _Rows, displacements: _Rows, /) -> _Floats:
    """Poses after displacements, exact for twists that stayed constant: the vehicle moves along an arc.

    Args:
        poses: poses in the world (x [m], y [m], yaw [rad]), (3,) or (T, 3).
        displacements: twists times the time they were held (forward [m], left [m], turn [rad]), in the shape of
            ``poses``.

    Returns:
        Poses in the shape of ``poses``; the yaw is added up, not wrapped.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.

    Example:
        >>> import math, omnistep
        >>> omnistep.moved_by([0.0, 0.0, math.pi / 2], [1.0, 0.0, 0.0]).round(9).tolist()  # facing left
        [0.0, 1.0, 1.570796327]
    """

@final
class Wheel:
    """One driven wheel with free rollers on its rim. Its numbers are checked when a :class:`Layout` is built.

    Args:
        position_m: position of the contact point in the body frame [m] (x forward, y left), each within +-1000.
        rolling_direction: direction in which the vehicle moves when this wheel alone turns positively, (x, y) of any
            length but zero; forward by default.
        roller_angle_rad: angle from the rolling direction to the axis of the roller on the ground [rad],
            counter-clockwise is positive: 0 for an omni wheel, +-pi/4 for a mecanum wheel, never +-pi/2.
        radius_m: rolling radius [m], 0.0001 to 100.
        gear: wheel velocity over actuator velocity, 1e-6 to 1000: 1 for direct drive, 0.05 for a 20:1 reduction.
        reversed: the actuator turns the wheel backwards when it turns positively.

    Raises:
        ConfigError: a position or direction is not two numbers.
        TypeError: an argument is not a number.

    Example:
        >>> import omnistep
        >>> omnistep.Wheel(position_m=(0.3, -0.2), radius_m=0.05, gear=0.05).rolling_direction
        (1.0, 0.0)
    """

    def __new__(
        cls,
        *,
        position_m: _Row,
        rolling_direction: _Row | None = None,
        roller_angle_rad: float = 0.0,
        radius_m: float,
        gear: float = 1.0,
        reversed: bool = False,
    ) -> Wheel: ...
    @property
    def position_m(self) -> tuple[float, float]:
        """Position of the contact point [m], x and y."""
    @property
    def rolling_direction(self) -> tuple[float, float]:
        """Direction in which the vehicle moves when this wheel alone turns positively, as given."""
    @property
    def roller_angle_rad(self) -> float:
        """Angle from the rolling direction to the axis of the roller on the ground [rad]."""
    @property
    def radius_m(self) -> float:
        """Rolling radius [m]."""
    @property
    def gear(self) -> float:
        """Wheel velocity over actuator velocity."""
    @property
    def reversed(self) -> bool:
        """The actuator turns the wheel backwards when it turns positively."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, tuple[()]]: ...

@final
class Layout:
    """A set of wheels that can move the vehicle in every direction: 3 to 8 wheels, N below.

    Args:
        wheels: the wheels, in the order of every array over wheels.

    Raises:
        ConfigError: a number of a wheel is out of range, the wheels cannot move the vehicle in three directions, or
            the condition number is above 100.
        TypeError: not a list of wheels.

    Example:
        >>> import omnistep
        >>> layout = omnistep.Layout.omni(wheels=3, circle_radius_m=0.2, wheel_radius_m=0.05)
        >>> len(layout), round(layout.condition_number, 6)
        (3, 1.0)
    """

    def __new__(cls, *, wheels: Sequence[Wheel]) -> Layout: ...
    @staticmethod
    def chugo7(*, r1_m: float, r2_m: float, radius_m: float) -> Layout:
        """The seven-wheel vehicle of the paper; ``docs/units.md`` draws it.

        Args:
            r1_m: distance of the front and rear rows from the middle [m], above 0.
            r2_m: distance of the side wheels from the centre line [m], above 0.
            radius_m: rolling radius of the wheels [m].

        Raises:
            ConfigError: a length is out of range.
        """
    @staticmethod
    def omni(*, wheels: int, circle_radius_m: float, offset_rad: float = 0.0, wheel_radius_m: float) -> Layout:
        """Equal omni wheels on a circle, each rolling counter-clockwise.

        Args:
            wheels: how many, 3 to 8.
            circle_radius_m: radius of the circle [m], above 0.
            offset_rad: angle from forward to the first wheel [rad], counter-clockwise is positive.
            wheel_radius_m: rolling radius of the wheels [m].

        Raises:
            ConfigError: a count, length or angle is out of range.
        """
    @staticmethod
    def mecanum4(*, wheelbase_m: float, track_m: float, radius_m: float) -> Layout:
        """Four mecanum wheels at the corners of a rectangle: front left, front right, rear left, rear right.

        All turn positively when the vehicle drives forward. The axes of the rollers on the ground form a diamond.

        Args:
            wheelbase_m: distance from the front to the rear contact points [m], above 0.
            track_m: distance from the left to the right contact points [m], above 0.
            radius_m: rolling radius of the wheels [m].

        Raises:
            ConfigError: a length is out of range.
        """
    @property
    def wheels(self) -> tuple[Wheel, ...]:
        """The wheels, in order."""
    @property
    def condition_number(self) -> float:
        """Ratio of noise amplification in the worst direction of motion to that in the best direction, 1 to 100.

        Yaw is measured at the wheels' mean lever arm, so that metres and radians are comparable.
        """
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, tuple[()]]: ...

@final
class Kinematics:
    """Body twist to actuator velocities and back, for one twist or T of them; float64 throughout.

    Twists are (vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise). Arguments are not changed, and every
    returned array is new.

    Args:
        layout: the wheels.
        forward: method that estimates the twist from more wheels than degrees of freedom: the twist with the smallest
            sum of squared wheel errors, or the average over the wheels, eq. (7) of the paper.
        weights: least squares by the sum of weight times squared error, (N,), each 0 to 1000000: the inverse variance
            of each wheel's measurement. A wheel of weight 0 is ignored.

    Raises:
        ConfigError: an unknown ``forward``, an average that does not undo the inverse map of this layout, or weights
            that are out of range, too few, or leave less than three motions.
        TypeError: weights are not numbers.

    Example:
        >>> import omnistep
        >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.6, track_m=0.4, radius_m=0.1)
        >>> omnistep.Kinematics(layout=layout).inverse([1.0, 0.0, 2.0]).round(9).tolist()
        [0.0, 20.0, 0.0, 20.0]
    """

    def __new__(
        cls,
        *,
        layout: Layout,
        forward: Literal["least_squares", "paper_average"] = "least_squares",
        weights: _Row | None = None,
    ) -> Kinematics: ...
    @property
    def layout(self) -> Layout:
        """The wheels."""
    @property
    def inverse_matrix(self) -> _Floats:
        """The inverse map A, one row [1/m, 1/m, 1] per wheel, (N, 3): ``inverse(x)`` is ``A @ x``."""
    @property
    def forward_matrix(self) -> _Floats:
        """The forward map, a left inverse of A, one row per degree of freedom, (3, N)."""
    def inverse(self, twists: _Rows) -> _Floats:
        """Actuator velocities that move the vehicle with the twists.

        Args:
            twists: (3,) or (T, 3).

        Returns:
            Velocities [rad/s], (N,) or (T, N).

        Raises:
            ConfigError: the shape is wrong or a number is not finite.
            TypeError: not numbers.
        """
    def forward(self, velocities: _Rows) -> _Floats:
        """The twists from actuator velocities.

        Args:
            velocities: actuator velocities [rad/s], (N,) or (T, N).

        Returns:
            Twists, (3,) or (T, 3).

        Raises:
            ConfigError: the shape is wrong or a number is not finite.
            TypeError: not numbers.
        """
    def residual(self, velocities: _Rows) -> _Floats:
        """The part of actuator velocities that no motion of the vehicle explains: zero if no wheel slips.

        Args:
            velocities: actuator velocities [rad/s], (N,) or (T, N).

        Returns:
            Velocities [rad/s] in the shape of ``velocities``.

        Raises:
            ConfigError: the shape is wrong or a number is not finite.
            TypeError: not numbers.
        """
    def desaturate(
        self,
        twists: _Rows,
        *,
        limits_rad_s: float | _Row,
        gives_way: Literal["uniform", "yaw", "translation"] = "uniform",
    ) -> Desaturated:
        """Scale twists down to the wheels' speed limits.

        Args:
            twists: (3,) or (T, 3).
            limits_rad_s: highest speed of every actuator [rad/s], or of each, (N,); above 0, to 1e6.
            gives_way: ``uniform`` scales the whole twist, so that the path stays the same; ``yaw`` keeps translation
                and ``translation`` keeps the yaw rate as far as each is possible alone, even if the two together would
                have been possible.

        Returns:
            The scaled twists, which every wheel can follow.

        Raises:
            ConfigError: a shape is wrong, a number is not finite, a limit is out of range, or ``gives_way`` is
                unknown.
            TypeError: not numbers.
        """
    def __reduce__(self) -> tuple[Any, tuple[()]]: ...
    def scale_velocities(self, velocities: _Rows, *, limits_rad_s: float | _Row) -> Desaturated:
        """Wheel velocities scaled into their limits by one factor, even if they correspond to no twist.

        Args:
            velocities: actuator velocities [rad/s], (N,) or (T, N).
            limits_rad_s: highest speed of every actuator [rad/s], or of each, (N,); above 0, to 1e6.

        Returns:
            The velocities within the limits, and their twist; both factors are equal.

        Raises:
            ConfigError: a shape is wrong, a number is not finite, or a limit is out of range.
            TypeError: not numbers.

        Example:
            >>> import omnistep
            >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.6, track_m=0.4, radius_m=0.1)
            >>> scaled = omnistep.Kinematics(layout=layout).scale_velocities([5.0, 6.0, 4.0, -8.0], limits_rad_s=4.0)
            >>> scaled.velocities.tolist(), int(scaled.limiting)
            ([2.5, 3.0, 2.0, -4.0], 3)
        """

@final
class Desaturated:
    """Twists that every wheel can follow, and their scale factors; made by :meth:`Kinematics.desaturate`.

    Shapes are those for (3,) and for (T, 3) twists.
    """

    @property
    def twist(self) -> _Floats:
        """The reduced twists, (3,) or (T, 3)."""
    @property
    def velocities(self) -> _Floats:
        """The actuator velocities [rad/s] that belong to them, within the limits, (N,) or (T, N)."""
    @property
    def translation_factor(self) -> _Floats:
        """Factor on the translation, 0 to 1, () or (T,)."""
    @property
    def yaw_factor(self) -> _Floats:
        """Factor on the yaw rate, 0 to 1, () or (T,)."""
    @property
    def limiting(self) -> _Integers:
        """Index of the wheel that set the smallest factor, -1 if nothing was reduced, () or (T,)."""

@final
class Estimator:
    """Estimates the pose and its covariance from wheels, gyro and accelerometer, also while wheels slip.

    An extended Kalman filter with the common slip of all wheels as a state. Redundancy cannot detect that slip, but an
    accelerometer can. Wheels that disagree are weighted less. If the vehicle is commanded to rest and is at rest, its
    velocity is 0, and the filter then estimates the biases of gyro and accelerometer. NaN marks a missing reading,
    which is left out.

    Args:
        kinematics: the map from wheel velocities to the vehicle's motion.
        period_s: time between two steps [s], 1e-6 to 10.
        wheel_rad_s: noise of a wheel's velocity [rad/s], a standard deviation like every noise below; 0.1.
        gyro_rad_s: noise of the yaw rate [rad/s]; 0.01.
        accelerometer_m_s2: noise of each acceleration [m/s^2]; 0.05.
        wander_m_s_per_sqrt_s: random walk of the velocity without an acceleration reading [m/s per root of s]; 0.3.
        bias_rad_s: standard deviation of the gyro bias at the start [rad/s]; 0.02.
        bias_walk_rad_s_per_sqrt_s: random walk of the bias [rad/s per root of s]; 1e-4.
        accelerometer_bias_m_s2: standard deviation of the accelerometer's bias at the start, or of what a lean adds
            that is not measured [m/s^2]; 0.05.
        accelerometer_bias_walk_m_s2_per_sqrt_s: random walk of it [m/s^2 per root of s]; 0.01.
        slip_m_s: slip of the whole vehicle while its wheels agree [m/s]; 0.001.
        slip_s: correlation time of the slip [s]; 0.2.
        still_wheel_rad_s: commanded to rest, the vehicle counts as at rest if its wheels turn no faster than this,
            beyond noise, on average over 50 ms [rad/s], 0 to 1000; 0.05.
        still_gyro_rad_s: and if the gyro stays within this range of its own average, which may lie anywhere within four
            deviations of the estimated bias [rad/s], 0 to 1000; 0.05.
        still_m_s2: and if each acceleration is at most this beyond four deviations of its bias, on average
            [m/s^2], 0 to 1000; 0.1.

    Raises:
        ConfigError: a value is out of range.

    Example:
        >>> import omnistep
        >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.5, track_m=0.4, radius_m=0.1)
        >>> kinematics = omnistep.Kinematics(layout=layout)
        >>> estimator = omnistep.Estimator(kinematics=kinematics, period_s=0.001, accelerometer_bias_m_s2=1e-4)
        >>> spinning = [[10.0] * 4] * 1000  # at 1 m/s for a second, on ice: the vehicle follows at 0.5 m/s^2
        >>> poses = estimator.step(spinning, yaw_rates=0.0, accelerations=[0.5, 0.0])
        >>> abs(float(poses[-1, 0]) - 0.25) < 0.01, abs(float(estimator.slip[0]) - 0.5) < 0.02
        (True, True)
    """

    def __new__(
        cls,
        *,
        kinematics: Kinematics,
        period_s: float,
        wheel_rad_s: float | None = None,
        gyro_rad_s: float | None = None,
        accelerometer_m_s2: float | None = None,
        wander_m_s_per_sqrt_s: float | None = None,
        bias_rad_s: float | None = None,
        bias_walk_rad_s_per_sqrt_s: float | None = None,
        accelerometer_bias_m_s2: float | None = None,
        accelerometer_bias_walk_m_s2_per_sqrt_s: float | None = None,
        slip_m_s: float | None = None,
        slip_s: float | None = None,
        still_wheel_rad_s: float | None = None,
        still_gyro_rad_s: float | None = None,
        still_m_s2: float | None = None,
    ) -> Estimator: ...
    @property
    def pose(self) -> _Floats:
        """The pose now, (3,)."""
    @property
    def twist(self) -> _Floats:
        """The vehicle's estimated twist now, not the twist of its wheels, (3,)."""
    @property
    def slip(self) -> _Floats:
        """Common slip of all wheels: their twist less the vehicle's twist, (3,)."""
    @property
    def covariance(self) -> _Floats:
        """Covariance of the pose, (3, 3), in x [m], y [m] and yaw [rad]."""
    @property
    def gyro_bias_rad_s(self) -> float:
        """Estimated reading of the gyro at rest [rad/s]."""
    @property
    def accelerometer_bias_m_s2(self) -> _Floats:
        """Estimated readings of the accelerometer at rest, forward and to the left [m/s^2], (2,)."""
    @property
    def nis(self) -> _Floats:
        """Normalised squared innovation per row of the last step, over the wheels used: 1 on average; NaN if none."""
    def step(
        self,
        wheels: _Rows,
        *,
        yaw_rates: float | _Row | None = None,
        accelerations: _Rows | None = None,
        commanded_rest: bool | Sequence[bool] | _Bools | None = None,
    ) -> _Floats:
        """Process one period per row.

        Args:
            wheels: actuator velocities [rad/s], (N,) or (T, N).
            yaw_rates: yaw rate from the gyro [rad/s], one or (T,); none by default.
            accelerations: horizontal accelerations without gravity, along the heading and to its left [m/s^2], (2,) or
                (T, 2); none by default.
            commanded_rest: the vehicle is commanded to rest, one or (T,); False by default.

        Returns:
            The pose after each, (3,) or (T, 3).

        Raises:
            ConfigError: a shape is wrong.
            TypeError: not numbers.
        """
    def reset(self, pose: _Row, *, pose_deviations: _Row | None = None) -> None:
        """Set the pose and its uncertainty; the yaw is wrapped.

        Args:
            pose: x [m], y [m], yaw [rad].
            pose_deviations: standard deviations of x, y and yaw; 0 (known exactly) by default.

        Raises:
            ConfigError: not three finite numbers, or a deviation that is not valid.
            TypeError: not numbers.
        """

@final
class Odometry:
    """Dead reckoning from wheels, with its pose: exact for twists that stay constant over a period.

    Steps accept one row, or T rows at once, and return the pose after each: x [m] and y [m] in the world, yaw [rad],
    counter-clockwise positive, in (-pi, pi]. A row with NaN or an infinity is ignored; if rows are positions, the next
    row includes its motion.

    Args:
        kinematics: the map from wheel velocities to the vehicle's motion.
        period_s: time between two steps [s], 1e-6 to 10.
        pose: the initial pose; the origin, facing +x, by default.

    Raises:
        ConfigError: ``period_s`` is out of range, or the pose is not three finite numbers.

    Example:
        >>> import math, omnistep
        >>> layout = omnistep.Layout.omni(wheels=3, circle_radius_m=0.2, wheel_radius_m=0.05)
        >>> kinematics = omnistep.Kinematics(layout=layout)
        >>> odometry = omnistep.Odometry(kinematics=kinematics, period_s=0.01)
        >>> circle = kinematics.inverse([[1.0, 0.0, math.tau]] * 50)  # half a turn to the left
        >>> poses = odometry.step_velocities(circle)
        >>> poses.shape, abs(float(odometry.pose[1]) - 1.0 / math.pi) < 1e-9  # a circle of 1 / tau
        ((50, 3), True)
    """

    def __new__(cls, *, kinematics: Kinematics, period_s: float, pose: _Row | None = None) -> Odometry: ...
    @property
    def kinematics(self) -> Kinematics:
        """The map from wheel velocities to the vehicle's motion."""
    @property
    def period_s(self) -> float:
        """Time between two steps [s]."""
    @property
    def pose(self) -> _Floats:
        """The pose now, (3,)."""
    def step_velocities(self, velocities: _Rows) -> _Floats:
        """Integrate one period per row of actuator velocities, each held constant over its period.

        Args:
            velocities: [rad/s], (N,) or (T, N).

        Returns:
            The pose after each, (3,) or (T, 3).

        Raises:
            ConfigError: the shape is wrong.
            TypeError: not numbers.
        """
    def step_positions(self, positions: _Rows) -> _Floats:
        """Integrate the rotation of the actuators since the previous row; the very first row only initialises.

        Args:
            positions: actuator positions [rad], unwrapped, (N,) or (T, N).

        Returns:
            The pose after each, (3,) or (T, 3).

        Raises:
            ConfigError: the shape is wrong.
            TypeError: not numbers.
        """
    def step_displacements(self, displacements: _Rows) -> _Floats:
        """Integrate displacements along arcs in the body frame, from another source.

        Args:
            displacements: forward [m], left [m], turn [rad], (3,) or (T, 3).

        Returns:
            The pose after each, (3,) or (T, 3).

        Raises:
            ConfigError: the shape is wrong.
            TypeError: not numbers.
        """
    def reset(self, pose: _Row) -> None:
        """Set the pose; the yaw is wrapped. Positions are kept: the next row adds the rotation since the last row.

        Raises:
            ConfigError: not three finite numbers.
            TypeError: not numbers.
        """
    def forget_positions(self) -> None:
        """Use the next positions only to initialise, as the first: for encoders that were set to zero."""

@final
class Waypoint:
    """A waypoint of a path with optional constraints. Its numbers are checked when a path is planned.

    Args:
        x_m: world x [m], -10000 to 10000.
        y_m: world y [m], -10000 to 10000.
        kind: shape of the path from the previous waypoint: ``line``, ``arc`` (with ``sweep_rad``), or ``spline``,
            smooth through this waypoint and its neighbours. On a line from a waypoint at the same position the vehicle
            turns on the spot to the heading, or waits for the time.
        sweep_rad: turn of the direction of travel on an arc [rad]: left is +, 0.01 to 6.2 or as much to the right.
        heading_rad: heading at this waypoint [rad], reached by the shorter turn; if left out, the turn continues to the
            next waypoint with a heading. The default of the first waypoint is 0.
        speed_m_s: highest speed on the segment to this waypoint [m/s], above 0 and up to 1000; only the planner's
            limits apply if left out.
        time_s: time of arrival [s] from the start, up to 100000; as early as the limits allow if left out.

    Raises:
        ConfigError: an unknown ``kind``, or ``sweep_rad`` without an arc or an arc without it.
        TypeError: an argument is not a number.

    Example:
        >>> import omnistep
        >>> omnistep.Waypoint(1.0, 1.0, kind="arc", sweep_rad=1.57).kind
        'arc'
    """

    def __new__(
        cls,
        x_m: float,
        y_m: float,
        *,
        kind: Literal["line", "arc", "spline"] = "line",
        sweep_rad: float | None = None,
        heading_rad: float | None = None,
        speed_m_s: float | None = None,
        time_s: float | None = None,
    ) -> Waypoint: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, tuple[()]]: ...
    @property
    def x_m(self) -> float:
        """World x [m]."""
    @property
    def y_m(self) -> float:
        """World y [m]."""
    @property
    def kind(self) -> str:
        """Shape of the path from the previous waypoint: line, arc or spline."""
    @property
    def sweep_rad(self) -> float | None:
        """Turn of the direction of travel on an arc [rad]; None for lines and splines."""
    @property
    def heading_rad(self) -> float | None:
        """Heading at this waypoint [rad]."""
    @property
    def speed_m_s(self) -> float | None:
        """Highest speed on the segment to this waypoint [m/s]."""
    @property
    def time_s(self) -> float | None:
        """Time of arrival [s]."""

@final
class TrajectoryPlanner:
    """Plans trajectories through waypoints, within the wheels' speeds and torques; firmware's code in float64.

    No wheel turns faster than ``share`` of its highest speed; curves and accelerations use no more than ``share`` of
    the motors' torque at their speed; velocity, acceleration and jerk along the path and of the heading stay within
    their limits. The planner does not model ground friction, so limit ``acceleration`` accordingly.

    Args:
        kinematics: the wheels.
        velocity: highest speed along the path [m/s] and of the heading [rad/s], two numbers, like the next three
            arguments: 0, or 0.001 or more.
        acceleration: highest acceleration while the speed grows [m/s^2, rad/s^2], 0.001 or more, finite.
        deceleration: highest deceleration while the speed shrinks; ``acceleration`` if left out.
        jerk: highest rate of change of the acceleration [m/s^3, rad/s^3], 0.001 or more; no limit if left out.
        mass_kg: mass of the whole vehicle [kg], above 0.
        yaw_kg_m2: yaw moment of inertia about the centre of mass [kg.m^2], above 0.
        centre_m: centre of mass from the vehicle's origin, forward and to the left [m]; the origin if left out.
        speeds_rad_s: highest speed of actuators [rad/s], 0.001 or more: one number, or one per wheel, like the next
            three arguments.
        stall_torque_n_m: torque of actuators at rest [N.m], above 0.
        slope_n_m_s_rad: torque lost per speed [N.m per rad/s], 0 or more; 0 if left out.
        wheel_kg_m2: inertia of wheel and rotor, referred to the actuator [kg.m^2], 0 or more; 0 if left out.
        fastest: largest magnitude of vx, vy [m/s], wz [rad/s] of the body twist, 0, or 0.001 or more; no limit if left
            out.
        quickest: largest change of each [m/s^2, m/s^2, rad/s^2], 0.001 or more; no limit if left out.
        share: fraction of the wheels' speeds and torques that a trajectory may use, 0.05 to 1: the remaining fraction
            is a reserve for the follower.

    Raises:
        ConfigError: an argument is out of range, or has the wrong length.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> layout = omnistep.Layout.mecanum4(wheelbase_m=0.5, track_m=0.4, radius_m=0.076)
        >>> planner = omnistep.TrajectoryPlanner(
        ...     kinematics=omnistep.Kinematics(layout=layout), velocity=[0.8, 2.0], acceleration=[1.0, 4.0],
        ...     jerk=[8.0, 40.0], mass_kg=24.0, yaw_kg_m2=1.0, speeds_rad_s=25.0, stall_torque_n_m=3.0)
        >>> ahead = planner.plan([(0.0, 0.0), (2.0, 0.0)])
        >>> round(ahead.duration_s, 9) == 2.0 / 0.8 + 0.8 / 1.0 + 1.0 / 8.0  # and half of v / a + a / j for each ramp
        True
    """

    def __new__(
        cls,
        *,
        kinematics: Kinematics,
        velocity: _Row,
        acceleration: _Row,
        deceleration: _Row | None = None,
        jerk: _Row | None = None,
        mass_kg: float,
        yaw_kg_m2: float,
        centre_m: _Row | None = None,
        speeds_rad_s: float | _Row,
        stall_torque_n_m: float | _Row,
        slope_n_m_s_rad: float | _Row | None = None,
        wheel_kg_m2: float | _Row | None = None,
        fastest: _Row | None = None,
        quickest: _Row | None = None,
        share: float = 0.9,
    ) -> TrajectoryPlanner: ...
    def plan(self, waypoints: Iterable[Waypoint | _Row] | _Floats, /) -> Trajectory:
        """The trajectory through waypoints, from rest to rest.

        Args:
            waypoints: 2 to 1000 of them; a pair of x and y [m] is a waypoint that is reached on a line.

        Raises:
            ConfigError: too few or too many waypoints; a value is out of range; a waypoint repeats the previous one; or
                the limits do not allow its time.
            TypeError: not waypoints.
        """
    def velocities(self, sample: TrajectorySample, /) -> _Floats:
        """Actuator velocities [rad/s] of a vehicle that follows a sample exactly, (N,) or (T, N)."""
    def torques(self, sample: TrajectorySample, /) -> _Floats:
        """Actuator torques [N.m] that a sample's acceleration requires, (N,) or (T, N), without friction.

        Of all torques that produce the acceleration, the set with the smallest sum of squares.
        """

@final
class Trajectory:
    """A reference trajectory, from :class:`TrajectoryPlanner` or ``Scenario.trajectory``.

    Example:
        >>> import omnistep
        >>> square = omnistep.Scenario("square").trajectory
        >>> square.at([0.0, square.duration_s]).pose[:, :2].round(6).tolist()  # it ends where it began
        [[0.0, 0.0], [0.0, 0.0]]
    """

    @property
    def duration_s(self) -> float:
        """Duration [s]."""
    @property
    def starts_s(self) -> _Floats:
        """Start time of the segment to each waypoint after the first [s], (K,)."""
    @property
    def lengths_m(self) -> _Floats:
        """Length of each segment [m], (K,); [rad] for a turn on the spot, 0 for waiting."""
    def at(self, time_s: float | _Row, /) -> TrajectorySample:
        """The trajectory at given times.

        Args:
            time_s: since its start [s], a number or (T,). Before 0, and for NaN, the sample is the first pose, at rest;
                from ``duration_s`` on, the last pose.

        Raises:
            ConfigError: the shape is wrong.
            TypeError: not numbers.
        """

@final
class TrajectorySample:
    """A :class:`Trajectory` at one time, or at each of many."""

    @property
    def time_s(self) -> _Floats:
        """The given times [s], () or (T,)."""
    @property
    def pose(self) -> _Floats:
        """Reference pose (x [m], y [m], heading [rad] in (-pi, pi]), (3,) or (T, 3)."""
    @property
    def velocity(self) -> _Floats:
        """Reference velocity along the world's axes (x, y [m/s], yaw [rad/s]), (3,) or (T, 3)."""
    @property
    def acceleration(self) -> _Floats:
        """Reference acceleration (x, y [m/s^2], yaw [rad/s^2]), (3,) or (T, 3)."""
    @property
    def feed_forward(self) -> _Floats:
        """The body twist (vx, vy [m/s], wz [rad/s]) of a vehicle at the reference pose, (3,) or (T, 3)."""
    @property
    def speed_m_s(self) -> _Floats:
        """Speed along the path [m/s], rad/s in a turn on the spot; 0 or more, () or (T,)."""
    @property
    def done(self) -> _Bools:
        """The end is reached, () or (T,)."""

@final
class HolonomicFollower:
    """Follows a trajectory: commands its velocity in the body frame plus a correction proportional to the pose error.

    It is stateless. The velocity correction is limited as a vector; the yaw rate correction follows the shorter turn.
    The firmware's code, in float64.

    Args:
        gain_per_s: commanded velocity per distance [m/s per m], 0 to 1000. Its inverse, the time constant of the
            return, should be several times the time constant of the wheels' loops.
        heading_gain_per_s: commanded yaw rate per heading error [rad/s per rad], 0 to 1000.
        limit_m_s: largest correction of the velocity [m/s], 0 to 1000.
        limit_rad_s: largest correction of the yaw rate [rad/s], 0 to 1000.

    Raises:
        ConfigError: an argument is out of range.

    Example:
        >>> import omnistep
        >>> end = omnistep.Scenario("square").trajectory.at(1e3)  # at the origin, facing +x, at rest
        >>> follower = omnistep.HolonomicFollower(
        ...     gain_per_s=2.0, heading_gain_per_s=2.0, limit_m_s=0.2, limit_rad_s=0.5)
        >>> follower.step(end, [0.0, 0.05, 0.0]).twist.round(9).tolist()  # 5 cm too far to the left
        [0.0, -0.1, 0.0]
    """

    def __new__(
        cls, *, gain_per_s: float, heading_gain_per_s: float, limit_m_s: float, limit_rad_s: float
    ) -> HolonomicFollower: ...
    def step(self, sample: TrajectorySample, pose: _Rows, /) -> Follow:
        """The twist to command, for a vehicle at a pose and the sample as its reference.

        Args:
            sample: of one time or of T.
            pose: pose of the vehicle (x [m], y [m], yaw [rad]), (3,) or (T, 3). If the pose is not finite, there is no
                correction: the result is the trajectory's own twist.

        Raises:
            ConfigError: a shape is wrong, or the lengths differ.
            TypeError: not numbers.
        """

@final
class Follow:
    """Result of :meth:`HolonomicFollower.step`: the errors and the command, once or T times."""

    @property
    def twist(self) -> _Floats:
        """The body twist to command (vx, vy [m/s], wz [rad/s]), (3,) or (T, 3)."""
    @property
    def error_m(self) -> _Floats:
        """Position error in the vehicle frame, forward and left [m], (2,) or (T, 2)."""
    @property
    def error_rad(self) -> _Floats:
        """Heading error [rad], () or (T,)."""

@final
class EncoderCounter:
    """Decodes incremental encoders whose hardware counters wrap around, at any width, and accumulates the counts.

    Args:
        counts_per_turn: counted edges per turn of the measured shaft, 1 to 1e9 (four per line of a quadrature encoder),
            times the gear ratio if the encoder sits before the gear.
        bits: width of the counter, 2 to 32.
        wheels: number of encoders side by side, 1 to 1000; if left out, a single encoder, with numbers instead of rows.

    Raises:
        ConfigError: an argument is out of range.

    Example:
        >>> import omnistep
        >>> encoder = omnistep.EncoderCounter(counts_per_turn=360.0, bits=16)
        >>> encoder.update([65_530, 65_534, 2, 65_535]).tolist(), int(encoder.counts)  # across the wrap, and back
        ([0, 4, 4, -3], 5)
    """

    def __new__(cls, *, counts_per_turn: float, bits: int, wheels: int | None = None) -> EncoderCounter: ...
    def update(self, readings: float | _Rows) -> _Integers:
        """Process readings in order; return the counts since the previous reading, positive forwards, 0 for the first.

        A wrap-around counts in the shorter direction, so read a counter at least once per half of its range.

        Args:
            readings: whole numbers, -2147483648 to 4294967295, a number or (T,); of several encoders (N,) or (T, N).
                Bits beyond the counter's width are ignored.

        Returns:
            Counts in the shape of ``readings``.

        Raises:
            ConfigError: the shape is wrong, or a number is not whole or out of range.
            TypeError: not numbers.
        """
    @property
    def counts(self) -> _Integers:
        """Counts since the first reading, () or (N,)."""
    @property
    def angle_rad(self) -> _Floats:
        """Angle since the first reading [rad], () or (N,)."""
    @property
    def count_rad(self) -> float:
        """Angle of one count [rad]."""
    def reset(self) -> None:
        """Reset to the initial state, before the first reading."""

@final
class VelocityEstimator:
    """Estimates velocities from the integer counts of coarse encoders. The firmware's code, in float64.

    When counts stop, the velocity falls: it is at most one count over the time without counts. With a count of angle d,
    a period T and a wheel that turns steadily, a window of n periods is off by at most d / (n T) and lags by n T / 2;
    an observer is off by at most d bandwidth / e and lags by 2 / bandwidth.

    Args:
        count_rad: angle of one count [rad], 1e-9 to 7.
        period_s: control period [s], 1e-6 to 10.
        method: ``window``, the counts of the last ``periods`` over their time; ``edges``, the counts between the last
            edges of two periods over the time between them (the M/T method); or ``observer``, which follows the
            counted angle with both poles at ``bandwidth_rad_s``.
        periods: length of a window in periods, 1 to 32; 1 if left out.
        bandwidth_rad_s: bandwidth of an observer [rad/s], 0.001 to 1 over the period.
        wheels: number of wheels side by side, 1 to 1000; if left out, a single wheel, with numbers instead of rows.

    Raises:
        ConfigError: an argument is out of range, unknown, or not compatible with another.

    Example:
        >>> import math, omnistep
        >>> estimator = omnistep.VelocityEstimator(count_rad=math.radians(1.0), period_s=0.001, periods=4)
        >>> estimator.step([1, 0, 0, 0]).round(3).tolist()  # a degree in 4 ms; before the window is full too
        [4.363, 4.363, 4.363, 4.363]
    """

    def __new__(
        cls,
        *,
        count_rad: float,
        period_s: float,
        method: Literal["window", "edges", "observer"] = "window",
        periods: int | None = None,
        bandwidth_rad_s: float | None = None,
        wheels: int | None = None,
    ) -> VelocityEstimator: ...
    def step(self, counts: float | _Rows, *, since_edge_s: float | _Rows | None = None) -> _Floats:
        """One control period, or T of them, one after the other.

        Args:
            counts: counts of each period, whole numbers, positive forwards, a number or (T,); of several wheels (N,) or
                (T, N).
            since_edge_s: time from the last edge to the end of the period [s], in that shape, which ``edges`` uses. If
                it is NaN, or not within the period, it counts as 0, as if left out.

        Returns:
            Velocities [rad/s] in the shape of ``counts``; always finite.

        Raises:
            ConfigError: a shape is wrong, or a count is not whole or beyond 32 bits.
            TypeError: not numbers.
        """
    @property
    def count_rad(self) -> float:
        """Angle of one count [rad]."""
    @property
    def period_s(self) -> float:
        """Control period [s]."""
    def reset(self) -> None:
        """Reset to the initial state: at rest."""

@final
class DcMotor:
    """A DC motor by its data sheet: its torque range at a speed, and the duty cycle for a torque.

    Torques and velocities are at the motor shaft, before any gear; positive is forwards. Arrays of any shape; a single
    number is compatible with every shape. The model is steady-state, without winding inductance.

    Args:
        torque_constant_n_m_a: torque per current, and voltage per velocity [N.m/A], above 0.
        resistance_ohm: resistance of the winding and everything in series with it [ohm], above 0.
        no_load_current_a: current that overcomes friction [A], 0 or more and below the stall current.
        supply_v: voltage of the supply [V], above 0.
        current_limit_a: current limit of the driver [A], above the no-load current; none if left out.

    Raises:
        ConfigError: an argument is out of range.

    Example:
        >>> import omnistep
        >>> motor = omnistep.DcMotor(
        ...     torque_constant_n_m_a=0.05, resistance_ohm=2.0, no_load_current_a=0.1, supply_v=12.0,
        ...     current_limit_a=3.0)
        >>> given = motor.duty([0.045, 1.0], [84.0, 0.0])  # the second is more than the driver's current gives
        >>> given.duty.round(6).tolist(), given.torque_n_m.round(6).tolist(), given.limited.tolist()
        ([0.516667, 0.5], [0.045, 0.15], [False, True])
    """

    def __new__(
        cls,
        *,
        torque_constant_n_m_a: float,
        resistance_ohm: float,
        no_load_current_a: float = 0.0,
        supply_v: float,
        current_limit_a: float | None = None,
    ) -> DcMotor: ...
    @property
    def no_load_speed_rad_s(self) -> float:
        """Speed without load [rad/s]."""
    @property
    def stall_torque_n_m(self) -> float:
        """Stall torque [N.m], within the driver's current limit."""
    def torque_range(self, velocity_rad_s: float | _Array) -> tuple[_Floats, _Floats]:
        """Lowest (0 or less) and highest (0 or more) torque [N.m] at velocities [rad/s], each in their shape.

        Raises:
            TypeError: not numbers.
        """
    def duty(self, torque_n_m: float | _Array, velocity_rad_s: float | _Array, /) -> MotorDuty:
        """Duty cycle of a bridge without a current loop, for a torque [N.m] at a velocity [rad/s].

        For values that are not finite the duty cycle is 0, which counts as limited.

        Raises:
            ConfigError: the shapes differ.
            TypeError: not numbers.
        """
    def current_a(self, torque_n_m: float | _Array, velocity_rad_s: float | _Array, /) -> _Floats:
        """Current [A] for a torque [N.m] at a velocity [rad/s], friction included.

        Raises:
            ConfigError: the shapes differ.
            TypeError: not numbers.
        """
    def voltage_v(self, torque_n_m: float | _Array, velocity_rad_s: float | _Array, /) -> _Floats:
        """Voltage [V] at the terminals for a torque [N.m] at a velocity [rad/s].

        Raises:
            ConfigError: the shapes differ.
            TypeError: not numbers.
        """
    def electrical_power_w(self, torque_n_m: float | _Array, velocity_rad_s: float | _Array, /) -> _Floats:
        """Electrical power [W] for a torque [N.m] at a velocity [rad/s]; negative flows back into the supply.

        Raises:
            ConfigError: the shapes differ.
            TypeError: not numbers.
        """
    def heat_w(self, torque_n_m: float | _Array, velocity_rad_s: float | _Array, /) -> _Floats:
        """Heat of the winding [W] for a torque [N.m] at a velocity [rad/s]; never negative.

        Raises:
            ConfigError: the shapes differ.
            TypeError: not numbers.
        """

@final
class MotorDuty:
    """Duty cycle of a bridge for each torque, with the resulting current and torque, in the shape of the request."""

    @property
    def duty(self) -> _Floats:
        """Part of the supply's voltage at the terminals, -1 to 1; 0 shorts the motor, which brakes."""
    @property
    def current_a(self) -> _Floats:
        """Resulting current [A], positive forwards."""
    @property
    def torque_n_m(self) -> _Floats:
        """Resulting torque at the shaft [N.m]: the requested torque, unless limited."""
    @property
    def limited(self) -> _Bools:
        """The supply voltage or the driver's current limit restricts the torque."""

def torque_duty(
    torque_n_m: float | _Array,
    velocity_rad_s: float | _Array,
    *,
    stall_torque_n_m: float,
    slope_n_m_s_rad: float = 0.0,
) -> _Floats:
    """Duty cycle of a bridge without a current loop, from a motor's stall torque and its decrease with speed.

    The line of :func:`torque_range` at a fraction of the supply voltage, solved for the fraction. It needs only a data
    sheet's stall torque and no-load speed; :class:`DcMotor` also yields the current.

    Args:
        torque_n_m: torque at the actuator [N.m], an array of any shape or a number.
        velocity_rad_s: its velocity [rad/s], in that shape or a number.
        stall_torque_n_m: torque at rest with the whole supply [N.m], above 0.
        slope_n_m_s_rad: torque lost per speed [N.m per rad/s], 0 or more.

    Returns:
        Duties, -1 to 1; 0 shorts the motor, which brakes with slope times velocity. 0 for NaN.

    Raises:
        ConfigError: a torque or slope is out of range, or the shapes differ.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> omnistep.torque_duty([0.5, 0.5, 2.0], [0.0, 4.0, 4.0], stall_torque_n_m=2.0, slope_n_m_s_rad=0.25).tolist()
        [0.25, 0.75, 1.0]
    """

@final
class Pid:
    """A PID loop on an actuator's velocity, eq. (10) of the paper, with its state.

    ``u = kp e + ki (integral of e) + kd e'`` with ``e = reference - measured``; integrals and derivatives are backward
    differences. The firmware's code, in float64.

    Args:
        kp_n_m_s_rad: proportional gain [N.m per rad/s], 0 to 1e6.
        ki_n_m_rad: integral gain [N.m per rad], 0 to 1e6.
        kd_n_m_s2_rad: derivative gain [N.m per rad/s^2], 0 to 1e6.
        period_s: control period [s], 1e-6 to 10.
        proportional_weight: weight of the reference in the proportional term, 0 to 1.
        derivative_weight: weight of the reference in the derivative term, 0 to 1: 0 is the derivative of the
            measurement alone.
        derivative_filter_s: time constant of the derivative's filter [s], 0 to 1000.
        static_friction_n_m: feed-forward in the direction of the reference [N.m], 0 to 1e6.
        viscous_friction_n_m_s_rad: feed-forward by the reference [N.m per rad/s], 0 to 1e6.
        inertia_n_m_s2_rad: feed-forward by the reference's change [N.m per rad/s^2], 0 to 1e6.
        order: whether the integral includes the present error before or after the output is formed.
        anti_windup: treatment of the integral while the output is limited: ``"conditioned"`` (the default),
            ``"conditional"``, ``"none"``, ``{"clamp": {"limit_n_m": 1.0}}`` with the largest integral term [N.m], 0 to
            1e9, or ``{"back_calculation": {"tracking_time_s": 0.1}}`` with a time constant [s], the period to 1e6.
        integral_zone_rad_s: the integral accumulates errors of at most this [rad/s], 0 or more; a larger error resets
            it to 0 (WPILib's ``IZone``).
        proportional_limit_n_m: largest proportional term [N.m], 0 or more.
        output_n_m: lowest (<= 0) and highest (>= 0) output [N.m].

    Raises:
        ConfigError: an argument is out of range, unknown, or not compatible with another.

    Example:
        >>> import omnistep
        >>> pid = omnistep.Pid(kp_n_m_s_rad=2.0, ki_n_m_rad=10.0, period_s=0.1)
        >>> pid.step([1.0, 1.0], 0.0).output_n_m.tolist()  # 2 * 1 + 10 * (0.1 * 1), then more
        [3.0, 4.0]
    """

    def __new__(
        cls,
        *,
        kp_n_m_s_rad: float,
        ki_n_m_rad: float = 0.0,
        kd_n_m_s2_rad: float = 0.0,
        period_s: float,
        proportional_weight: float = 1.0,
        derivative_weight: float = 1.0,
        derivative_filter_s: float = 0.0,
        static_friction_n_m: float = 0.0,
        viscous_friction_n_m_s_rad: float = 0.0,
        inertia_n_m_s2_rad: float = 0.0,
        order: Literal["before_output", "after_output"] = "before_output",
        anti_windup: Literal["conditioned", "conditional", "none"] | Mapping[str, Mapping[str, float]] = ...,
        integral_zone_rad_s: float = ...,
        proportional_limit_n_m: float = ...,
        output_n_m: tuple[float, float] = ...,
    ) -> Pid: ...
    def step(self, reference_rad_s: float | _Row, measured_rad_s: float | _Row) -> PidSample:
        """One step, or T of them, one after the other.

        Args:
            reference_rad_s: reference [rad/s], a number or (T,); one number stays the same for every step.
            measured_rad_s: measurement [rad/s], likewise. NaN, or more than 1e6 rad/s, leaves the state unchanged and
                yields the integral term alone.

        Returns:
            Output and terms, () or (T,).

        Raises:
            ConfigError: the lengths differ.
            TypeError: not numbers.
        """
    def track(self, output_n_m: float, *, reference_rad_s: float, measured_rad_s: float) -> None:
        """Bumpless transfer: the next step with this reference and measurement yields ``output_n_m`` [N.m].

        Without an integral gain, or with an error beyond the integral zone, this has no effect, and the output may
        jump.

        Raises:
            ConfigError: a number is not finite.
        """
    def reset(self) -> None:
        """Return to the initial state."""
    @property
    def integral_n_m(self) -> float:
        """State of the integral [N.m]."""
    @property
    def period_s(self) -> float:
        """Control period [s]."""

@final
class PidSample:
    """Result of :meth:`Pid.step`: arrays () for one step, (T,) for many."""

    @property
    def output_n_m(self) -> _Floats:
        """Output within the limits [N.m]."""
    @property
    def p_n_m(self) -> _Floats:
        """Proportional term [N.m]."""
    @property
    def i_n_m(self) -> _Floats:
        """Integral term [N.m]."""
    @property
    def d_n_m(self) -> _Floats:
        """Derivative term [N.m]."""
    @property
    def ff_n_m(self) -> _Floats:
        """Feed-forward [N.m]."""
    @property
    def saturated(self) -> _Bools:
        """The limits reduced the output."""

@final
class CommandShaper:
    """Conditions commands before they reach a vehicle's controller: limits, a time-out, an emergency stop.

    The firmware's code, in float64. It is stateful; a call with T rows is the same as T calls with one row.

    Args:
        period_s: control period [s], 1e-6 to 10.
        velocity: highest speeds of vx, vy [m/s] and wz [rad/s], 0 or more; with ``keeps_direction``, of the speed along
            the direction of motion and of the yaw rate. No limit if left out, as for the other limits.
        acceleration: change of velocity while the speed grows, above 0, likewise [m/s^2, rad/s^2].
        deceleration: change of velocity while the speed shrinks, above 0, likewise.
        jerk: change of the acceleration, above 0, likewise [m/s^3, rad/s^3].
        keeps_direction: limits along the motion, two numbers each (linear, yaw), so that the direction is kept while
            the speed grows; otherwise per axis, three numbers each, and the path bends while an axis lags.
        timeout_s: greatest age of a command [s], 0 or more; an older command is replaced by rest. No time-out if left
            out.
        emergency_deceleration: deceleration of an emergency stop (linear [m/s^2], yaw [rad/s^2]), above 0, and the
            most after a time-out; an immediate stop if left out.

    Raises:
        ConfigError: an argument is out of range, or has the wrong length.
        TypeError: not numbers.

    Example:
        >>> import omnistep
        >>> shaper = omnistep.CommandShaper(period_s=0.5, acceleration=[1.0, 1.0, 1.0], timeout_s=0.5)
        >>> ahead = [[2.0, 0.0, 0.0]] * 4
        >>> shaped = shaper.step(ahead, arrived=[True, False, False, False])
        >>> shaped.twist[:, 0].tolist(), shaped.status.tolist()  # half a metre per second a period, then a time-out
        ([0.5, 1.0, 0.0, 0.0], [2, 2, 3, 3])
    """

    def __new__(
        cls,
        *,
        period_s: float,
        velocity: _Row | None = None,
        acceleration: _Row | None = None,
        deceleration: _Row | None = None,
        jerk: _Row | None = None,
        keeps_direction: bool = False,
        timeout_s: float | None = None,
        emergency_deceleration: _Row | None = None,
    ) -> CommandShaper: ...
    def step(self, twists: _Rows, *, arrived: bool | Sequence[bool] | _Bools | None = None) -> ShapedCommands:
        """One control period, or T of them, one after the other.

        Args:
            twists: commanded body twists (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3). A command that is not a
                number is rejected, and the last command remains.
            arrived: whether a command arrived in the period, (T,); if none did, the row is not read. Every period if
                left out.

        Returns:
            The shaped commands.

        Raises:
            ConfigError: a shape is wrong, or the lengths differ.
            TypeError: not numbers, or ``arrived`` is not true or false.
        """
    def emergency_stop(self) -> None:
        """Stop, regardless of commands, until :meth:`release`."""
    def release(self) -> None:
        """End an emergency stop; earlier commands are discarded."""
    def reset(self) -> None:
        """Reset to the initial state: at rest, without a command."""
    @property
    def stopped(self) -> bool:
        """An emergency stop is active."""
    @property
    def period_s(self) -> float:
        """Control period [s]."""

@final
class ShapedCommands:
    """Result of :meth:`CommandShaper.step`, for one command or for T commands."""

    @property
    def twist(self) -> _Floats:
        """Twists within the limits (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3); always finite."""
    @property
    def status(self) -> _Integers:
        """0 idle, 1 following, 2 limited, 3 timed out, 4 emergency stop, () or (T,)."""
    @property
    def rejected(self) -> _Bools:
        """A command arrived that is not finite or beyond reason, () or (T,)."""

@final
class Controller:
    """The controller of a scenario, as firmware runs it.

    It limits the command, maps it to the wheels, runs one PID loop per wheel within the motors' limits, and coordinates
    the loops. It is stateful; a call with T rows is the same as T calls with one row. Several threads may share a
    controller: their calls wait for each other.

    Args:
        scenario: a built-in name, the path of a .toml file or a :class:`Scenario`; only its vehicle and ``[control]``
            are used. "flat" if left out.
        policy: coordination policy instead of the scenario's.
        overrides: keys to replace, as in :func:`omnistep.run`; ``{"control.precision": "f32"}`` is bit-identical to
            firmware.

    Raises:
        ConfigError: a name, key or value is wrong, or the policy is ``traction`` or ``traction_runup``, which also read
            hinges and an inertial unit: step them in a :class:`Simulation`.

    Warns:
        UserWarning: one encoder count reads as a velocity for which the gains request more torque than the motor
            provides.

    Example:
        >>> import omnistep
        >>> controller = omnistep.Controller("step", policy="scale_references")
        >>> trace = omnistep.run("step", policy="scale_references", overrides={"duration_s": 0.2})
        >>> commands = list(zip(*(trace[f"command_{axis}"] for axis in ("vx_m_s", "vy_m_s", "wz_rad_s"))))
        >>> again = controller.step(commands, trace.wheels("measured_rad_s"))
        >>> bool((again.applied_n_m == trace.wheels("applied_n_m")).all())
        True
    """

    def __new__(
        cls,
        scenario: str | PathLike[str] | Scenario = ...,
        *,
        policy: str | None = None,
        overrides: Mapping[str, Any] | None = None,
    ) -> Controller: ...
    def step(self, commands: _Rows, measured_rad_s: _Rows) -> ControlSample:
        """One control step, or T of them, one after the other; Ctrl-C stops it.

        Args:
            commands: body twists (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3); (3,) applies to every row of
                ``measured_rad_s``.
            measured_rad_s: actuator velocities [rad/s], (N,) or (T, N), likewise. NaN marks a wheel without an encoder
                reading.

        Returns:
            Every signal, one row each.

        Raises:
            ConfigError: a shape is wrong, the lengths differ, or a command is not finite.
            TypeError: not numbers.
        """
    def reset(self) -> None:
        """Return to the initial state."""
    @property
    def scenario(self) -> Scenario:
        """The scenario of the controller."""
    @property
    def policy(self) -> str:
        """Name of the coordination policy, with its replaced parts."""
    @property
    def period_s(self) -> float:
        """Control period [s]."""

@final
class ControlSample:
    """Signals of one step of a :class:`Controller`, or of T steps; every shape below then begins with T."""

    @property
    def command(self) -> _Floats:
        """The command within the vehicle's limits, (3,)."""
    @property
    def estimated(self) -> _Floats:
        """The twist from the measured velocities, (3,)."""
    @property
    def common_factor(self) -> _Floats:
        """Factor of the policy on all torques or all references, 0 to 1, ()."""
    @property
    def reference_rad_s(self) -> _Floats:
        """References as commanded [rad/s], (N,)."""
    @property
    def p_n_m(self) -> _Floats:
        """Proportional terms [N.m], (N,)."""
    @property
    def i_n_m(self) -> _Floats:
        """Integral terms [N.m], (N,)."""
    @property
    def d_n_m(self) -> _Floats:
        """Derivative terms [N.m], (N,)."""
    @property
    def requested_n_m(self) -> _Floats:
        """Torques requested with the whole reference [N.m], (N,)."""
    @property
    def applied_n_m(self) -> _Floats:
        """Torques to apply [N.m], (N,), within the limits."""
    @property
    def limit_lower_n_m(self) -> _Floats:
        """Lowest torques allowed [N.m], <= 0, (N,)."""
    @property
    def limit_upper_n_m(self) -> _Floats:
        """Highest torques allowed [N.m], >= 0, (N,)."""
    @property
    def residual_rad_s(self) -> _Floats:
        """Parts of the measured velocities that no motion of the vehicle explains [rad/s], (N,)."""
    @property
    def saturated(self) -> _Bools:
        """The request was outside the limits, (N,)."""

@final
class Vehicle:
    """A vehicle as its file describes it, checked; immutable, compared by value, and can be pickled.

    ``vehicle["motor.stall_torque_n_m"]`` and ``vehicle["wheel.0.radius_m"]`` are values of the file.

    Args:
        vehicle: a built-in name (see :func:`list_vehicles`), the path of a .toml file or another :class:`Vehicle`.
        overrides: keys to replace, ``{"motor.stall_torque_n_m": 1.0}``.

    Raises:
        ConfigError: a name, key or value is wrong; the message names the key and the allowed values.
        TypeError: a value is of a type that no key can hold.

    Example:
        >>> import omnistep
        >>> vehicle = omnistep.Vehicle("chugo7", overrides={"wheel.0.radius_m": 0.07})
        >>> vehicle.mass_kg, vehicle["wheel.0.radius_m"], len(vehicle.layout)
        (20.0, 0.07, 7)
    """

    def __new__(
        cls, vehicle: str | PathLike[str] | Vehicle = ..., *, overrides: Mapping[str, Any] | None = None
    ) -> Vehicle: ...
    @staticmethod
    def from_toml(text: str, *, overrides: Mapping[str, Any] | None = None) -> Vehicle:
        """The vehicle that the text of a file describes.

        Raises:
            ConfigError: a key or value is wrong.
        """
    @staticmethod
    def from_dict(keys: Mapping[str, Any]) -> Vehicle:
        """The vehicle that a file with these keys would describe; None marks an absent key.

        Raises:
            ConfigError: a key or value is wrong.
            TypeError: a value is of a type that no key can hold.
        """
    def replace(self, overrides: Mapping[str, Any] | None = None) -> Vehicle:
        """The same vehicle with other keys.

        Raises:
            ConfigError: a key or value is wrong.
        """
    def to_toml(self) -> str:
        """The vehicle as a file."""
    def to_dict(self) -> dict[str, Any]:
        """Every key of the file."""
    def __getitem__(self, key: str, /) -> Any:
        """The value at a dotted key; elements of lists count from 0.

        Raises:
            KeyError: there is no such key; the message names the existing keys.
        """
    @property
    def name(self) -> str:
        """Name in logs."""
    @property
    def wheel_names(self) -> list[str]:
        """Names of the N wheels, in the order of every array over wheels."""
    @property
    def layout(self) -> Layout:
        """The wheel layout for kinematics."""
    @property
    def mass_kg(self) -> float:
        """Mass of the whole vehicle [kg]."""
    @property
    def centre_of_mass_m(self) -> _Floats:
        """Centre of mass of the vehicle at rest on flat ground [m], (3,)."""
    @property
    def no_load_rad_s(self) -> float | None:
        """Velocity at which the motors' torque falls to 0 [rad/s]; None if the limit is constant."""
    def static_loads_n(self, *, gravity_m_s2: float = 9.81) -> _Floats | None:
        """Load of each wheel on flat ground [N], (N,); None if moment balance alone does not determine it.

        Raises:
            ConfigError: gravity is not above 0.
        """
    def speeds_at(self, actuator_rad_s: float) -> _Floats:
        """Speeds along x, y [m/s] and yaw rate [rad/s], each alone, for this speed of the fastest actuator, (3,).

        Raises:
            ConfigError: not a finite number.
        """
    def urdf(self, *, ros2_control: Literal["velocity", "effort"] | None = None) -> str:
        """The vehicle as URDF, for RViz, Rerun and other simulators.

        Args:
            ros2_control: adds a block for ros2_control, whose controllers command each wheel by its ``velocity``
                [rad/s] or ``effort`` [N.m]; None for none.

        Raises:
            ConfigError: ``ros2_control`` is none of these.

        Example:
            >>> import omnistep
            >>> omnistep.Vehicle("mecanum4").urdf(ros2_control="velocity").count("<command_interface ")
            4
        """
    def ros2_controllers(self) -> str:
        """The ros2_control YAML file, for ``omni_wheel_drive_controller`` or ``mecanum_drive_controller``.

        Raises:
            ConfigError: neither controller matches the vehicle's kinematics; the message names the wheel.

        Example:
            >>> import omnistep
            >>> print(omnistep.Vehicle("mecanum4").ros2_controllers().splitlines()[0])
            # ros2_control's controllers for the vehicle mecanum4. Units are m, rad and s.
        """
    def _repr_html_(self) -> str: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Scenario:
    """A vehicle, its ground and its commands, checked. It is immutable and can be pickled.

    ``scenario["terrain.height_m"]`` and ``scenario["vehicle.wheel.0.radius_m"]`` are values of the file.

    Args:
        scenario: a built-in name (see :func:`list_scenarios`), the path of a .toml file or another :class:`Scenario`.
        policy: coordination policy instead of the scenario's (see :func:`list_policies`).
        vehicle: a vehicle instead of the scenario's: a name, a path or a :class:`Vehicle`.
        overrides: keys to replace, as in :func:`omnistep.run`.
        seed: seed of perturbation and noise, 0 to 2**63 - 1.

    Raises:
        ConfigError: a name, key or value is wrong; the message names the key and the allowed values.
        TypeError: a value is of a type that no key can hold.

    Example:
        >>> import omnistep
        >>> low = omnistep.Scenario("step", policy="scale_torques", overrides={"terrain.height_m": 0.03})
        >>> low["terrain.height_m"], low.vehicle.name, low.policy
        (0.03, 'chugo7', 'scale_torques')
        >>> omnistep.Scenario.from_dict(low.to_dict()) == low
        True
    """

    def __new__(
        cls,
        scenario: str | PathLike[str] | Scenario = ...,
        *,
        policy: str | None = None,
        vehicle: str | PathLike[str] | Vehicle | None = None,
        overrides: Mapping[str, Any] | None = None,
        seed: int | None = None,
    ) -> Scenario: ...
    @staticmethod
    def from_toml(text: str, *, overrides: Mapping[str, Any] | None = None) -> Scenario:
        """The scenario that the text of a file describes; paths in it are relative to the working directory.

        Raises:
            ConfigError: a key or value is wrong.
        """
    @staticmethod
    def from_dict(keys: Mapping[str, Any]) -> Scenario:
        """The scenario that a file with these keys would describe; None marks an absent key.

        Raises:
            ConfigError: a key or value is wrong.
            TypeError: a value is of a type that no key can hold.
        """
    def replace(
        self,
        overrides: Mapping[str, Any] | None = None,
        *,
        policy: str | None = None,
        vehicle: str | PathLike[str] | Vehicle | None = None,
        seed: int | None = None,
    ) -> Scenario:
        """The same scenario with other keys.

        Raises:
            ConfigError: a name, key or value is wrong.
        """
    def to_toml(self) -> str:
        """The scenario as a file, with its vehicle; derived gains are left out."""
    def mjcf(self) -> str:
        """Vehicle and ground as MJCF, for MuJoCo: every roller is a separate body.

        Raises:
            ConfigError: a wheel without rollers, or friction patches on ground that is not level.
        """
    def to_dict(self) -> dict[str, Any]:
        """Every key of the file, the vehicle's keys under ``vehicle``."""
    def __getitem__(self, key: str, /) -> Any:
        """The value at a dotted key; elements of lists count from 0.

        Raises:
            KeyError: there is no such key; the message names the existing keys.
        """
    @property
    def name(self) -> str:
        """Its name."""
    @property
    def policy(self) -> str:
        """Name of the coordination policy, with its replaced parts."""
    @property
    def seed(self) -> int:
        """Seed of perturbation and noise."""
    @property
    def period_s(self) -> float:
        """Control period [s]."""
    @property
    def duration_s(self) -> float:
        """Time limit of a run [s]."""
    @property
    def trajectory(self) -> Trajectory | None:
        """The path of its command, planned for its vehicle from the start pose; None if the command is not a path."""
    @property
    def follower(self) -> HolonomicFollower | None:
        """The follower of the path, with the gains of the file; None if the command is not a path."""
    @property
    def wheel_models(self) -> list[Literal["ball", "rollers"]]:
        """Model of each wheel, ``"ball"`` or ``"rollers"``: the effect of ``physics.wheel_model`` on this ground.

        Example:
            >>> import omnistep
            >>> omnistep.Scenario("step", vehicle="mecanum4").wheel_models
            ['rollers', 'rollers', 'rollers', 'rollers']
        """
    @property
    def vehicle(self) -> Vehicle:
        """The vehicle; gains that its file leaves out are derived here."""
    def _repr_html_(self) -> str: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    @staticmethod
    def _of_state(text: str) -> Scenario: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

def read_mcap(path: str | PathLike[str], *, on_progress: Callable[[float], object] | None = None) -> Log:
    """Read an MCAP log: :func:`omnistep.read_mcap` without a progress bar.

    Args:
        path: as in :func:`omnistep.read_mcap`.
        on_progress: called with the completed part, 0 to 1, every few milliseconds; an exception in it ends the
            reading.
    """

def recover(path: str | PathLike[str], out: str | PathLike[str]) -> float:
    """Write the intact part of a truncated MCAP file of any program as a complete file; return its length [s].

    Args:
        path: the truncated file.
        out: the file to write.

    Raises:
        LogError: the file cannot be read or written, or is damaged in another way.
    """

def write_recording(
    path: str | PathLike[str],
    scenario: str | PathLike[str] | Scenario,
    columns: Mapping[str, _Floats],
    facts: Mapping[str, str],
    map: str,
) -> None:
    """Write measurements on a vehicle as a log.

    Args:
        path: the log.
        scenario: vehicle, control period, and the commands for a simulation.
        columns: one number for each control period, NaN if unknown, by the column names of a trace.
        facts: metadata of the log, by name.
        map: the column map, as TOML text.

    Raises:
        LogError: columns differ in length or have a name that is not valid, or the file cannot be written.
    """

@final
class Log:
    """A run read back from its log.

    >>> import omnistep, pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "flat.mcap"
    ...     trace = omnistep.run("flat", overrides={"duration_s": 0.5}, mcap=path)
    ...     log = omnistep.read_mcap(path)
    >>> bool((log.trace.wheels("applied_n_m") == trace.wheels("applied_n_m")).all())
    True
    >>> log.frames["base_link"].shape
    (26, 7)
    """

    @property
    def path(self) -> Path:
        """Path of the log."""
    @property
    def run(self) -> dict[str, str]:
        """Program version, scenario, vehicle, policy and seed by name."""
    @property
    def complete(self) -> bool:
        """The log is complete; otherwise its last chunk, at most one simulated second, may be missing."""
    @property
    def recorded(self) -> bool:
        """The log was measured on a vehicle (:func:`omnistep.import_log`); unmeasured values are NaN.

        There is no outcome, and the scenario holds the recorded commands for a simulation.
        """
    @property
    def scenario_toml(self) -> str:
        """The scenario of the run as a scenario file that includes the vehicle; derived gains are written out."""
    @property
    def trace(self) -> Trace:
        """Every control period: the columns of the run's trace that its log holds, and the commands before limits.

        These are the controller's inputs, estimates and outputs, and the torques and forces at the wheels; ``asked_*``
        are additional columns. A log, and therefore this trace, lacks these columns: ``command_*``, ``twist_*``,
        ``pose_*``, ``body_*``, ``hinge_*``, ``row_*``, ``force_*_n``, the energies (``*_j``) and ``newton_residual_n``;
        for each wheel ``residual_rad_s``, ``rim_m_s``, ``along_m_s``, ``normal_*``, ``contact_*`` and their positions
        ``x_m``, ``y_m``, ``z_m``. Poses are in :attr:`frames`; plots that show positions require the log itself.
        ``omnistep.run(omnistep.Scenario.from_toml(log.scenario_toml))`` recomputes every column.
        """
    @property
    def outcome(self) -> Outcome | None:
        """The metrics; None if the run was killed before its end, or was not simulated."""
    @property
    def frame_time_s(self) -> _Floats:
        """Times of the frames [s], (F,)."""
    @property
    def frames(self) -> dict[str, _Floats]:
        """Frames in the world by name, (F, 7): x, y, z [m] and the unit quaternion x, y, z, w."""
    @property
    def odometry(self) -> dict[str, _Floats]:
        """Odometry pose from ``/odom``; each array has shape (O,).

        ``time_s``, and the columns ``odom_*`` of a run's trace.
        """
    @property
    def ground_truth(self) -> dict[str, _Floats]:
        """True pose from ``/ground_truth/odom``; each array has shape (O,).

        ``time_s``, ``pose_x_m``, ``pose_y_m``, ``pose_yaw_rad``.
        """
    @property
    def urdf(self) -> str:
        """The vehicle as URDF."""
    @property
    def terrain_urdf(self) -> str:
        """The ground as URDF."""
    def show(self, *, height_px: int = 420) -> PlayerFrame:
        """The run in the player of reports, in a notebook.

        Args:
            height_px: height of the frame, 100 to 4000.

        Returns:
            A frame that needs no network. Poses are shown at 50 moments a second, or at fewer if the run is long.

        Raises:
            ConfigError: the run has no row or no poses; or it is the ``trace`` of a log: pass the log.
        """
    def _repr_html_(self) -> str: ...
    def scene(self) -> dict[str, Any]:
        """The vehicle and the ground around the run's path, for the player in ``web/player``.

        ``web/player/README.md`` describes ``bodies``, ``wheels``, ``ground`` and ``patches``, in metres and radians.
        ``frames`` maps numbers to frame names. Everything is derived from the scenario in the log.

        >>> import omnistep, pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder) / "step.mcap"
        ...     trace = omnistep.run("step", overrides={"duration_s": 0.1}, mcap=path)
        ...     scene = omnistep.read_mcap(path).scene()
        >>> floor, step = scene["ground"]
        >>> round(step["at_m"][2] + step["half_m"][2], 6)  # how high its upper side is [m]
        0.05
        >>> scene["frames"][scene["wheels"][3]["frame"]]
        'wheel_4'
        """

@final
class Trace:
    """A finished run: named columns of float64, one row per control period.

    ``trace["time_s"]`` and ``trace.wheels("measured_rad_s")`` are read-only NumPy arrays on the trace's own memory:
    nothing is copied, and the arrays keep the trace alive. ``docs/columns.md`` lists the columns.
    """

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
    @property
    def wheel_names(self) -> list[str]:
        """Names of the N wheels, in the order of every array over wheels."""
    @property
    def wheel_signals(self) -> list[str]:
        """Names that :meth:`wheels` accepts."""
    @property
    def wheel_radius_m(self) -> _Floats:
        """Rolling radii of the wheels [m], (N,)."""
    @property
    def terrain(self) -> dict[str, str | float]:
        """The ground: ``kind``, ``friction``, and for a step ``height_m`` and ``start_x_m``."""
    def ground_m(self, x_m: Sequence[float] | _Floats, *, y_m: float = ...) -> _Floats:
        """Height of the ground [m] at positions x_m [m], (M,), along the line y_m [m]."""
    @property
    def scenario(self) -> str:
        """Name of the scenario."""
    @property
    def vehicle(self) -> str:
        """Name of the vehicle."""
    @property
    def policy(self) -> str:
        """Name of the coordination policy, with its replaced parts, or of a controller of your own."""
    @property
    def seed(self) -> int:
        """Seed of the perturbation."""
    @property
    def outcome(self) -> Outcome:
        """The metrics of the run."""
    def wheels(self, signal: str) -> _Floats:
        """A signal of all wheels, (T, N), without a copy.

        Raises:
            KeyError: there is no such signal; the message suggests the nearest.
        """
    def columns(self) -> dict[str, _Floats]:
        """Every column by name, each (T,), without a copy."""
    def metrics(self) -> dict[str, Any]:
        """The metrics of the run by name, as :meth:`Outcome.to_dict`."""
    def to_numpy(self) -> _Floats:
        """Every column side by side in the order of ``names``, (T, C), without a copy; read-only."""
    def to_arrow(self) -> Any:
        """A ``pyarrow.Table`` on the trace's own memory.

        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> trace.to_arrow().num_rows
        500

        Raises:
            ImportError: pyarrow is not installed.
        """
    def to_polars(self) -> Any:
        """A ``polars.DataFrame`` on the trace's own memory.

        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> trace.to_polars().shape == (500, len(trace.names))
        True

        Raises:
            ImportError: polars is not installed.
        """
    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame``: a copy, because pandas keeps its own memory.

        Raises:
            ImportError: pandas is not installed.
        """
    def show(self, *, height_px: int = 420) -> PlayerFrame:
        """The run in the player of reports, in a notebook.

        Args:
            height_px: height of the frame, 100 to 4000.

        Returns:
            A frame that needs no network. Poses are shown at 50 moments a second, or at fewer if the run is long.

        Raises:
            ConfigError: the run has no row or no poses; or it is the ``trace`` of a log: pass the log.
        """
    def _repr_html_(self) -> str: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """The columns as an Arrow stream without a copy: ``pyarrow.table(trace)``, ``duckdb.sql("from trace")``."""
    def __getitem__(self, name: str, /) -> _Floats:
        """A column, (T,), without a copy.

        Raises:
            KeyError: there is no such column; the message suggests the nearest.
        """
    def __contains__(self, name: object, /) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...
    def __reduce__(self) -> tuple[Any, tuple[str, str, bytes]]: ...
    @staticmethod
    def _of_state(scenario: str, policy: str, state: bytes) -> Trace: ...

@final
class Outcome:
    """Metrics of a run; if there is an obstacle, over the crossing (docs/metrics.md).

    A metric that was not measured, because nothing crossed or the run was killed, is NaN, or None if documented.
    """

    @property
    def verdict(
        self,
    ) -> Literal[
        "climbed",
        "stalled",
        "slid_along",
        "unfinished",
        "arrived",
        "completed",
        "tipped",
        "overspeed",
        "wrong_way",
        "drove_on",
        "rolled_on",
        "off_course",
        "fell_short",
        "tilted",
        "touched",
        "gained_energy",
        "diverged",
    ]:
        """Result of the run; `completed` on flat ground, `unfinished` if `duration_s` ended it.

        docs/metrics.md defines each of them.
        """
    @property
    def climbed(self) -> bool:
        """Whether the verdict is `climbed`; a vehicle that got across, but `touched`, has not."""
    @property
    def engine(self) -> Literal["rapier", "articulated", "mujoco"]:
        """Physics engine: `rapier`, `articulated`, or `mujoco` in :func:`omnistep.mujoco.run`."""
    @property
    def wheel_model_valid(self) -> bool:
        """The wheel model is valid on this ground: rollers, or balls that represent them there.

        docs/physics.md, Validity of the ball model.
        """
    @property
    def crossing_s(self) -> float | None:
        """From the foremost wheel's contact to the last wheel beyond the obstacle [s]; None unless climbed."""
    @property
    def stalled_at_m(self) -> float | None:
        """World x of the base where it stalled [m]; None unless stalled."""
    @property
    def stalled_row(self) -> int | None:
        """The foremost row that had not passed the obstacle at the stall, 1 is the front row; None unless stalled."""
    @property
    def limited_by(self) -> Literal["torque", "friction", "time"] | None:
        """Limiting factor: `torque`, `friction` or `time`; None unless stalled or unfinished.

        docs/metrics.md, Limit of a stalled run.
        """
    @property
    def limited_wheels(self) -> int | None:
        """Wheels that slipped, or stood still while their motors were at their limit; None if neither happened."""
    @property
    def touched_body(self) -> str | None:
        """The first body that was more than 2 mm below the ground; None if none was."""
    @property
    def touched_s(self) -> float | None:
        """Time when that happened, from the start of the run [s]; None if there was none."""
    @property
    def touched_x_m(self) -> float | None:
        """World x of the deepest point then [m]."""
    @property
    def touched_y_m(self) -> float | None:
        """World y of that point [m]."""
    @property
    def touched_depth_m(self) -> float | None:
        """Depth of that point below the ground [m]."""
    @property
    def retries(self) -> int | None:
        """Number of retries of traction control; None for policies without retries."""
    @property
    def stall_s(self) -> float:
        """Longest time that a motor applied 90 % of its stall torque or more while the vehicle stood still [s]."""
    @property
    def stall_from_s(self) -> float | None:
        """Start of that time, from the start of the run [s]; None if there was none."""
    @property
    def pitch_peak_deg(self) -> float:
        """Largest nose-up angle of any body [deg]."""
    @property
    def nose_down_peak_deg(self) -> float:
        """Largest nose-down angle of any body, positive [deg]."""
    @property
    def yaw_error_deg(self) -> float:
        """Heading minus commanded heading, at the end of the crossing [deg]; left is positive."""
    @property
    def slip_rms(self) -> float:
        """Root mean square of the slip ratio over driven wheels that touch the ground."""
    @property
    def speed_error_rms(self) -> float:
        """Root mean square of the relative speed error (the disturbed ratio) over driven wheels."""
    @property
    def speed_error_realised_rms(self) -> float:
        """Root mean square of the speed error relative to the reference after the policy's reduction."""
    @property
    def speed_ratio_std(self) -> float:
        """Standard deviation over driven wheels of velocity over reference, root mean square over time."""
    @property
    def slip_speed_std(self) -> float:
        """Standard deviation over driven wheels of slip speed, over commanded speed: 0 if all wheels roll."""
    @property
    def shape_error_rms_rad_s(self) -> float:
        """Root mean square of the part of the velocities that no common factor on the references explains [rad/s]."""
    @property
    def torque_squared_n2m2s(self) -> float:
        """Sum over wheels of the time integral of torque squared [N^2.m^2.s]."""
    @property
    def work_j(self) -> float:
        """Work of the motors [J]."""
    @property
    def cost_of_transport(self) -> float | None:
        """Work of the motors over weight times distance; None for less than 1 cm."""
    @property
    def e_over_mgh(self) -> float | None:
        """Work of the motors over weight times height gained; None unless climbed to a greater height."""
    @property
    def required_friction(self) -> float:
        """Friction coefficient that sufficed in 95 of 100 averages of 10 ms."""
    @property
    def energy_residual(self) -> float:
        """Energy that the balance does not explain, over the total energy through the motors."""
    @property
    def path_error_rms_m(self) -> float | None:
        """Root mean square over time of the distance of the base from its reference pose [m]; None without a path."""
    @property
    def path_error_peak_m(self) -> float | None:
        """Largest distance of the base from its reference pose [m]; None without a path."""
    @property
    def arrived_s(self) -> float | None:
        """Time since which the base was at the end of its path [s]; None if it was elsewhere when the run ended."""
    @property
    def odometry_error_m(self) -> float:
        """Distance of the base's origin from its position by odometry [m], at the end of the crossing or run."""
    @property
    def final_x_m(self) -> float:
        """True x of the base's origin then [m], world."""
    @property
    def final_y_m(self) -> float:
        """True y then [m], world."""
    @property
    def final_yaw_rad(self) -> float:
        """True heading then [rad], counter-clockwise positive, -pi to pi."""
    def to_dict(self) -> dict[str, str | bool | float | None]:
        """The metrics by name."""
    def _repr_html_(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...
    @staticmethod
    def _of_state(state: str) -> Outcome: ...
    def _rows(self) -> dict[str, tuple[str | None, bool]]:
        """Each metric's value as tables format it, and whether the command's tables show it for this run, by key."""

@final
class Simulation:
    """A scenario being simulated, one control period at a time.

    Several threads may share a simulation: their calls wait for each other, without the interpreter's lock. It can be
    pickled with a controller of your own and the recorded periods; the copy's continuation is bit-identical.

    Args:
        scenario: a built-in name, the path of a .toml file or a :class:`Scenario`; the step by default.
        policy: coordination policy instead of the scenario's, or a controller of your own, as in :func:`omnistep.run`.
        overrides: keys to replace, as in :func:`omnistep.run`.
        seed: seed of the scenario's perturbation.
        record: keep every period, some 4 kB each, for ``trace``, ``outcome`` and ``finish``.

    Raises:
        ConfigError: a name, key or value is wrong.
        TypeError: the policy is not a policy.

    Warns:
        UserWarning: one encoder count reads as a velocity for which the gains request more torque than the motor has;
            or ``traction`` or ``traction_runup`` lacks sensors or motor speed that it requires.

    Example:
        >>> import omnistep
        >>> simulation = omnistep.Simulation("flat")
        >>> for _ in range(1000):
        ...     sample = simulation.step((0.2, 0.0, 0.0))
        >>> simulation.time_s, bool(abs(sample.twist[0] - 0.2) < 0.01)
        (1.0, True)
        >>> len(simulation.trace), simulation.outcome.verdict
        (1000, 'completed')
    """

    def __new__(
        cls,
        scenario: str | PathLike[str] | Scenario = ...,
        *,
        policy: PolicyLike | None = None,
        overrides: Mapping[str, Any] | None = None,
        seed: int | None = None,
        record: bool = True,
    ) -> Simulation: ...
    def step(self, command: Sequence[float] | _Floats) -> Sample:
        """Measure, control, and hold the torques for one control period.

        Args:
            command: body twist (vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise).

        Raises:
            ConfigError: not three components, or one is not finite; the state is unchanged.
            TypeError: not a sequence of numbers; the state is unchanged.
            SimulationError: the physics diverged (a value is not finite), or a policy of your own returned no valid
                torques. An exception of the policy itself is raised unchanged. That period had no torque and is not
                recorded.
        """
    def step_torques(self, torques_n_m: Sequence[float] | _Floats) -> Sample:
        """Hold actuator torques for one control period, without the controller.

        The sample's ``applied_n_m`` and all observations are as usual; the controller's other signals are NaN
        (``saturated`` is False). The controller's integrals do not change.

        Args:
            torques_n_m: torque of every actuator [N.m], (N,).

        Raises:
            ConfigError: not one finite torque for each wheel; the state is unchanged.
            TypeError: not a sequence of numbers; the state is unchanged.
            SimulationError: the physics diverged (a value is not finite).
        """
    def save(self) -> bytes:
        """All data that :meth:`resume` needs for a bit-identical continuation.

        It excludes recorded periods and the state of a policy of your own; a pickle includes both.

        Raises:
            SimulationError: the controller's state cannot be read.

        Example:
            >>> import omnistep
            >>> simulation = omnistep.Simulation("flat")
            >>> sample = simulation.step((0.2, 0.0, 0.0))
            >>> again = omnistep.Simulation.resume("flat", simulation.save())
            >>> simulation.step((0.2, 0.0, 0.0)).twist[0] == again.step((0.2, 0.0, 0.0)).twist[0]
            True
        """
    @staticmethod
    def resume(
        scenario: str | PathLike[str] | Scenario,
        state: bytes,
        *,
        policy: PolicyLike | None = None,
        overrides: Mapping[str, Any] | None = None,
        seed: int | None = None,
    ) -> Simulation:
        """A simulation of the same scenario at the time when ``state`` was saved; its trace begins there.

        Args:
            scenario: the same scenario: a built-in name, the path of a .toml file or a :class:`Scenario`.
            state: the result of :meth:`save`.
            policy: the same policy; a controller of your own continues from the object's state and is not reset.
            overrides: the same overrides.
            seed: the same seed.

        Raises:
            SimulationError: the state is damaged, or of another scenario or version.

        Example:
            >>> import omnistep
            >>> state = omnistep.Simulation("flat").save()
            >>> omnistep.Simulation.resume("flat", state).time_s
            0.0
        """
    def command_at(self, time_s: float) -> tuple[float, float, float]:
        """The scenario's own command at a time [s], as a body twist for the present heading."""
    @property
    def trace(self) -> Trace:
        """Every signal of every period so far, including periods without the controller.

        Raises:
            ConfigError: nothing was recorded.
        """
    @property
    def outcome(self) -> Outcome:
        """The metrics so far.

        Raises:
            ConfigError: nothing was recorded.
        """
    def finish(self, *, mcap: str | PathLike[str] | None = None) -> Trace:
        """The run so far, as a trace and as a log; the simulation can continue.

        Args:
            mcap: path of an MCAP log to write.

        Raises:
            ConfigError: nothing was recorded.
            LogError: the log could not be written.
        """
    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
    @property
    def period_s(self) -> float:
        """Control period [s]."""
    @property
    def measured_rad_s(self) -> _Floats:
        """Present encoder readings of the actuator velocities [rad/s], (N,), for a loop on `step_torques`."""
    @property
    def wheel_names(self) -> list[str]:
        """Names of the N wheels."""
    @property
    def scenario(self) -> Scenario:
        """The simulated scenario."""
    @property
    def policy(self) -> str:
        """Name of the coordination policy, or of a controller of your own."""
    def __reduce__(self) -> tuple[Any, tuple[str, Any, bytes, bytes | None]]: ...
    @staticmethod
    def _of_state(scenario: str, policy: Any, state: bytes, kept: bytes | None) -> Simulation: ...

@final
class Episodes:
    """Environments of one task, stepped together, which :mod:`omnistep.gym` wraps for Gymnasium.

    Args:
        task: ``"step_climb"`` or ``"drive"``.
        scenario, policy, overrides: as in :class:`Simulation`. ranges: new ranges of the random values of episodes, by
        name. frame_skip: number of control periods for which an action is held, 1 to 1000. num_envs: number of
        environments, 1 to 65536. threads: number of threads; 0 for one per core.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

    def __new__(
        cls,
        task: str,
        *,
        scenario: str | PathLike[str] | Scenario,
        policy: str | None,
        overrides: Mapping[str, Any] | None,
        ranges: Sequence[tuple[str, tuple[float, float]]],
        frame_skip: int,
        num_envs: int = 1,
        threads: int = 0,
    ) -> Episodes: ...
    def reset(
        self, seeds: Sequence[int | None], fixed: Sequence[tuple[str, float]], mask: Sequence[bool]
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start the next episode of those in `mask`.

        Args:
            seeds: one for each environment; None continues its sequence of random numbers.
            fixed: values that are not drawn.
            mask: one flag for each environment.

        Returns:
            Observations, (num_envs, observations), and figures by name: an array of each, and one mask ``_name`` of its
            valid values. A figure without any valid value is left out.

        Raises:
            ConfigError: a name or value is wrong; the present episodes then continue.
        """
    def step(
        self, actions: NDArray[np.float32], autoreset: str
    ) -> tuple[NDArray[np.float32], _Floats, _Bools, _Bools, dict[str, Any], tuple[list[Any], dict[str, Any]] | None]:
        """Step all environments, without the interpreter's lock.

        Args:
            actions: num_envs x actions numbers, clipped to -1 to 1.
            autoreset: ``"Disabled"``, ``"NextStep"`` or ``"SameStep"``.

        Returns:
            Observations, rewards, terminated, truncated, figures; and where episodes ended and began in one step, the
            last observation of each (None for the others) and their figures.

        Raises:
            ConfigError: the actions are wrong, or an episode is over; the state is unchanged.
        """
    @property
    def actions(self) -> int:
        """Size of an action."""
    @property
    def observations(self) -> int:
        """Size of an observation."""
    @property
    def action_s(self) -> float:
        """Duration for which an action is held [s]."""
    @property
    def engine(self) -> str:
        """The physics engine."""
    @property
    def ranges(self) -> list[tuple[str, tuple[float, float]]]:
        """Values that differ between episodes, and their ranges."""
    def wheels_m(self, index: int) -> tuple[_Floats, _Floats]:
        """Centres of one environment's wheels in the world [m], (N, 3), and their radii [m], (N,).

        Raises:
            IndexError: there is no such environment.
        """
    def ground_m(self, index: int, x_m: Sequence[float] | _Floats) -> _Floats:
        """Height of one environment's ground [m] at places x [m], y = 0.

        Raises:
            IndexError: there is no such environment.
        """

@final
class Observation:
    """Inputs of a controller of your own in a control period: sensors, its own torques, its command.

    There is one object for each run. It and its arrays are overwritten before every step: copy the values that you
    keep. The arrays are read-only. N wheels and H hinges are in the order of :class:`omnistep.PolicyInfo`.

    Example:
        >>> import omnistep
        >>> def kept(observation):
        ...     seen.append((observation.period, observation.command.copy(), observation.wheels_rad_s.shape))
        ...     return [0.0] * 7
        >>> seen = []
        >>> trace = omnistep.run("flat", policy=kept, overrides={"duration_s": 0.01})
        >>> [period for period, *_ in seen[:3]], seen[0][1].shape, seen[0][2]
        ([0, 1, 2], (3,), (7,))
    """

    @property
    def period(self) -> int:
        """Control periods before this one."""
    @property
    def time_s(self) -> float:
        """Time since the start [s]."""
    @property
    def command(self) -> _Floats:
        """The last command that arrived, (3,): vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise.

        It is the output of the scenario's heading hold, before any limit of the vehicle.
        """
    @property
    def new_command(self) -> bool:
        """The command arrived since the previous period."""
    @property
    def wheels_rad_s(self) -> _Floats:
        """Actuator velocities by the encoders [rad/s], (N,); NaN if no reading arrived."""
    @property
    def torques_n_m(self) -> _Floats:
        """Torques that were applied in the previous period [N.m], (N,); 0 in the first."""
    @property
    def hinges_rad(self) -> _Floats:
        """Angles of the hinges [rad], (H,)."""
    @property
    def hinges_rad_s(self) -> _Floats:
        """Rates of the hinges [rad/s], (H,)."""
    @property
    def rate_rad_s(self) -> _Floats:
        """Angular velocity of the base about its x, y and z axes by the gyro [rad/s], (3,)."""
    @property
    def specific_force_m_s2(self) -> _Floats:
        """Acceleration of the base minus gravity along its axes [m/s^2], (3,): 9.81 upwards at rest."""
    @property
    def roll_rad(self) -> float:
        """Angle of the base's y axis above the horizon [rad]: left side up is positive."""
    @property
    def pitch_rad(self) -> float:
        """Angle of the base's x axis above the horizon [rad]: nose up is positive."""
    @property
    def climbed_m(self) -> float:
        """Height of the edge that a wheel has climbed in this period, by ``odometry.kind = "ground"`` [m]; else 0."""

@final
class Sample:
    """Signals and results of one control period. Arrays over wheels are (N,)."""

    @property
    def time_s(self) -> float:
        """End of the control period [s]."""
    @property
    def command(self) -> tuple[float, float, float]:
        """The command: vx [m/s], vy [m/s], wz [rad/s]."""
    @property
    def estimated(self) -> tuple[float, float, float]:
        """The twist from the encoders, at the start of the period."""
    @property
    def twist(self) -> tuple[float, float, float]:
        """The true twist along the vehicle's heading, at the end of the period."""
    @property
    def common_factor(self) -> float:
        """Factor of the policy on all torques or all references, 0 to 1."""
    @property
    def position_m(self) -> _Floats:
        """Position of the base [m], (3,)."""
    @property
    def rotation_xyzw(self) -> _Floats:
        """Orientation of the base, a unit quaternion (4,)."""
    @property
    def yaw_rad(self) -> float:
        """Heading of the base [rad]."""
    @property
    def body_nose_up_rad(self) -> dict[str, float]:
        """Nose-up angle of each body [rad]."""
    @property
    def hinge_angle_rad(self) -> dict[str, float]:
        """Angle of each hinge [rad]."""
    @property
    def hinge_rate_rad_s(self) -> dict[str, float]:
        """Rate of each hinge [rad/s]."""
    @property
    def reference_rad_s(self) -> _Floats:
        """Reference as commanded [rad/s]."""
    @property
    def measured_rad_s(self) -> _Floats:
        """Measured velocity [rad/s], at the start of the period."""
    @property
    def p_n_m(self) -> _Floats:
        """Proportional term [N.m]."""
    @property
    def i_n_m(self) -> _Floats:
        """Integral term [N.m]."""
    @property
    def d_n_m(self) -> _Floats:
        """Derivative term [N.m]."""
    @property
    def requested_n_m(self) -> _Floats:
        """Torque requested with the whole reference [N.m]."""
    @property
    def applied_n_m(self) -> _Floats:
        """Torque applied [N.m], within the limits."""
    @property
    def limit_lower_n_m(self) -> _Floats:
        """Lowest torque allowed [N.m], <= 0."""
    @property
    def limit_upper_n_m(self) -> _Floats:
        """Highest torque allowed [N.m], >= 0."""
    @property
    def residual_rad_s(self) -> _Floats:
        """Part of the measured velocity that no motion of the vehicle explains [rad/s]."""
    @property
    def saturated(self) -> _Bools:
        """The request was outside the limits."""
    @property
    def disturbed_ratio(self) -> _Floats:
        """Safe form of eq. (14) of the paper, within -2 to 2; lagging is +."""
    @property
    def slip_ratio(self) -> _Floats:
        """Safe form of eq. (15) of the paper, within -2 to 2; spinning is +; 0 in the air."""
    @property
    def rim_m_s(self) -> _Floats:
        """Speed along the push [m/s], from the wheel's rotation against the world."""
    @property
    def along_m_s(self) -> _Floats:
        """Velocity of the wheel's centre along the push in the contact's tangent plane [m/s]."""
    @property
    def force_normal_n(self) -> _Floats:
        """Ground force along the contact normals [N], averaged over the period."""
    @property
    def force_along_n(self) -> _Floats:
        """Ground force along the push [N], averaged over the period."""
    @property
    def normal_x(self) -> _Floats:
        """Direction of the normal force in the world, x; zero in the air."""
    @property
    def normal_y(self) -> _Floats:
        """Direction of the normal force in the world, y."""
    @property
    def normal_z(self) -> _Floats:
        """Direction of the normal force in the world, z."""
    @property
    def x_m(self) -> _Floats:
        """Centre of the axle in the world [m], x."""
    @property
    def y_m(self) -> _Floats:
        """Centre of the axle in the world [m], y."""
    @property
    def z_m(self) -> _Floats:
        """Centre of the axle in the world [m], z."""
    @property
    def torque_n_m(self) -> _Floats:
        """Torque that acted on the actuator [N.m], averaged over the period."""
    @property
    def contact_x_m(self) -> _Floats:
        """Point of contact in the world [m], x, the mean weighted by the normal force; zero in the air."""
    @property
    def contact_y_m(self) -> _Floats:
        """Point of contact in the world [m], y."""
    @property
    def contact_z_m(self) -> _Floats:
        """Point of contact in the world [m], z."""
    @property
    def touches(self) -> _Bools:
        """The wheel touched the ground during the period."""

@final
class MotorBenchTrace:
    """Speeds and loads of wheels A, B and C, one row every 0.1 s."""

    @property
    def policy(self) -> str:
        """Name of the coordination policy."""
    @property
    def t_s(self) -> _Floats:
        """Time [s], (T,)."""
    @property
    def speed_rpm(self) -> _Floats:
        """Velocities [rpm], (T, 3)."""
    @property
    def torque_n_m(self) -> _Floats:
        """Applied torques [N.m], (T, 3)."""
    @property
    def load_n_m_s_rad(self) -> _Floats:
        """Dampers applied [N.m.s/rad], (T, 3)."""
    @property
    def common_factor(self) -> _Floats:
        """Common factor of the policy, (T,)."""
    def __len__(self) -> int: ...

@final
class ClimbLimits:
    """Torque and run-up: required by a step, and available. Arrays over rows are (3,), the front row first."""

    @property
    def vehicle(self) -> str:
        """The vehicle's name."""
    @property
    def height_m(self) -> float:
        """Height of the step [m]."""
    @property
    def friction(self) -> float:
        """Coulomb coefficient between wheels and ground."""
    @property
    def torque_n_m(self) -> float:
        """Torque of each actuator [N.m]."""
    @property
    def speed_m_s(self) -> float:
        """Speed at which each row is assumed to meet the edge [m/s]."""
    @property
    def possible(self) -> bool:
        """The climb is not excluded: no verdict is `impossible`."""
    @property
    def decisive(self) -> Literal["front", "middle", "rear"]:
        """The row that needs the most run-up; if no row needs any, the row that needs the most torque."""
    @property
    def rows(self) -> list[str]:
        """`front`, `middle`, `rear`."""
    @property
    def wheels(self) -> list[list[str]]:
        """Names of the wheels of each row."""
    @property
    def verdicts(self) -> list[Literal["torque", "run_up", "open", "impossible"]]:
        """For each row: `torque` suffices at any speed; the `run_up` compensates for it; it is `open`; or `impossible`.

        Open means that the result depends on the part of the run-up that the impact on the edge leaves.
        """
    @property
    def least_torque_n_m(self) -> _Floats:
        """Least torque of an actuator that lifts each row, however slowly [N.m]; infinite if no torque does."""
    @property
    def deficit_j(self) -> _Floats:
        """Energy that the torque lacks, up to the worst point of each row's path [J]; 0 if it suffices."""
    @property
    def path_mass_kg(self) -> _Floats:
        """Inertia of the motion up the edge right after the impact, over the square of the hinge's distance [kg]."""
    @property
    def kept_at_most(self) -> _Floats:
        """Part of the run-up's kinetic energy that the impact leaves at most, 0 to 1."""
    @property
    def kept_on_path(self) -> _Floats:
        """The part that it leaves if all motion must follow the path, 0 to ``kept_at_most``."""
    @property
    def run_up_m_s(self) -> _Floats:
        """Below this run-up each row does not climb, whatever the impact leaves [m/s]."""
    @property
    def path_run_up_m_s(self) -> _Floats:
        """From this run-up on, the energy suffices if the impact leaves the motion along the path [m/s]."""
    def _repr_html_(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...

def plan_route(
    scenario: Scenario,
    to: list[float],
    *,
    chart: str,
    file: str,
    map: str | PathLike[str] | None,
    elevation: tuple[str | PathLike[str], float, float] | None,
    keep_out: list[tuple[float, float, float, float]],
    cost: str,
    margin: float,
    clearance_m: float,
    resolution_m: float,
    around_m: float,
) -> str:
    """Plan a route, for :func:`omnistep.plan_route`.

    Args:
        scenario: as in :func:`omnistep.plan_route`.
        to: x and y [m], and a heading [deg] if it matters.
        chart: the text of a climb chart's file.
        file: the name of that file in messages.
        map: a file of map_server, or None for the scenario's ground.
        elevation: the picture of its heights, and the heights of black and white [m], or None for a level map.
        keep_out: rectangles that the vehicle does not enter, x from and to, y from and to [m].
        cost: ``time``, ``energy`` or ``risk``.
        margin: part of the chart's limits to plan with.
        clearance_m: distance from obstacles [m].
        resolution_m: cells of the scenario's ground [m].
        around_m: how far around start and goal the ground is looked at [m].

    Returns:
        The route as JSON.

    Raises:
        ConfigError: a file or an argument is not usable.
        NoRouteError: there is no way.
    """

def drive_route(route: str, scenario: Scenario) -> Scenario:
    """The scenario with a route as its path, for :attr:`omnistep.routes.Route.scenario`.

    Args:
        route: a route as JSON.
        scenario: the scenario that it was planned in.

    Raises:
        ConfigError: the route is no JSON of a route, or a point is beyond what a path may be.
    """

@final
class ChartRuns:
    """The runs of a climb chart, checked, for :mod:`omnistep.charts`."""

    def __new__(
        cls,
        vehicle: str | PathLike[str] | Vehicle,
        *,
        policy: str | None,
        edges: Sequence[str],
        sides_deg: Sequence[float],
        skews_deg: Sequence[float],
        friction: float,
        speed_m_s: float,
        margin: float,
        starts: int,
        overrides: Mapping[str, Any] | None,
    ) -> ChartRuns:
        """The runs of a chart; the arguments are as in :func:`omnistep.climb_chart`.

        Raises:
            ConfigError: a name, key or value is wrong.
        """
    def scenario(
        self,
        edge: str,
        size_m: float,
        side_deg: float,
        *,
        skew_deg: float = 0.0,
        x_m: float = 0.0,
        heading_deg: float = 0.0,
    ) -> str:
        """The scenario of one run of the chart, as a file with its vehicle.

        Args:
            edge: the obstacle.
            size_m: its size [m].
            side_deg: direction of travel in the vehicle's axes [deg].
            skew_deg: direction of travel off the edge's normal [deg].
            x_m: start of the run, world x [m].
            heading_deg: heading relative to the approach [deg].

        Raises:
            ConfigError: a value is out of range.
        """
    def compute(
        self,
        *,
        done: str | None = None,
        file: str = "chart",
        jobs: int | None = None,
        keep: Callable[[str], object] | None = None,
    ) -> str:
        """The text of the chart's file, with the cells of the text ``done``.

        Args:
            done: text of the file of a chart that was begun; None to begin.
            file: the name of that file in messages.
            jobs: runs at the same time, one for each core by default.
            keep: called with the text after each cell.

        Raises:
            ConfigError: the chart that was begun holds other runs.
        """
    @classmethod
    def check(cls, file: str, text: str) -> None:
        """Check the text of a chart's file.

        Raises:
            ConfigError: the text is not a chart; the message names file, key and value.
        """

@final
class Plan:
    """The runs of a study or a sweep, every scenario checked, for :mod:`omnistep.ensembles`."""

    #: Largest number of points of a study or a sweep.
    MOST_POINTS: Final[int]

    @staticmethod
    def of_study(
        study: str | PathLike[str],
        *,
        overrides: Mapping[str, Any] | None = None,
        seeds: int | Sequence[int] | None = None,
    ) -> Plan:
        """The runs of a study by built-in name or path.

        Raises:
            ConfigError: a name, key or value is wrong.
        """
    @staticmethod
    def of_points(
        points: Sequence[Mapping[str, Any]],
        *,
        scenario: str | PathLike[str] | Scenario = ...,
        policy: str | None = None,
        overrides: Mapping[str, Any] | None = None,
        seeds: int | Sequence[int],
        own: Packed | None = None,
    ) -> Plan:
        """The runs of a scenario with the keys of each point replaced, all seeds of a point together.

        Args:
            points: the keys of each.
            scenario: as in :func:`omnistep.sweep`.
            policy: a coordination policy instead of the scenario's.
            overrides: keys to replace in every run.
            seeds: number of seeds, or a list of them.
            own: a controller of your own instead: its name, the identifier of its control law, its pickle.

        Raises:
            ConfigError: a name, key or value is wrong; the message names the point.
        """
    @property
    def name(self) -> str:
        """Name of the study, or ``sweep``."""
    @property
    def axes(self) -> list[str]:
        """Varied keys."""
    @property
    def metrics(self) -> list[str]:
        """Names of the metrics of a row that are numbers or booleans."""
    def policy_notes(self) -> list[str]:
        """Notes, one per line: inputs that traction control lacks, and runs whose policy is not the usual default."""
    def __len__(self) -> int: ...

@final
class Store:
    """A folder of results, locked against other programs until it is closed."""

    def __new__(cls, folder: str | PathLike[str], plan: Plan) -> Store: ...
    def close(self) -> None:
        """Unlock the folder."""
    def forget_errors(self) -> int:
        """Remove the rows with an error, so that their runs are missing again; return how many."""
    def read(self) -> Rows:
        """Every existing row of the plan.

        Raises:
            ConfigError: the folder holds results of another study or version.
            StudyError: the folder cannot be read.
        """
    def compute(
        self, rows: Rows, *, jobs: int | None = None, watch: Callable[[int, int], object] | None = None
    ) -> tuple[int, int]:
        """Compute the rows that ``rows`` lacks and write each as soon as it is done.

        Args:
            rows: the existing rows.
            jobs: threads; as many as there are cores by default.
            watch: called a few times per second with the number of completed rows and the number of failed ones.

        Returns:
            Both numbers at the end.

        Raises:
            StudyError: the folder cannot be written.
            KeyboardInterrupt: Ctrl-C was pressed; finished rows are written.
        """

@final
class Rows:
    """Rows of a plan in the order of its runs."""

    @property
    def missing(self) -> int:
        """Number of runs without a row."""
    @property
    def damaged(self) -> list[tuple[Path, str]]:
        """Files that could not be read and were set aside, and why."""
    @property
    def kinds(self) -> dict[str, Literal["bool", "int", "float", "str"]]:
        """Kind of each column by name."""
    def batches(self, size: int) -> list[str]:
        """The runs without a row as texts for :func:`compute_batch`, at most ``size`` runs each."""
    def to_dicts(self) -> list[dict[str, Any]]:
        """One dictionary per row; None if nothing was measured."""
    def cells(self, metrics: Sequence[str] | None = None) -> list[dict[str, Any]]:
        """One dictionary per combination: each axis by its column, counts of runs, mean and interval of each metric.

        Args:
            metrics: names of metrics; the map's by default.

        Raises:
            ConfigError: a name is not a metric.
        """
    def paired(self, key: str, baseline: object, metric: str) -> list[dict[str, Any]]:
        """One dictionary per combination with another value: its metric minus the given value's metric, seed by seed.

        Raises:
            ConfigError: the key does not vary, no run has the value, or the name is not a metric.
        """
    def __len__(self) -> int: ...
    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """The rows by the Arrow PyCapsule interface."""

def metrics() -> list[tuple[str, str, str, str, str]]:
    """Key, heading, meaning, unit and ``lower``, ``zero`` or nothing for every metric, in the order of tables."""

def policy_name(policy: PolicyLike) -> str:
    """Name of a policy in tables and traces."""

def did_you_mean_file(path: str | PathLike[str]) -> str:
    """Suggest a similarly named file next to a missing one, as a suffix for the name in a message, or nothing."""

def shortened(message: str) -> str:
    """A message with its values cut at 200 characters; the allowed values are kept."""

def wilson(yes: int, runs: int) -> tuple[float, float] | None:
    """Return the 95 % Wilson score interval of a rate; None without a run."""

def mean_interval(measured: Sequence[float]) -> tuple[float, tuple[float, float] | None] | None:
    """Return the mean and its 95 % interval by Student's t; no interval for one measurement, None for none."""

def damage(path: str | PathLike[str]) -> str | None:
    """Check the bytes of a Parquet file of results.

    Args:
        path: the file; any Parquet file.

    Returns:
        The damage, or None; None for a file that omnistep has not written.

    Raises:
        StudyError: it cannot be read.
    """

def compute_batch(
    batch: str, folder: str | PathLike[str], *, jobs: int | None = None, own: Packed | None = None
) -> tuple[int, int]:
    """Compute the missing rows of a batch in the folder, each row written as soon as it is done.

    Args:
        batch: one text of :meth:`Rows.batches`.
        folder: the folder of results, which a :class:`Store` holds open.
        jobs: threads; as many as there are cores by default.
        own: the plan's own controller.

    Returns:
        Number of computed rows, and number of these that failed.

    Raises:
        ConfigError: the folder belongs to another study, or the batch to another version of omnistep.
        StudyError: the folder cannot be written.
        KeyboardInterrupt: Ctrl-C was pressed; finished rows are written.
    """
