"""The same with Fast DDS, the library of ROS 2's default middleware: it reads, and it steers."""

import time

import pytest
from messages import definitions, message, twist
from peers import until


def decoded(samples: list[bytes], kind: str):
    """The last sample, as rosbags reads it."""
    return definitions().deserialize_cdr(samples[-1], kind)


def test_fast_dds_reads_the_state_and_the_description_and_steers(fast_dds, run):
    peer = fast_dds()
    odom = peer.read("/odom", "nav_msgs/msg/Odometry")
    truth = peer.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    run("flat", "--set", "command.vx_m_s=0")
    description = peer.read("/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    frames = peer.read("/tf_static", "tf2_msgs/msg/TFMessage", transient=True, depth=1)
    until(lambda: odom and description and frames, "odometry, the description and the fixed frames")
    text = message("std_msgs/msg/String").deserialize(description[0]).data
    assert text.startswith('<robot name="chugo7">') and text.rstrip().endswith("</robot>")
    assert decoded(frames, "tf2_msgs/msg/TFMessage").transforms[0].child_frame_id == "imu_link"
    before = decoded(odom, "nav_msgs/msg/Odometry").pose.pose.position
    peer.write("/cmd_vel", "geometry_msgs/msg/Twist")

    def sideways() -> bool:
        peer.send("/cmd_vel", bytes(twist(vy=-0.2).serialize()))
        time.sleep(0.05)
        return decoded(odom, "nav_msgs/msg/Odometry").pose.pose.position.y < before.y - 0.2

    until(sideways, "0.2 m to the right")
    seen = decoded(odom, "nav_msgs/msg/Odometry").pose.pose.position
    real = decoded(truth, "nav_msgs/msg/Odometry").pose.pose.position
    # Two topics may be a message apart, 4 mm; the vehicle does not slip by more than a millimetre.
    assert (seen.x, seen.y) == pytest.approx((real.x, real.y), abs=0.01)


@pytest.mark.parametrize("reliable", [True, False])
def test_a_reader_may_ask_for_less_than_the_writer_gives(fast_dds, run, reliable):
    """`rviz2` and ros2_control read what sensors say with best effort."""
    peer = fast_dds()
    joints = peer.read("/joint_states", "sensor_msgs/msg/JointState", reliable=reliable, depth=5)
    run("flat")
    until(lambda: len(joints) > 20, "twenty messages")
    assert len(decoded(joints, "sensor_msgs/msg/JointState").name) == 9
