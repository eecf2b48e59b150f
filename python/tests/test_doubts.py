"""What looks wrong with a log is reported: signs, the order of wheels, units; and nothing where all is right."""

import numpy as np
import pytest

import omnistep
from omnistep import _followed, _plausibility
from omnistep._motion_model import Motion
from omnistep._stretches import cut
from omnistep._vehicle_masses import Masses
from omnistep._wheel_logs import read

MAP = (
    'schema_version = 1\nvehicle = "mecanum4"\nperiod_s = 0.01\n[time]\ncolumn = "t"\n'
    '[wheels]\nnames = ["a", "b", "c", "d"]\nunit = "rad/s"\n'
    '[command]\nnames = ["vx", "vy", "wz"]\n[gyro]\nnames = ["g"]\n'
)


def imported(tmp_path, change, keys=MAP):
    """The summary of two seconds of driving about, of which something was changed."""
    time = 0.01 * np.arange(200)
    twists = np.stack([0.3 * np.sin(3 * time), 0.2 * np.cos(2 * time), np.sin(5 * time)], axis=1)
    wheels = omnistep.Kinematics(layout=omnistep.Vehicle("mecanum4").layout).inverse(twists)
    table = {"t": time, **dict(zip("abcd", wheels.T.copy(), strict=True)), "g": twists[:, 2].copy()}
    table |= dict(zip(("vx", "vy", "wz"), twists.T.copy(), strict=True))
    change(table)
    rows = [",".join(table), *(",".join(repr(float(c[k])) for c in table.values()) for k in range(len(time)))]
    (tmp_path / "robot.csv").write_text("\n".join(rows))
    (tmp_path / "my.toml").write_text(keys)
    return omnistep.import_log(tmp_path / "robot.csv", map=tmp_path / "my.toml", out=tmp_path / "robot.mcap")


def scaled(names, by):
    def change(table):
        for name in names:
            table[name] = table[name] * by

    return change


def swapped(table):
    table["a"], table["b"] = table["b"], table["a"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda table: None, []),
        # Noise of a tenth of what the wheels turn is none of that.
        (lambda table: table.update(a=table["a"] + 0.4 * np.random.default_rng(1).normal(size=200)), []),
        (
            scaled("b", -1.0),
            [
                "a counter is reversed",
                "as the gyro reads: wheel front_right looks reversed",
                "do not follow the command: wheel front_right looks reversed",
            ],
        ),
        # The redundancy of mecanum wheels has one sign for the first two: it does not tell them apart.
        (
            swapped,
            [
                "as the gyro reads: wheels front_left and front_right look exchanged",
                "the wheels do not follow the command: wheels front_left and front_right look exchanged",
            ],
        ),
        (scaled("g", 180 / np.pi), ["the gyro reads 57.3 times the yaw rate from the wheels"]),
        (scaled("g", -1.0), ["the gyro has the opposite sign"]),
        (scaled("abcd", -1.0), ["the gyro has the opposite sign", "all wheels turn opposite to the command"]),
        (scaled("t", 1e-3), ["samples are 1e-05 s apart: check the unit of time"]),
    ],
    ids=["right", "noise", "sign", "order", "degrees", "gyro", "all signs", "time"],
)
def test_import_tells_what_looks_wrong(tmp_path, change, said):
    # Of 2 ms no control periods of 10 ms are left, so these are shorter there.
    of_time = bool(said) and "unit of time" in said[0]
    summary = imported(tmp_path, change, MAP.replace("0.01", "0.0005") if of_time else MAP)
    if of_time:
        assert said[0] in summary.doubts[0]
        return
    assert len(summary.doubts) == len(said), summary.doubts
    for doubt, part in zip(summary.doubts, said, strict=True):
        assert part in doubt and f"doubtful: {doubt}" in str(summary)


def test_a_command_that_comes_a_nanosecond_late_is_the_periods_own(tmp_path):
    # As clocks jitter: held at the start of a period it would be the one before, in half of the periods.
    rng = np.random.default_rng(3)
    late = rng.choice([-1e-9, 1e-9], size=200)
    late[0] = 0.0
    summary = imported(tmp_path, lambda table: table.update(t=table["t"] + late))
    log = omnistep.read_mcap(summary.path)
    asked = 0.3 * np.sin(3 * 0.01 * np.arange(len(log.trace)))
    # A nanosecond of 10 ms of the one before, and nanoseconds are whole.
    assert np.abs(log.trace["asked_vx_m_s"] - asked).max() < 1e-8


def test_pwm_comes_in_as_duty_cycles_and_is_identified_by(tmp_path):
    keys = MAP.replace("[gyro]", '[duty]\nnames = ["p", "q", "r", "s"]\nscale = 0.003921568627450980\n[gyro]')

    def pwm(table):
        table.update(dict.fromkeys("pqrs", np.where(table["t"] < 1.0, 255.0, -300.0)))

    summary = imported(tmp_path, pwm, keys)
    log = omnistep.read_mcap(summary.path)
    duty = log.trace["commanded_duty_front_left"]
    assert duty[:99] == pytest.approx(1.0, abs=1e-12) and duty[101:] == pytest.approx(-300 / 255, rel=1e-12)
    beyond = [each.beyond for each in summary.signals if each.signal == "duty"]
    assert beyond == [100] * 4
    with pytest.raises(omnistep.ConfigError, match=r"_duty reaches 1\.176, allowed: -1 to 1"):
        omnistep.identify(log, vehicle="mecanum4")


def test_a_log_without_torques_says_what_it_lacks(tmp_path):
    log = imported(tmp_path, lambda table: None).path
    with pytest.raises(omnistep.ConfigError, match=r"no torque in wheel_front_left_applied_n_m, allowed: .*\[duty\]"):
        omnistep.identify(log, vehicle="mecanum4")


def test_a_torque_beyond_the_motors_line_at_its_speed_is_counted(tmp_path):
    keys = MAP.replace("[gyro]", '[torques]\nnames = ["p", "q", "r", "s"]\n[gyro]')
    vehicle = omnistep.Vehicle("mecanum4")
    stall, end = vehicle["motor.stall_torque_n_m"], vehicle.no_load_rad_s

    def torques(table):
        # Half of the line's beside it, and of one wheel all of what the motor has standing.
        table.update({new: 0.5 * stall * (1 - abs(table[of]) / end) for new, of in zip("pqr", "abc", strict=True)})
        table["s"] = np.full(200, stall)

    summary = imported(tmp_path, torques, keys)
    beyond = [each.beyond for each in summary.signals if each.signal == "torques"]
    turning = int((imported_wheel(summary.path) > 1e-3 * end).sum())
    assert beyond[:3] == [0, 0, 0] and abs(beyond[3] - turning) <= 2


def imported_wheel(path):
    return omnistep.read_mcap(path).trace.wheels("measured_rad_s")[:, 3]


def test_times_in_milliseconds_are_reported():
    vehicle = omnistep.Vehicle("mecanum4")
    log = {"time_s": 10.0 * np.arange(300)}
    for name in vehicle.wheel_names:
        log |= {f"wheel_{name}_measured_rad_s": np.ones(300), f"wheel_{name}_applied_n_m": np.ones(300)}
    with pytest.raises(
        omnistep.ConfigError, match=r"rows of time_s are 10 s apart, allowed: 5e-05 to 0\.5 s; log it in s"
    ):
        omnistep.identify(log, vehicle=vehicle)


def test_calibrate_names_the_run_that_no_vehicle_makes():
    drawn = omnistep.Vehicle("mecanum4")
    kinematics = omnistep.Kinematics(layout=drawn.layout)
    runs = []
    for twist in [(0.3, 0, 0), (0, 0.3, 0), (0, 0, 1), (0.2, 0, 0.5), (0, -0.2, -0.5), (-0.3, 0.1, 0.2)]:
        wheels = kinematics.inverse([twist] * 401)
        x, y, yaw = omnistep.moved_by([0, 0, 0], 4.0 * np.array(twist))
        log = {"time_s": 0.01 * np.arange(401)}
        log |= {f"wheel_{name}_measured_rad_s": wheels[:, k] for k, name in enumerate(drawn.wheel_names)}
        runs.append({"log": log, "end_x_m": x, "end_y_m": y, "end_yaw_rad": yaw})

    def reported(runs):
        found = omnistep.calibrate([omnistep.CalibrationRun(**run) for run in runs], vehicle=drawn)
        return [line for line in found.undetermined if line.startswith("run[")]

    assert reported(runs) == []
    centimetres = [dict(run) for run in runs]
    centimetres[1]["end_y_m"] *= 10
    assert [
        line
        for line in reported(centimetres)
        if line.startswith("run[1]: its end is ") and "check that it is in m, " in line
    ]
    degrees = [dict(run, end_yaw_rad=np.degrees(run["end_yaw_rad"]) % 6.28) for run in runs]
    assert [line for line in reported(degrees) if "check that it is in rad" in line]
    turned = [dict(run, log=dict(run["log"])) for run in runs]
    for run in turned:
        run["log"]["wheel_front_left_measured_rad_s"] = -run["log"]["wheel_front_left_measured_rad_s"]
    assert len([line for line in reported(turned) if "a counter is reversed" in line]) >= 5


def test_coarse_counts_and_wheels_that_hardly_turn_are_not_doubtful():
    # 360 counts at 1 kHz: one count is 17 rad/s for a period, the wheels turn at 4.
    time = 0.001 * np.arange(3000)
    twists = np.stack([0.3 * np.sin(3 * time), 0.0 * time, 0.0 * time], axis=1)
    vehicle = omnistep.Vehicle("chugo7")
    kinematics = omnistep.Kinematics(layout=vehicle.layout)
    angles = np.cumsum(kinematics.inverse(twists), axis=0) * 0.001
    counted = np.floor(angles * 360 / (2 * np.pi)) * 2 * np.pi / 360
    measured = np.diff(counted, axis=0, prepend=counted[:1]) / 0.001
    assert _plausibility.of_wheels(vehicle, measured, 0.001) == []
    # Ahead, wheels 2 and 6 are commanded to stand; a creep aside turns them as the others.
    creep = kinematics.inverse(twists + 0.005 * twists[:, [2, 0, 1]])
    assert _followed.of_command(vehicle, creep, twists, 0.001) == []
    # Commanded to go ahead alone, a vehicle says nothing of their signs.
    creep[:, [1, 5]] *= -1.0
    assert _followed.of_command(vehicle, creep, twists, 0.001) == []
    assert _followed.of_command(vehicle, -creep, twists, 0.001) != []


def test_rows_that_are_seconds_apart_are_doubtful():
    assert _plausibility.of_steps(0.005) == _plausibility.of_steps(0.5) == []
    assert _plausibility.of_steps(5.0) == ["samples are 5 s apart: check the unit of time"]


def test_the_delay_of_motors_does_not_depend_on_the_counted_side_of_the_gear():
    drawn = omnistep.Vehicle("mecanum4")
    times = []
    for gear in (1.0, 0.05):
        keys = {f"wheel.{k}.gear": gear for k in range(4)}
        vehicle = drawn.replace(keys)
        masses = Masses(vehicle)
        time = 0.01 * np.arange(300)
        log = {"time_s": time}
        for name in vehicle.wheel_names:
            log |= {f"wheel_{name}_measured_rad_s": np.full(300, 5.0 / gear), f"wheel_{name}_duty": np.ones(300)}
        read_log = read(log, vehicle)
        for lifted in (False, True):
            cut_log = cut(read_log, masses, read_log.duty, lifted=lifted)
            motion = Motion(cut_log, masses, read_log.duty, 1.0)
            # The same brake at the wheel: at an actuator that turns 20 times as fast it is 400 times as weak.
            p = {
                "mass_kg": 24.0,
                "yaw_inertia_kg_m2": 1.3,
                "wheel_inertia_kg_m2": 0.0035,
                "viscous_n_m_s_rad": 0.01,
                "slope_n_m_s_rad": 0.1 * gear**2,
            }
            times.append(motion.time_constant_s(p))
    assert times[:2] == pytest.approx(times[2:], rel=1e-9)
    # In the air the wheel's inertia over the brake.
    assert times[1] == pytest.approx(0.0035 / 0.11, rel=1e-9)


POSE_MAP = MAP.split("[command]")[0].replace('unit = "rad/s"', 'unit = "count"\ncounts_per_turn = 210')
PARTS = [(0.25, 0, 0)] * 400 + [(0, 0.25, 0)] * 400 + [(0, 0, 0.6)] * 500 + [(0.2, 0, 0.3)] * 500


def imported_with_pose(
    tmp_path, wheels="abcd", pose="xyh", counts=210, unit="rad", signs=(1, 1, 1), marker=(0, 0), late=0, noise=0.0,
    read=None, speed=1.0, hz=100, before=0.0, file=None,
):  # fmt: skip
    """The doubts of a drive ahead, aside, on the spot and round a bend, in whole counts, with the pose."""
    kinematics = omnistep.Kinematics(layout=omnistep.Vehicle("mecanum4").layout)
    # It stands before: so that a heading, or where it is, is not 0.
    twists = speed * np.array(PARTS if speed == 1.0 else PARTS * 3)
    turned = np.cumsum(kinematics.inverse(twists) * 0.01, axis=0)
    at, poses = np.array([0.0, 0.0, before]), []
    for twist in twists:
        at = np.asarray(omnistep.moved_by(at, 0.01 * np.array(twist)))
        cos, sin = np.cos(at[2]), np.sin(at[2])
        off = [cos * marker[0] - sin * marker[1], sin * marker[0] + cos * marker[1], 0.0]
        poses.append((at + off) * signs)
    poses = [poses[0]] * late + poses[: len(poses) - late]
    poses = np.array(poses) + noise * np.random.default_rng(0).normal(size=(len(poses), 3))
    poses = poses if read is None else read(poses)
    poses[np.arange(len(poses)) % (100 // hz) != 0] = np.nan
    table = {"t": 0.01 * np.arange(1, len(twists) + 1)}
    table |= dict(zip("abcd", np.floor(turned.T * 210 / (2 * np.pi)), strict=True))
    table |= dict(zip("xyh", np.array(poses).T, strict=True))
    rows = [",".join(table), *(",".join(repr(float(c[k])) for c in table.values()) for k in range(len(twists)))]
    (tmp_path / "pose.csv").write_text("\n".join(rows))
    listed = ", ".join(f'"{name}"' for name in wheels)
    keys = POSE_MAP.replace('["a", "b", "c", "d"]', f"[{listed}]").replace(
        "counts_per_turn = 210", f"counts_per_turn = {counts}"
    )
    if file is not None:
        (tmp_path / "robot.toml").write_text(file.to_toml())
        keys = keys.replace("mecanum4", "robot.toml")
    of_pose = ", ".join(f'"{name}"' for name in pose)
    (tmp_path / "pose.toml").write_text(f'{keys}[pose]\nnames = [{of_pose}]\nunit = "{unit}"\n')
    return omnistep.import_log(tmp_path / "pose.csv", map=tmp_path / "pose.toml", out=tmp_path / "pose.mcap").doubts


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, None),
        ({"wheels": "abdc"}, "read as front_left, front_right, rear_right, rear_left"),
        ({"wheels": "badc"}, "read as front_right, front_left, rear_right, rear_left"),
        ({"wheels": "dbca"}, "read as rear_right, front_right, rear_left, front_left"),
        ({"pose": "yxh"}, "x and y of the pose look exchanged"),
        ({"signs": (-1, 1, 1)}, "x of the pose looks reversed"),
        ({"signs": (1, -1, 1)}, "y of the pose looks reversed"),
        ({"signs": (1, 1, -1)}, "the heading of the pose looks reversed"),
        ({"signs": (1, 1, 180 / np.pi)}, "the heading of the pose looks like degrees"),
        ({"counts": 420}, "the vehicle moves 2 times what the wheels say"),
        ({"counts": 231}, "the vehicle moves 1.1 times what the wheels say"),
        ({"marker": (-0.2, 0.1)}, "the pose looks taken -0.20 m ahead and 0.10 m left of the vehicle's middle"),
        ({"late": 30}, "the pose looks 0.3 s late"),
        ({"noise": 0.01}, None),
    ],
)
def test_a_pose_in_the_log_finds_what_the_map_has_wrong(tmp_path, change, said):
    doubts = [line for line in imported_with_pose(tmp_path, **change) if "otherwise than the pose" in line]
    if said is None:
        assert doubts == []
        return
    (line,) = doubts
    # What is left is a count more or less in half a second, 1 in 50 to 100.
    assert said in line and line.endswith(("then 1 %", "then 2 %")), line


@pytest.mark.parametrize("track_m", [0.3, 0.36])
def test_a_file_with_the_other_mounting_is_named_and_not_the_order_of_the_wheels(tmp_path, track_m):
    # Of the vehicle the lever is 0.45 m; of the file, mounted the other way round, the difference of half its sides.
    drawn = omnistep.Vehicle("mecanum4")
    keys = {f"wheel.{k}.roller_angle_rad": -wheel.roller_angle_rad for k, wheel in enumerate(drawn.layout.wheels)}
    for k, wheel in enumerate(drawn.layout.wheels):
        sides = np.sign(wheel.position_m)
        keys[f"wheel.{k}.position_m"] = list(sides * [0.45 - 0.5 * track_m, 0.5 * track_m])
    doubts = imported_with_pose(tmp_path, file=drawn.replace(keys))
    (line,) = [line for line in doubts if "otherwise than the pose" in line]
    assert 'mounted the other way round ("O" and "X" exchanged), then' in line
    assert line.endswith(("then 1 %", "then 2 %")), line


def frozen(poses):
    poses[2000:] = poses[2000]
    return poses


def jumped(poses):
    poses[2000:] += [0.5, 0.3, 0.0]
    return poses


def compass(poses):
    return np.column_stack([poses[:, :2], 0.5 * np.pi - poses[:, 2]])


SLOW = {"speed": 0.2}
MILLIMETRE = {"noise": 1e-3, "before": 0.5}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        # At 0.05 m/s half a second is 25 mm: parts are as long as they have to be.
        (SLOW, None),
        ({**SLOW, "pose": "yxh"}, "x and y of the pose look exchanged"),
        ({**SLOW, "signs": (1, 1, -1)}, "the heading of the pose looks reversed"),
        ({**SLOW, "wheels": "abdc"}, "read as front_left, front_right, rear_right, rear_left"),
        (
            {**SLOW, "read": lambda poses: poses + np.array([0, 0, 0.5 * np.pi])},
            "heading looks 90.1 degrees to the left",
        ),
        ({**SLOW, "late": 100}, "the pose looks 1 s late"),
        ({**SLOW, "read": frozen}, "the pose does not move from 21.5 to 5"),
        ({**SLOW, "read": jumped}, "the pose jumps by 0.58 m and 0 degrees at 20.0"),
        # Every reading has its noise: that of a pose in centimetres is 100 times as much.
        (MILLIMETRE, None),
        ({**MILLIMETRE, "signs": (100, 100, 1)}, "x and y of the pose look like centimetres"),
        ({**MILLIMETRE, "signs": (1 / 0.0254, 1 / 0.0254, 1)}, "x and y of the pose look like inches"),
        ({**MILLIMETRE, "signs": (1, -1, -1)}, "y of the pose and the heading of the pose look reversed"),
        ({**MILLIMETRE, "signs": (1, 1, 180 / np.pi)}, "the heading of the pose looks like degrees"),
        ({**MILLIMETRE, "read": compass}, "the heading of the pose looks like a compass's"),
        # A sample a second: parts begin and end at samples.
        ({"hz": 1}, None),
        ({"hz": 1, "late": 10}, None),
        ({"hz": 2, "pose": "yxh"}, "x and y of the pose look exchanged"),
        ({"signs": (0, 0, 0)}, "the pose does not move while the wheels do"),
        ({"signs": (0, 0, 0), "noise": 1e-3}, "the pose does not move while the wheels do"),
        # It turns on the spot, too.
        ({"signs": (1, 1, 0)}, "the heading of the pose does not change"),
        # Wheels in deg/s turn the vehicle round and round in each part.
        ({"counts": 210 / 57.3}, "the vehicle moves 0.0174 times what the wheels say"),
        ({"counts": 210 / 57.3, "hz": 1}, "degrees from one pose to the next, too far to compare them"),
    ],
)
def test_slow_robots_and_slow_poses_are_compared_too(tmp_path, change, said):
    doubts = [line for line in imported_with_pose(tmp_path, **change) if "pose" in line]
    if said is None:
        assert doubts == []
        return
    assert len(doubts) == 1 + (change == {"signs": (1, 1, 0)})
    assert said in doubts[-1] and len(doubts[-1]) < 300, doubts


def repeated(poses):
    for first, last in ((200, 330), (1000, 1150), (1500, 1600)):
        poses[first:last] = poses[first]
    return poses


def test_poses_that_are_the_last_one_again_are_named_and_not_blamed_on_the_wheels(tmp_path):
    # The plate was hidden for 1 to 1.5 s, and the recorder wrote its last pose.
    doubts = [line for line in imported_with_pose(tmp_path, read=repeated) if "pose" in line]
    (same,) = [line for line in doubts if "to the last digit" in line]
    # Rows of 10 ms: 200 to 329, and what the resampler lays between the last of them and the next.
    assert "from 2.0 to 3.3 s while the wheels move, and 2 times more: repeated there, or wheels slipped" in same, same
    assert not any("the pose jumps" in line for line in doubts), doubts
    assert not any("otherwise than the pose" in line for line in doubts), doubts
    # What is wrong with the wheels is seen beside it.
    doubts = imported_with_pose(tmp_path, read=repeated, wheels="abdc")
    assert any("read as front_left, front_right, rear_right, rear_left" in line for line in doubts), doubts


@pytest.mark.parametrize("at", range(600, 2700, 300))
def test_a_counter_that_began_again_is_none_that_goes_round(at):
    time = 0.01 * np.arange(3000)
    counts = np.floor(2000 * np.sin(0.7 * time) + 1500 * np.sin(0.23 * time + 1))
    counts[at:] -= counts[at]
    (line,) = _plausibility.of_counter("w", time, counts, 7600.0) or [""]
    assert "goes round" not in line


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (lambda true: true, None),
        (lambda true: np.where(true > 32766, true % 32767, true), "wrap_bits = 15"),
        (lambda true: (true + 30000) % 65536, "wrap_bits = 16"),
        (lambda true: np.where(true > 20000, true - 20000, true), "the counter began again"),
    ],
)
def test_a_counter_that_starts_again_is_reported(tmp_path, read, said):
    counts = read(100 * np.arange(400))
    rows = ["t,a,b,c,d", *(f"{0.01 * k:.2f}," + ",".join([str(count)] * 4) for k, count in enumerate(counts))]
    (tmp_path / "c.csv").write_text("\n".join(rows))
    (tmp_path / "c.toml").write_text(POSE_MAP.replace("210", "4096"))
    summary = omnistep.import_log(tmp_path / "c.csv", map=tmp_path / "c.toml", out=tmp_path / "c.mcap")
    doubts = [line for line in summary.doubts if " jumps by " in line]
    assert len(doubts) == (0 if said is None else 4) and all(said in line for line in doubts)


def test_a_clock_that_goes_back_is_named_and_no_counter_is_blamed(tmp_path):
    # From row 251 on the clock is 0.5 s behind: 50 rows have times that were there before.
    rows = ["t,a,b,c,d"]
    rows += [f"{0.01 * k - 0.5 * (k >= 250):.2f}," + ",".join([str(100 * k)] * 4) for k in range(400)]
    (tmp_path / "c.csv").write_text("\n".join(rows))
    (tmp_path / "c.toml").write_text(POSE_MAP.replace("210", "4096"))
    summary = omnistep.import_log(tmp_path / "c.csv", map=tmp_path / "c.toml", out=tmp_path / "c.mcap")
    said = "column t: time goes back by 0.49 s in row 251, from 2.49 to 2 s: the clock was set there; import the log"
    assert summary.doubts[0].startswith(said) and not any("counter" in line for line in summary.doubts)
    assert all(each.unordered == 50 for each in summary.signals)


@pytest.mark.parametrize(
    "times",
    [
        [0.01 * k for k in range(400)] + [3.5],
        [0.01 * k for k in (*range(40), *range(42, 47), 40, 41, *range(47, 400))],
    ],
    ids=["the last row", "two rows at once"],
)
def test_rows_that_come_late_are_no_clock_that_was_set_back(tmp_path, times):
    rows = [f"{time:.2f}," + ",".join([str(round(10_000 * time))] * 4) for time in times]
    # A row that was cut has no time of its own.
    (tmp_path / "c.csv").write_text("\n".join(["t,a,b,c,d", *rows, "0.0,,,,"]))
    (tmp_path / "c.toml").write_text(POSE_MAP.replace("210", "4096"))
    summary = omnistep.import_log(tmp_path / "c.csv", map=tmp_path / "c.toml", out=tmp_path / "c.mcap")
    assert not any("goes back" in line for line in summary.doubts)
    assert all(each.missing == 1 for each in summary.signals)


def test_rates_that_no_motor_has_are_reported_in_words(tmp_path):
    summary = imported(tmp_path, scaled("abcd", 60.0), MAP.split("[command]")[0])
    (line,) = [line for line in summary.doubts if "faster than the motors without load, 30 rad/s" in line]
    assert line.startswith("wheels: a (") and "rad/min is 60" in line


def test_a_column_without_a_number_is_named(tmp_path):
    rows = "".join(f"{0.01 * k:.2f},1,1,1,\n" for k in range(100))
    (tmp_path / "log.csv").write_text("t,a,b,c,d\n" + rows)
    (tmp_path / "map.toml").write_text(
        'schema_version = 1\nvehicle = "mecanum4"\nperiod_s = 0.01\n[time]\ncolumn = "t"\nunit = "s"\n'
        '[wheels]\nnames = ["a", "b", "c", "d"]\nunit = "rad/s"\nat = "wheel"\n'
    )
    summary = omnistep.import_log(tmp_path / "log.csv", map=tmp_path / "map.toml", out=tmp_path / "log.mcap")
    assert "d of [wheels] has no number" in summary.doubts
