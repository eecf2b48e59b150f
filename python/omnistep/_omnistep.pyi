"""The compiled part of omnistep."""

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float64]
_Bools: TypeAlias = NDArray[np.bool_]

__all__ = [
    "Outcome",
    "Sample",
    "Simulation",
    "Trace",
    "WheelsTrace",
    "__version__",
    "cli",
    "policies",
    "run",
    "scenarios",
    "vehicles",
    "wheels",
]

__version__: str

def run(
    scenario: str | PathLike[str] = ...,
    *,
    policy: str | None = None,
    overrides: Mapping[str, Any] | None = None,
    seed: int | None = None,
    mcap: str | PathLike[str] | None = None,
) -> Trace:
    """Run a scenario from start to end.

    Other Python threads go on meanwhile; Ctrl-C stops the run.

    Args:
        scenario: a built-in name (see :func:`scenarios`) or the path of a .toml file; the step by default.
        policy: coordination policy instead of the scenario's (see :func:`policies`).
        overrides: keys of the scenario, or of its vehicle behind ``vehicle.``, and the values to put there:
            ``{"terrain.height_m": 0.03, "vehicle.motor.stall_torque_n_m": 1.0}``. Elements of lists count from 0:
            ``"vehicle.wheel.0.radius_m"``. Values are numbers, strings, bools, or lists or arrays of them.
        seed: seed of the scenario's perturbation, 0 to 2**63 - 1.
        mcap: path of an MCAP log to write; it has that name only when the run went to its end.

    Returns:
        Every signal of every control period.

    Raises:
        ConfigError: a name, key or value is wrong, or a file cannot be read; the message names it and what is allowed.
        TypeError: a value is none of what a key can hold.
        SimulationError: the physics left the finite numbers.
        LogError: the log could not be written.
        KeyboardInterrupt: Ctrl-C was pressed; no log is left.
    """

def wheels(
    policy: str = "synchronised",
    *,
    overrides: Mapping[str, Any] | None = None,
    experiment: str | PathLike[str] = ...,
) -> WheelsTrace:
    """Run section 3.3 of the paper: three motors on dampers, torque limited by eq. (13).

    Args:
        policy: ``independent``, ``paper`` or ``synchronised``.
        overrides: keys of the experiment and the values to put there: ``{"friction_n_m_s_rad": 2e-4}``.
        experiment: the built-in ``wheels``, the default, or the path of a .toml file.

    Returns:
        A row every 0.1 s, or every control period where that is longer.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

def policies() -> list[str]:
    """Names of the coordination policies."""

def scenarios() -> list[str]:
    """Names of the built-in scenarios."""

def vehicles() -> list[str]:
    """Names of the built-in vehicles."""

def cli(argv: Sequence[str]) -> int:
    """Run the command line ``argv`` (the program's name first); return the exit code."""

@final
class Trace:
    """A finished run: named columns of float64, one row a control period.

    ``trace["time_s"]`` and ``trace.wheels("measured_rad_s")`` are read-only NumPy arrays on the trace's own memory:
    nothing is copied, and the arrays keep the trace alive. ``docs/conventions.md`` lists the columns.
    """

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
    @property
    def wheel_names(self) -> list[str]:
        """Names of the N wheels, in the order of every array over wheels."""
    @property
    def wheel_signals(self) -> list[str]:
        """Names that :meth:`wheels` takes."""
    @property
    def wheel_radius_m(self) -> _Floats:
        """Rolling radii of the wheels [m], (N,)."""
    @property
    def terrain(self) -> dict[str, str | float]:
        """The ground: ``kind``, ``friction``, and for a step ``height_m`` and ``at_m``."""
    @property
    def scenario(self) -> str:
        """Name of the scenario."""
    @property
    def vehicle(self) -> str:
        """Name of the vehicle."""
    @property
    def policy(self) -> str:
        """Name of the coordination policy."""
    @property
    def seed(self) -> int:
        """Seed of the perturbation."""
    @property
    def outcome(self) -> Outcome:
        """The figures of the run."""
    def wheels(self, signal: str) -> _Floats:
        """A signal of all wheels, (T, N), without a copy.

        Raises:
            KeyError: there is no such signal; the message suggests the nearest.
        """
    def columns(self) -> dict[str, _Floats]:
        """Every column by name, each (T,), without a copy."""
    def __getitem__(self, name: str, /) -> _Floats:
        """A column, (T,), without a copy.

        Raises:
            KeyError: there is no such column; the message suggests the nearest.
        """
    def __contains__(self, name: object, /) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...

@final
class Outcome:
    """Figures of a run; on a step, over the crossing (docs/conventions.md)."""

    @property
    def climbed(self) -> bool:
        """Every wheel stands on the upper plane; False on flat ground."""
    @property
    def crossing_s(self) -> float | None:
        """From the foremost wheel's touch to the last wheel's stand [s]; None unless climbed."""
    @property
    def pitch_peak_deg(self) -> float:
        """Largest nose-up angle of any body [deg]."""
    @property
    def slip_rms(self) -> float:
        """Root mean square of the slip ratio over driven wheels that touch the ground."""
    @property
    def disturbed_rms(self) -> float:
        """Root mean square of the disturbed ratio over driven wheels."""
    @property
    def spread_rms(self) -> float:
        """Root mean square of the spread of velocity over reference."""
    @property
    def heat_n2m2s(self) -> float:
        """Sum over wheels of the time integral of torque squared [N^2.m^2.s]."""
    def to_dict(self) -> dict[str, bool | float | None]:
        """The figures by name."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Simulation:
    """A scenario being simulated, one control period at a time.

    Args:
        scenario: a built-in name or the path of a .toml file; the step by default.
        policy: coordination policy instead of the scenario's.
        overrides: keys to replace, as in :func:`run`.
        seed: seed of the scenario's perturbation.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

    def __new__(
        cls,
        scenario: str | PathLike[str] = ...,
        *,
        policy: str | None = None,
        overrides: Mapping[str, Any] | None = None,
        seed: int | None = None,
    ) -> Simulation: ...
    def step(self, command: Sequence[float] | _Floats) -> Sample:
        """Measure, control, and hold the torques for one control period.

        Args:
            command: body twist (vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise).

        Raises:
            ConfigError: not three components, or one is not finite; nothing happened then.
            TypeError: not a sequence of numbers; nothing happened then.
            SimulationError: the physics left the finite numbers.
        """
    def step_torques(self, torques_n_m: Sequence[float] | _Floats) -> Sample:
        """Hold actuator torques for one control period, past the controller.

        The sample's ``applied_n_m`` and all that is observed are as ever; the controller's other signals are NaN
        (``saturated`` is False). The controller's integrals stay as they are.

        Args:
            torques_n_m: torque of every actuator [N.m], (N,).

        Raises:
            ConfigError: not one finite torque a wheel; nothing happened then.
            TypeError: not a sequence of numbers; nothing happened then.
            SimulationError: the physics left the finite numbers.
        """
    def command_at(self, time_s: float) -> tuple[float, float, float]:
        """The scenario's own command at a time [s]."""
    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
    @property
    def period_s(self) -> float:
        """Control period [s]."""
    @property
    def measured_rad_s(self) -> _Floats:
        """Actuator velocities as the encoders see them now [rad/s], (N,): what a loop on `step_torques` measures."""
    @property
    def wheel_names(self) -> list[str]:
        """Names of the N wheels."""
    @property
    def policy(self) -> str:
        """Name of the coordination policy."""

@final
class Sample:
    """What one control period did and what came of it. Arrays over wheels are (N,)."""

    @property
    def time_s(self) -> float:
        """End of the control period [s]."""
    @property
    def command(self) -> tuple[float, float, float]:
        """The command: vx [m/s], vy [m/s], wz [rad/s]."""
    @property
    def estimated(self) -> tuple[float, float, float]:
        """The twist that the encoders amount to, at the start of the period."""
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
        """Torque asked for with the whole reference [N.m]."""
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
    def saturated(self) -> _Bools:
        """The request was outside the limits."""
    @property
    def residual_rad_s(self) -> _Floats:
        """Part of the measured velocity that no motion of the vehicle explains [rad/s]."""
    @property
    def disturbed_ratio(self) -> _Floats:
        """Safe form of eq. (14), within -2 to 2; lagging is +."""
    @property
    def slip_ratio(self) -> _Floats:
        """Safe form of eq. (15), within -2 to 2; spinning is +; 0 in the air."""
    @property
    def rim_m_s(self) -> _Floats:
        """Speed of the rim [m/s]."""
    @property
    def along_m_s(self) -> _Floats:
        """Velocity of the wheel's centre along its rolling direction in the contact's tangent plane [m/s]."""
    @property
    def force_normal_n(self) -> _Floats:
        """Ground force along the contact normals [N], averaged over the period."""
    @property
    def force_along_n(self) -> _Floats:
        """Ground force along the rolling direction [N], averaged over the period."""
    @property
    def touches(self) -> _Bools:
        """The wheel touched the ground during the period."""

@final
class WheelsTrace:
    """Speeds and loads of wheels A, B and C, a row every 0.1 s."""

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
