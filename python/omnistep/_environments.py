"""Common parts of the environments of omnistep.gym, around `Episodes`, which computes everything."""

# mypy: disallow-subclassing-any=False, warn-unused-ignores=False
# (Gymnasium is an extra: where it is not installed, its classes have no types.)

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Episodes, Scenario
from omnistep.errors import ConfigError

try:
    import gymnasium as gymnasium  # type: ignore[import-not-found]
    from gymnasium.vector import AutoresetMode as AutoresetMode  # type: ignore[import-not-found]
    from gymnasium.vector import VectorEnv  # type: ignore[import-not-found]
    from gymnasium.vector.utils import batch_space  # type: ignore[import-not-found]
except ImportError:
    raise ImportError('omnistep.gym needs Gymnasium: pip install "omnistep[learn]"') from None

Range: TypeAlias = tuple[float, float]
_Numbers: TypeAlias = NDArray[np.float32]
_Info: TypeAlias = dict[str, Any]
_SEEDS = 2**63
_MODES = tuple(mode.value for mode in AutoresetMode)


class Task:
    """Common part of a single and a vector environment of one task."""

    _task: ClassVar[str]
    _scenario: ClassVar[str]
    _overrides: ClassVar[Mapping[str, Any]]
    _frame_skip: ClassVar[int]
    _from_above: ClassVar[bool] = False
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012  (Gymnasium's own)
    _episodes: Episodes

    def _start(
        self,
        scenario: str | PathLike[str] | Scenario | None,
        policy: str | None,
        overrides: Mapping[str, Any] | None,
        frame_skip: int | None,
        ranges: Mapping[str, Range | None],
        render_mode: str | None,
        **batch: int,
    ) -> tuple[Any, Any]:
        """Make the episodes and return the spaces of observations and actions of one environment."""
        if render_mode not in (None, "rgb_array"):
            allowed = "None or 'rgb_array'"
            raise ConfigError(f"render_mode = {render_mode!r}, allowed: {allowed}", key="render_mode")
        for name, key in {"height_m": "terrain.height_m", "friction": "terrain.friction"}.items():
            if name in ranges and key in (overrides or {}):
                message = f"overrides: {key} is drawn for every episode, allowed: {name}=(low, high)"
                raise ConfigError(message, key=key)
        own = self._overrides if scenario is None else {}
        self._episodes = Episodes(
            self._task,
            scenario=self._scenario if scenario is None else scenario,
            policy=policy,
            overrides={**own, **(overrides or {})},
            ranges=[(name, _pair(name, given)) for name, given in ranges.items() if given is not None],
            frame_skip=self._frame_skip if frame_skip is None else frame_skip,
            **batch,
        )
        box = gymnasium.spaces.Box
        observations, actions = self._episodes.observations, self._episodes.actions
        return box(-1.0, 1.0, (observations,), np.float32), box(-1.0, 1.0, (actions,), np.float32)

    @property
    def ranges(self) -> dict[str, Range]:
        """Values that differ between episodes and their ranges; the names are the options of ``reset``."""
        return dict(self._episodes.ranges)

    @property
    def action_s(self) -> float:
        """Duration of one action [s]."""
        return self._episodes.action_s

    @property
    def engine(self) -> str:
        """Name of the physics engine, as in ``physics.engine``."""
        return self._episodes.engine


class Single(Task, gymnasium.Env):
    """One environment: an `Episodes` of one."""

    def __init__(
        self,
        *,
        scenario: str | PathLike[str] | Scenario | None,
        policy: str | None,
        overrides: Mapping[str, Any] | None,
        frame_skip: int | None,
        render_mode: str | None,
        **ranges: Range | None,
    ) -> None:
        self.observation_space, self.action_space = self._start(
            scenario, policy, overrides, frame_skip, ranges, render_mode
        )
        self.render_mode = render_mode
        # Frame rate of Gymnasium's video wrapper, in simulated time.
        self.metadata = {**type(self).metadata, "render_fps": max(1, round(1.0 / self.action_s))}
        self._seeded = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[_Numbers, _Info]:
        """Start the next episode.

        Args:
            seed: 0 to 2**63 - 1; equal seeds produce equal sequences of episodes. None continues the present sequence
                of random numbers, which begins with the system's.
            options: values for this episode instead of drawn ones, by the names of :attr:`ranges`.

        Returns:
            The observation, float32 within -1 to 1, and ``info`` with further figures.

        Raises:
            ConfigError: the seed, a name or a value is out of range; the present episode then continues.
        """
        seeds = _seeds([seed])
        if seed is None and not self._seeded:
            seeds = [int(self.np_random.integers(_SEEDS))]
        observations, infos = self._episodes.reset(seeds, _fixed(options), [True])
        super().reset(seed=seed)
        self._seeded = True
        return observations[0], _single(infos)

    def step(self, action: _Numbers) -> tuple[_Numbers, float, bool, bool, _Info]:
        """Hold an action, clipped to -1 to 1, for :attr:`action_s`.

        Returns:
            The observation, the reward, whether the task is over (done or failed), whether the time is up, and
            ``info``.

        Raises:
            ConfigError: a number is not finite, their count is wrong, or the episode is over; the state is unchanged.
        """
        seen, reward, terminated, truncated, infos, _ = self._episodes.step(_actions(action), "Disabled")
        return seen[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), _single(infos)

    def render(self) -> Any:
        """Draw the vehicle: (H, W, 3) uint8; None unless ``render_mode="rgb_array"``, which needs matplotlib."""
        return _draw(self, 0) if self.render_mode == "rgb_array" else None


class Many(Task, VectorEnv):
    """Environments stepped by threads, without the interpreter's lock."""

    def __init__(
        self,
        *,
        num_envs: int,
        scenario: str | PathLike[str] | Scenario | None,
        policy: str | None,
        overrides: Mapping[str, Any] | None,
        frame_skip: int | None,
        autoreset_mode: str | AutoresetMode,
        threads: int | None,
        render_mode: str | None,
        **ranges: Range | None,
    ) -> None:
        self.autoreset_mode = _mode(autoreset_mode)
        batch = {"num_envs": _count("num_envs", num_envs, 1), "threads": _count("threads", threads or 0, 0)}
        self.single_observation_space, self.single_action_space = self._start(
            scenario, policy, overrides, frame_skip, ranges, render_mode, **batch
        )
        self.num_envs = num_envs
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.render_mode = render_mode
        fps = max(1, round(1.0 / self.action_s))
        self.metadata = {**type(self).metadata, "render_fps": fps, "autoreset_mode": self.autoreset_mode}
        self._seeded = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Numbers, _Info]:
        """Start the next episode of every environment.

        Args:
            seed: a number for the first environment, one more for each that follows; or one an environment.
            options: as in the single environment, for all of them; ``"reset_mask"``, (num_envs,) of bools, for some.

        Returns:
            Observations, (num_envs, n) float32, and an array of each figure, with a mask ``_name``.

        Raises:
            ConfigError: as the single environment.
        """
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        chosen = np.ones(self.num_envs, dtype=np.bool_) if mask is None else np.asarray(mask, dtype=np.bool_)
        if seed is None:
            seeds = _seeds([None] * self.num_envs)
        else:
            given: Any = seed
            seeds = _seeds(list(given) if np.iterable(given) else [given + k for k in range(self.num_envs)])
        if len(seeds) == len(chosen) == self.num_envs:
            for k in np.flatnonzero(chosen & ~self._seeded):
                seeds[k] = int(self.np_random.integers(_SEEDS)) if seeds[k] is None else seeds[k]
        observations, infos = self._episodes.reset(seeds, _fixed(options), chosen.tolist())
        self._seeded |= chosen
        return observations, infos

    def step(
        self, actions: _Numbers
    ) -> tuple[_Numbers, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], _Info]:
        """Hold the actions, (num_envs, n), for :attr:`action_s`.

        ``metadata["autoreset_mode"]`` determines what follows the end of an episode.

        Returns:
            Observations, rewards, whether each task is over, whether each time is up, and figures. With `SAME_STEP`
            also ``final_obs`` and ``final_info`` of the episodes that ended.

        Raises:
            ConfigError: as in the single environment; the state is unchanged.
        """
        given = np.asarray(actions)
        if given.shape != self.action_space.shape:
            allowed = f"shape {self.action_space.shape}"
            raise ConfigError(f"actions = an array of shape {given.shape}, allowed: {allowed}", key="actions")
        seen, rewards, terminated, truncated, infos, last = self._episodes.step(
            _actions(given), self.autoreset_mode.value
        )
        if last is not None:
            ended = np.array([each is not None for each in last[0]])
            final = np.full(self.num_envs, None, dtype=object)
            for k in np.flatnonzero(ended):
                final[k] = last[0][k]
            infos |= {"final_obs": final, "_final_obs": ended, "final_info": last[1], "_final_info": ended.copy()}
        return seen, rewards, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """Draw every vehicle, as the single environment does."""
        return tuple(_draw(self, k) for k in range(self.num_envs)) if self.render_mode == "rgb_array" else None


def _pair(name: str, given: Any) -> Range:
    try:
        low, high = (float(end) for end in given)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{name} = {given!r}, allowed: the two ends of a range", key=name) from error
    return low, high


def _fixed(options: Mapping[str, Any] | None) -> list[tuple[str, float]]:
    """Values that a reset does not draw."""
    fixed = []
    for name, value in (options or {}).items():
        try:
            fixed.append((name, float(value)))
        except (TypeError, ValueError) as error:
            raise ConfigError(f"options: {name} = {value!r}, allowed: a number", key=name) from error
    return fixed


def _seeds(seeds: Sequence[Any]) -> list[int | None]:
    for seed in seeds:
        if seed is not None and not (isinstance(seed, int | np.integer) and 0 <= seed < _SEEDS):
            raise ConfigError(f"seed = {seed!r}, allowed: 0 to {_SEEDS - 1}, or None", key="seed")
    return [None if seed is None else int(seed) for seed in seeds]


def _count(name: str, value: Any, least: int) -> int:
    if not isinstance(value, int | np.integer) or not least <= value <= 65536:
        raise ConfigError(f"{name} = {value!r}, allowed: {least} to 65536", key=name)
    return int(value)


def _mode(given: str | AutoresetMode) -> AutoresetMode:
    name = given.value if isinstance(given, AutoresetMode) else given
    if name not in _MODES:
        raise ConfigError(f"autoreset_mode = {given!r}, allowed: {', '.join(_MODES)}", key="autoreset_mode")
    return AutoresetMode(name)


def _actions(given: Any) -> _Numbers:
    try:
        return np.asarray(given, dtype=np.float32)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"action = {given!r}, allowed: numbers, -1 to 1", key="action") from error


def _single(infos: _Info) -> _Info:
    """Figures of the only environment, as Python's own numbers."""
    return {name: values[0].item() for name, values in infos.items() if not name.startswith("_")}


def _draw(environment: Task, index: int) -> NDArray[np.uint8]:
    """Draw the wheels and the ground: from the vehicle's right over a step, from above where heading matters."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.collections import EllipseCollection
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError('render needs matplotlib: pip install "omnistep[learn]"') from error
    centres, radii = environment._episodes.wheels_m(index)
    middle = centres.mean(axis=0)
    across = 1 if environment._from_above else 2
    figure: Any = Figure(figsize=(6.4, 3.2), dpi=100, layout="constrained")
    canvas: Any = FigureCanvasAgg(figure)
    ax = figure.add_subplot()
    if environment._from_above:
        ax.set_ylim(middle[1] - 0.4, middle[1] + 0.4)
    else:
        x = np.linspace(middle[0] - 0.8, middle[0] + 0.8, 801)
        ax.fill_between(x, environment._episodes.ground_m(index, x), -1.0, color="0.8")
        ax.set_ylim(middle[2] - 0.3, middle[2] + 0.5)
    wheels = EllipseCollection(
        2 * radii,
        2 * radii,
        0 * radii,
        units="xy",
        offsets=centres[:, [0, across]],
        transOffset=ax.transData,
        facecolors="none",
        edgecolors="#0072B2",
    )
    ax.add_collection(wheels)
    ax.set(xlim=(middle[0] - 0.8, middle[0] + 0.8), xlabel="x [m]", ylabel=f"{'xyz'[across]} [m]", aspect="equal")
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
