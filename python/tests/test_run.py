"""Runs, traces and the user's own loop."""

import gc
import sys
import threading
import time
from types import MappingProxyType

import numpy as np
import pytest

import omnistep


def test_columns_share_the_memory_of_the_trace_and_cannot_be_written(climb):
    time = climb["time_s"]
    assert time.dtype == np.float64
    assert time.shape == (len(climb),) == (6000,)
    assert time.base is climb
    assert time.__array_interface__["data"] == (climb["time_s"].__array_interface__["data"][0], True)
    with pytest.raises(ValueError, match="read-only"):
        time[0] = 1.0
    with pytest.raises(ValueError, match="WRITEABLE"):
        time.flags.writeable = True
    speeds = climb.wheels("measured_rad_s")
    assert speeds.shape == (6000, 7)
    assert np.shares_memory(speeds, climb["wheel_5_measured_rad_s"])
    np.testing.assert_array_equal(speeds[:, 4], climb["wheel_5_measured_rad_s"])
    assert all(np.shares_memory(climb[name], column) for name, column in climb.columns().items())


def test_arrays_keep_the_trace_alive():
    time = omnistep.run("flat", overrides={"duration_s": 0.05})["time_s"]
    gc.collect()
    np.testing.assert_allclose(time, np.arange(1, 51) * 1e-3, rtol=0, atol=1e-15)


def test_names_are_what_can_be_read(climb):
    assert list(climb) == climb.names
    assert "pose_x_m" in climb
    assert "pose_x" not in climb
    assert 3 not in climb
    with pytest.raises(KeyError, match=r"did you mean .*pose_x_m"):
        climb["pose_x"]
    with pytest.raises(KeyError, match=r"did you mean .*measured_rad_s"):
        climb.wheels("measured")
    assert {name.split("_", 2)[2] for name in climb.names if name.startswith("wheel_")} == set(climb.wheel_signals)
    assert climb.wheel_names == list("1234567")
    assert climb.terrain == {"kind": "step", "friction": 0.7, "height_m": 0.05, "start_x_m": 0.7}
    assert (climb.scenario, climb.vehicle, climb.policy, climb.seed) == ("step", "chugo7", "scale_references", 0)
    np.testing.assert_array_equal(climb.wheel_radius_m, np.full(7, 0.066))


def test_the_step_is_climbed_with_the_pitch_that_geometry_asks_for(climb):
    outcome = climb.outcome
    assert outcome.climbed
    assert outcome.crossing_s == pytest.approx(2.5, abs=0.3)  # 0.66 m at 0.3 m/s, and some tenths for the bumps
    assert outcome.pitch_peak_deg == pytest.approx(np.degrees(np.arcsin(0.05 / 0.30)), abs=0.5)
    assert outcome.to_dict()["torque_squared_n2m2s"] == outcome.torque_squared_n2m2s
    assert outcome == climb.outcome != omnistep.run("flat", overrides={"duration_s": 0.01}).outcome
    assert "climbed in" in repr(climb)


def test_one_newton_metre_stalls_and_says_so():
    trace = omnistep.run(policy="independent", overrides={"vehicle.motor.stall_torque_n_m": 1.0})
    assert not trace.outcome.climbed
    assert trace.outcome.crossing_s is None


def test_compare_runs_the_policies_named_in_order():
    traces = omnistep.compare("flat", policies=["scale_torques", "independent"], overrides={"duration_s": 0.1})
    assert list(traces) == ["scale_torques", "independent"]
    assert traces["scale_torques"].policy == "scale_torques"
    assert list(omnistep.compare("flat", overrides={"duration_s": 0.01})) == omnistep.list_policies()


def test_a_user_s_own_loop_with_the_scenario_s_command_is_the_run_bit_for_bit(climb):
    sim = omnistep.Simulation("step", policy="scale_references")
    assert sim.period_s == 0.001
    for row in range(len(climb)):
        sample = sim.step(sim.command_at(sim.time_s))
        assert sample.time_s == climb["time_s"][row]
        np.testing.assert_array_equal(sample.measured_rad_s, climb.wheels("measured_rad_s")[row])
        np.testing.assert_array_equal(sample.applied_n_m, climb.wheels("applied_n_m")[row])
    assert sample.twist == tuple(climb[f"twist_{axis}"][-1] for axis in ("vx_m_s", "vy_m_s", "wz_rad_s"))
    assert sample.body_nose_up_rad["front"] == climb["body_front_nose_up_rad"][-1]
    assert sample.hinge_angle_rad["pitch"] == climb["hinge_pitch_angle_rad"][-1]
    np.testing.assert_array_equal(sample.force_normal_n, climb.wheels("force_normal_n")[-1])
    np.testing.assert_array_equal(sample.slip_ratio, climb.wheels("slip_ratio")[-1])
    np.testing.assert_array_equal(sample.position_m, [climb[f"pose_{a}_m"][-1] for a in "xyz"])


@pytest.mark.parametrize("command", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.5), (0.2, -0.1, 0.3)])
def test_flat_ground_twist_is_the_command_within_a_thousandth(command):
    sim = omnistep.Simulation("flat")
    twists = [sim.step(command).twist for _ in range(4000)][3000:]
    # Measured: at most 3e-4 of the command. The components not commanded: a few um/s.
    np.testing.assert_allclose(np.mean(twists, axis=0), command, rtol=1e-3, atol=1e-5)


def test_torques_without_a_controller_accelerate_the_vehicle():
    sim = omnistep.Simulation("flat")
    forward = np.array([1, 0, -1, 1, 1, 0, -1]) * 0.3
    for _ in range(500):
        sample = sim.step_torques(forward)
    np.testing.assert_array_equal(sample.applied_n_m, forward)
    # What only the controller knows is not made up.
    for unknown in (sample.measured_rad_s, sample.reference_rad_s, sample.disturbed_ratio, sample.command):
        assert np.isnan(unknown).all()
    # (m + 5 I / r^2) v' = 5 tau / r: wheels 2 and 6 stand crosswise. Wheels of 1 kg: I / r^2 = 0.5 kg.
    assert sample.twist[0] == pytest.approx(0.5 * 5 * 0.3 / 0.066 / (20 + 2.5), rel=1e-3)


@pytest.mark.parametrize("value", [np.int64(500), np.array(500), 500])
def test_integers_of_numpy_are_integers(value):
    key = "sensors.encoder_counts"
    assert omnistep.Scenario("flat", overrides=MappingProxyType({key: value}))[key] == 500


def test_override_values_arrive_exactly():
    values = {"terrain.friction": np.float32(0.1), "duration_s": 0.1 + 0.2}
    trace = omnistep.run("flat", overrides=values)
    assert trace.terrain["friction"] == float(np.float32(0.1))
    assert len(trace) == 300
    moved = omnistep.Simulation("flat", overrides={"vehicle.wheel.0.position_m": np.array([-0.3, -0.25])})
    assert len(moved.wheel_names) == 7


def test_same_seed_same_run_other_seed_other_run():
    overrides = {"perturbation.yaw_rad": 0.05, "duration_s": 0.2}
    one, again, other = (omnistep.run("step", overrides=overrides, seed=seed) for seed in (1, 1, 2))
    for name in one:
        np.testing.assert_array_equal(one[name], again[name])
    assert one["pose_yaw_rad"][-1] != other["pose_yaw_rad"][-1]


def turns_of_another_thread_during(call):
    """How often another thread got the interpreter's lock while a call went on."""
    stop, turns = threading.Event(), 0

    def count():
        nonlocal turns
        while not stop.is_set():
            turns += 1
            time.sleep(0)  # lets the lock go

    thread = threading.Thread(target=count)
    interval = sys.getswitchinterval()
    # The lock is not requested in the next minute: the thread runs where this one lets it go, or not at all.
    sys.setswitchinterval(60.0)
    try:
        thread.start()
        before = turns
        call()
        return turns - before
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        thread.join()


def test_other_threads_run_while_a_run_goes_on():
    # A run of some 100 ms, a turn of microseconds.
    overrides = {"duration_s": 0.5, "physics.engine": "rapier"}
    assert turns_of_another_thread_during(lambda: omnistep.run("flat", overrides=overrides, progress=False)) > 10
    # What keeps the lock is noticed: as many numbers in Python.
    assert turns_of_another_thread_during(lambda: sum(range(3_000_000))) == 0


def test_runs_at_once_in_threads_are_the_run_alone_bit_for_bit():
    results = {}
    weak = {"duration_s": 0.5, "vehicle.motor.stall_torque_n_m": 0.2}  # so that policies differ

    def work(policy, key):
        results[policy, key] = omnistep.run("flat", policy=policy, overrides=weak).to_numpy()

    pairs = [(policy, key) for policy in ("scale_torques", "independent") for key in (1, 2)]
    threads = [threading.Thread(target=work, args=pair) for pair in pairs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for policy, key in pairs:
        assert (results[policy, key] == omnistep.run("flat", policy=policy, overrides=weak).to_numpy()).all()
    assert (results["scale_torques", 1] != results["independent", 1]).any()


def test_a_torque_loop_of_one_s_own_reads_the_encoders_and_holds_the_speed():
    sim = omnistep.Simulation("flat")
    reference = np.array([1, 0, -1, 1, 1, 0, -1]) * 0.2 / 0.066
    for _ in range(2000):
        sample = sim.step_torques(np.clip(0.5 * (reference - sim.measured_rad_s), -2.0, 2.0))
    # Proportional control alone; nothing resists on flat ground but the contacts.
    assert sample.twist[0] == pytest.approx(0.2, rel=1e-3)
