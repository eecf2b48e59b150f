"""The compiled part of omnistep."""

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float64]
_Bools: TypeAlias = NDArray[np.bool_]
_Integers: TypeAlias = NDArray[np.int64]
_Row: TypeAlias = Sequence[float] | NDArray[np.floating[Any] | np.integer[Any]]
_Rows: TypeAlias = _Row | Sequence[_Row]

__all__ = [
    "Desaturated",
    "Episodes",
    "Kinematics",
    "Layout",
    "Log",
    "Outcome",
    "Sample",
    "Simulation",
    "Trace",
    "Wheel",
    "WheelsTrace",
    "__version__",
    "cli",
    "discretize",
    "moved_by",
    "policies",
    "read_mcap",
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

def discretize(twists: _Rows, *, dt_s: float) -> _Floats:
    """Twists that, held for a period, end where a straight line along the twists given would.

    A vehicle that turns while it moves drifts off the line that it was told to follow; commands held for a period are
    straightened by this.

    Args:
        twists: body twists (vx [m/s], vy [m/s], wz [rad/s]), (3,) or (T, 3).
        dt_s: the period [s], above 0. The turn within it should stay below one revolution.

    Returns:
        Body twists in the shape of ``twists``; wz is kept.

    Raises:
        ConfigError: a shape is wrong or a number is not finite.
        TypeError: not numbers.
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
    """

@final
class Wheel:
    """One driven wheel with free rollers on its rim. Its numbers are checked when a :class:`Layout` is built.

    Args:
        position_m: place of the contact point in the body frame [m] (x forward, y left), each within +-1000.
        rolling_direction: the way the vehicle moves when this wheel alone turns positively, (x, y) of any length but
            zero; forward by default.
        roller_angle_rad: angle from the rolling direction to the axis of the roller on the ground [rad],
            counter-clockwise is positive: 0 for an omni wheel, +-pi/4 for a mecanum wheel, never +-pi/2.
        radius_m: rolling radius [m], 0.0001 to 100.
        gear: wheel velocity over actuator velocity, 1e-6 to 1000: 1 for direct drive, 0.05 for a 20:1 reduction.
        reversed: the actuator turns the wheel backwards when it turns positively.

    Raises:
        ConfigError: a position or direction is not two numbers.
        TypeError: an argument is not a number.
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
        """Place of the contact point [m], x and y."""
    @property
    def rolling_direction(self) -> tuple[float, float]:
        """The way the vehicle moves when this wheel alone turns positively, as given."""
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

@final
class Layout:
    """Wheels that together can move the vehicle in every direction: 3 to 8 of them, N in what follows.

    Args:
        wheels: the wheels; their order is that of every array over wheels.

    Raises:
        ConfigError: a number of a wheel is out of range, the wheels cannot move the vehicle in three directions, or
            the condition number is above 100.
        TypeError: not a list of wheels.
    """

    def __new__(cls, *, wheels: Sequence[Wheel]) -> Layout: ...
    @staticmethod
    def chugo7(*, r1_m: float, r2_m: float, radius_m: float) -> Layout:
        """The seven-wheel vehicle of the paper; ``docs/conventions.md`` draws it.

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
        """How much more wheel noise is amplified in the worst direction of motion than in the best, 1 to 100.

        Yaw is measured at the wheels' mean lever, so that metres and radians compare.
        """
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Kinematics:
    """Body twist to actuator velocities and back, for one twist or T of them; float64 throughout.

    Twists are (vx [m/s] forward, vy [m/s] left, wz [rad/s] counter-clockwise). What is handed in is not changed;
    every array handed out is new.

    Args:
        layout: the wheels.
        forward: how a twist is estimated from more wheels than a body has motions: the twist with the smallest sum
            of squared wheel errors, or the mean of what each wheel says, eq. (7) of the paper.
        weights: least squares by the sum of weight times squared error, (N,), each 0 to 1000000: the inverse variance
            of what each wheel says. A wheel of weight 0 has no say.

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
        """The inverse map A, one row [1/m, 1/m, 1] a wheel, (N, 3): ``inverse(x)`` is ``A @ x``."""
    @property
    def forward_matrix(self) -> _Floats:
        """The forward map, a left inverse of A, one row a motion, (3, N)."""
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
        """The twists that actuator velocities amount to.

        Args:
            velocities: actuator velocities [rad/s], (N,) or (T, N).

        Returns:
            Twists, (3,) or (T, 3).

        Raises:
            ConfigError: the shape is wrong or a number is not finite.
            TypeError: not numbers.
        """
    def residual(self, velocities: _Rows) -> _Floats:
        """The part of actuator velocities that no motion of the vehicle explains: zero where no wheel slips.

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
        """Slower wheels for twists that no wheel can turn fast enough for.

        Args:
            twists: (3,) or (T, 3).
            limits_rad_s: highest speed of every actuator [rad/s], or of each, (N,); above 0, to 1e6.
            gives_way: ``uniform`` scales the whole twist, so that the path stays the same; ``yaw`` keeps translation
                and ``translation`` keeps the yaw rate as far as it is possible alone, also where the two together
                would have been possible.

        Returns:
            What every wheel can follow.

        Raises:
            ConfigError: a shape is wrong, a number is not finite, a limit is out of range, or ``gives_way`` is
                unknown.
            TypeError: not numbers.
        """

@final
class Desaturated:
    """Twists that every wheel can follow, and what became of those asked for; made by :meth:`Kinematics.desaturate`.

    Shapes are those for (3,) and for (T, 3) twists.
    """

    @property
    def twist(self) -> _Floats:
        """The twists as reduced, (3,) or (T, 3)."""
    @property
    def velocities(self) -> _Floats:
        """The actuator velocities [rad/s] that belong to them, within the limits, (N,) or (T, N)."""
    @property
    def translation_factor(self) -> _Floats:
        """What translation was multiplied by, 0 to 1, () or (T,)."""
    @property
    def yaw_factor(self) -> _Floats:
        """What the yaw rate was multiplied by, 0 to 1, () or (T,)."""
    @property
    def limiting(self) -> _Integers:
        """Index of the wheel that set the smallest factor, -1 where nothing was reduced, () or (T,)."""

def read_mcap(path: str | PathLike[str]) -> Log:
    """Read an MCAP log of a run, finished or not; every checksum is checked.

    Other Python threads go on meanwhile.

    Args:
        path: the log; a killed run's ends with ``.mcap.part``.

    Returns:
        The run.

    Raises:
        LogError: the file cannot be read, is damaged, or is no log of omnistep.
        ConfigError: its scenario is not of this version.
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
        """Where it was read."""
    @property
    def run(self) -> dict[str, str]:
        """Program version, scenario, vehicle, policy and seed by name."""
    @property
    def complete(self) -> bool:
        """Was it finished? Else its last chunk, at most a simulated second, may be missing."""
    @property
    def scenario_toml(self) -> str:
        """The scenario as it was run, its vehicle inside, as a scenario file has it."""
    @property
    def trace(self) -> Trace:
        """Every control period: the columns of the run's own trace that its log has, and what was asked for."""
    @property
    def outcome(self) -> Outcome | None:
        """The figures; None where the run was killed before its end."""
    @property
    def frame_time_s(self) -> _Floats:
        """Times of the frames [s], (F,)."""
    @property
    def frames(self) -> dict[str, _Floats]:
        """Frames in the world by name, (F, 7): x, y, z [m] and the unit quaternion x, y, z, w."""
    @property
    def urdf(self) -> str:
        """The vehicle as URDF."""
    @property
    def terrain_urdf(self) -> str:
        """The ground as URDF."""

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
    def ground_m(self, x_m: Sequence[float] | _Floats, *, y_m: float = ...) -> _Floats:
        """Height of the ground [m] at places x_m [m], (M,), along the line y_m [m]."""
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
    def metrics(self) -> dict[str, Any]:
        """The figures of the run by name, as :meth:`Outcome.to_dict`."""
    def to_numpy(self) -> _Floats:
        """Every column side by side in the order of ``names``, (T, C), without a copy; read-only."""
    def to_polars(self) -> Any:
        """A ``polars.DataFrame`` on the trace's own memory.

        >>> import omnistep
        >>> trace = omnistep.run("flat", overrides={"duration_s": 0.5})
        >>> trace.to_polars().shape == (500, len(trace.names))
        True

        Raises:
            ImportError: polars is not there.
        """
    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame``: a copy, as pandas keeps its own memory.

        Raises:
            ImportError: pandas is not there.
        """
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

@final
class Outcome:
    """Figures of a run; where there is an obstacle, over the crossing (docs/conventions.md)."""

    @property
    def verdict(self) -> Literal["climbed", "stalled", "unfinished", "driven", "tipped", "diverged"]:
        """How it ended; `driven` on flat ground."""
    @property
    def climbed(self) -> bool:
        """Every wheel stands on the ground beyond the obstacle; False on flat ground."""
    @property
    def crossing_s(self) -> float | None:
        """From the foremost wheel's touch to the last wheel's stand [s]; None unless climbed."""
    @property
    def stalled_at_m(self) -> float | None:
        """World x of the base where it stalled [m]; None unless stalled."""
    @property
    def stalled_row(self) -> int | None:
        """The foremost row that had not passed the obstacle then, 1 is the front row; None unless stalled."""
    @property
    def pitch_peak_deg(self) -> float:
        """Largest nose-up angle of any body [deg]."""
    @property
    def yaw_error_deg(self) -> float:
        """Heading less the heading commanded, at the end of the crossing [deg]; left is positive."""
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
    def shape_error_rms_rad_s(self) -> float:
        """Root mean square of the part of the velocities that no common factor on the references explains [rad/s]."""
    @property
    def heat_n2m2s(self) -> float:
        """Sum over wheels of the time integral of torque squared [N^2.m^2.s]."""
    @property
    def work_j(self) -> float:
        """Work of the motors [J]."""
    @property
    def cost_of_transport(self) -> float | None:
        """That work over weight times way; None where it went less than 1 cm."""
    @property
    def e_over_mgh(self) -> float | None:
        """That work over weight times height gained; None unless climbed to a higher place."""
    @property
    def required_friction(self) -> float:
        """Friction that the wheels called for in 95 of 100 averages of 10 ms."""
    @property
    def energy_residual(self) -> float:
        """Energy that the book cannot place, over all that went through the motors."""
    def to_dict(self) -> dict[str, str | bool | float | None]:
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
        """The scenario's own command at a time [s], as a body twist for the present heading."""
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
class Episodes:
    """Environments of one task, stepped together: what :mod:`omnistep.gym` wraps for Gymnasium.

    Args:
        task: ``"step_climb"`` or ``"drive"``.
        scenario, policy, overrides: as of :class:`Simulation`.
        ranges: what replaces the ranges that episodes' differences are drawn from, by name.
        frame_skip: control periods that an action is held for, 1 to 1000.
        num_envs: number of environments, 1 to 65536.
        threads: threads; 0 for one a core.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

    def __new__(
        cls,
        task: str,
        *,
        scenario: str | PathLike[str],
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
            seeds: one an environment; None goes on with its row of random numbers.
            fixed: values that are not drawn.
            mask: one flag an environment.

        Returns:
            Observations, (num_envs, observations), and figures by name: an array of each, and one ``_name`` that says
            which of its values count. What no environment knows is left out.

        Raises:
            ConfigError: a name or value is wrong; the present episodes go on then.
        """
    def step(
        self, actions: NDArray[np.float32], autoreset: str
    ) -> tuple[NDArray[np.float32], _Floats, _Bools, _Bools, dict[str, Any], tuple[list[Any], dict[str, Any]] | None]:
        """Step all environments, outside the interpreter's lock.

        Args:
            actions: num_envs x actions numbers, clipped to -1 to 1.
            autoreset: ``"Disabled"``, ``"NextStep"`` or ``"SameStep"``.

        Returns:
            Observations, rewards, terminated, truncated, figures; and where episodes ended and began in one step, the
            last observation of each (None for the others) and their figures.

        Raises:
            ConfigError: the actions are wrong, or an episode is over; nothing happened then.
        """
    @property
    def actions(self) -> int:
        """Numbers in an action."""
    @property
    def observations(self) -> int:
        """Numbers in an observation."""
    @property
    def action_s(self) -> float:
        """Time that an action is held [s]."""
    @property
    def ranges(self) -> list[tuple[str, tuple[float, float]]]:
        """What differs between episodes, and its range."""
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
