"""MuJoCo as a second opinion: the quick part of scripts/mujoco/gate.py, and what the file must hold."""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

import omnistep

mujoco = pytest.importorskip("mujoco", reason='MuJoCo is not installed: pip install "omnistep[mujoco]"')
second = pytest.importorskip("omnistep.mujoco")

ROOT = Path(__file__).resolve().parents[2]
VEHICLES = ["omni3", "mecanum4", "chugo7", "rocker_bogie6"]


@pytest.fixture(scope="module")
def gate():
    spec = importlib.util.spec_from_file_location("gate_of_mujoco", ROOT / "scripts/mujoco/gate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_contacts_are_the_springs_and_dampers_of_the_vehicle_file(vehicle):
    scenario = omnistep.Scenario("flat", vehicle=vehicle)
    model = second.load(scenario)
    for wheel in scenario.vehicle.to_dict()["wheel"]:
        # docs/physics.md: m (2 pi f)^2 and 2 zeta sqrt(k m), f = 200 Hz and zeta = 5 of the scenario.
        stiffness = wheel["mass_kg"] * (2 * math.pi * 200.0) ** 2
        damping = 10.0 * math.sqrt(stiffness * wheel["mass_kg"])
        hub = model.body(f"wheel_{wheel['name']}").id
        shapes = [i for i in range(model.ngeom) if model.body_parentid[model.geom_bodyid[i]] == hub]
        shapes = [i for i in shapes if model.geom_contype[i] == 1]
        assert shapes
        for shape in shapes:
            solimp = model.geom_solimp[shape, 0]
            soft = (1.0 - solimp) / solimp * model.body_invweight0[model.geom_bodyid[shape], 0]
            found = -model.geom_solref[shape] / solimp / soft
            # One inverse mass a wheel, the mean over its rollers: the frame turns with some more than with others.
            np.testing.assert_allclose(found, [stiffness, damping], rtol=0.04)


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_model_weighs_what_the_vehicle_does(vehicle):
    scenario = omnistep.Scenario("flat", vehicle=vehicle)
    model, keys = second.load(scenario), scenario.vehicle.to_dict()
    mass = sum(part["mass_kg"] for part in (*keys["body"], *keys["wheel"]))
    assert model.body_subtreemass[model.body("base_link").id] == pytest.approx(mass, rel=1e-9)
    for wheel in keys["wheel"]:
        hub = model.body(f"wheel_{wheel['name']}").id
        assert model.body_subtreemass[hub] == pytest.approx(wheel["mass_kg"], rel=1e-9)


@pytest.mark.parametrize("name", ["step", "stairs", "ramp", "ditch", "half_step", "step_down", "rough", "height_map"])
def test_the_ground_is_as_high_as_ours(name):
    scenario = omnistep.Scenario(name, overrides={"duration_s": 0.01})
    model = second.load(scenario)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    trace = omnistep.run(scenario, progress=False)
    base, hit = model.body("base_link").id, np.zeros(1, dtype=np.int32)
    groups = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8)  # what is only seen is in group 1
    for x in np.arange(0.45, 2.0, 0.0713):
        for y in (-0.317, 0.0, 0.193):
            expected = trace.ground_m([x], y_m=y)[0]
            height = 5.0 - mujoco.mj_ray(
                model, data, np.array([x, y, 5.0]), np.array([0.0, 0.0, -1.0]), groups, 1, base, hit
            )
            # A cell of a field of heights is cut along one of its two diagonals.
            assert height == pytest.approx(expected, abs=1e-3 if name in ("rough", "height_map") else 1e-9), (x, y)


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_row_loads_are_ours_within_a_hundredth_of_a_newton(gate, vehicle):
    np.testing.assert_allclose(gate.loads_n(gate.theirs, vehicle), gate.loads_n(gate.ours, vehicle), atol=gate.LOAD_N)


@pytest.mark.parametrize("vehicle", ["omni3", "chugo7"])
def test_free_acceleration_is_ours_within_half_a_per_cent(gate, vehicle):
    expected = gate.acceleration_m_s2(gate.ours, vehicle)
    assert gate.acceleration_m_s2(gate.theirs, vehicle) == pytest.approx(expected, rel=gate.ACCELERATION)


@pytest.mark.parametrize(
    ("vehicle", "command"),
    [("omni3", (0.3, 0.0, 0.0)), ("mecanum4", (0.0, 0.3, 0.0)), ("mecanum4", (0.0, 0.0, 0.5))],
)
def test_flat_twists_are_ours_within_a_thousandth(gate, vehicle, command):
    expected = gate.twist(gate.ours, vehicle, command)
    assert gate.twist(gate.theirs, vehicle, command) == pytest.approx(expected, rel=gate.TWIST)


def test_friction_in_mujoco_lifts_what_slides():
    # Why rows of the gate where much slides have bounds of their own: 2.2 kg on the spring and damper of chugo7.
    mass, stiffness, damper, friction, step = 2.2, 1.58e6, 12.6e3, 0.7, 5e-4
    soft = 0.4 / (damper * step)
    solimp = 1.0 / (1.0 + soft * mass)
    resistance = (1.0 - solimp) / solimp / mass
    solref = f"{-stiffness * resistance * solimp} {-damper * resistance * solimp}"
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="10"/><worldbody>
        <geom type="plane" size="0 0 1"/><body pos="0 0 0.01">
        <joint type="slide" axis="1 0 0" name="x"/><joint type="slide" axis="0 0 1"/>
        <geom type="sphere" size="0.01" mass="{mass}" condim="3" friction="{friction} 0 0" priority="1"
         solref="{solref}" solimp="{solimp} {solimp} 0.001"/></body></worldbody>
        <actuator><velocity joint="x" kv="1e6"/></actuator></mujoco>""")

    def sunk_m(slip_m_s):
        data = mujoco.MjData(model)
        data.ctrl[0] = slip_m_s
        mujoco.mj_step(model, data, 4000)
        return -data.qpos[1]

    still = mass * 9.81 / stiffness
    # Of MuJoCo's own convex cone: (1 + mu^2 / impratio) of the depth, less mu v times damper over spring.
    sliding = (1.0 + friction**2 / 10.0) * still - friction * 0.002 * damper / stiffness
    assert sunk_m(0.0) == pytest.approx(still, rel=1e-3)
    assert sunk_m(0.002) == pytest.approx(sliding, rel=0.05)
    assert sliding < 0.25 * still


def test_the_yaw_rate_of_two_rows_is_ours_within_what_sliding_rollers_make_of_it(gate):
    expected = gate.twist(gate.ours, *gate.SLIDING[0])
    off = gate.twist(gate.theirs, *gate.SLIDING[0]) / expected - 1.0
    assert abs(off) < gate.SLIDING_TWIST


@pytest.fixture(scope="module")
def climb():
    return second.run("step", policy="independent", overrides={"stop_when_done": True}, progress=False)


def test_the_step_is_crossed_within_three_per_cent_of_our_time(gate, climb):
    ours = gate.ours("step", {"stop_when_done": True}, "independent")
    assert climb.outcome.verdict == ours.outcome.verdict == "climbed"
    assert climb.outcome.crossing_s == pytest.approx(ours.outcome.crossing_s, rel=gate.CROSSING)


def test_a_run_has_the_columns_of_ours_and_its_forces_explain_its_motion(gate, climb):
    assert climb.outcome.engine == "mujoco"
    assert climb.outcome.wheel_model_valid
    ours = omnistep.run("step", policy="independent", overrides={"duration_s": 0.01}, progress=False)
    assert climb.names == ours.names
    # Momentum changes by what contacts and gravity push; what is left over is the integrator's.
    assert np.max(climb["newton_residual_n"]) < 0.02 * 20 * 9.81
    assert np.median(climb["newton_residual_n"]) < 1e-3 * 20 * 9.81
    assert np.all(np.isnan(climb["friction_loss_j"])) and math.isnan(climb.outcome.energy_residual)
    # 20 kg higher by 5 cm, and nothing else has supplied it.
    assert climb["potential_j"][-1] == pytest.approx(20 * 9.81 * 0.05, rel=0.02)
    assert climb["work_in_j"][-1] > climb["potential_j"][-1] + climb["kinetic_j"][-1]


def test_a_gear_and_its_friction_are_felt_at_the_axle():
    keys = {"vehicle": "omni3", "duration_s": 0.3, "vehicle.motor.gear_friction_n_m": 0.05}
    keys |= {f"vehicle.wheel.{i}.gear": 0.05 for i in range(3)}
    # 0.02 N.m behind a gear of 20 are 0.4 N.m; friction holds the wheels against 0.04 N.m and takes 0.05 of more.
    still = second.run("flat", policy=lambda seen: np.full(3, 0.002), overrides=keys, progress=False)
    assert np.max(np.abs(still["twist_wz_rad_s"])) < 1e-3
    free = second.run("flat", policy=lambda seen: np.full(3, 0.02), overrides=keys, progress=False)
    scenario = omnistep.Scenario("flat", overrides=keys)
    ours = omnistep.run(
        scenario.replace({"physics.engine": "articulated", "physics.wheel_model": "rollers"}),
        policy=lambda seen: np.full(3, 0.02),
        progress=False,
    )
    assert free["twist_wz_rad_s"][-1] == pytest.approx(ours["twist_wz_rad_s"][-1], rel=0.01)
    # An encoder reads the motor, which turns twenty times as fast as its wheel.
    expected = ours.wheels("measured_rad_s")[-1]
    assert np.all(expected > 20.0)
    np.testing.assert_allclose(free.wheels("measured_rad_s")[-1], expected, rtol=0.02)


def test_a_changed_model_runs_and_a_foreign_one_is_refused():
    scenario = omnistep.Scenario("flat", overrides={"duration_s": 0.05})
    model = second.load(scenario)
    model.opt.gravity[2] = -1.62
    trace = second.run(scenario, model=model, progress=False)
    loads = [np.mean(trace[f"row_{i}_load_n"][-10:]) for i in (1, 2, 3)]
    assert sum(loads) == pytest.approx(20 * 1.62, rel=0.01)
    foreign = '<mujoco><option timestep="{}"/></mujoco>'
    with pytest.raises(KeyError, match="base_link"):
        second.run(scenario, model=mujoco.MjModel.from_xml_string(foreign.format(5e-4)), progress=False)
    with pytest.raises(ValueError, match=r"a time step of 0.002 s, allowed: 0.0005 s"):
        second.run(scenario, model=mujoco.MjModel.from_xml_string(foreign.format(2e-3)), progress=False)


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_what_is_put_into_the_scene_is_no_wheel_and_forces_are_read_from_either_cone(cone):
    scenario = omnistep.Scenario("flat", overrides={"duration_s": 0.3, "command.vx_m_s": 0.0})
    ball = '<worldbody><body pos="3 0 0.05"><freejoint/><geom size="0.05" mass="5" condim="1"/></body>'
    text = scenario.mjcf().replace("<worldbody>", ball, 1).replace('cone="elliptic"', f'cone="{cone}"')
    trace = second.run(scenario, model=mujoco.MjModel.from_xml_string(text), progress=False)
    loads = [np.mean(trace[f"row_{i}_load_n"][-50:]) for i in (1, 2, 3)]
    assert sum(loads) == pytest.approx(20 * 9.81, rel=1e-3)


def test_what_the_controller_raises_and_what_mujoco_cannot_do_is_said(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings into a file

    def broken(seen):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        second.run("flat", policy=broken, progress=False)
    load = [{"kind": "load_added", "body": "rear", "mass_kg": 1.0, "at_m": [0.0, 0.0, 0.2], "from_s": 0.1}]
    with pytest.raises(omnistep.ConfigError, match="load_added"):
        second.run("flat", overrides={"fault": load}, progress=False)
    with pytest.raises(omnistep.ConfigError, match="expected `articulated` or `rapier`"):
        omnistep.run("flat", overrides={"physics.engine": "mujoco"})
    falling = second.load("flat")
    falling.opt.gravity[2] = -1e12
    with pytest.raises(omnistep.SimulationError, match="diverged"):
        second.run("flat", model=falling, progress=False)


class _Fake:
    """Physics of omni3 that show prescribed states."""

    def __init__(self, shown, seen):
        self.shown, self.seen = shown, seen

    def start(self, x_m, yaw_rad):
        pass

    def step(self, torques_n_m, dampers_n_m_s_rad, holds_n_m):
        return self.shown, np.empty((0, 10))

    def observe(self):
        return self.seen


def test_physics_that_show_no_numbers_have_diverged_and_too_few_are_refused():
    scenario = omnistep.Scenario("flat", vehicle="omni3", overrides={"duration_s": 0.01})
    still, seen = np.zeros(6), np.zeros(5 + 13 + 6 * 3)
    seen[11] = 1.0  # a quaternion
    nowhere = seen.copy()
    nowhere[5] = np.nan
    for shown, state in ((np.full(6, np.nan), seen), (still, nowhere)):
        with pytest.raises(omnistep.SimulationError, match="diverged"):
            second.run_external(_Fake(shown, state), scenario)
    with pytest.raises(ValueError, match="step returned 5 angles and rates"):
        second.run_external(_Fake(still[:5], seen), scenario)
    with pytest.raises(ValueError, match="observe returned 35 numbers, allowed: 36"):
        second.run_external(_Fake(still, seen[:35]), scenario)
