"""Which frames a run sends, and how several vehicles share a `/tf`."""

import pytest
from peers import until


def edges(samples):
    """Parent and child of every transform."""
    return {(one.header.frame_id, one.child_frame_id) for sample in samples for one in sample.transforms}


def test_odom_leaves_hinges_and_wheels_to_another_node(cyclone, run):
    tf = cyclone.read("/tf", "tf2_msgs/msg/TFMessage")
    static = cyclone.read("/tf_static", "tf2_msgs/msg/TFMessage", transient=True, depth=1)
    joints = cyclone.read("/joint_states", "sensor_msgs/msg/JointState")
    run("flat", "--tf", "odom", "--publish-map-frame")
    assert edges(tf.after(20)) == {("map", "odom"), ("odom", "base_link"), ("odom", "world")}
    assert edges([static.first()]) == {("base_link", "imu_link")}
    # What the other node makes of them.
    assert len([name for name in joints.first().name if name.startswith("wheel_")]) == 7


def test_none_leaves_all_frames_to_others(cyclone, run):
    tf = cyclone.read("/tf", "tf2_msgs/msg/TFMessage")
    static = cyclone.read("/tf_static", "tf2_msgs/msg/TFMessage", transient=True, depth=1)
    odom = cyclone.read("/odom", "nav_msgs/msg/Odometry")
    run("flat", "--tf", "none")
    odom.after(50)
    assert tf.samples == static.samples == []


def test_vehicles_with_prefixes_are_one_tree_below_the_map(cyclone, run):
    tf = cyclone.read("/tf", "tf2_msgs/msg/TFMessage")
    static = cyclone.read("/tf_static", "tf2_msgs/msg/TFMessage", transient=True)
    odom = {name: cyclone.read(f"/{name}/odom", "nav_msgs/msg/Odometry") for name in ("one", "two")}
    for name in odom:
        clock = [] if name == "one" else ["--topic-rate", "clock=0"]
        options = ["--namespace", name, "--frame-prefix", f"{name}/", "--publish-map-frame", "--tf", "odom"]
        run("flat", "--set", "vehicle=mecanum4", *options, *clock)
    expected = set()
    for name in odom:
        frames = [("map", "odom"), ("odom", "base_link"), ("odom", "world")]
        expected |= {(f"{name}/{a}" if a != "map" else a, f"{name}/{b}") for a, b in frames}
    until(lambda: edges(tf.samples) >= expected, "the frames of both")
    assert edges(tf.samples) == expected
    children = [child for _, child in expected]
    assert len(children) == len(set(children)), "a frame has one parent"
    links = {("one/base_link", "one/imu_link"), ("two/base_link", "two/imu_link")}
    until(lambda: edges(static.samples) == links, "the fixed frames of both")
    for name, topic in odom.items():
        first = topic.first()
        assert (first.header.frame_id, first.child_frame_id) == (f"{name}/odom", f"{name}/base_link")


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--tf", "none", "--publish-map-frame"], "--publish-map-frame = true, allowed: only with --tf all and odom"),
        (["--tf", "none", "--topic-rate", "tf=20"], "--topic-rate = tf=20, allowed: 0 with --tf none"),
        (["--frame-prefix", "/robot1/"], "--frame-prefix = /robot1/, allowed: "),
        (["--tf", "wheels"], "invalid value 'wheels' for '--tf <FRAMES>'"),
    ],
)
def test_what_cannot_be_asked_for_is_said(run, options, line):
    refused = run("flat", *options, ready=False)
    assert refused.ended() == 2
    assert line in refused.said
