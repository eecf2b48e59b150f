"""Scenarios in MuJoCo, an independent reference, under our controller; the only module that names MuJoCo.

MuJoCo simulates the vehicle that :meth:`Scenario.mjcf` writes, with every roller a body of its own. Controller,
sensors, actuators, command, trace and metrics are the simulation's; only the physics is MuJoCo's. It needs the extra
``mujoco``. docs/mujoco.md lists the measured figures.

>>> import omnistep.mujoco
>>> trace = omnistep.mujoco.run("flat", overrides={"duration_s": 0.1})
>>> trace.outcome.verdict, trace.outcome.engine
('completed', 'mujoco')
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from os import PathLike
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Scenario, Trace, run_external
from omnistep._progress import bar
from omnistep.own_policy import PolicyLike

__all__ = ["Watch", "load", "run"]

_Floats: TypeAlias = NDArray[np.float64]

#: Called after every control period with MuJoCo's model and its state.
Watch: TypeAlias = Callable[[Any, Any], object]


def _mujoco() -> Any:
    """MuJoCo's own module."""
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        raise ImportError('omnistep.mujoco needs MuJoCo: pip install "omnistep[mujoco]"') from error


def load(scenario: str | PathLike[str] | Scenario = "step", *, overrides: Mapping[str, Any] | None = None) -> Any:
    """Return a scenario's vehicle and ground as MuJoCo's model.

    Args:
        scenario: a built-in name, the path of a .toml file or a :class:`Scenario`.
        overrides: keys to replace, as in :func:`omnistep.run`.

    Returns:
        A ``mujoco.MjModel``: joints ``free``, the hinges, ``wheel_NAME``, ``wheel_NAME_roller_K``; actuators
        ``wheel_NAME``.

    Raises:
        ConfigError: a name, key or value is wrong, or a wheel has no rollers.
        ImportError: MuJoCo is not installed.

    Example:
        >>> import omnistep.mujoco
        >>> model = omnistep.mujoco.load("step")
        >>> model.nu, model.njnt == 1 + 2 + 7 + 7 * 12
        (7, True)
    """
    return _mujoco().MjModel.from_xml_string(Scenario(scenario, overrides=overrides).mjcf())


def run(
    scenario: str | PathLike[str] | Scenario = "step",
    *,
    policy: PolicyLike | None = None,
    overrides: Mapping[str, Any] | None = None,
    seed: int | None = None,
    model: Any = None,
    watch: Watch | None = None,
    progress: bool = True,
) -> Trace:
    """Run a scenario from start to end in MuJoCo.

    ``physics.engine``, ``physics.wheel_model`` and ``physics.solver_iterations`` have no effect. Masses that are added
    to a body during the run (``load_added``) are an error.

    Args:
        scenario: as in :func:`omnistep.run`.
        policy: as in :func:`omnistep.run`.
        overrides: as in :func:`omnistep.run`.
        seed: as in :func:`omnistep.run`.
        model: a ``mujoco.MjModel`` instead of the scenario's own: a changed result of :func:`load`, with its names and
            its time step.
        watch: called after every control period with the ``mujoco.MjModel`` and its ``mujoco.MjData``, to draw or to
            measure.
        progress: show a bar, in a terminal or a notebook, when it takes more than a second.

    Returns:
        Every signal of every control period, as in :func:`omnistep.run`. The energy that contacts and joints dissipate
        is unknown: ``friction_loss_j``, ``impact_loss_j``, ``joint_loss_j``, ``energy_residual_j`` and the outcome's
        ``energy_residual`` are NaN.

    Raises:
        ConfigError: a name, key or value is wrong, a wheel has no rollers, or a mass is added to a body during the run.
        KeyError: a model of your own lacks a body or a joint.
        ValueError: its time step is not the scenario's.
        SimulationError: MuJoCo diverged (a value is not finite), or a policy of your own returned no valid torques.
        ImportError: MuJoCo is not installed.

    Example:
        >>> import omnistep.mujoco
        >>> trace = omnistep.mujoco.run("flat", overrides={"vehicle": "omni3", "duration_s": 0.5})
        >>> len(trace), bool(abs(trace["row_1_load_n"][-1] + trace["row_2_load_n"][-1] - 7.2 * 9.81) < 0.5)
        (500, True)
    """
    preset = policy if isinstance(policy, str) else None
    given = Scenario(scenario, policy=preset, overrides=overrides, seed=seed)
    with bar("MuJoCo", shown=progress) as advance:
        on_progress = advance if progress else None
        return run_external(_Physics(given, model, watch), given, policy=policy, on_progress=on_progress)


class _Physics:
    """A scenario's vehicle in MuJoCo, one physics step at a time: the interface that ``run_external`` needs."""

    def __init__(self, scenario: Scenario, model: Any, watch: Watch | None) -> None:
        self._mujoco = mujoco = _mujoco()
        warnings = mujoco.mjtWarning
        self._diverged = [warnings.mjWARN_BADQPOS, warnings.mjWARN_BADQVEL, warnings.mjWARN_BADQACC]
        self.model = load(scenario) if model is None else model
        step_s = scenario["physics.timestep_s"]
        if abs(self.model.opt.timestep - step_s) > 1e-9 * step_s:
            raise ValueError(f"model: a time step of {self.model.opt.timestep} s, allowed: {step_s} s, the scenario's")
        self.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        self.data = mujoco.MjData(self.model)
        self._watch = watch
        vehicle = scenario.vehicle.to_dict()
        bodies = [body["name"] for body in vehicle["body"]]
        links = ["base_link", *bodies[1:]]
        wheels = [f"wheel_{wheel['name']}" for wheel in vehicle["wheel"]]
        self._bodies = [self.model.body(name).id for name in links]
        # From the vehicle's frame as it stands on flat ground to each body's own.
        places = {hinge["child"]: hinge["anchor_m"] for hinge in vehicle.get("hinge", [])}
        self._origins = [np.array(places.get(name, (0.0, 0.0, 0.0))) for name in bodies]
        joints = [self.model.joint(hinge["name"]) for hinge in vehicle.get("hinge", [])]
        self._hinges = [(int(joint.qposadr[0]), int(joint.dofadr[0])) for joint in joints]
        self._hubs = [self.model.body(name).id for name in wheels]
        axles = [self.model.joint(name) for name in wheels]
        self._turns = np.array([int(joint.qposadr[0]) for joint in axles])
        self._spins = np.array([int(joint.dofadr[0]) for joint in axles])
        self._gears = np.array([wheel.get("gear", 1.0) for wheel in vehicle["wheel"]])
        # The wheel of each shape; -1 for the ground.
        hub_of = {hub: i for i, hub in enumerate(self._hubs)}
        parents = self.model.body_parentid[self.model.geom_bodyid]
        self._wheel_of = np.array([hub_of.get(int(parent), -1) for parent in parents])

    def start(self, x_m: float, yaw_rad: float) -> None:
        """Put the vehicle at its start, with its offset along x and its heading."""
        mujoco = self._mujoco
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[0] += x_m
        turn = np.array([np.cos(yaw_rad / 2.0), 0.0, 0.0, np.sin(yaw_rad / 2.0)])
        turned = np.empty(4)
        mujoco.mju_mulQuat(turned, turn, self.data.qpos[3:7].copy())
        self.data.qpos[3:7] = turned
        mujoco.mj_step1(self.model, self.data)

    def step(self, torques_n_m: _Floats, dampers_n_m_s_rad: _Floats, holds_n_m: _Floats) -> tuple[_Floats, _Floats]:
        """Make one physics step; return angles and rates of the axles, and the contacts of this step."""
        mujoco, model, data = self._mujoco, self.model, self.data
        data.ctrl[:] = torques_n_m * self._gears
        model.dof_damping[self._spins] = dampers_n_m_s_rad
        model.dof_frictionloss[self._spins] = holds_n_m
        mujoco.mj_step2(model, data)
        touches = self._touches()
        # Positions and velocities of all parts as they are now, which the next step begins with.
        mujoco.mj_step1(model, data)
        if any(data.warning[kind].number for kind in self._diverged):
            raise FloatingPointError("MuJoCo has no finite state")
        return np.concatenate((data.qpos[self._turns], data.qvel[self._spins])), touches

    def _touches(self) -> _Floats:
        """Contacts of wheels, (C, 10): wheel, force on it, normal out of the ground, position."""
        mujoco, contact = self._mujoco, self.data.contact
        wheels = self._wheel_of[contact.geom]
        felt = np.flatnonzero((contact.efc_address >= 0) & (wheels.max(axis=1, initial=-1) >= 0))
        if not felt.size:
            return np.empty((0, 10))
        wheels, frames = wheels[felt], contact.frame[felt].reshape(-1, 3, 3)
        # A contact's normal points from its first shape to its second one.
        sign = np.where(wheels[:, 1] >= 0, 1.0, -1.0)[:, None]
        if self.model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC and np.all(contact.dim[felt] >= 3):
            parts = self.data.efc_force[contact.efc_address[felt][:, None] + np.arange(3)]
        else:  # of a changed model
            forces = np.zeros((felt.size, 6))
            for index, row in zip(felt, forces, strict=True):
                mujoco.mj_contactForce(self.model, self.data, int(index), row)
            parts = forces[:, :3]
        force = np.einsum("ck,ckx->cx", parts, frames)
        wheel = wheels.max(axis=1)[:, None].astype(float)
        return np.concatenate((wheel, sign * force, sign * frames[:, 0], contact.pos[felt]), axis=1)

    def observe(self) -> _Floats:
        """Return energies, momentum, and the state of bodies, hinges and wheels."""
        mujoco, model, data = self._mujoco, self.model, self.data
        if self._watch is not None:
            self._watch(model, data)
        mujoco.mj_subtreeVel(model, data)
        base = self._bodies[0]
        kinetic, potential = data.energy[1], data.energy[0]
        seen = [[kinetic, potential], model.body_subtreemass[base] * data.subtree_linvel[base]]
        velocity = np.empty(6)
        for body, origin in zip(self._bodies, self._origins, strict=True):
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
            arm = -data.xmat[body].reshape(3, 3) @ origin
            w, x, y, z = data.xquat[body]
            turning = velocity[:3].copy()
            seen += [data.xpos[body] + arm, [x, y, z, w], velocity[3:] + np.cross(turning, arm), turning]
        seen += [[data.qpos[angle], data.qvel[rate]] for angle, rate in self._hinges]
        for hub in self._hubs:
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, hub, velocity, 0)
            seen += [data.xpos[hub].copy(), velocity[3:].copy()]
        return np.concatenate(seen)
