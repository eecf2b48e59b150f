"""The peers among themselves: what the other tests find fault with is then the program's."""

from messages import Header, JointState, Time, message, stamp_ns, twist
from peers import until


def joints(k: int) -> object:
    header = Header(stamp=Time(sec=k, nanosec=7), frame_id="base_link")
    return JointState(header=header, name=["wheel_1", "w"], position=[0.1 * k, -1.0], velocity=[], effort=[float(k)])


def test_what_cyclone_sends_reaches_fast_dds_in_the_bytes_of_both(cyclone, fast_dds):
    fast = fast_dds()
    came = fast.read("/joint_states", "sensor_msgs/msg/JointState")
    writer = cyclone.write("/joint_states", "sensor_msgs/msg/JointState", depth=100)
    sent = [joints(k) for k in range(100)]
    for sample in sent:
        writer.write(sample)
    until(lambda: len(came) == 100, "100 samples")
    assert came == [bytes(sample.serialize()) for sample in sent]


def test_what_fast_dds_sends_reaches_cyclone(cyclone, fast_dds):
    commands = cyclone.read("/cmd_vel", "geometry_msgs/msg/Twist")
    fast = fast_dds()
    fast.write("/cmd_vel", "geometry_msgs/msg/Twist", depth=100)
    for k in range(100):
        fast.send("/cmd_vel", bytes(twist(vx=0.01 * k, wz=-1.0).serialize()))
    got = [(sample.linear.x, sample.angular.z) for sample in commands.after(100)]
    assert got == [(0.01 * k, -1.0) for k in range(100)]


def test_who_comes_late_gets_the_last_text_of_either(cyclone, fast_dds):
    text = "<robot/>" * 1500  # 12 kB: more than one datagram on most networks
    string = message("std_msgs/msg/String")
    writer = cyclone.write("/robot_description", "std_msgs/msg/String", matched=False, transient=True, depth=1)
    writer.write(string(data="old"))
    writer.write(string(data=text))
    late = fast_dds().read("/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    until(lambda: late, "the text")
    assert [string.deserialize(sample).data for sample in late] == [text]
    first = fast_dds()
    first._made("write", "/terrain/robot_description", "std_msgs/msg/String", True, True, 1)
    first.send("/terrain/robot_description", bytes(string(data=text).serialize()))
    ground = cyclone.read("/terrain/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    assert ground.first().data == text


def test_stamps_are_found_in_every_type():
    assert stamp_ns(joints(3)) == 3_000_000_007
    clock = message("rosgraph_msgs/msg/Clock")(clock=Time(sec=1, nanosec=5))
    assert stamp_ns(clock) == 1_000_000_005
    transform = message("geometry_msgs/msg/TransformStamped")
    transforms = [transform(header=joints(2).header, child_frame_id="x", transform=None)]
    assert stamp_ns(message("tf2_msgs/msg/TFMessage")(transforms=transforms)) == 2_000_000_007
