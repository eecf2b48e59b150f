"""Import compares wheels with duty cycles, commands and a gyro, and names the reading of the log that would fit."""

import numpy as np
import pytest

import omnistep
from omnistep import _followed, _gyro_doubts

PERIOD_S = 0.01
NAMES = ("front_left", "front_right", "rear_left", "rear_right")


@pytest.fixture(scope="module", params=[(0, "brake", 1440), (1, "coast", 48)], ids=str)
def hobby(request, hobby_plant):
    """Rates of the wheels and duty cycles of a hobby robot that shares no code with this; 48 counts are noisy."""
    seed, zero, counts = request.param
    table = hobby_plant.table(seed, zero, counts)
    angles, pwm = (np.stack([table[f"{of}_{k}"] for k in range(1, 5)], axis=1) for of in ("enc", "pwm"))
    measured = np.diff(angles * 2 * np.pi / counts, axis=0, prepend=np.nan) / PERIOD_S
    return hobby_plant.file(), measured, pwm


def test_wheels_that_do_not_follow_their_duty_cycles_are_named(hobby):
    vehicle, measured, pwm = hobby
    duty, not_as = pwm / 255, "the wheels do not follow the duty cycles: "

    def said(measured=measured, duty=duty):
        return _followed.of_duty(vehicle, measured, duty, PERIOD_S)

    assert said() == []
    for order, reading in [
        ([1, 0, 3, 2], "wheels front_left and front_right, rear_left and rear_right look exchanged"),
        ([0, 1, 3, 2], "wheels rear_left and rear_right look exchanged"),
        ([1, 2, 0, 3], "the wheels look read as front_right, rear_left, front_left, rear_right"),
    ]:
        assert said(duty=duty[:, order]) == [not_as + reading]
    assert said(measured * [1, 1, -1, 1]) == [not_as + "wheel rear_left looks reversed"]
    assert said(-measured) == [not_as + "all wheels look reversed"]
    assert said(duty=pwm) == ["duty cycles reach 250, allowed: -1 to 1: of a PWM of 255 scale is 0.00392"]
    # Of rpm the gain is 9.55, times the part of the line's speed that friction leaves: at least half.
    (line,) = said(measured * 30 / np.pi)
    assert 0.5 * 9.55 < float(line.removeprefix("the wheels turn ").split()[0]) < 1.2 * 9.55 and "rpm 9.55" in line


def by_hand(pose_plant, seed, noise):
    """A drive by hand: twists as commanded, wheels that slip and are late, a gyro."""
    rng = np.random.default_rng(seed)
    twists = pose_plant.commanded(rng, 40.0)
    slipped = 1.0 + 0.03 * noise * pose_plant.wandering(rng, len(twists), 4)
    late = round(0.08 / pose_plant.STEP_S)
    driven = np.roll(twists, late, axis=0)
    measured = pose_plant.rolled(driven) * slipped + 0.3 * noise * rng.standard_normal((len(twists), 4))
    gyro = driven[:, 2] + noise * (0.02 * rng.standard_normal(len(twists)) + 0.01)
    return omnistep.Vehicle("mecanum4"), measured, twists, gyro, pose_plant.STEP_S


@pytest.mark.parametrize(("seed", "noise"), [(0, 0.0), (1, 1.0), (2, 3.0)])
def test_a_drive_by_hand_is_not_doubtful_and_its_wrong_maps_are(pose_plant, seed, noise):
    vehicle, measured, twists, gyro, period_s = by_hand(pose_plant, seed, noise)

    def command(measured=measured, twists=twists):
        return _followed.of_command(vehicle, measured, twists, period_s)

    def yaw(measured=measured, gyro=gyro):
        return _gyro_doubts.of_gyro(vehicle, measured, gyro, period_s)

    assert command() == yaw() == []
    not_as, not_yaw = "the wheels do not follow the command: ", "the wheels do not turn the vehicle as the gyro reads: "
    rear, sides = [0, 1, 3, 2], [1, 0, 3, 2]
    assert command(measured[:, rear]) == [not_as + "wheels rear_left and rear_right look exchanged"]
    # A command that points y to the right and turns clockwise is the same.
    (line,) = command(measured[:, sides])
    assert line.startswith(not_as + "y of the command and wz of the command look reversed")
    assert line.endswith("or wheels front_left and front_right, rear_left and rear_right look exchanged")
    assert command(measured * [1, -1, 1, 1]) == [not_as + "wheel front_right looks reversed"]
    assert "all wheels turn opposite to the command" in command(-measured)[0]
    for factor, words in [(60.0, "rad/min"), (30 / np.pi, "rpm"), (1 / (2 * np.pi), "turns a second")]:
        (line,) = command(measured * factor)
        # Late wheels and slip leave the factor within 15 %.
        assert float(line.removeprefix("the wheels turn ").split()[0]) == pytest.approx(factor, rel=0.15)
        assert words in line
    # Of three motions a gyro sees one: several readings may fit, the right one among them.
    assert yaw(measured[:, rear])[0].startswith(not_yaw)
    assert "wheels rear_left and rear_right look exchanged" in yaw(measured[:, rear])[0]
    assert "the gyro has the opposite sign" in yaw(-measured)[0] and "or all wheels look reversed" in yaw(-measured)[0]
    assert "or wheels front_left and front_right, rear_left and rear_right look exchanged" in yaw(measured[:, sides])[0]


def test_a_vehicle_that_stands_or_drives_ahead_alone_says_nothing_of_the_order():
    vehicle, time = omnistep.Vehicle("mecanum4"), 0.02 * np.arange(1000)
    ahead = np.stack([0.3 * np.sin(time), 0 * time, 0 * time], axis=1)
    measured = np.asarray(omnistep.Kinematics(layout=vehicle.layout).inverse(ahead))
    assert _followed.of_command(vehicle, measured[:, [1, 0, 3, 2]], ahead, 0.02) == []
    assert _followed.of_duty(vehicle, 0.0 * measured, 0.1 + 0.0 * measured, 0.02) == []
    assert _gyro_doubts.of_gyro(vehicle, measured, 0.0 * time, 0.02) == []
    unknown = np.full_like(measured, np.nan)
    assert (
        _followed.of_command(vehicle, unknown, ahead, 0.02) == _followed.of_duty(vehicle, unknown, unknown, 0.02) == []
    )
