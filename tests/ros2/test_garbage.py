"""Bytes on the topics of commands that are no command: each is a line, none moves or ends anything."""

import random
import struct

import pytest
from messages import Header, JointState, Time, stamp_ns, twist
from peers import until

HEADER = b"\x00\x01\x00\x00"
GARBAGE = {
    "nothing at all": b"",
    "half a twist": bytes(twist(vx=0.5).serialize())[:28],
    "a twist and a half": bytes(twist(vx=0.5).serialize()) + bytes(24),
    "random bytes": random.Random(7).randbytes(300),
    "a text longer than what is there": struct.pack("<iII", 1, 2, 0xFFFFFFFF) + bytes(60),
    "40 kB of zeros": bytes(40_000),
}
WHEEL = "wheel_front_left"


def joints(names: list[str], velocity: list[float]) -> bytes:
    header = Header(stamp=Time(sec=0, nanosec=0), frame_id="")
    return bytes(JointState(header=header, name=names, position=[], velocity=velocity, effort=[]).serialize())


def lines(one) -> list[str]:
    """What it has said beyond that it is ready."""
    return [line for line in one.said.splitlines() if not line.startswith("publishing on ROS 2")]


def goes_on(one, clock):
    """It still runs, two seconds later."""
    start = stamp_ns(clock.samples[-1])
    until(lambda: stamp_ns(clock.samples[-1]) > start + 2_000_000_000, "two seconds more")
    assert one.process.poll() is None, one.said


@pytest.mark.parametrize("what", GARBAGE)
@pytest.mark.parametrize("kind", ["geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"])
def test_no_garbage_moves_the_vehicle(cyclone, fast_dds, run, kind, what):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    one = run("flat", "--set", "command.vx_m_s=0")
    peer = fast_dds()
    peer.write("/cmd_vel", kind)
    clock.first()
    garbage = GARBAGE[what]
    for _ in range(30):
        peer.send("/cmd_vel", garbage if garbage.startswith(HEADER) else HEADER + garbage)
    goes_on(one, clock)
    # Zeros are a command of rest, of whatever length they are.
    assert all(abs(sample.twist.twist.linear.x) < 0.01 for sample in truth.samples[5:])
    said = lines(one)
    assert len(said) <= 20
    assert all(len(line) < 300 and "/cmd_vel" in line for line in said), said
    assert one.stop() == 0


@pytest.mark.parametrize(
    ("names", "velocity"),
    [(["wheel_x"], [1.0]), ([WHEEL], []), ([WHEEL], [1.0, 2.0]), ([WHEEL], [float("inf")])],
    ids=["joints of others alone", "no value", "a value too many", "infinite"],
)
def test_commands_of_joints_that_do_not_fit_are_reported_and_move_nothing(cyclone, run, fast_dds, names, velocity):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    states = cyclone.read("/joint_states", "sensor_msgs/msg/JointState")
    one = run("flat", "--set", "vehicle=mecanum4", "--ros2-control", "velocity")
    peer = fast_dds()
    peer.write("/joint_commands", "sensor_msgs/msg/JointState")
    clock.first()
    peer.send("/joint_commands", joints(names, velocity))
    until(lambda: lines(one), "a line that says why")
    goes_on(one, clock)
    assert len(lines(one)) == 1 and "/joint_commands" in one.said
    assert all(abs(value) < 0.05 for value in states.samples[-1].velocity)
