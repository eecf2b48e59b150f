"""Trajectories, followers, encoders and motors in Python: the numbers of the control library, over arrays."""

import math
import pickle

import numpy as np
import pytest

import omnistep


def refused(call, *args, **kwargs):
    with pytest.raises(omnistep.ConfigError, match="allowed") as caught:
        call(*args, **kwargs)
    return caught.value


def planner(**other):
    layout = omnistep.Layout.mecanum4(wheelbase_m=0.5, track_m=0.4, radius_m=0.1)
    given = {
        "kinematics": omnistep.Kinematics(layout=layout),
        "velocity": [0.5, 1.0],
        "acceleration": [1.0, 1.0],
        "jerk": [10.0, 10.0],
        "mass_kg": 20.0,
        "yaw_kg_m2": 1.0,
        "speeds_rad_s": 25.0,
        "stall_torque_n_m": 3.0,
    }
    return omnistep.TrajectoryPlanner(**{**given, **other})


# Trajectories


def test_a_straight_way_has_the_times_speeds_and_torques_of_its_limits():
    plan = planner()
    ahead = plan.plan([(0.0, 0.0), omnistep.Waypoint(2.0, 0.0)])
    # Way over speed, and for each of two ramps half of v / a + a / j, as in omni-core's own examples.
    assert ahead.duration_s == pytest.approx(2.0 / 0.5 + 0.5 / 1.0 + 1.0 / 10.0, abs=1e-9)
    halfway = ahead.at(0.5 * ahead.duration_s)
    assert halfway.pose == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    assert plan.velocities(halfway) == pytest.approx([5.0] * 4, abs=1e-9)  # 0.5 m/s over 0.1 m
    speeding_up = ahead.at(0.3)  # the jerk of 10 m/s^3 is behind
    assert speeding_up.acceleration == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    assert plan.torques(speeding_up) == pytest.approx([20.0 * 1.0 / 4.0 * 0.1] * 4, abs=1e-9)


def test_samples_of_many_times_are_those_of_each_and_integrate_to_the_way():
    spline = omnistep.Waypoint(1.5, 1.0, kind="spline", heading_rad=1.0)
    arc = omnistep.Waypoint(1.0, 0.0, kind="arc", sweep_rad=1.57)
    plan = planner()
    path = plan.plan([(0.0, 0.0), arc, spline, (0.0, 0.0)])
    times = np.linspace(-1.0, path.duration_s + 1.0, 20_001)
    samples = path.at(times)
    each = [path.at(time) for time in times[::500]]
    for name, columns in [("pose", 3), ("velocity", 3), ("acceleration", 3), ("feed_forward", 3)]:
        values = getattr(samples, name)
        assert values.shape == (20_001, columns)
        assert (values[::500] == [getattr(one, name) for one in each]).all()
    assert plan.torques(samples).shape == plan.velocities(samples).shape == (20_001, 4)
    assert (samples.speed_m_s == samples.speed_m_s.clip(0.0, 0.5 + 1e-9)).all()
    # Velocities are the poses' own changes: trapezoids of up to 1 m/s^3 over steps of 1 ms leave 1e-7 m.
    step = times[1] - times[0]
    steps = (samples.velocity[1:] + samples.velocity[:-1]) * 0.5 * step
    turns = np.unwrap(samples.pose[:, 2])
    moved = np.column_stack([samples.pose[:, :2], turns])
    np.testing.assert_allclose(moved[0] + steps.cumsum(axis=0), moved[1:], rtol=0, atol=1e-5)
    # At rest before and after; done from the end on.
    outside = (times <= 0.0) | (times >= path.duration_s)
    assert not samples.velocity[outside].any()
    assert (samples.done == (times >= path.duration_s)).all()
    assert path.starts_s.shape == path.lengths_m.shape == (3,)
    assert path.lengths_m[0] == pytest.approx(1.57 * 0.5 / math.sin(0.785), abs=1e-6)


def test_a_trajectory_of_a_scenario_is_what_its_run_follows():
    scenario = omnistep.Scenario("square", overrides={"command.follow.gain_per_s": 0.0})
    assert omnistep.Scenario("flat").trajectory is None and omnistep.Scenario("flat").follower is None
    trace = omnistep.run(scenario)
    reference = scenario.trajectory.at(trace["time_s"])  # poses and places belong to the end of the period
    for i, axis in enumerate(("x_m", "y_m", "yaw_rad")):
        # Times of whole nanoseconds are rounded once more here: 1e-15 s at 0.5 m/s.
        np.testing.assert_allclose(trace[f"path_{axis}"], reference.pose[:, i], rtol=0, atol=1e-12)


def test_a_trajectory_is_refused_with_the_waypoint_and_the_key():
    plan = planner()
    late = omnistep.Waypoint(2.0, 0.0, time_s=1.0)
    assert refused(plan.plan, [(0.0, 0.0), late]).key == "waypoints[1].time_s"
    assert refused(plan.plan, [(0.0, 0.0), (math.nan, 0.0)]).key == "waypoints[1].x_m"
    assert refused(plan.plan, [(0.0, 0.0), (0.0, 0.0)]).key == "waypoints[1].x_m"
    assert refused(plan.plan, []).key == "waypoints"
    assert refused(plan.plan, np.zeros((2, 3))).key == "waypoints"
    assert refused(plan.plan, ((float(k), 0.0) for k in range(10**9))).key == "waypoints"
    assert refused(omnistep.Waypoint, 0.0, 0.0, kind="bow").key == "kind"
    assert refused(omnistep.Waypoint, 0.0, 0.0, kind="arc").key == "sweep_rad"
    assert refused(omnistep.Waypoint, 0.0, 0.0, sweep_rad=1.0).key == "sweep_rad"
    for wrong in (3, "ab", [1.0, 2.0], [None, None]):
        with pytest.raises(TypeError, match="waypoint"):
            plan.plan(wrong)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"velocity": [-1.0, 1.0]}, "velocity[0]"),
        ({"acceleration": [1.0, math.nan]}, "acceleration[1]"),
        ({"deceleration": [math.inf, 1.0]}, "deceleration[0]"),
        ({"jerk": [0.0, 1.0]}, "jerk[0]"),
        ({"velocity": [1.0]}, "velocity"),
        ({"mass_kg": 0.0}, "mass_kg"),
        ({"centre_m": [0.0, math.nan]}, "centre_m"),
        ({"speeds_rad_s": [25.0] * 3}, "speeds_rad_s"),
        ({"speeds_rad_s": [25.0, 25.0, 0.0, 25.0]}, "speeds_rad_s[2]"),
        ({"stall_torque_n_m": -1.0}, "stall_torque_n_m[0]"),
        ({"wheel_kg_m2": [0.0, 0.0, 0.0, -1.0]}, "wheel_kg_m2[3]"),
        ({"share": 2.0}, "share"),
    ],
)
def test_an_argument_of_a_planner_is_refused_by_its_name(arguments, key):
    assert refused(planner, **arguments).key == key


def test_times_that_are_none_are_refused_or_the_start():
    path = planner().plan([(0.0, 0.0), (1.0, 0.0)])
    strange = path.at([math.nan, -math.inf, math.inf])
    assert strange.pose[:, 0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert path.at([]).pose.shape == (0, 3)
    assert refused(path.at, [[0.0, 1.0]]).key == "time_s"
    with pytest.raises(TypeError, match="time_s"):
        path.at(["soon"])


def test_a_waypoint_survives_pickle():
    waypoint = omnistep.Waypoint(1.0, 2.0, kind="arc", sweep_rad=-0.5, speed_m_s=0.2, time_s=9.0)
    assert pickle.loads(pickle.dumps(waypoint)) == waypoint
    assert repr(waypoint) == "omnistep.Waypoint(1, 2, kind='arc', sweep_rad=-0.5, speed_m_s=0.2, time_s=9)"


# Followers


def test_a_follower_keeps_a_simulated_vehicle_on_the_square():
    # By hand what a scenario does by itself: the same trajectory and gains, the pose of a camera on the ceiling.
    scenario = omnistep.Scenario("square", overrides={"command.follow.pose": "truth"})
    trajectory, follower = scenario.trajectory, scenario.follower
    simulation = omnistep.Simulation(scenario, record=False)
    pose, furthest = np.zeros(3), 0.0
    while simulation.time_s < trajectory.duration_s:
        follow = follower.step(trajectory.at(simulation.time_s), pose)
        sample = simulation.step(follow.twist)
        pose = np.array([sample.position_m[0], sample.position_m[1], sample.yaw_rad])
        furthest = max(furthest, float(np.hypot(*follow.error_m)))
    # docs/drive-a-path.md: 17.6 mm with the pose of odometry, 21.7 mm without any.
    assert 0.005 < furthest < 0.025
    assert np.hypot(*pose[:2]) < 0.01 and simulation.time_s > 4.0


def test_a_follower_over_rows_is_that_of_each():
    follower = omnistep.HolonomicFollower(gain_per_s=2.0, heading_gain_per_s=2.0, limit_m_s=0.2, limit_rad_s=0.5)
    path = planner().plan([(0.0, 0.0), (1.0, 0.0)])
    samples = path.at(np.linspace(0.0, 3.0, 50))
    poses = np.random.default_rng(3).normal(size=(50, 3))
    rows = follower.step(samples, poses)
    assert rows.twist.shape == (50, 3) and rows.error_m.shape == (50, 2) and rows.error_rad.shape == (50,)
    for k, time in enumerate(samples.time_s):
        one = follower.step(path.at(time), poses[k])
        assert (one.twist == rows.twist[k]).all() and (one.error_m == rows.error_m[k]).all()
    # One pose or one sample serves for all.
    assert (follower.step(samples, poses[0]).twist[0] == rows.twist[0]).all()
    assert (follower.step(path.at(samples.time_s[:1]), poses).twist[0] == rows.twist[0]).all()
    # 3 m and 4 m away: 0.2 m/s in that direction.
    away = follower.step(path.at(0.0), [-3.0, -4.0, 0.0])
    assert away.twist == pytest.approx([0.12, 0.16, 0.0], abs=1e-12)
    assert float(away.error_rad) == 0.0
    # Where the pose is not known nothing is corrected.
    assert (follower.step(samples, [math.nan, 0.0, 0.0]).twist == samples.feed_forward).all()


def test_a_follower_refuses_by_name():
    good = {"gain_per_s": 2.0, "heading_gain_per_s": 2.0, "limit_m_s": 0.2, "limit_rad_s": 0.5}
    for name in good:
        for bad in (-1.0, 1001.0, math.nan):
            assert refused(omnistep.HolonomicFollower, **{**good, name: bad}).key == name
    follower = omnistep.HolonomicFollower(**good)
    samples = planner().plan([(0.0, 0.0), (1.0, 0.0)]).at([0.0, 0.1, 0.2])
    assert refused(follower.step, samples, np.zeros((2, 3))).key == "pose"
    assert refused(follower.step, samples, [0.0, 0.0]).key == "pose"
    assert refused(follower.step, samples, np.zeros((0, 3))).key == "pose"
    none = planner().plan([(0.0, 0.0), (1.0, 0.0)]).at(0.0)
    assert follower.step(none, np.zeros((0, 3))).twist.shape == (0, 3)


# Encoders


@pytest.mark.parametrize("bits", [2, 8, 16, 31, 32])
def test_a_counter_of_any_width_counts_across_its_wrap(bits):
    ways = np.random.default_rng(bits).integers(-(2 ** (bits - 1)), 2 ** (bits - 1), 500)
    positions = np.concatenate([[12345], 12345 + ways.cumsum()])
    encoder = omnistep.EncoderCounter(counts_per_turn=360.0, bits=bits)
    assert (encoder.update(positions % 2**bits)[1:] == ways).all()
    assert int(encoder.counts) == ways.sum()
    assert float(encoder.angle_rad) == pytest.approx(math.radians(ways.sum()), rel=1e-12)
    encoder.reset()
    assert int(encoder.counts) == 0 and int(encoder.update(77)) == 0


def test_several_encoders_are_as_many_single_ones():
    readings = np.random.default_rng(5).integers(0, 2**16, (200, 3))
    together = omnistep.EncoderCounter(counts_per_turn=64.0, bits=16, wheels=3)
    counts = together.update(readings)
    for wheel in range(3):
        single = omnistep.EncoderCounter(counts_per_turn=64.0, bits=16)
        assert (single.update(readings[:, wheel]) == counts[:, wheel]).all()
        assert together.counts[wheel] == single.counts
    for method in ({}, {"periods": 8}, {"method": "edges"}, {"method": "observer", "bandwidth_rad_s": 50.0}):
        given = {"count_rad": together.count_rad, "period_s": 0.001, **method}
        velocities = omnistep.VelocityEstimator(**given, wheels=3).step(counts)
        for wheel in range(3):
            one_by_one = omnistep.VelocityEstimator(**given)
            assert (velocities[:, wheel] == [one_by_one.step(count) for count in counts[:, wheel]]).all()


def test_velocities_of_edges_with_their_times_are_exact():
    # 5 rad/s: a count every 3.49 ms, as in omni-core's own example.
    count_rad, period_s = math.tau / 360.0, 0.001
    times = np.arange(1, 100) * period_s
    counted = np.floor(5.0 * times / count_rad)
    edges = omnistep.VelocityEstimator(count_rad=count_rad, period_s=period_s, method="edges")
    read = edges.step(np.diff(counted, prepend=0.0), since_edge_s=times - counted * count_rad / 5.0)
    assert read[-1] == pytest.approx(5.0, abs=1e-9)
    # Then the wheel stands: at most a count in the time since, and 0 from the time of three counts at 0.25 rad/s on.
    stands = edges.step(np.zeros(1000))
    periods = math.ceil(3.0 * count_rad / 0.25 / period_s)
    assert 0.0 < stands[periods - 20] <= count_rad / ((periods - 20) * period_s)
    assert (stands[periods:] == 0.0).all()
    # Without times the counts of a period: off by up to a period over the time between edges.
    edges.reset()
    blind = edges.step(np.diff(counted, prepend=0.0))
    assert 0.2 < np.abs(blind[30:] - 5.0).max() < 5.0 * 0.001 / (count_rad / 5.0 - 0.001)


def test_an_observer_settles_at_the_velocity():
    observer = omnistep.VelocityEstimator(count_rad=0.01, period_s=0.001, method="observer", bandwidth_rad_s=50.0)
    assert observer.step([3] * 1000)[-1] == pytest.approx(30.0, abs=1e-9)


def test_encoders_refuse_what_is_no_count():
    encoder = omnistep.EncoderCounter(counts_per_turn=360.0, bits=16)
    velocity = omnistep.VelocityEstimator(count_rad=0.01, period_s=0.001)
    for bad in (math.nan, math.inf, 0.5, 2.0**32):
        assert refused(encoder.update, [0.0, bad]).key == "readings"
        assert refused(velocity.step, bad).key == "counts"
    assert int(encoder.update(1)) == 0  # nothing of a refused call was taken in
    assert refused(encoder.update, np.zeros((2, 2))).key == "readings"
    assert encoder.update([]).shape == velocity.step([]).shape == (0,)
    three = omnistep.VelocityEstimator(count_rad=0.01, period_s=0.001, wheels=3)
    assert "[1, 2] = 0.5" in str(refused(three.step, [[0, 0, 0], [0, 0, 0.5]]))
    assert refused(three.step, [0, 0]).key == "counts"
    assert refused(three.step, [0, 0, 0], since_edge_s=[0.0, 0.0]).key == "since_edge_s"
    assert refused(velocity.step, [0, 0], since_edge_s=[0.0]).key == "since_edge_s"
    with pytest.raises(TypeError, match="counts"):
        velocity.step("many")


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"count_rad": 0.0}, "count_rad"),
        ({"period_s": math.nan}, "period_s"),
        ({"periods": 33}, "periods"),
        ({"method": "guess"}, "method"),
        ({"method": "edges", "periods": 2}, "periods"),
        ({"bandwidth_rad_s": 10.0}, "bandwidth_rad_s"),
        ({"method": "observer"}, "bandwidth_rad_s"),
        ({"method": "observer", "bandwidth_rad_s": 1001.0}, "bandwidth_rad_s"),
        ({"wheels": 0}, "wheels"),
    ],
)
def test_an_argument_of_a_velocity_estimator_is_refused_by_its_name(arguments, key):
    given = {"count_rad": 0.01, "period_s": 0.001, **arguments}
    assert refused(omnistep.VelocityEstimator, **given).key == key
    if key == "wheels":
        assert refused(omnistep.EncoderCounter, counts_per_turn=1.0, bits=8, wheels=0).key == key


# Motors

SHEET = {"torque_constant_n_m_a": 0.0234, "resistance_ohm": 2.32, "no_load_current_a": 0.037, "supply_v": 24.0}


def test_a_duty_satisfies_the_motors_equations_over_arrays_of_any_shape():
    random = np.random.default_rng(7)
    torque, velocity = random.uniform(-0.3, 0.3, (50, 4)), random.uniform(-1500.0, 1500.0, (50, 4))
    motor = omnistep.DcMotor(**SHEET, current_limit_a=8.0)
    answer = motor.duty(torque, velocity)
    assert answer.duty.shape == answer.limited.shape == (50, 4) and (np.abs(answer.duty) <= 1.0).all()
    # 1e-9 is rounding of sums of up to 60 V.
    np.testing.assert_allclose(24.0 * answer.duty, 2.32 * answer.current_a + 0.0234 * velocity, rtol=0, atol=1e-9)
    np.testing.assert_allclose(motor.current_a(answer.torque_n_m, velocity), answer.current_a, rtol=0, atol=1e-9)
    assert (answer.torque_n_m[~answer.limited] == torque[~answer.limited]).all()
    assert answer.limited.any() and not answer.limited.all()
    # Electrical power is heat, friction and shaft power.
    friction = 0.0234 * 0.037 * np.abs(velocity)
    np.testing.assert_allclose(
        motor.electrical_power_w(torque, velocity),
        motor.heat_w(torque, velocity) + friction + torque * velocity,
        atol=1e-9,
    )
    np.testing.assert_allclose(
        motor.electrical_power_w(torque, velocity),
        motor.voltage_v(torque, velocity) * motor.current_a(torque, velocity),
    )
    # A number serves for every shape.
    assert (motor.duty(0.1, velocity).duty == motor.duty(np.full((50, 4), 0.1), velocity).duty).all()
    assert motor.duty(0.1, 2.0).duty.shape == ()


def test_a_motors_line_and_its_duty_are_those_of_torque_range():
    motor = omnistep.DcMotor(**SHEET)
    # Stall: 24 V / 2.32 ohm = 10.345 A, less friction, times 23.4 mN.m/A.
    assert motor.stall_torque_n_m == pytest.approx(0.2412, abs=1e-4)
    assert float(motor.voltage_v(0.0, motor.no_load_speed_rad_s)) == pytest.approx(24.0, abs=1e-12)
    line = {"stall_torque_n_m": motor.stall_torque_n_m}
    line["slope_n_m_s_rad"] = motor.stall_torque_n_m / motor.no_load_speed_rad_s
    velocities = np.linspace(-1200.0, 1200.0, 101)
    for ours, theirs in zip(motor.torque_range(velocities), omnistep.torque_range(velocities, **line), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)
    # The line's duty gives just the torque within the range: stall duty - slope velocity.
    _, most = omnistep.torque_range(velocities, **line)
    duty = omnistep.torque_duty(0.5 * most, velocities, **line)
    inside = np.abs(duty) < 1.0
    np.testing.assert_allclose(
        (line["stall_torque_n_m"] * duty - line["slope_n_m_s_rad"] * velocities)[inside], 0.5 * most[inside], atol=1e-12
    )
    assert inside.sum() > 60


def test_a_motor_refuses_by_name_and_survives_what_is_not_finite():
    for name, bad in [("torque_constant_n_m_a", 0.0), ("resistance_ohm", math.nan), ("supply_v", -1.0)]:
        assert refused(omnistep.DcMotor, **{**SHEET, name: bad}).key == name
    assert refused(omnistep.DcMotor, **SHEET, current_limit_a=0.01).key == "current_limit_a"
    motor = omnistep.DcMotor(**SHEET)
    answer = motor.duty([math.nan, math.inf, -math.inf], 0.0)
    assert not answer.duty.any() and answer.limited.all()
    assert not omnistep.torque_duty(math.nan, [0.0, 1.0], stall_torque_n_m=1.0).any()
    assert refused(motor.duty, np.zeros((2, 3)), np.zeros(3)).key == "velocity_rad_s"
    assert refused(omnistep.torque_duty, 0.0, 0.0, stall_torque_n_m=-1.0).key == "stall_torque_n_m"
    assert motor.duty([], 0.0).duty.shape == (0,)
    with pytest.raises(TypeError, match="torque_n_m"):
        motor.heat_w("hot", 0.0)
