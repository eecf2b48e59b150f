"""WPILib's mecanum kinematics, plane motions and PID, run live beside ours.

The convention. A wheel's rollers let its contact slip across the roller's axis ``a`` only, so that with the contact at
``p`` and the rolling direction ``d`` forward, ``a . (v + wz x p) = w r (a . d)``. With ``a`` at an angle of -45 degrees
(front left, rear right) that is ``w r = vx - vy - (x + y) wz``, at +45 degrees (front right, rear left)
``w r = vx + vy + (x - y) wz``: for wheels anywhere, not only at the corners of a rectangle. WPILib has these very rows,
in the same order of wheels, so the two agree for any layout without adapting one to the other. WPILib counts in surface
speeds [m/s], we in actuator velocities [rad/s].
"""

import sys
from platform import machine

import numpy as np
import pytest

import omnistep

# Where the `test` extra installs it, it must be there: what could be skipped unseen would prove nothing.
if not (sys.platform == "linux" and machine() == "x86_64" and sys.version_info < (3, 15)):
    pytest.importorskip("wpimath", reason="robotpy-wpimath is not installed on this platform", exc_type=ImportError)
from wpimath.controller import PIDController
from wpimath.geometry import Pose2d, Rotation2d, Translation2d, Twist2d
from wpimath.kinematics import ChassisSpeeds, MecanumDriveKinematics, MecanumDriveWheelSpeeds

LAYOUTS = 10_000
QUADRANTS = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])  # front left, front right, rear left, rear right
ROLLER_ANGLES_RAD = np.array([-1, 1, 1, -1]) * np.pi / 4
# Both work in float64. Magnitudes are 1 to 22 (m/s, rad/s), condition numbers of these maps (metres and radians taken
# as they are) below 4, which our normal equations square: 2.2e-16 * 22 * 16 = 8e-14 for one rounding, and a map is
# a few of them. 1.4e-14 was measured; a convention that differs would show in the first digit.
EXACT = {"rtol": 0, "atol": 1e-12}


def speeds(wheels):
    return wheels.frontLeft, wheels.frontRight, wheels.rearLeft, wheels.rearRight


def theirs(positions_m):
    return MecanumDriveKinematics(*(Translation2d(x, y) for x, y in positions_m.tolist()))


def ours(positions_m, radii_m, **options):
    wheels = [
        omnistep.Wheel(position_m=position, roller_angle_rad=angle, radius_m=radius)
        for position, angle, radius in zip(positions_m, ROLLER_ANGLES_RAD, radii_m, strict=True)
    ]
    return omnistep.Kinematics(layout=omnistep.Layout(wheels=wheels), **options)


def test_ten_thousand_unsymmetric_mecanum_layouts_agree():
    random = np.random.default_rng(20_260)
    positions_m = random.uniform(0.05, 0.6, (LAYOUTS, 4, 2)) * QUADRANTS  # every wheel on its own
    radii_m = np.repeat(random.uniform(0.02, 0.2, (LAYOUTS, 1)), 4, axis=1)
    twists = random.uniform(-5.0, 5.0, (LAYOUTS, 3))
    measured_m_s = random.uniform(-10.0, 10.0, (LAYOUTS, 4))
    limits_m_s = random.uniform(1.0, 10.0, LAYOUTS)

    inverse, desaturated = np.empty((2, LAYOUTS, 4)), np.empty((2, LAYOUTS, 4))
    forward = np.empty((2, LAYOUTS, 3))
    for i in range(LAYOUTS):
        kinematics, radius_m = ours(positions_m[i], radii_m[i]), radii_m[i, 0]
        inverse[0, i] = kinematics.inverse(twists[i]) * radius_m
        forward[0, i] = kinematics.forward(measured_m_s[i] / radius_m)
        reduced = kinematics.desaturate(twists[i], limits_rad_s=limits_m_s[i] / radius_m)
        desaturated[0, i] = reduced.velocities * radius_m

        kinematics = theirs(positions_m[i])
        wheels = kinematics.toWheelSpeeds(ChassisSpeeds(*twists[i]))
        inverse[1, i] = speeds(wheels)
        twist = kinematics.toChassisSpeeds(MecanumDriveWheelSpeeds(*measured_m_s[i]))
        forward[1, i] = twist.vx, twist.vy, twist.omega
        wheels.desaturate(limits_m_s[i])
        desaturated[1, i] = speeds(wheels)

    np.testing.assert_allclose(*inverse, **EXACT)
    np.testing.assert_allclose(*forward, **EXACT)
    np.testing.assert_allclose(*desaturated, **EXACT)
    saturated = (np.abs(inverse[1]).max(axis=1) > limits_m_s).mean()
    assert 0.3 < saturated < 0.9  # both sides of the limit were tried
    # What was compared was large: nothing agrees by being nearly zero.
    assert all(np.abs(quantity[1]).max() > 9.0 for quantity in (inverse, forward, desaturated))


def test_wheels_of_several_radii_agree_when_weighted_by_their_squares():
    # We minimise errors in rad/s, WPILib those in m/s: error^2 [m/s] = radius^2 error^2 [rad/s].
    random = np.random.default_rng(20_261)
    plain = np.empty(1000)
    for i in range(1000):
        positions_m = random.uniform(0.05, 0.6, (4, 2)) * QUADRANTS
        radii_m, measured_m_s = random.uniform(0.02, 0.2, 4), random.uniform(-10.0, 10.0, 4)
        twist = theirs(positions_m).toChassisSpeeds(MecanumDriveWheelSpeeds(*measured_m_s))
        twist = [twist.vx, twist.vy, twist.omega]
        weighted = ours(positions_m, radii_m, weights=radii_m**2)
        # Radii differ by up to 10, their squares by 100, and so may the condition of the equations.
        np.testing.assert_allclose(weighted.forward(measured_m_s / radii_m), twist, rtol=0, atol=1e-11)
        plain[i] = np.abs(ours(positions_m, radii_m).forward(measured_m_s / radii_m) - twist).max()
    assert plain.max() > 1.0  # without weights it is another twist


def discretized(twists, period_s):
    held = [ChassisSpeeds.discretize(*twist, period_s) for twist in twists.tolist()]
    return np.array([(twist.vx, twist.vy, twist.omega) for twist in held])


@pytest.mark.parametrize(("least_rad", "most_rad"), [(0.1, 3.0), (0.0, 2e-5)])
def test_discretized_commands_agree(least_rad, most_rad):
    # WPILib's logarithm divides by 1 - cos(turn), which loses 2.2e-16 / turn^2 of its digits: 2.2e-14 of 5 m/s at
    # 0.1 rad. It takes a series below 4.5e-5 rad.
    random, period_s = np.random.default_rng(20_262), 0.02
    twists = random.uniform(-5.0, 5.0, (LAYOUTS, 3))
    turns_rad = random.uniform(least_rad, most_rad, LAYOUTS) * random.choice([-1, 1], LAYOUTS)
    twists[:, 2] = turns_rad / period_s
    np.testing.assert_allclose(
        omnistep.discretize(twists, dt_s=period_s), discretized(twists, period_s), rtol=1e-12, atol=1e-12
    )


def test_between_the_series_and_large_turns_ours_keeps_the_digits():
    turns_rad = np.geomspace(5e-5, 5e-3, 1000)
    twists = np.column_stack([np.ones(1000), np.zeros(1000), turns_rad])
    # (t/2) / tan(t/2) = 1 - t^2/12 - t^4/720 - ..., the next term below 1e-18 here.
    exact = 1 - turns_rad**2 / 12 - turns_rad**4 / 720
    np.testing.assert_allclose(omnistep.discretize(twists, dt_s=1.0)[:, 0], exact, rtol=0, atol=1e-15)
    # Theirs within what dividing by 1 - cos(turn) leaves: 1.1e-16 of rounding twice, in what is turn^2 / 2.
    error = np.abs(discretized(twists, 1.0)[:, 0] - exact)
    assert (error <= 4.4e-16 / turns_rad**2 + 1e-15).all()


def test_poses_moved_along_arcs_agree():
    random = np.random.default_rng(20_263)
    poses = random.uniform(-3.0, 3.0, (LAYOUTS, 3))
    displacements = random.uniform(-1.0, 1.0, (LAYOUTS, 3)) * [1.0, 1.0, 3.0]
    # WPILib divides 1 - cos(turn) by the turn: 1.1e-16 / turn of the way, 1.1e-13 at a milliradian.
    displacements[:, 2] += np.copysign(1e-3, displacements[:, 2])
    moved = [
        Pose2d(x, y, Rotation2d(yaw)).exp(Twist2d(*by))
        for (x, y, yaw), by in zip(poses.tolist(), displacements.tolist(), strict=True)
    ]
    ends = omnistep.moved_by(poses, displacements)
    np.testing.assert_allclose(ends[:, :2], [(pose.X(), pose.Y()) for pose in moved], **EXACT)
    # Theirs is wrapped, ours is added up.
    turns = (ends[:, 2] - [pose.rotation().radians() for pose in moved]) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), **EXACT)


@pytest.mark.parametrize("zone_rad_s", [0.0, 0.5, 2.0, np.inf])
@pytest.mark.parametrize("kd", [0.0, 0.01])
def test_a_pid_with_an_integral_zone_agrees(zone_rad_s, kd):
    period_s, times = 0.02, np.arange(3000) * 0.02
    # Both start without an error: WPILib's first derivative is of all of it.
    reference = 3.0 * np.sin(times) * np.sin(0.37 * times)
    measured = np.sin(2.3 * times)
    ours = omnistep.Pid(
        kp_n_m_s_rad=0.3,
        ki_n_m_rad=2.0,
        kd_n_m_s2_rad=kd,
        period_s=period_s,
        integral_zone_rad_s=zone_rad_s,
        anti_windup="none",
    )
    theirs = PIDController(0.3, 2.0, kd, period_s)
    theirs.setIntegratorRange(-1e9, 1e9)  # +-1 if left out
    theirs.setIZone(zone_rad_s)
    expected = [theirs.calculate(y, r) for y, r in zip(measured.tolist(), reference.tolist(), strict=True)]
    sample = ours.step(reference, measured)
    # 3000 sums of up to 10 N.m, rounded at 2e-16 of it.
    np.testing.assert_allclose(sample.output_n_m, expected, rtol=0, atol=1e-11)
    inside = np.abs(reference - measured) <= zone_rad_s
    assert (sample.i_n_m[~inside] == 0.0).all()
    if np.isfinite(zone_rad_s) and zone_rad_s > 0.0:
        assert 0.1 < inside.mean() < 0.9 and np.abs(sample.i_n_m).max() > 0.1  # both were tried
