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


@pytest.mark.parametrize("policy", ["independent", "traction"])
@pytest.mark.parametrize("seconds", [4.0, 20.0])
@pytest.mark.parametrize("counts", [0.0, 4096.0])
def test_a_drive_straight_ahead_at_one_speed_is_not_doubtful(policy, seconds, counts):
    # Without its start nothing is left of it but the loops' overshoot, which falls while the command stays.
    straight = {
        "vehicle": "mecanum4",
        "physics.engine": "articulated",
        "duration_s": seconds,
        "command": {"vx_m_s": 0.3, "ramp_s": 0.3},
        "control.period_s": 0.005,
        "sensors.encoder_counts": counts,
        "vehicle.motor.gear_friction_n_m": 0.1,
    }
    trace, vehicle = omnistep.run("flat", policy=policy, overrides=straight), omnistep.Vehicle("mecanum4")
    measured = trace.wheels("measured_rad_s")
    asked = np.stack([trace[f"command_{axis}"] for axis in ("vx_m_s", "vy_m_s", "wz_rad_s")], axis=1)
    assert _followed.of_command(vehicle, measured, asked, 0.005) == []
    (line,) = _followed.of_command(vehicle, -measured, asked, 0.005)
    assert "all wheels" in line and ("opposite" in line or "reversed" in line)
    (line,) = _followed.of_command(vehicle, measured * [1, -1, 1, 1], asked, 0.005)
    assert "the command turns no wheel backwards, but wheels turn both ways" in line


def driven(name, seed=0, speed=0.4):
    """A minute of a vehicle's twists, another one every two seconds; wheels late by 0.1 s with noise, gyro, duty."""
    vehicle, rng = omnistep.Vehicle(name), np.random.default_rng(seed)
    asked = np.repeat(rng.uniform(-1, 1, (30, 3)) * [speed, speed, 2.5 * speed], 200, axis=0)
    asked[rng.random(30).repeat(200) < 0.2] = 0.0
    twists = np.zeros_like(asked)
    for k in range(10, len(asked)):
        twists[k] = twists[k - 1] + 0.1 * (asked[k - 10] - twists[k - 1])
    wheels = np.asarray(omnistep.Kinematics(layout=vehicle.layout).inverse(twists))
    wheels = wheels * (1 + 0.02 * rng.standard_normal(wheels.shape)) + 0.02 * rng.standard_normal(wheels.shape)
    gyro = 0.97 * twists[:, 2] + 0.01 * rng.standard_normal(len(twists)) + 0.01
    duty = wheels / (vehicle.no_load_rad_s or 40.0) + 0.05 * np.tanh(wheels)
    return vehicle, wheels, asked, gyro, duty


VEHICLES = ("mecanum4", "omni3", "chugo7", "rocker_bogie6")
LATE = (-200, -100, -50, 50, 100, 200)


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("speed", [0.05, 0.4])
def test_a_gyro_is_absolute_and_its_clock_and_axis_are_reported(name, speed):
    vehicle, wheels, _, gyro, _ = driven(name, speed=speed)

    def said(gyro=gyro, by=1.0):
        return _gyro_doubts.of_gyro(vehicle, by * wheels, gyro, PERIOD_S)

    assert said() == said(0.8 * gyro) == said(1.3 * gyro) == []
    for factor in (2.0, 4.0, 0.5, 0.25):
        for (line,) in (said(factor * gyro), said(by=1.0 / factor)):
            times = float(line.removeprefix("the gyro reads ").split()[0])
            assert times == pytest.approx(0.97 * factor, rel=0.1) and "quadrature makes 2 or 4 counts of one" in line
    not_as = "the gyro does not follow the yaw rate from the wheels: "
    (noise,) = said(0.02 * np.random.default_rng(1).standard_normal(len(gyro)))
    assert noise.startswith(not_as + "they correlate by ")
    assert said(0.0 * gyro) == [not_as + "it is constant"]
    assert said(0.01 * np.cumsum(gyro)) == [not_as + "it looks like an angle"]
    for late in LATE:
        (line,) = said(np.roll(gyro, late))
        assert line.startswith(f"the gyro looks {abs(late) / 100:g} s {'late' if late > 0 else 'early'}: ")


@pytest.mark.parametrize("name", VEHICLES)
def test_clocks_of_command_and_duty_cycles_that_differ_are_reported(name):
    vehicle, wheels, asked, _, duty = driven(name)
    for of, what, say in ((_followed.of_command, asked, "the command"), (_followed.of_duty, duty, "the duty cycles")):
        assert of(vehicle, wheels, what, PERIOD_S) == []
        for late in LATE:
            (line,) = of(vehicle, wheels, np.roll(what, late, axis=0), PERIOD_S)
            start, end = f"the wheels follow {say} ", " s late"
            if late > 0:
                start, end = "the wheels move ", f" s before {say}"
            found = float(line.removeprefix(start).split()[0])
            # A command is followed 0.2 s late as it is.
            assert line.startswith(start) and end in line and abs(found - abs(late) / 100) < 0.25, line


@pytest.mark.parametrize("name", VEHICLES)
def test_wheels_that_stand_while_driven_or_turn_twice_are_named(name):
    vehicle, wheels, asked, gyro, duty = driven(name)
    second = vehicle.wheel_names[1]

    def said(wheels):
        return [of(vehicle, wheels, what, PERIOD_S)
                for of, what in ((_followed.of_command, asked), (_followed.of_duty, duty))]  # fmt: skip

    assert said(0.0 * wheels) == [["all wheels stand while they are driven"]] * 2
    assert _gyro_doubts.of_gyro(vehicle, 0.0 * wheels, gyro, PERIOD_S) == ["the wheels stand while the gyro turns"]
    dead, frozen, double = (wheels.copy() for _ in range(3))
    dead[:, 1] = 0.0
    assert said(dead) == [[f"wheel {second} stands while driven"]] * 2
    frozen[1000:, 1] = 0.0
    for (line,) in said(frozen):
        assert line.startswith(f"wheel {second} stands from 1") and line.endswith(" s while driven")
    double[:, 1] *= 2.0
    for (line,) in said(double):
        times = float(line.removeprefix(f"wheel {second} turns ").split()[0])
        # The others differ by their noise and what they are driven.
        assert times == pytest.approx(2.0, rel=0.1) and "as far as the others for what drives it" in line
    none = duty * (np.arange(duty.shape[1]) != 1)
    assert _followed.of_duty(vehicle, wheels, none, PERIOD_S) == [
        f"the duty cycle of wheel {second} is always 0 while it turns"
    ]


@pytest.mark.parametrize("name", VEHICLES)
def test_axes_and_units_of_a_command_are_named_before_wheels_are(name):
    vehicle, wheels, asked, _, _ = driven(name)
    for read, reading in (
        (asked[:, [1, 0, 2]], "x and y of the command look exchanged"),
        (asked * [1, -1, 1], "y of the command looks reversed"),
        (asked * [1, 1, -1], "wz of the command looks reversed"),
        (asked * [1, 1, 180 / np.pi], "wz of the command looks like degrees"),
        (asked * [1, 1, np.pi / 180], "wz of the command looks like radians that are read as degrees"),
        (asked * [1000, 1000, 1], "x and y of the command look like millimetres"),
    ):
        (line,) = _followed.of_command(vehicle, wheels, read, PERIOD_S)
        assert line.startswith(f"the wheels do not follow the command: {reading}"), line


@pytest.mark.parametrize("name", VEHICLES)
def test_duty_cycles_and_wheels_without_direction_are_reported(name):
    vehicle, wheels, asked, _, duty = driven(name)
    (line,) = _followed.of_duty(vehicle, wheels, np.abs(duty), PERIOD_S)
    assert line.startswith("the duty cycles turn no wheel backwards, but wheels turn both ways")
    for of, what in ((_followed.of_command, asked), (_followed.of_duty, duty)):
        (line,) = of(vehicle, np.abs(wheels), what, PERIOD_S)
        assert line.startswith("no wheel turns backwards, but ")
