"""Controllers of your own: their inputs, and their transfer to other processes."""

import hashlib
import inspect
import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Kinematics, Observation, Scenario, Vehicle, policy_name, shortened
from omnistep.errors import ConfigError

Torques: TypeAlias = NDArray[np.floating[Any]] | Sequence[float]


@dataclass(frozen=True, eq=False)
class PolicyInfo:
    """Information that a controller of your own receives once, in ``reset(info)``.

    Attributes:
        scenario: the scenario of the run.
        vehicle: its vehicle.
        kinematics: the maps between body twist and actuator velocities of that vehicle.
        wheel_names: names of the N wheels, in the order of every array over wheels.
        hinge_names: names of the H hinges, in the order of every array over hinges.
        period_s: control period [s].
        stall_torque_n_m: torque of every motor at rest [N.m].
        slope_n_m_s_rad: decrease of the driving torque per speed [N.m per rad/s]; 0 for a constant limit.
        seed: seed of perturbation and noise, for random numbers of your law.

    Example:
        >>> import omnistep
        >>> info = omnistep.PolicyInfo.of(omnistep.Scenario("step", seed=3))
        >>> info.wheel_count, info.hinge_names, info.stall_torque_n_m, info.seed
        (7, ('pitch', 'roll'), 2.0, 3)
        >>> info.kinematics.inverse_matrix.shape
        (7, 3)
    """

    scenario: Scenario
    vehicle: Vehicle
    kinematics: Kinematics
    wheel_names: tuple[str, ...]
    hinge_names: tuple[str, ...]
    period_s: float
    stall_torque_n_m: float
    slope_n_m_s_rad: float
    seed: int

    @classmethod
    def of(cls, scenario: Scenario) -> "PolicyInfo":
        """Return the information of a scenario for a policy."""
        vehicle = scenario.vehicle
        keys = vehicle.to_dict()
        motor = keys["motor"]
        # A file states either the slope or the end of the line.
        no_load = vehicle.no_load_rad_s
        slope = motor.get("slope_n_m_s_rad", motor["stall_torque_n_m"] / no_load if no_load else 0.0)
        return cls(
            scenario=scenario,
            vehicle=vehicle,
            kinematics=Kinematics(layout=vehicle.layout),
            wheel_names=tuple(vehicle.wheel_names),
            hinge_names=tuple(hinge["name"] for hinge in keys.get("hinge", [])),
            period_s=scenario.period_s,
            stall_torque_n_m=motor["stall_torque_n_m"],
            slope_n_m_s_rad=slope,
            seed=scenario.seed,
        )

    @property
    def wheel_count(self) -> int:
        """Number of wheels, N."""
        return len(self.wheel_names)


class Policy(Protocol):
    """A controller of your own: any object with these two methods; a function of the observation also works.

    Three attributes are optional: ``name`` (a string; else the class's), ``signals`` (names of numeric attributes that
    are read after every step: columns of traces and logs), ``version`` (a string for :func:`omnistep.sweep`; change it
    with the law).

    Example:
        >>> import omnistep
        >>> class Damper:
        ...     signals = ("fastest_rad_s",)
        ...     def reset(self, info):
        ...         self.gain = 0.1 * info.stall_torque_n_m
        ...     def step(self, observation):
        ...         self.fastest_rad_s = abs(observation.wheels_rad_s).max()
        ...         return -self.gain * observation.wheels_rad_s
        >>> trace = omnistep.run("flat", policy=Damper(), overrides={"duration_s": 0.1})
        >>> trace.policy, "fastest_rad_s" in trace
        ('Damper', True)
    """

    def reset(self, info: PolicyInfo, /) -> object:
        """Return to the initial state, for this vehicle: called once before a run."""

    def step(self, observation: Observation, /) -> Torques:
        """Return a torque for every actuator [N.m], (N,), finite; the torques are limited to the motors' range."""


#: Type of ``policy``: the name of a coordination policy, or a controller of your own.
PolicyLike: TypeAlias = str | Policy | Callable[[Observation], Torques]

#: A controller of your own on its way to a worker: name, identity, pickle.
Packed: TypeAlias = tuple[str, str, bytes]


def packed(policy: Policy | Callable[[Observation], Torques]) -> Packed:
    """Return a policy in the form for workers, with an identifier of its control law.

    The identifier is its ``version`` if it has one, otherwise a digest of its pickle and of the source of its class.
    """
    name = policy_name(policy)
    try:
        data = pickle.dumps(policy, protocol=5)
    except Exception as error:
        message = (
            f"policy {name}: it cannot be pickled, but every run of a sweep needs its own copy "
            f"({type(error).__name__}: {error}), allowed: a function or an object of a class at the top of a module"
        )
        raise ConfigError(shortened(message), key="policy") from error
    version = getattr(policy, "version", None)
    if version is not None:
        if not isinstance(version, str):
            raise TypeError(shortened(f"policy {name}: version = {version!r}, allowed: a string"))
        return name, f"{name} version {version}", data
    digest = hashlib.sha256(data)
    digest.update(_source(policy).encode())
    return name, f"{name} {digest.hexdigest()[:32]}", data


def _source(policy: object) -> str:
    """Return the source text of a policy's function or class; empty if there is none."""
    thing = policy if inspect.isroutine(policy) else type(policy)
    try:
        return inspect.getsource(thing)
    except (OSError, TypeError):
        return ""
