"""Bags of ROS 2 in, mcap and sqlite3, written by a foreign library."""

import sys

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import omnistep
from omnistep.__main__ import main

TYPES = get_typestore(Stores.ROS2_JAZZY)
START_NS = 1_790_000_000_000_000_000
PERIOD_NS = 1_000_000

MAP = """
schema_version = 1
vehicle = "omni3"
period_s = 0.001

[wheels]
topic = "/joint_states"
names = ["left", "right", "rear"]
unit = "rad"

[torques]
topic = "/joint_states"
names = ["left", "right", "rear"]

[command]
topic = "/cmd_vel"
max_gap_s = inf

[gyro]
topic = "/imu"

[accelerometer]
topic = "/imu"

[pose]
topic = "/tracker"

[odometry]
topic = "/odom"
"""


def _message(kind):
    return TYPES.types[kind]


def _header(time_ns):
    stamp = _message("builtin_interfaces/msg/Time")(sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    return _message("std_msgs/msg/Header")(stamp=stamp, frame_id="base_link")


def _vector(x, y, z):
    return _message("geometry_msgs/msg/Vector3")(x=float(x), y=float(y), z=float(z))


def _twist(vx, vy, wz):
    return _message("geometry_msgs/msg/Twist")(linear=_vector(vx, vy, 0), angular=_vector(0, 0, wz))


def _pose(x, y, yaw):
    place = _message("geometry_msgs/msg/Point")(x=float(x), y=float(y), z=0.0)
    turn = _message("geometry_msgs/msg/Quaternion")(x=0.0, y=0.0, z=np.sin(yaw / 2), w=np.cos(yaw / 2))
    return _message("geometry_msgs/msg/Pose")(position=place, orientation=turn)


def _messages(trace, *, stamped):
    """Topic, type, time [ns] and message of a run: joints and IMU at 1 kHz and 200 Hz, the rest at 50 Hz."""
    joints, imu = "sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu"
    command = "geometry_msgs/msg/TwistStamped" if stamped else "geometry_msgs/msg/Twist"
    odometry = "nav_msgs/msg/Odometry"
    turned = np.cumsum(trace.wheels("measured_rad_s") * 1e-3, axis=0)
    torques, velocities = trace.wheels("torque_n_m"), trace.wheels("measured_rad_s")
    order = [2, 0, 1]  # not the map's
    for row in range(len(trace)):
        time_ns = START_NS + row * PERIOD_NS
        names = ["rear", "left", "right"]
        positions, speeds, efforts = (each[row, order].copy() for each in (turned, velocities, torques))
        state = _message(joints)(
            header=_header(time_ns), name=names, position=positions, velocity=speeds, effort=efforts
        )
        yield "/joint_states", joints, time_ns, state
        if row % 5 == 0:
            quaternion = _message("geometry_msgs/msg/Quaternion")(x=0.0, y=0.0, z=0.0, w=1.0)
            rate = trace["twist_wz_rad_s"][row - 1] if row else 0.0
            unknown = np.zeros(9)
            reading = _message(imu)(
                header=_header(time_ns),
                orientation=quaternion,
                orientation_covariance=unknown,
                angular_velocity=_vector(0.1, 0.2, rate),
                angular_velocity_covariance=unknown,
                linear_acceleration=_vector(0, 0, 9.81),
                linear_acceleration_covariance=unknown,
            )
            yield "/imu", imu, time_ns, reading
        if row % 20 == 0:
            twist = _twist(*(trace[f"command_{axis}"][row] for axis in ("vx_m_s", "vy_m_s", "wz_rad_s")))
            message = _message(command)(header=_header(time_ns), twist=twist) if stamped else twist
            yield "/cmd_vel", command, time_ns, message
            for topic, off in (("/tracker", 0.0), ("/odom", 0.5)):
                at = (trace["pose_x_m"][row] + off, trace["pose_y_m"][row], trace["pose_yaw_rad"][row])
                unknown = np.zeros(36)
                seen = _message(odometry)(
                    header=_header(time_ns + PERIOD_NS),  # poses are of the end of a period
                    child_frame_id="base_link",
                    pose=_message("geometry_msgs/msg/PoseWithCovariance")(pose=_pose(*at), covariance=unknown),
                    twist=_message("geometry_msgs/msg/TwistWithCovariance")(twist=_twist(0, 0, 0), covariance=unknown),
                )
                yield topic, odometry, time_ns + PERIOD_NS, seen


def _bag(path, messages, plugin):
    with Writer(path, version=9, storage_plugin=plugin) as bag:
        topics = {}
        for topic, kind, time_ns, message in messages:
            if topic not in topics:
                topics[topic] = bag.add_connection(topic, kind, typestore=TYPES)
            # Received a little later than it was made.
            bag.write(topics[topic], time_ns + 300_000, TYPES.serialize_cdr(message, kind))
    return path


@pytest.fixture(scope="module", params=[StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite3"])
def bag(request, tmp_path_factory, curve):
    path = tmp_path_factory.mktemp("bags") / "drive"
    return _bag(path, _messages(curve, stamped=request.param is StoragePlugin.MCAP), request.param)


RECEIVED = 'period_s = 0.001\n[time]\nclock = "received"\n'


def _imported(folder, bag, keys=MAP):
    # The bag in sqlite3 has a Twist, which has no time but that of its arrival: all are read by that.
    if "clock" not in keys and (bag.suffix == ".db3" or list(bag.glob("*.db3"))):
        keys = keys.replace("period_s = 0.001\n", RECEIVED)
    (folder / "my.toml").write_text(keys)
    summary = omnistep.import_log(bag, map=folder / "my.toml", out=folder / "robot.mcap")
    return summary, omnistep.read_mcap(folder / "robot.mcap")


def test_a_bag_gives_what_was_written_into_it(bag, tmp_path, curve):
    _, log = _imported(tmp_path, bag)
    trace = log.trace
    assert len(trace) == len(curve)
    # Differences of sums in doubles: 1e-12 of some radians over a millisecond.
    assert np.allclose(trace.wheels("measured_rad_s")[1:], curve.wheels("measured_rad_s")[1:], atol=1e-9, rtol=0)
    assert np.array_equal(trace.wheels("torque_n_m"), curve.wheels("torque_n_m"))
    rows = np.arange(0, len(curve), 20)
    for axis in ("vx_m_s", "vy_m_s", "wz_rad_s"):
        # Held for the 20 periods until the next one.
        sent = trace[f"asked_{axis}"][rows + 1]
        assert np.array_equal(sent, curve[f"command_{axis}"][rows])
        assert np.array_equal(sent, trace[f"asked_{axis}"][rows + 19])
    for name in ("pose_x_m", "pose_y_m", "pose_yaw_rad"):
        assert np.allclose(trace[name][rows], curve[name][rows], atol=1e-12), name
    assert np.allclose(trace["odom_x_m"][rows] - trace["pose_x_m"][rows], 0.5)
    assert np.allclose(trace["gyro_rad_s"][5:-5:5], curve["twist_wz_rad_s"][4:-6:5], atol=1e-12)
    known = np.isfinite(trace["sensed_roll_rate_rad_s"])
    assert np.allclose(trace["sensed_roll_rate_rad_s"][known], 0.1) and known.sum() >= len(curve) - 5
    assert np.allclose(trace["sensed_specific_force_z_m_s2"][known], 9.81)
    counts = dict(_counts(log.path))
    # 2 s at 50 Hz and the first period; the last pose is unknown, because the last sample is before it.
    assert (counts["/joint_states"], counts["/odom"], counts["/ground_truth/odom"]) == (101, 100, 100)


def _counts(path):
    from mcap.reader import make_reader

    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    for number, channel in summary.channels.items():
        yield channel.topic, summary.statistics.channel_message_counts[number]


def test_a_file_of_a_bag_is_read_as_its_folder_is(bag, tmp_path):
    [file] = [each for each in bag.iterdir() if each.suffix in (".mcap", ".db3")]
    _, log = _imported(tmp_path, bag)
    folder = log.trace.to_numpy().copy()
    _, log = _imported(tmp_path, file)
    assert np.array_equal(folder, log.trace.to_numpy(), equal_nan=True)


def test_times_of_arrival_and_fields_of_any_message(bag, tmp_path):
    keys = MAP.replace("period_s = 0.001\n", RECEIVED)
    keys = keys.replace('[gyro]\ntopic = "/imu"', '[gyro]\ntopic = "/imu"\nnames = ["angular_velocity.y"]')
    _, log = _imported(tmp_path, bag, keys)
    known = np.isfinite(log.trace["gyro_rad_s"])
    assert known.any() and np.allclose(log.trace["gyro_rad_s"][known], 0.2)


def _two_topics(path, first_ns, *, stamp_ns=0, last_ns=None, stamped=False):
    """Joints and commands of 3 s at 100 Hz: their arrival from `first_ns` on, their headers from `stamp_ns` on."""
    joints, twist = "sensor_msgs/msg/JointState", "geometry_msgs/msg/Twist"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        states = bag.add_connection("/joint_states", joints, typestore=TYPES)
        kind = f"{twist}Stamped" if stamped else twist
        commands = bag.add_connection("/cmd_vel", kind, typestore=TYPES)
        for k in range(300):
            at_ns = k * 10_000_000
            header = _header(stamp_ns + at_ns)
            numbers = {name: np.full(3, float(k)) for name in ("position", "velocity", "effort")}
            state = _message(joints)(header=header, name=["left", "right", "rear"], **numbers)
            bag.write(states, first_ns + at_ns, TYPES.serialize_cdr(state, joints))
            command = _twist(0.2, 0, 0)
            if stamped:
                command = _message(kind)(header=_header(last_ns if last_ns and k == 299 else at_ns), twist=command)
            bag.write(commands, first_ns + at_ns, TYPES.serialize_cdr(command, kind))
    return path


TWO_TOPICS = MAP.split("[gyro]")[0].replace("period_s = 0.001", "period_s = 0.01")
ARRIVED = TWO_TOPICS.replace("[wheels]", '[time]\nclock = "received"\n[wheels]')


def test_headers_and_arrivals_are_never_mixed(tmp_path, monkeypatch, capfd):
    bag = _two_topics(tmp_path / "drive", START_NS, stamp_ns=5 * 10**9)
    code, _, err = _command_line(bag, tmp_path, monkeypatch, capfd, TWO_TOPICS)
    said = '"header": messages on /cmd_vel have no time stamps, those on /joint_states have, allowed: "received"'
    assert code == 2 and err.count("\n") == 1 and f"my.toml: time.clock: {said}" in err, err
    summary, log = _imported(tmp_path, bag, ARRIVED)
    assert np.isfinite(log.trace["asked_vx_m_s"]).all()
    known = {each.signal: each.known for each in summary.signals}
    # Of positions the first velocity is not known.
    assert known == {"wheels": 299, "torques": 300, "command": 300} and "known in" in str(summary)


def test_a_simulated_clock_begins_with_0(tmp_path):
    bag = _two_topics(tmp_path / "drive", START_NS, stamped=True)
    summary, _ = _imported(tmp_path, bag, TWO_TOPICS)
    assert [each.known for each in summary.signals] == [299] * 3 + [300] * 6


@pytest.mark.parametrize("clock", ["header", "received"])
def test_messages_years_apart_are_one_line(tmp_path, monkeypatch, capfd, clock):
    late_ns = (2**31 - 1) * 10**9
    if clock == "header":
        keys = TWO_TOPICS
        bag = _two_topics(tmp_path / "drive", START_NS, last_ns=late_ns, stamped=True)
        said = "messages on /cmd_vel are 2.14748e+09 s apart, allowed: 1e+07 s"
    else:
        keys = ARRIVED
        # The last log time in a file may be anything up to this.
        bag = _two_topics(tmp_path / "drive", 0)
        [file] = bag.glob("*.mcap")
        bag = _late(file, tmp_path / "late.mcap", 2**64 - 2)
        said = "messages on /cmd_vel are 1.84467e+10 s apart, allowed: 1e+07 s"
    code, _, err = _command_line(bag, tmp_path, monkeypatch, capfd, keys)
    assert code == 2 and err.count("\n") == 1 and said in err, err


def _late(source, path, log_time):
    """The messages of a file, the last of them logged at another time."""
    from mcap.reader import make_reader
    from mcap.writer import Writer as FileWriter

    with source.open("rb") as file, path.open("wb") as copy:
        writer = FileWriter(copy)
        writer.start(profile="ros2")
        channels = {}
        messages = list(make_reader(file).iter_messages())
        for number, (schema, channel, message) in enumerate(messages):
            if channel.topic not in channels:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, schema_id)
            at = log_time if number + 1 == len(messages) else message.log_time
            writer.add_message(channels[channel.topic], at, message.data, at)
        writer.finish()
    return path


BAD = [
    (MAP.replace("/imu", "/imus"), "my.toml: gyro.topic: no '/imus' in drive, there are: /imu"),
    (
        MAP.replace('names = ["left", "right", "rear"]\nunit', "unit"),
        "my.toml: wheels.names: missing, allowed: joints of",
    ),
    (
        MAP.replace('"/imu"', '"/imu"\nnames = ["speed.x"]', 1),
        "my.toml: gyro.names: no field 'speed.x' in a message of type",
    ),
    (
        MAP.replace('"/imu"', '"/imu"\nnames = ["header.frame_id"]', 1),
        "my.toml: gyro.names: field 'header.frame_id' is not a number",
    ),
    (MAP.replace('"/imu"', '"/imu"\nnames = ["__class__.x"]', 1), "my.toml: gyro.names: no field '__class__.x'"),
    (
        MAP.replace('[gyro]\ntopic = "/imu"', '[gyro]\nunit = "rad/s"'),
        "my.toml: gyro.topic: missing, allowed: a topic of",
    ),
    (
        MAP.replace('[command]\ntopic = "/cmd_vel"', '[command]\ntopic = "/imu"'),
        "my.toml: command.names: missing, allowed: fi",
    ),
]


@pytest.mark.parametrize(("keys", "said"), BAD, ids=range(len(BAD)))
def test_what_is_wrong_with_a_map_of_a_bag_is_one_line(bag, tmp_path, monkeypatch, capfd, keys, said):
    code, out, err = _command_line(bag, tmp_path, monkeypatch, capfd, keys)
    assert (code, out) == (2, "") and err.count("\n") == 1, err
    assert said in err, err


def _command_line(bag, folder, monkeypatch, capfd, keys):
    (folder / "my.toml").write_text(keys)
    monkeypatch.chdir(bag.parent)
    monkeypatch.setattr(sys, "argv", ["omnistep", "import", bag.name, "--map", str(folder / "my.toml")])
    code = main()
    said = capfd.readouterr()
    return code, said.out, said.err


def test_a_joint_that_is_never_there_leaves_its_column_empty_and_the_summary_says_so(bag, tmp_path):
    summary, log = _imported(tmp_path, bag, MAP.replace('"left"', '"links"'))
    assert np.isnan(log.trace.wheels("measured_rad_s")[:, 0]).all()
    assert np.isfinite(log.trace.wheels("measured_rad_s")[1:, 1:]).all()
    assert [each.samples for each in summary.signals[:3]] == [0, 2000, 2000]


def test_broken_bags_are_one_line(bag, tmp_path, monkeypatch, capfd):
    [file] = [each for each in bag.iterdir() if each.suffix in (".mcap", ".db3")]
    whole = file.read_bytes()
    rng = np.random.default_rng(3)
    garbled = bytearray(whole)
    for at in rng.integers(0, len(whole), 200):
        garbled[at] ^= 0xFF
    (tmp_path / "my.toml").write_text(MAP)
    for name, data in (
        ("torn", whole[: len(whole) // 2]),
        ("empty", b""),
        ("garbled", bytes(garbled)),
        ("text", b"robot\n"),
    ):
        path = tmp_path / f"{name}{file.suffix}"
        path.write_bytes(data)
        out = str(tmp_path / "out.mcap")
        arguments = ["import", str(path), "--map", str(tmp_path / "my.toml"), "-o", out, "--quiet"]
        monkeypatch.setattr(sys, "argv", ["omnistep", *arguments])
        code = main()
        said = capfd.readouterr()
        # A reader may still find all that it needs.
        assert (code == 2 and said.err.count("\n") == 1 and said.err.startswith("error: ")) or code == 0, (
            name,
            said.err,
        )
        if name in ("empty", "text"):
            assert code == 2, name
        if (name, file.suffix) == ("torn", ".mcap"):
            # What is there is imported, and it is said that the rest is missing.
            assert code == 0 and "its end is missing, as of a recording that was cut off" in said.out, said
    (tmp_path / "none").mkdir()
    monkeypatch.setattr(sys, "argv", ["omnistep", "import", str(tmp_path / "none"), "--map", str(tmp_path / "my.toml")])
    assert main() == 2 and capfd.readouterr().err.count("\n") == 1


def test_what_is_there_of_a_cut_off_bag_is_imported(tmp_path):
    whole, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    omnistep.run("flat", overrides={"vehicle": "mecanum4", "duration_s": 3.0}, mcap=whole, progress=False)
    cut.write_bytes(whole.read_bytes()[: int(0.7 * whole.stat().st_size)])
    (tmp_path / "map.toml").write_text(
        'schema_version = 1\nvehicle = "mecanum4"\nperiod_s = 0.02\n[wheels]\ntopic = "/joint_states"\n'
        'names = ["wheel_front_left", "wheel_front_right", "wheel_rear_left", "wheel_rear_right"]\nunit = "rad"\n'
        'at = "wheel"\n'
    )
    summaries = [
        omnistep.import_log(log, map=tmp_path / "map.toml", out=tmp_path / "out.mcap", progress=False)
        for log in (whole, cut)
    ]
    # Chunks are of a second: of 0.7 of the file there are two.
    assert [summary.rows for summary in summaries] == [150, pytest.approx(100, abs=2)]
    assert summaries[0].doubts == ()
    assert summaries[1].doubts[0].startswith("its end is missing, as of a recording that was cut off: ")
    # A file that had been made longer before the power went ends in zeros, within a record or behind one.
    for zeros in (64, 100_000):
        (tmp_path / "zeros.mcap").write_bytes(cut.read_bytes() + bytes(zeros))
        summary = omnistep.import_log(
            tmp_path / "zeros.mcap", map=tmp_path / "map.toml", out=tmp_path / "out.mcap", progress=False
        )
        assert (summary.rows, len(summary.doubts)) == (summaries[1].rows, 1)
    garbled = bytearray(cut.read_bytes())
    garbled[20_000] ^= 0xFF  # in the first chunk: what lies between chunks is not needed
    # Damage before the end is not taken for the end, zeros or not.
    for zeros in (0, 64):
        cut.write_bytes(garbled + bytes(zeros))
        with pytest.raises(omnistep.LogError, match=r"cut\.mcap"):
            omnistep.import_log(cut, map=tmp_path / "map.toml", out=tmp_path / "out.mcap", progress=False)
