"""Environments for reinforcement learning, for Gymnasium.

They need Gymnasium (extra ``learn``). Importing this module registers ``omnistep/StepClimb-v0`` and
``omnistep/Drive-v0``; ``gymnasium.make("omnistep.gym:omnistep/StepClimb-v0")`` does both at once. docs/learning.md has
actions, observations and rewards in tables.

>>> import gymnasium
>>> import omnistep.gym
>>> env = gymnasium.make("omnistep/StepClimb-v0")
>>> observation, info = env.reset(seed=1, options={"height_m": 0.03})
>>> info["height_m"], env.action_space.shape, observation.dtype.name
(0.03, (5,), 'float32')
"""

# mypy: disallow-subclassing-any=False
# (Gymnasium is an extra: where it is not installed, its classes have no types.)

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any, ClassVar

from omnistep._environments import AutoresetMode, Many, Range, Single, Task, gymnasium
from omnistep._omnistep import Scenario

__all__ = ["DriveEnv", "DriveVectorEnv", "StepClimbEnv", "StepClimbVectorEnv", "register"]

# The engine whose answers at 1 ms are those at an eighth of it (docs/validation.md); headings and places differ as in
# the ensembles there.
_PHYSICS = {"physics.engine": "articulated", "physics.timestep_s": 0.001}
_PERTURBED = {"perturbation.yaw_rad": 0.03, "perturbation.start_m": 0.02}


class _StepClimb(Task):
    _task = "step_climb"
    _scenario = "step"
    _overrides: ClassVar[Mapping[str, Any]] = {**_PHYSICS, **_PERTURBED}
    _frame_skip = 50


class _Drive(Task):
    _task = "drive"
    _scenario = "flat"
    _overrides: ClassVar[Mapping[str, Any]] = _PHYSICS
    _frame_skip = 20
    _from_above = True


class StepClimbEnv(_StepClimb, Single):
    """Climb a step; its height and friction differ from episode to episode and are not observed.

    An action is the forward command, the yaw command and a torque added to each row of wheels, on top of the
    controller. docs/learning.md has the tables.

    Args:
        height_m: range of the random height of the step [m]; (0.02, 0.06) by default.
        friction: range of the random friction coefficient; (0.5, 0.9) by default.
        scenario: a built-in name, the path of a .toml file or an :class:`omnistep.Scenario`, with
            ``terrain.kind = "step"``. By default ``"step"`` on the articulated engine with physics steps of 1 ms,
            headings within 0.03 rad and starts within 2 cm.
        policy: coordination policy instead of the scenario's.
        overrides: keys to replace, as in :func:`omnistep.run`.
        frame_skip: number of control periods for which an action is held; 50 by default.
        render_mode: None or ``"rgb_array"``.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

    def __init__(
        self,
        *,
        height_m: Range | None = None,
        friction: Range | None = None,
        scenario: str | PathLike[str] | Scenario | None = None,
        policy: str | None = None,
        overrides: Mapping[str, Any] | None = None,
        frame_skip: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(
            scenario=scenario,
            policy=policy,
            overrides=overrides,
            frame_skip=frame_skip,
            render_mode=render_mode,
            height_m=height_m,
            friction=friction,
        )


class StepClimbVectorEnv(_StepClimb, Many):
    """Many :class:`StepClimbEnv`, stepped by threads: environment k gives the bits of a single one.

    Args:
        num_envs: number of environments.
        height_m: as in :class:`StepClimbEnv`.
        friction: as in :class:`StepClimbEnv`.
        scenario: as in :class:`StepClimbEnv`.
        policy: as in :class:`StepClimbEnv`.
        overrides: as in :class:`StepClimbEnv`.
        frame_skip: as in :class:`StepClimbEnv`.
        render_mode: as in :class:`StepClimbEnv`.
        autoreset_mode: when the next episode begins, of ``gymnasium.vector.AutoresetMode``.
        threads: threads; one for each core by default.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        height_m: Range | None = None,
        friction: Range | None = None,
        scenario: str | PathLike[str] | Scenario | None = None,
        policy: str | None = None,
        overrides: Mapping[str, Any] | None = None,
        frame_skip: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(
            num_envs=num_envs,
            scenario=scenario,
            policy=policy,
            overrides=overrides,
            frame_skip=frame_skip,
            autoreset_mode=autoreset_mode,
            threads=threads,
            render_mode=render_mode,
            height_m=height_m,
            friction=friction,
        )


class DriveEnv(_Drive, Single):
    """Make the vehicle follow a twist on flat ground by the torques of its wheels, without the controller.

    Args:
        vx_m_s: range of the random forward speed [m/s]; (-0.4, 0.4) by default.
        vy_m_s: range of the random speed to the left [m/s]; (-0.4, 0.4) by default.
        wz_rad_s: range of the random yaw rate [rad/s]; (-0.8, 0.8) by default.
        scenario: a built-in name or the path of a .toml file; by default ``"flat"`` on the articulated engine with
            physics steps of 1 ms.
        overrides: keys to replace, as in :func:`omnistep.run`.
        frame_skip: number of control periods for which an action is held; 20 by default.
        render_mode: None or ``"rgb_array"``.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

    def __init__(
        self,
        *,
        vx_m_s: Range | None = None,
        vy_m_s: Range | None = None,
        wz_rad_s: Range | None = None,
        scenario: str | PathLike[str] | Scenario | None = None,
        overrides: Mapping[str, Any] | None = None,
        frame_skip: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(
            scenario=scenario,
            policy=None,
            overrides=overrides,
            frame_skip=frame_skip,
            render_mode=render_mode,
            vx_m_s=vx_m_s,
            vy_m_s=vy_m_s,
            wz_rad_s=wz_rad_s,
        )


class DriveVectorEnv(_Drive, Many):
    """Many :class:`DriveEnv`, stepped by threads: environment k gives the bits of a single one.

    Args:
        num_envs: number of environments.
        vx_m_s: as in :class:`DriveEnv`.
        vy_m_s: as in :class:`DriveEnv`.
        wz_rad_s: as in :class:`DriveEnv`.
        scenario: as in :class:`DriveEnv`.
        overrides: as in :class:`DriveEnv`.
        frame_skip: as in :class:`DriveEnv`.
        render_mode: as in :class:`DriveEnv`.
        autoreset_mode: when the next episode begins, of ``gymnasium.vector.AutoresetMode``.
        threads: threads; one for each core by default.

    Raises:
        ConfigError: a name, key or value is wrong.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        vx_m_s: Range | None = None,
        vy_m_s: Range | None = None,
        wz_rad_s: Range | None = None,
        scenario: str | PathLike[str] | Scenario | None = None,
        overrides: Mapping[str, Any] | None = None,
        frame_skip: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(
            num_envs=num_envs,
            scenario=scenario,
            policy=None,
            overrides=overrides,
            frame_skip=frame_skip,
            autoreset_mode=autoreset_mode,
            threads=threads,
            render_mode=render_mode,
            vx_m_s=vx_m_s,
            vy_m_s=vy_m_s,
            wz_rad_s=wz_rad_s,
        )


def register() -> None:
    """Register the environments with Gymnasium; importing this module has done it."""
    for name in ("StepClimb", "Drive"):
        # No `max_episode_steps`: the time is up inside, so that single and vector environments agree.
        if (environment := f"omnistep/{name}-v0") not in gymnasium.registry:
            gymnasium.register(
                environment, entry_point=f"{__name__}:{name}Env", vector_entry_point=f"{__name__}:{name}VectorEnv"
            )


register()
