"""The estimator in Python: beside WPILib's on the same data, and by itself."""

import sys
from platform import machine

import numpy as np
import pytest

import omnistep

PERIOD_S = 1e-3
ENCODER_RAD_S, GYRO_RAD_S, ACCELEROMETER_M_S2 = 0.1, 0.01, 0.05  # standard deviations, those that the estimator expects
SEEDS = 12
REST_S = 0.5


def kinematics():
    return omnistep.Kinematics(layout=omnistep.Scenario("flat", vehicle="mecanum4").vehicle.layout)


def accelerations(yaws, twists):
    """What a level accelerometer feels between the rows: the change of velocity in the world, along the new heading."""
    c, s = np.cos(yaws), np.sin(yaws)
    vx, vy = twists[:, 0], twists[:, 1]
    world = np.column_stack([c * vx - s * vy, s * vx + c * vy])
    change = np.diff(world, axis=0, prepend=np.zeros((1, 2))) / PERIOD_S
    return np.column_stack([c * change[:, 0] + s * change[:, 1], c * change[:, 1] - s * change[:, 0]])


def command(time_s):
    if time_s < REST_S or 2.0 <= time_s < 2.5:
        return 0.0, 0.0, 0.0
    return (0.6, 0.0, 0.0) if time_s < 2.0 else (0.2, 0.3, 0.5)


def recorded(seed, friction):
    """Poses, and what the sensors said: of four mecanum wheels that start and stop at once."""
    overrides = {
        "physics.engine": "articulated",
        "sensors.encoder_noise_rad_s": ENCODER_RAD_S,
        "perturbation.yaw_rad": 0.05,
        "perturbation.start_m": 0.05,
        "terrain.friction": friction,
    }
    scenario = omnistep.Scenario("flat", vehicle="mecanum4", overrides=overrides, seed=seed)
    simulation = omnistep.Simulation(scenario)
    commands = np.array([command(k * PERIOD_S) for k in range(3500)])
    for row in commands:
        simulation.step(row)
    trace, random = simulation.trace, np.random.default_rng(seed)
    twists = np.column_stack([trace[f"twist_{name}"] for name in ("vx_m_s", "vy_m_s", "wz_rad_s")])
    poses = np.column_stack([trace["pose_x_m"], trace["pose_y_m"], np.unwrap(trace["pose_yaw_rad"])])
    # Rows of velocities belong to the start of a period, those of poses to its end: the next row's.
    wheels = trace.wheels("measured_rad_s")[1:]
    felt = accelerations(poses[:, 2], twists)[:-1]
    return {
        "poses": poses[:-1],
        "wheels": wheels,
        "gyro": twists[:-1, 2] + 0.02 * random.standard_normal() + GYRO_RAD_S * random.standard_normal(len(wheels)),
        "felt": felt + ACCELEROMETER_M_S2 * random.standard_normal(felt.shape),
        "rest": ~commands[:-1].any(axis=1),
    }


def calibrated():
    """The estimator of a unit whose accelerometer has noise and no bias, as the recorded one."""
    return omnistep.Estimator(
        kinematics=kinematics(),
        period_s=PERIOD_S,
        accelerometer_bias_m_s2=1e-4,
        accelerometer_bias_walk_m_s2_per_sqrt_s=1e-4,
    )


def ours(data):
    estimator = calibrated()
    estimator.reset(data["poses"][0])
    return estimator.step(
        data["wheels"], yaw_rates=data["gyro"], accelerations=data["felt"], commanded_rest=data["rest"]
    )


def theirs(data):
    """WPILib's estimator of mecanum drives, its gyro calibrated while the vehicle stands."""
    if not (sys.platform == "linux" and machine() == "x86_64" and sys.version_info < (3, 15)):
        pytest.importorskip("wpimath", reason="robotpy-wpimath is not installed on this platform", exc_type=ImportError)
    from wpimath.estimator import MecanumDrivePoseEstimator
    from wpimath.geometry import Pose2d, Rotation2d, Translation2d
    from wpimath.kinematics import MecanumDriveKinematics, MecanumDriveWheelPositions

    layout = kinematics().layout
    places = [Translation2d(*wheel.position_m) for wheel in layout.wheels]
    radius_m = layout.wheels[0].radius_m
    bias = data["gyro"][: int(REST_S / PERIOD_S)].mean() if data["rest"][0] else 0.0
    turned = np.cumsum(data["gyro"] - bias) * PERIOD_S
    ways = np.cumsum(data["wheels"], axis=0) * PERIOD_S * radius_m

    def positions(row):
        found = MecanumDriveWheelPositions()
        found.frontLeft, found.frontRight, found.rearLeft, found.rearRight = row.tolist()
        return found

    x, y, yaw = data["poses"][0].tolist()
    estimator = MecanumDrivePoseEstimator(
        MecanumDriveKinematics(*places), Rotation2d(0.0), positions(np.zeros(4)), Pose2d(x, y, Rotation2d(yaw))
    )
    poses = []
    for k, (turn, way) in enumerate(zip(turned.tolist(), ways, strict=True)):
        pose = estimator.updateWithTime(k * PERIOD_S, Rotation2d(turn), positions(way))
        poses.append((pose.X(), pose.Y(), pose.rotation().radians()))
    return np.array(poses)


def errors_m(data):
    truth = data["poses"][-1, :2]
    return [float(np.hypot(*(of(data)[-1, :2] - truth))) for of in (ours, theirs)]


def test_on_ice_it_is_nearer_than_wpilibs():
    # Wet ice, everywhere: the wheels spin and lock, which no redundancy of wheels sees.
    found = np.array([errors_m(recorded(seed, friction=0.05)) for seed in range(100, 100 + SEEDS)])
    less = found[:, 1] - found[:, 0]
    # 95 % interval of the mean difference by Student's t of 11 degrees of freedom.
    half = 2.201 * less.std(ddof=1) / np.sqrt(SEEDS)
    assert less.mean() - half > 0.0, f"{less.mean():.4f} +- {half:.4f} m"
    # And by far: a tenth.
    assert found[:, 0].mean() < 0.1 * found[:, 1].mean(), found.mean(axis=0)


def test_without_noise_and_slip_it_is_where_wpilibs_is():
    time_s = np.arange(1, 5001) * PERIOD_S
    twists = np.column_stack([0.5 * np.sin(time_s), 0.3 * np.sin(0.7 * time_s), 0.8 * np.sin(0.4 * time_s)])
    before = np.vstack([np.zeros(3), twists[:-1]])
    # Two readings make the mean over a period, for the yaw of both.
    yaws = np.cumsum((twists[:, 2] + before[:, 2]) / 2) * PERIOD_S
    data = {
        "poses": np.zeros((1, 3)),
        "wheels": kinematics().inverse(twists),
        "gyro": twists[:, 2],
        "felt": accelerations(yaws, twists),
        "rest": np.zeros(len(twists), dtype=bool),
    }
    here, there = ours(data), theirs(data)
    assert np.hypot(*there[-1, :2]) > 0.5  # it went somewhere
    # Theirs takes the reading at a period's end for all of it: half a period of 0.6 m/s at most, 0.3 mm.
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-3)


def test_rows_at_once_are_the_rows_one_by_one():
    data = recorded(1, friction=0.7)
    at_once = ours(data)
    estimator = calibrated()
    estimator.reset(data["poses"][0])
    some = slice(0, 700)
    rows = zip(*(data[name][some] for name in ("wheels", "gyro", "felt", "rest")), strict=True)
    one_by_one = [
        estimator.step(wheels, yaw_rates=float(gyro), accelerations=felt, commanded_rest=bool(rest))
        for wheels, gyro, felt, rest in rows
    ]
    np.testing.assert_array_equal(at_once[some], one_by_one)
    assert estimator.nis.shape == ()
    assert estimator.covariance.shape == (3, 3)


def test_what_still_is_can_be_set():
    # A gyro that idling motors shake by 0.04 rad/s, which is no motion of the vehicle.
    random, bias = np.random.default_rng(4), 0.05
    shakes = bias + 0.04 * np.sin(0.3 * np.arange(3000)) + GYRO_RAD_S * random.standard_normal(3000)

    def learnt(**settings):
        estimator = omnistep.Estimator(kinematics=kinematics(), period_s=PERIOD_S, **settings)
        estimator.step(np.zeros((3000, 4)), yaw_rates=shakes, accelerations=[0.0, 0.0], commanded_rest=True)
        return estimator.gyro_bias_rad_s

    # The noise of 2950 readings leaves 2e-4 rad/s, and the sine less.
    assert abs(learnt() - bias) < 1e-3
    # 0.028 rad/s, root mean square, are more than this and the noise: it is not taken to stand.
    assert abs(learnt(still_gyro_rad_s=0.01)) < 0.01
    with pytest.raises(omnistep.ConfigError, match=r"^still_gyro_rad_s = -1, allowed: 0 to 1000$"):
        learnt(still_gyro_rad_s=-1.0)


def test_the_bias_of_the_accelerometer_is_learnt_at_rest():
    random, bias = np.random.default_rng(5), np.array([0.15, -0.1])
    estimator = omnistep.Estimator(kinematics=kinematics(), period_s=PERIOD_S)
    felt = bias + ACCELEROMETER_M_S2 * random.standard_normal((3000, 2))
    estimator.step(np.zeros((3000, 4)), yaw_rates=0.0, accelerations=felt, commanded_rest=True)
    # Four times the noise of the 1950 readings after the first 1.05 s.
    assert np.abs(estimator.accelerometer_bias_m_s2 - bias).max() < 4.0 * ACCELEROMETER_M_S2 / np.sqrt(1950)


def test_what_is_wrong_is_named():
    with pytest.raises(omnistep.ConfigError, match=r"^gyro_rad_s = -1, allowed: 1e-6 to 1000$"):
        omnistep.Estimator(kinematics=kinematics(), period_s=PERIOD_S, gyro_rad_s=-1.0)
    estimator = omnistep.Estimator(kinematics=kinematics(), period_s=PERIOD_S)
    with pytest.raises(omnistep.ConfigError, match="yaw_rates = 3 rows"):
        estimator.step(np.zeros((5, 4)), yaw_rates=np.zeros(3))
    with pytest.raises(omnistep.ConfigError, match="pose ="):
        estimator.reset([np.nan, 0.0, 0.0])
    # Missing readings are left out.
    assert np.isfinite(estimator.step([np.nan, 0.0, 0.0, 0.0])).all()
