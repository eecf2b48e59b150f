"""Commands made followable, points and frames of a twist, and the ratios of the paper."""

import re

import numpy as np
import pytest

import omnistep

RNG_SEED = 20


def commands(count: int) -> np.ndarray:
    return np.random.default_rng(RNG_SEED).uniform(-2.0, 2.0, (count, 3))


def refused(call, *args, **kwargs) -> omnistep.ConfigError:
    with pytest.raises(omnistep.ConfigError) as caught:
        call(*args, **kwargs)
    assert "\n" not in str(caught.value)
    return caught.value


def test_no_axis_is_faster_or_changes_faster_than_it_may():
    period_s = 0.01
    velocity, up, down = np.array([1.0, 0.5, 1.5]), np.array([2.0, 1.0, 3.0]), np.array([4.0, 2.5, 6.0])
    shaper = omnistep.CommandShaper(period_s=period_s, velocity=velocity, acceleration=up, deceleration=down)
    twist = shaper.step(np.repeat(commands(50), 80, axis=0)).twist
    # A velocity is the limit itself, once it is reached: one rounding of a number near 1 is 2e-16.
    assert (np.abs(twist).max(axis=0) <= velocity + 1e-15).all()
    before, after = np.vstack([np.zeros(3), twist[:-1]]), twist
    crosses = before * after < 0.0
    # Across zero the speed shrinks to 0 and grows from there: the speed lost over one limit and that gained over the
    # other share a period.
    lost = np.where(crosses, np.abs(before), np.maximum(np.abs(before) - np.abs(after), 0.0))
    gained = np.where(crosses, np.abs(after), np.maximum(np.abs(after) - np.abs(before), 0.0))
    part = lost / (down * period_s) + gained / (up * period_s)
    # Differences of numbers near 1 are off by some 2e-16; over the smallest step, 0.01 m/s, that is 2e-14.
    assert part.max() <= 1.0 + 1e-13
    for axis in range(3):  # and every limit is used, for the whole of a period
        shrinks, grows = lost[:, axis] > 0.0, gained[:, axis] > 0.0
        assert lost[shrinks & ~grows, axis].max() == pytest.approx(down[axis] * period_s, rel=1e-13)
        assert gained[grows & ~shrinks, axis].max() == pytest.approx(up[axis] * period_s, rel=1e-13)
        assert (shrinks & grows).any()


def test_a_jerk_limit_holds_the_second_difference():
    shaper = omnistep.CommandShaper(period_s=0.01, acceleration=[2.0] * 3, deceleration=[2.0] * 3, jerk=[10.0] * 3)
    twist = shaper.step(np.repeat([[1.0, 0.0, 0.0]], 300, axis=0)).twist[:, 0]
    jerk = np.diff(np.concatenate([[0.0, 0.0], twist]), 2) / 0.01**2
    there = int(np.argmax(twist == 1.0))
    assert there > 0 and (twist[there:] == 1.0).all()
    # The period that meets the target exactly may do with any jerk, and so may the next, in which the rest of the
    # acceleration ends.
    limited = np.delete(jerk, [there, there + 1])
    # Second differences of numbers near 1 are off by some 4e-16, over the square of the period that is 4e-12 m/s3.
    assert np.abs(limited).max() <= 10.0 + 1e-11
    assert np.abs(limited).max() >= 10.0 - 1e-11  # it is used


def test_limits_along_the_motion_keep_its_direction():
    shaper = omnistep.CommandShaper(period_s=0.01, acceleration=[1.0, 1.0], keeps_direction=True)
    twist = shaper.step(np.repeat([[0.6, 0.8, 0.0]], 120, axis=0)).twist
    np.testing.assert_allclose(twist[:, 1] * 0.6, twist[:, 0] * 0.8, atol=1e-12)  # rounding of numbers below 1
    np.testing.assert_allclose(np.hypot(twist[:99, 0], twist[:99, 1]), 0.01 * np.arange(1, 100), atol=1e-12)


def test_many_steps_are_one_after_the_other():
    rows = commands(20)
    whole = omnistep.CommandShaper(period_s=0.01, acceleration=[1.0] * 3).step(rows)
    one = omnistep.CommandShaper(period_s=0.01, acceleration=[1.0] * 3)
    singles = [one.step(row) for row in rows]
    np.testing.assert_array_equal(whole.twist, [single.twist for single in singles])
    assert singles[0].status.shape == () and singles[0].rejected.shape == ()


def test_a_time_out_and_an_emergency_stop_rest_the_vehicle():
    shaper = omnistep.CommandShaper(period_s=0.01, timeout_s=0.05, emergency_deceleration=[2.0, 8.0])
    arrived = [True] + [False] * 9
    shaped = shaper.step([[0.5, 0.0, 0.0]] * 10, arrived=arrived)
    assert shaped.status.tolist() == [1] * 6 + [3] * 4  # five periods old counts, six does not
    # Without limits as in an emergency stop: 2 m/s2 for 10 ms.
    np.testing.assert_allclose(shaped.twist[:, 0], [0.5] * 6 + [0.48, 0.46, 0.44, 0.42], atol=1e-12)
    shaper.step([0.5, 0.0, 0.0])
    shaper.emergency_stop()
    assert shaper.stopped
    stopping = shaper.step([[0.5, 0.0, 0.0]] * 30)
    assert set(stopping.status.tolist()) == {4}
    np.testing.assert_allclose(np.diff(stopping.twist[:20, 0]), -0.02, atol=1e-12)  # 2 m/s2 for 10 ms
    shaper.release()
    assert shaper.step([0.1, 0.0, 0.0]).twist[0] == 0.1


def test_what_is_no_command_is_rejected_and_the_last_one_stays():
    shaper = omnistep.CommandShaper(period_s=0.01)
    shaped = shaper.step([[0.3, 0.0, 0.0], [np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0]])
    assert shaped.rejected.tolist() == [False, True, True]
    assert shaped.twist[:, 0].tolist() == [0.3] * 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"period_s": 0.0}, "period_s = 0, allowed: 0.000001 to 10"),
        ({"acceleration": [1.0, 1.0]}, "acceleration = 2 values, allowed: three numbers: of vx, vy and wz"),
        ({"acceleration": [1.0, 1.0, 0.0]}, "acceleration[2] = 0, allowed: > 0 (infinity: no limit)"),
        ({"deceleration": [1.0, -2.0, 1.0]}, "deceleration[1] = -2, allowed: > 0 (infinity: no limit)"),
        ({"velocity": [-1.0, 1.0, 1.0]}, "velocity[0] = -1, allowed: 0 or more (infinity: no limit)"),
        (
            {"velocity": [1.0, np.nan], "keeps_direction": True},
            "velocity[1] = NaN, allowed: 0 or more (infinity: no limit)",
        ),
        ({"jerk": [1.0, 0.0], "keeps_direction": True}, "jerk[1] = 0, allowed: > 0 (infinity: no limit)"),
        (
            {"jerk": [1.0] * 3, "keeps_direction": True},
            "jerk = 3 values, allowed: two numbers with keeps_direction: linear and yaw",
        ),
        ({"timeout_s": -1.0}, "timeout_s = -1, allowed: finite and >= 0"),
        ({"emergency_deceleration": [1.0, 0.0]}, "emergency_deceleration[1] = 0, allowed: > 0 (infinity: no limit)"),
    ],
)
def test_a_shaper_says_which_number_is_out_of_range(arguments, message):
    error = refused(omnistep.CommandShaper, **{"period_s": 0.01, **arguments})
    assert str(error) == message
    assert error.key == re.match(r"\w+", message)[0]


def test_a_velocity_of_0_and_limits_of_infinity_are_limits():
    infinite = [np.inf] * 3
    shaper = omnistep.CommandShaper(period_s=0.01, velocity=[0.0, np.inf, np.inf], acceleration=infinite, jerk=infinite)
    assert shaper.step([1.0, 2.0, 3.0]).twist.tolist() == [0.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("arrived", "message"),
    [
        ([True, False], "arrived = 2 values, allowed: as many as twists, 3"),
        (True, "arrived = 1 value, allowed: as many as twists, 3"),
        (
            [[True], [True], [False]],
            "arrived = an array of shape (3, 1), allowed: true or false, or shape (T,) of them",
        ),
        ([[True], [True, False]], "arrived = rows of several lengths, allowed: true or false, or shape (T,) of them"),
    ],
)
def test_rows_and_arrivals_must_be_as_many(arrived, message):
    shaper = omnistep.CommandShaper(period_s=0.01)
    error = refused(shaper.step, [[0.0, 0.0, 0.0]] * 3, arrived=arrived)
    assert (str(error), error.key) == (message, "arrived")


@pytest.mark.parametrize("arrived", ["yes", [1.0, 0.0, 1.0], None, [None] * 3])
def test_arrivals_are_true_or_false(arrived):
    shaper = omnistep.CommandShaper(period_s=0.01)
    if arrived is None:  # all of them
        assert shaper.step([[0.1, 0.0, 0.0]] * 3, arrived=None).status.tolist() == [1, 1, 1]
        return
    with pytest.raises(TypeError, match=r"^arrived: .*, allowed: true or false"):
        shaper.step([[0.0, 0.0, 0.0]] * 3, arrived=arrived)


def test_points_and_frames_undo_each_other():
    twists, yaws = commands(50), np.linspace(-4.0, 4.0, 50)
    there = omnistep.at_point(twists, [0.3, -0.2])
    # All are sums of a few numbers below 3: each rounding is below 5e-16.
    np.testing.assert_allclose(omnistep.from_point(there, [0.3, -0.2]), twists, atol=1e-15)
    # v + wz x p
    np.testing.assert_allclose(there[:, 0], twists[:, 0] + 0.2 * twists[:, 2], atol=1e-15)
    world = omnistep.to_world(twists, yaws)
    np.testing.assert_allclose(omnistep.to_body(world, yaws), twists, atol=1e-15)
    np.testing.assert_allclose(np.hypot(*world[:, :2].T), np.hypot(*twists[:, :2].T), atol=1e-15)
    np.testing.assert_array_equal(omnistep.to_world(twists, 0.5)[7], omnistep.to_world(twists[7], 0.5))
    error = refused(omnistep.to_world, twists, [0.0, 1.0])
    assert (str(error), error.key) == ("yaw_rad = 2 numbers, allowed: as many as twists, 50, or one", "yaw_rad")
    error = refused(omnistep.to_body, twists[:1], [0.0, 1.0])
    assert str(error) == "yaw_rad = 2 numbers, allowed: as many as twists, 1"
    assert refused(omnistep.to_body, twists, np.nan).key == "yaw_rad"
    assert refused(omnistep.from_point, twists, [np.inf, 0.0]).key == "point_m"


def test_ratios_of_a_run_are_its_columns():
    trace = omnistep.run("step", policy="scale_references", overrides={"duration_s": 2.0}, progress=False)
    reference, measured = trace.wheels("reference_rad_s"), trace.wheels("measured_rad_s")
    for wheel in range(reference.shape[1]):
        found = omnistep.disturbed_ratio(reference[:, wheel], measured[:, wheel])
        np.testing.assert_array_equal(found, trace.wheels("disturbed_ratio")[:, wheel])
    requested = trace.wheels("requested_n_m")
    limits = {"lower_n_m": trace.wheels("limit_lower_n_m"), "upper_n_m": trace.wheels("limit_upper_n_m")}
    factor = omnistep.torque_factor(requested, **limits)
    inside = (requested <= limits["upper_n_m"]).all(axis=1) & (requested >= limits["lower_n_m"]).all(axis=1)
    np.testing.assert_array_equal(factor == 1.0, inside)
    # Scaled by the common factor every torque is within its limits; a product of numbers near 1 is rounded by 1e-16.
    scaled = factor[:, None] * requested
    assert (scaled <= limits["upper_n_m"] + 1e-15).all() and (scaled >= limits["lower_n_m"] - 1e-15).all()


def test_what_wheels_have_in_common_is_no_error_of_shape():
    reference = np.array([3.0, -2.0, 0.0, 5.0])
    for factor in (1.0, 0.4, 0.0):  # off by roundings of numbers below 5
        np.testing.assert_allclose(omnistep.shape_error(reference, factor * reference), 0.0, atol=1e-15)
        assert omnistep.speed_ratio_std(reference, factor * reference).item() == pytest.approx(0.0, abs=1e-15)
    error = omnistep.shape_error(np.tile(reference, (2, 1)), [[3.0, 2.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    np.testing.assert_allclose(
        error @ reference, 0.0, atol=1e-14
    )  # across the references, but for rounding of sums near 10


def test_a_motors_line_and_what_it_refuses():
    lower, upper = omnistep.torque_range([-5.0, 0.0, 5.0, 50.0], stall_torque_n_m=2.0, slope_n_m_s_rad=0.1)
    assert upper.tolist() == [2.0, 2.0, 1.5, 0.0]
    assert lower.tolist() == [-1.5, -2.0, -2.0, -2.0]
    lower, upper = omnistep.torque_range([-5.0, 0.0, 50.0], stall_torque_n_m=2.0)  # a constant limit
    assert (lower.tolist(), upper.tolist()) == ([-2.0] * 3, [2.0] * 3)
    for stall in (-1.0, 0.0):
        error = refused(omnistep.torque_range, 0.0, stall_torque_n_m=stall)
        assert str(error) == f"stall_torque_n_m = {stall:g}, allowed: finite and > 0"
        assert error.key == "stall_torque_n_m"
    error = refused(omnistep.torque_range, 0.0, stall_torque_n_m=1.0, slope_n_m_s_rad=-0.5)
    assert (str(error), error.key) == ("slope_n_m_s_rad = -0.5, allowed: finite and >= 0", "slope_n_m_s_rad")


@pytest.mark.parametrize("floor", [0.0, -1.0, np.nan, np.inf])
def test_a_floor_is_above_0(floor):
    wheels = [1.0, 2.0, 3.0]
    assert refused(omnistep.slip_ratio, 0.0, 0.0, floor_m_s=floor).key == "floor_m_s"
    assert refused(omnistep.disturbed_ratio, 0.0, 0.0, floor_rad_s=floor).key == "floor_rad_s"
    error = refused(omnistep.speed_ratio_std, wheels, wheels, floor_rad_s=floor)
    assert error.key == "floor_rad_s" and str(error).endswith("allowed: finite and > 0")


def test_a_ratio_is_the_same_forwards_and_backwards():
    assert omnistep.disturbed_ratio([10.0, -10.0], [8.0, -8.0]).tolist() == [0.2, 0.2]
    assert omnistep.slip_ratio([0.5, -0.5], [0.375, -0.375]).tolist() == [0.25, 0.25]


def test_one_row_of_wheels_serves_for_all_whatever_its_shape():
    rng = np.random.default_rng(RNG_SEED)
    references, velocities = rng.uniform(1.0, 5.0, (5, 7)), rng.uniform(1.0, 5.0, 7)
    expected = omnistep.shape_error(references, velocities)
    assert expected.shape == (5, 7)
    np.testing.assert_array_equal(omnistep.shape_error(references, velocities[None]), expected)
    np.testing.assert_array_equal(omnistep.shape_error(references[0], velocities[None]), expected[0])
    error = refused(omnistep.shape_error, references, np.ones((2, 7)))
    assert str(error) == "velocity_rad_s = 2 rows, allowed: as many as reference_rad_s, 5, or one"
    error = refused(omnistep.shape_error, references[0], np.ones((2, 7)))
    assert str(error) == "velocity_rad_s = 2 rows, allowed: as many as reference_rad_s, 1"
    assert omnistep.shape_error(np.zeros((0, 7)), velocities).shape == (0, 7)


def test_what_is_no_row_of_wheels_is_said_to_be_none():
    for bad, found in [
        (1.0, "()"),
        ([1.0, 2.0], "(2,)"),
        (np.ones((2, 9)), "(2, 9)"),
        (np.ones((1, 2, 7)), "(1, 2, 7)"),
    ]:
        error = refused(omnistep.shape_error, bad, bad)
        assert str(error) == (
            f"reference_rad_s = an array of shape {found}, allowed: shape (N,) or (T, N) of 3 to 8 wheels"
        )
    error = refused(omnistep.shape_error, [[1.0, 2.0, 3.0], [1.0]], [1.0, 2.0, 3.0])
    assert (error.key, "rows of several lengths" in str(error)) == ("reference_rad_s", True)
    for bad in ("abc", None):
        with pytest.raises(TypeError, match=r"^reference_rad_s: "):
            omnistep.shape_error(bad, [1.0, 2.0, 3.0])


def test_nothing_and_one_make_nothing():
    none, wheels = np.zeros(0), np.zeros((0, 7))
    assert omnistep.disturbed_ratio(none, [1.0]).shape == omnistep.disturbed_ratio(1.0, none).shape == (0,)
    pid = omnistep.Pid(kp_n_m_s_rad=1.0, period_s=0.1)
    assert pid.step(none, [1.0]).output_n_m.shape == pid.step(1.0, none).output_n_m.shape == (0,)
    controller = omnistep.Controller("flat", policy="scale_references")
    assert controller.step(np.zeros((0, 3)), np.zeros((1, 7))).applied_n_m.shape == (0, 7)
    assert controller.step([0.0, 0.0, 0.0], wheels).applied_n_m.shape == (0, 7)


def test_numbers_and_ranges_of_ratios_and_factors():
    error = refused(omnistep.disturbed_ratio, [1.0, 2.0, 3.0], [1.0, 2.0])
    assert str(error) == "velocity_rad_s = 2 numbers, allowed: as many as reference_rad_s, 3, or one"
    bad = {"lower_n_m": [0.1, -1.0, -1.0], "upper_n_m": [1.0, 1.0, 1.0]}
    assert refused(omnistep.torque_factor, [1.0, 1.0, 1.0], **bad).key == "lower_n_m"


def test_velocities_are_scaled_as_one():
    layout = omnistep.Layout.mecanum4(wheelbase_m=0.6, track_m=0.4, radius_m=0.1)
    kinematics = omnistep.Kinematics(layout=layout)
    velocities = np.random.default_rng(RNG_SEED).uniform(-20.0, 20.0, (100, 4))
    scaled = kinematics.scale_velocities(velocities, limits_rad_s=10.0)
    assert np.abs(scaled.velocities).max() <= 10.0 * (1 + 1e-15)
    np.testing.assert_allclose(scaled.velocities, scaled.translation_factor[:, None] * velocities, atol=1e-14)
    np.testing.assert_array_equal(scaled.translation_factor, np.minimum(1.0, 10.0 / np.abs(velocities).max(axis=1)))
    np.testing.assert_allclose(scaled.twist, kinematics.forward(scaled.velocities), atol=1e-15)
