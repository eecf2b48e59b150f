"""Odometry, PID and the whole controller in Python: the numbers of the control library, over arrays as step by step."""

import math

import numpy as np
import pytest

import omnistep


def kinematics():
    return omnistep.Kinematics(layout=omnistep.Layout.chugo7(r1_m=0.30, r2_m=0.23, radius_m=0.1))


# Odometry


def test_a_circle_of_one_turn_ends_where_it_began():
    maps = kinematics()
    odometry = omnistep.Odometry(kinematics=maps, period_s=0.001)
    poses = odometry.step_velocities(maps.inverse([[0.5, 0.2, math.tau]] * 1000))
    # Exact along arcs: what is left is rounding, 1000 times 1e-16 m.
    assert np.abs(odometry.pose[:2]).max() < 1e-12
    assert abs(math.remainder(odometry.pose[2], math.tau)) < 1e-11
    # Half way it is a diameter away from the start: 2 v / w.
    assert np.hypot(*poses[499, :2]) == pytest.approx(2 * math.hypot(0.5, 0.2) / math.tau, abs=1e-12)


def test_rows_at_once_are_the_same_bits_as_one_by_one():
    maps = kinematics()
    velocities = np.random.default_rng(1).normal(size=(200, 7))
    at_once = omnistep.Odometry(kinematics=maps, period_s=0.01, pose=[1.0, 2.0, 3.0])
    one_by_one = omnistep.Odometry(kinematics=maps, period_s=0.01, pose=[1.0, 2.0, 3.0])
    assert (at_once.step_velocities(velocities) == [one_by_one.step_velocities(row) for row in velocities]).all()
    positions = velocities.cumsum(axis=0)
    assert (at_once.step_positions(positions) == [one_by_one.step_positions(row) for row in positions]).all()


def test_the_first_positions_only_start_and_a_gap_costs_nothing():
    odometry = omnistep.Odometry(kinematics=kinematics(), period_s=0.001)
    forward = kinematics().inverse([1.0, 0.0, 0.0])
    positions = 7.0 + np.outer([0.0, 0.1, np.nan, 0.3], forward)
    x = odometry.step_positions(positions)[:, 0]
    assert x == pytest.approx([0.0, 0.1, 0.1, 0.3], abs=1e-12)
    odometry.forget_positions()
    assert odometry.step_positions(np.zeros(7))[0] == pytest.approx(0.3, abs=1e-12)
    odometry.reset([0.0, 0.0, 7.0])
    assert odometry.pose[2] == pytest.approx(7.0 - math.tau, abs=1e-12)
    assert odometry.step_displacements([0.0, 0.0, 0.5])[2] == pytest.approx(7.5 - math.tau, abs=1e-12)


def test_odometry_follows_a_simulated_vehicle():
    trace = omnistep.run("flat", overrides={"duration_s": 1.0, "command.wz_rad_s": 0.5})
    odometry = omnistep.Odometry(
        kinematics=omnistep.Kinematics(layout=omnistep.Vehicle("chugo7").layout), period_s=1e-3
    )
    poses = odometry.step_velocities(trace.wheels("measured_rad_s"))
    pose = np.stack([trace[f"pose_{axis}"] for axis in ("x_m", "y_m", "yaw_rad")], axis=1)
    # Wheels that start slip a little: 0.1 mm and 0.2 mrad were measured at the end. Without yaw y would be 49 mm off,
    # with yaw the other way round 98 mm and 0.85 rad.
    np.testing.assert_allclose(poses[-1, :2], pose[-1, :2], rtol=0, atol=1e-3)
    assert poses[-1, 2] == pytest.approx(pose[-1, 2], abs=1e-3)
    # It went somewhere, and turned: nearly the second's 0.3 m and 0.5 rad, less what starting took.
    assert pose[-1, 0] > 0.2 and pose[-1, 1] > 0.04 and pose[-1, 2] > 0.4


# PID


def test_a_pid_is_the_textbook_sum_of_its_terms():
    pid = omnistep.Pid(kp_n_m_s_rad=2.0, ki_n_m_rad=10.0, kd_n_m_s2_rad=0.5, period_s=0.1)
    reference, measured = np.array([1.0, 1.0, 2.0]), np.array([0.0, 0.5, 0.5])
    error = reference - measured
    sample = pid.step(reference, measured)
    assert sample.p_n_m == pytest.approx(2.0 * error)
    assert sample.i_n_m == pytest.approx(10.0 * 0.1 * error.cumsum())
    assert sample.d_n_m == pytest.approx(0.5 * np.diff(error, prepend=error[0]) / 0.1)  # none in the first step
    assert sample.output_n_m == pytest.approx(sample.p_n_m + sample.i_n_m + sample.d_n_m)
    assert not sample.saturated.any()
    assert pid.integral_n_m == pytest.approx(sample.i_n_m[-1])


def test_a_limited_pid_says_so_and_does_not_wind_up():
    def overshoot(anti_windup):
        pid = omnistep.Pid(
            kp_n_m_s_rad=1.0,
            ki_n_m_rad=5.0,
            period_s=0.01,
            output_n_m=(-1.0, 1.0),
            anti_windup=anti_windup,
        )
        speed, fastest, limited = 0.0, 0.0, False
        for _ in range(1000):  # an inertia of 1 kg.m^2 asked for 2 rad/s
            sample = pid.step(2.0, speed)
            limited |= bool(sample.saturated)
            speed += 0.01 * float(sample.output_n_m)
            fastest = max(fastest, speed)
        assert limited
        return fastest - 2.0

    none = overshoot("none")
    for anti_windup in [
        "conditioned",
        "conditional",
        {"back_calculation": {"tracking_time_s": 0.2}},
        {"clamp": {"limit_n_m": 0.5}},
    ]:
        assert overshoot(anti_windup) < 0.7 * none, anti_windup


@pytest.mark.parametrize("anti_windup", ["conditioned", {"back_calculation": {"tracking_time_s": 0.3 / 2.0}}])
def test_with_a_limited_proportional_term_a_blocked_loop_winds_up_to_its_limit(anti_windup):
    pid = omnistep.Pid(
        kp_n_m_s_rad=0.3,
        ki_n_m_rad=2.0,
        period_s=0.001,
        proportional_limit_n_m=0.4,
        output_n_m=(-1.0, 1.0),
        anti_windup=anti_windup,
    )
    blocked = pid.step(np.full(20_000, 10.0), 0.0)
    assert (blocked.p_n_m == 0.4).all() and blocked.output_n_m[-1] == 1.0
    # A law that compares outputs alone settles at 1 - 0.4 + 0.3 * 10 = 3.6 N.m. 0.02 N.m are a period's own.
    assert 0.98 - 1e-9 < pid.integral_n_m < 1.0 + 1e-9


def test_an_integral_zone_forgets_what_was_taken_in_before():
    pid = omnistep.Pid(kp_n_m_s_rad=1.0, ki_n_m_rad=4.0, period_s=0.25, integral_zone_rad_s=2.0)
    assert pid.step([9.0, 2.0, 1.0, 3.0, 1.0], 0.0).output_n_m.tolist() == [9.0, 4.0, 4.0, 3.0, 2.0]


def test_tracking_takes_over_without_a_bump_and_reset_forgets():
    pid = omnistep.Pid(kp_n_m_s_rad=2.0, ki_n_m_rad=10.0, period_s=0.1)
    pid.track(0.7, reference_rad_s=1.0, measured_rad_s=0.4)
    assert float(pid.step(1.0, 0.4).output_n_m) == pytest.approx(0.7)
    pid.reset()
    assert pid.integral_n_m == 0.0


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"kp_n_m_s_rad": -1.0}, "kp_n_m_s_rad"),
        ({"period_s": 0.0}, "period_s"),
        ({"anti_windup": "clamp"}, "anti_windup"),
        ({"anti_windup": {"clamp": {"tracking_time_s": 0.1}}}, "anti_windup"),
        ({"anti_windup": {"clamp": {"limit_n_m": -1}}}, "anti_windup.clamp.limit_n_m"),
        (
            {"anti_windup": {"back_calculation": {"tracking_time_s": 0.001}}},
            "anti_windup.back_calculation.tracking_time_s",
        ),
        ({"anti_windup": "windmill"}, "anti_windup"),
        ({"order": "during"}, "order"),
        ({"output_n_m": (0.1, 1.0)}, "output_n_m"),
        ({"static_friction_n_m": math.nan}, "static_friction_n_m"),
        ({"integral_zone_rad_s": -1.0}, "integral_zone_rad_s"),
        ({"proportional_limit_n_m": math.nan}, "proportional_limit_n_m"),
    ],
)
def test_an_argument_of_a_pid_is_refused_by_its_name(arguments, key):
    with pytest.raises(omnistep.ConfigError, match="allowed") as caught:
        omnistep.Pid(**{"kp_n_m_s_rad": 1.0, "period_s": 0.01, **arguments})
    assert caught.value.key == key


# Controller


# Those with loops of the wheels: traction control asks for hinges and an inertial unit besides.
@pytest.mark.parametrize("policy", ["independent", "scale_torques", "scale_references", "shared_integral"])
@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_a_controller_on_a_runs_measurements_gives_that_runs_torques_bit_for_bit(policy, precision):
    scenario = omnistep.Scenario("step", policy=policy, overrides={"duration_s": 1.0, "control.precision": precision})
    trace = omnistep.run(scenario)
    controller = omnistep.Controller(scenario)
    commands = np.column_stack([trace[f"command_{axis}"] for axis in ("vx_m_s", "vy_m_s", "wz_rad_s")])
    again = controller.step(commands, trace.wheels("measured_rad_s"))
    for signal in ("reference_rad_s", "requested_n_m", "applied_n_m", "limit_upper_n_m", "residual_rad_s"):
        assert (getattr(again, signal) == trace.wheels(signal)).all(), signal
    assert (again.common_factor == trace["common_factor"]).all()
    assert again.saturated.shape == (1000, 7)
    # Step by step, and freshly started, it is the same again.
    controller.reset()
    for k in range(300):
        single = controller.step(commands[k], trace.wheels("measured_rad_s")[k])
        assert (single.applied_n_m == again.applied_n_m[k]).all()
    assert single.common_factor.shape == ()


def test_a_controller_refuses_what_it_cannot_use_by_name():
    controller = omnistep.Controller("flat", policy="scale_references")
    with pytest.raises(omnistep.ConfigError, match=r"commands\[1\] = NaN"):
        controller.step([0.0, math.nan, 0.0], np.zeros(7))
    with pytest.raises(omnistep.ConfigError, match=r"measured_rad_s = 3 rows, allowed: as many as commands, 2, or one"):
        controller.step(np.zeros((2, 3)), np.zeros((3, 7)))
    # One row, whatever its dimensions, stays the same for every row of the other.
    assert controller.step(np.zeros((1, 3)), np.zeros((3, 7))).applied_n_m.shape == (3, 7)
    with pytest.raises(omnistep.ConfigError, match=r"allowed: shape \(7,\) or \(T, 7\)"):
        controller.step(np.zeros(3), np.zeros(3))
    # A wheel whose encoder says nothing is not bad input: its loop holds what its integral holds.
    assert np.isfinite(controller.step([0.3, 0.0, 0.0], [0, 0, 0, math.nan, 0, 0, 0]).applied_n_m).all()


def test_one_number_in_a_list_stays_the_same_for_every_step_of_a_pid():
    pid = omnistep.Pid(kp_n_m_s_rad=1.0, period_s=0.1)
    assert pid.step([1.0, 2.0], [0.5]).output_n_m.tolist() == [0.5, 1.5]
    with pytest.raises(
        omnistep.ConfigError, match="measured_rad_s = 3 numbers, allowed: as many as references, 2, or one"
    ):
        pid.step([1.0, 2.0], [0.0, 0.0, 0.0])


@pytest.mark.parametrize("kind", [omnistep.Controller, omnistep.Simulation, omnistep.run])
def test_encoders_of_which_one_count_is_more_than_the_motor_has_are_warned_of(kind):
    with pytest.warns(UserWarning, match=r"98\.2 rad/s, for which the gains ask 29\.6 N\.m, but the motor has 2"):
        kind("flat", policy="independent", overrides={"sensors.encoder_counts": 64, "duration_s": 0.1})
    kind("flat", overrides={"sensors.encoder_counts": 4096, "duration_s": 0.1})  # warnings are errors here
