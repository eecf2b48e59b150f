"""Traction control from Python: its signals, its keys, where it is refused."""

import pickle
import re
import warnings

import numpy as np
import pytest

import omnistep

QUICK = {"physics.engine": "articulated", "duration_s": 6.0}


@pytest.mark.parametrize("policy", ["traction", "traction_runup"])
def test_its_signals_tell_why_it_does_what_it_does(policy):
    trace = omnistep.run("step", policy=policy, overrides=QUICK)
    assert trace.outcome.climbed
    speed_wheel = trace["traction_speed_wheel"]
    assert set(np.unique(speed_wheel)) <= set(range(8))  # wheels from 1; 0 is none
    row = trace["traction_row"]
    first = [int(np.argmax(row == wanted)) for wanted in (0, 1, 2)]
    assert first == sorted(first) and set(np.unique(row)) == {0, 1, 2}  # front row, wheel 4, rear row
    # The measured speed follows the supervisor's target where nothing is climbed. After the command's ramp of 0.3 s
    # the integral overshoots by a twentieth of the 0.3 m/s, which goes with its time constant of 0.7 s.
    approach = slice(800, 1200)
    assert np.abs(trace["traction_speed_m_s"] - trace["traction_target_m_s"])[approach].max() < 0.015
    # The thrust is within what the motors have, and the share of the command that is reached within -1 and 1.
    assert np.abs(trace["traction_thrust_n_m"]).max() <= 2.0
    assert np.abs(trace["traction_factor"]).max() <= 1.0


def test_a_key_of_the_policy_goes_with_the_policy_that_is_asked_for():
    hard = {"terrain.friction": 0.55, "vehicle.motor.stall_torque_n_m": 1.4, "perturbation.yaw_rad": 0.03}
    once = omnistep.run("step", policy="traction", seed=5, overrides={**QUICK, **hard, "control.max_retries": 0})
    assert once["traction_retries"].max() == 0
    with pytest.raises(
        omnistep.ConfigError, match=r"max_retries: 0, allowed: only with control.policy = .traction. or"
    ):
        omnistep.run("step", policy="scale_torques", overrides={"control.max_retries": 0})


#: A step of 10 cm, higher than the wheels' radius of 6.6 cm: no friction brings a row onto it.
HOPELESS = {**QUICK, "terrain.height_m": 0.1}


def test_retries_are_a_metric_of_the_outcome_and_lines_in_the_plot():
    traces = omnistep.compare("step", policies=["scale_torques", "traction"], overrides=HOPELESS)
    tried = traces["traction"]
    retries = tried.outcome.retries
    assert retries == tried["traction_retries"][-1] > 0
    assert retries == tried.outcome.to_dict()["retries"]
    assert traces["scale_torques"].outcome.retries is None
    assert pickle.loads(pickle.dumps(tried.outcome)).retries == retries
    axes = omnistep.plot.climb(tried)
    dotted = [[line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == ":"] for ax in axes]
    # It backs off in the period after the one in which it was stuck for long enough: there the count rises.
    rises = tried["time_s"][1:][np.diff(tried["traction_retries"]) > 0]
    assert len(rises) == retries and all(np.array_equal(each, rises) for each in dotted)
    labels = [line.get_label() for line in axes[2].lines]
    assert labels.count("another try") == 1
    plain = omnistep.plot.climb(traces["scale_torques"])
    assert "another try" not in [line.get_label() for line in plain[2].lines]


def test_a_sweep_has_a_column_of_retries_that_is_null_of_loops(tmp_path):
    points = {"control.policy": ["scale_torques", "traction"]}
    result = omnistep.sweep(points, overrides=HOPELESS, out=tmp_path, progress=False)
    scaled, traction = (row["retries"] for row in result.rows())
    assert scaled is None and traction > 0
    assert result.summary("retries")[1]["retries"] == traction


#: What it says of a vehicle without encoders on its hinges.
WITHOUT = r"traction without hinge encoders: it cannot tell a climbing row from slipping wheels"
LACKS = {"physics.engine": "articulated", "duration_s": 0.05, "sensors.no_hinge_encoders": True}


def caught(call):
    """The warnings of a call: their texts, each a UserWarning that names this file."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        call()
    assert all(each.category is UserWarning and each.filename == __file__ for each in found), found
    return [str(each.message) for each in found]


def test_what_it_does_without_is_warned_of_once_wherever_it_runs(tmp_path):
    run = {"policy": "traction", "overrides": LACKS}
    (said,) = caught(lambda: omnistep.run("flat", **run))
    assert re.fullmatch(WITHOUT, said)
    assert caught(lambda: omnistep.Simulation("flat", **run)) == [said]
    both = caught(
        lambda: omnistep.compare("flat", policies=["scale_torques", "traction", "traction_runup"], overrides=LACKS)
    )
    assert both == [said, said.replace("traction", "traction_runup")]
    points = {"control.policy": ["scale_torques", "traction"]}
    for each in range(2):  # also where all rows are there
        sweep = {"scenario": "flat", "overrides": LACKS, "seeds": 3, "out": tmp_path, "progress": False}
        assert caught(lambda sweep=sweep: omnistep.sweep(points, **sweep)) == [f"3 of 6 runs: {said}"], each
    study = {"overrides": LACKS, "seeds": 1, "out": tmp_path / "study", "progress": False}
    assert caught(lambda: omnistep.run_study("ensemble", **study)) == [f"1 of 5 runs: {said}"]
    slow = {**LACKS, "sensors.no_hinge_encoders": False, "vehicle.motor.slope_n_m_s_rad": 0.1}
    (motors,) = caught(lambda: omnistep.run("flat", policy="traction_runup", overrides=slow))
    assert motors.startswith("traction_runup with motors of 20.0 rad/s without load: ")


def test_there_is_no_warning_of_it_under_another_controller():
    assert caught(lambda: omnistep.run("flat", policy="scale_torques", overrides=LACKS)) == []
    own = {"policy": lambda observation: 0.0 * observation.wheels_rad_s, "overrides": LACKS}
    assert caught(lambda: omnistep.run("step", **own)) == []  # whose own policy is traction


def test_its_torque_ends_at_rest_too():
    shorter = {"control.rest.bleed_s": 0.1, "duration_s": 1.5}
    shorter["command.then"] = [{"at_s": 1.0, "vx_m_s": 0.0, "vy_m_s": 0.0, "wz_rad_s": 0.0}]
    trace = omnistep.run("flat", policy="traction", overrides=shorter)
    torques = trace.wheels("applied_n_m")
    at_rest = trace["command_vx_m_s"] == 0.0
    over = np.flatnonzero(at_rest & (trace["time_s"] > 0.5))[0] + 100
    assert np.abs(torques[over - 150]).max() > 0.0 and (torques[over:] == 0.0).all()


def test_where_it_is_refused_it_says_where_and_what_would_do():
    with pytest.raises(omnistep.ConfigError, match=r"traction., allowed in a Controller, which does not read hinges"):
        omnistep.Controller("step", policy="traction")


def test_in_a_drive_it_climbs_and_both_tell_what_they_do():
    keys = {"physics.engine": "articulated", "drive.discretize": False}
    trace = omnistep.run("step", policy="traction_runup", overrides=keys, progress=False)
    assert trace.outcome.climbed and trace.outcome.retries == 0
    assert trace["drive_mode"].max() == 0.0 and (trace["traction_loops"] == 1.0).any()


def test_in_a_simulation_it_is_stepped_saved_and_resumed_to_the_same_bits():
    whole = omnistep.Simulation("step", policy="traction", overrides=QUICK)
    for _ in range(1500):
        whole.step((0.3, 0.0, 0.0))
    other = omnistep.Simulation.resume("step", whole.save(), policy="traction", overrides=QUICK)
    for _ in range(900):
        assert (whole.step((0.3, 0.0, 0.0)).applied_n_m == other.step((0.3, 0.0, 0.0)).applied_n_m).all()
