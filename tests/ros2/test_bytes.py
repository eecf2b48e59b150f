"""What goes over DDS is in every byte what the log of the same scenario holds."""

import subprocess

import pytest
from mcap.reader import make_reader
from messages import definitions, stamp_ns
from peers import until
from program import PROGRAM

KINDS = {
    "/odom": "nav_msgs/msg/Odometry",
    "/ground_truth/odom": "nav_msgs/msg/Odometry",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/vehicle_state": "omnistep_msgs/msg/VehicleState",
}


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Messages of the log of `flat` by topic and stamp."""
    folder = tmp_path_factory.mktemp("log")
    subprocess.run([PROGRAM, "run", "flat", "--quiet", "--out", folder], check=True, capture_output=True)
    messages: dict[str, dict[int, bytes]] = {}
    with next(folder.glob("*.mcap")).open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            messages.setdefault(channel.topic, {})[message.log_time] = message.data
    return messages


def test_messages_are_byte_for_byte_those_of_the_log(fast_dds, run, log):
    peer = fast_dds()
    came = {topic: peer.read(topic, kind) for topic, kind in KINDS.items()}
    description = peer.read("/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    one = run("flat", "--wait", "--duration", "3.5")
    assert one.ended() == 0
    until(lambda: description, "the description")
    for topic, kind in KINDS.items():
        stamps = [stamp_ns(definitions().deserialize_cdr(sample, kind)) for sample in came[topic]]
        assert len(stamps) > 75, "half of 3.5 s at 50 Hz; the readers are found in the meantime"
        for stamp, sample in zip(stamps, came[topic], strict=True):
            assert sample == log[topic][stamp], f"{topic} at {stamp} ns"
    # A text may be followed by the bytes that fill up the last four.
    text = log["/robot_description"][0]
    assert description[0][: len(text)] == text
    assert len(description[0]) - len(text) < 4
