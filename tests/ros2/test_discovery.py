"""Who finds whom: late readers, waiting for one, domains, names and rates."""

import re
import signal
from itertools import pairwise

import pytest
from messages import stamp_ns
from peers import Cyclone, until
from program import Run


def test_a_late_reader_gets_the_description_and_the_fixed_frames(cyclone, run):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    run("flat")
    until(lambda: clock.samples and stamp_ns(clock.samples[-1]) > 2_000_000_000, "two seconds")
    description = cyclone.read("/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    ground = cyclone.read("/terrain/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    frames = cyclone.read("/tf_static", "tf2_msgs/msg/TFMessage", transient=True, depth=10)
    assert description.first().data.startswith("<robot")
    assert ground.first().data.startswith("<robot")
    assert [one.child_frame_id for one in frames.first().transforms] == ["imu_link"]
    # Once: what is sent anew all the time would reach a reader that asks for nothing of before as well.
    later = cyclone.read("/robot_description", "std_msgs/msg/String", transient=False)
    now = stamp_ns(clock.samples[-1])
    until(lambda: stamp_ns(clock.samples[-1]) > now + 2_000_000_000, "two seconds more")
    assert len(description.samples) == len(ground.samples) == len(frames.samples) == 1
    assert later.samples == []


def test_a_run_that_waits_starts_with_its_first_reader(cyclone, run):
    first = run("flat", "--wait")
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    # Readers of other topics come later, and miss what was before them.
    assert stamp_ns(clock.first()) <= 100_000_000
    assert first.stop() == 0


def test_a_run_that_waits_can_be_ended_and_has_no_metrics(run):
    one = run("flat", "--wait")
    assert one.stop() == 130
    assert one.printed == ""
    assert one.said.splitlines()[-1].startswith("stopped: the run ended at 0.00 s")


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_a_run_ends_by_a_signal_with_its_metrics(cyclone, run, by):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    one = run("flat")
    until(lambda: clock.samples and stamp_ns(clock.samples[-1]) > 1_000_000_000, "a second")
    assert one.stop(by) == 0
    assert " completed |" in one.printed


def test_without_a_reader_a_run_ends_after_its_time(run):
    one = run("flat", "--duration", "1")
    assert one.ended() == 0
    assert " completed |" in one.printed


def test_the_domain_of_the_environment_is_followed():
    peers = {domain: Cyclone(domain) for domain in (0, 42)}
    clocks = {domain: peer.read("/clock", "rosgraph_msgs/msg/Clock") for domain, peer in peers.items()}
    one = Run("flat", domain=42)
    try:
        assert one.domain == 42
        assert len(clocks[42].after(50)) >= 50
        assert clocks[0].samples == []
    finally:
        one.close()
    one = Run("flat", domain=None)
    try:
        assert one.domain == 0
        clocks[0].first()
    finally:
        one.close()
        for peer in peers.values():
            peer.close()


@pytest.mark.parametrize("domain", ["233", "-1", "x", "1.5"])
def test_a_domain_that_is_none_is_one_line(domain):
    one = Run("flat", "--duration", "1", domain=domain, ready=False)
    try:
        assert one.ended() == 2
        lines = one.said.splitlines()
        assert len(lines) == 1, one.said
        assert "ROS_DOMAIN_ID" in lines[0] and "232" in lines[0]
        assert f" = {domain}," in lines[0]
    finally:
        one.close()


@pytest.mark.parametrize("namespace", ["robot1", "/fleet/robot_1"])
def test_names_are_under_the_namespace_but_the_clock(cyclone, run, namespace):
    under = "/" + namespace.strip("/")
    names = {
        "/clock": "rosgraph_msgs/msg/Clock",
        f"{under}/tf": "tf2_msgs/msg/TFMessage",
        f"{under}/odom": "nav_msgs/msg/Odometry",
        f"{under}/ground_truth/odom": "nav_msgs/msg/Odometry",
        f"{under}/joint_states": "sensor_msgs/msg/JointState",
        f"{under}/imu": "sensor_msgs/msg/Imu",
        f"{under}/vehicle_state": "omnistep_msgs/msg/VehicleState",
    }
    topics = [cyclone.read(topic, kind) for topic, kind in names.items()]
    topics.append(cyclone.read(f"{under}/robot_description", "std_msgs/msg/String", transient=True, depth=1))
    plain = cyclone.read("/odom", "nav_msgs/msg/Odometry")
    run("flat", "--namespace", namespace)
    for topic in topics:
        topic.first()
    cyclone.write(f"{under}/cmd_vel", "geometry_msgs/msg/Twist")
    assert plain.samples == []


@pytest.mark.parametrize("namespace", ["1robot", "a//b", "a b", "ro-bot"])
def test_a_namespace_that_ros_would_refuse_is_one_line(namespace, domain):
    one = Run("flat", "--duration", "1", "--namespace", namespace, domain=domain, ready=False)
    try:
        assert one.ended() == 2
        assert "--namespace" in one.said
    finally:
        one.close()


def test_rates_are_as_asked(cyclone, run):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    odom = cyclone.read("/odom", "nav_msgs/msg/Odometry")
    joints = cyclone.read("/joint_states", "sensor_msgs/msg/JointState")
    imu = cyclone.read("/imu", "sensor_msgs/msg/Imu")
    run("flat", "--topic-rate", "/odom=10", "--topic-rate", "/joint_states=200", "--topic-rate", "/imu=0")
    for topic, period_ns in ((odom, 100_000_000), (joints, 5_000_000), (clock, 10_000_000)):
        at = [stamp_ns(sample) for sample in topic.after(30)[1:]]
        steps = [after - before for before, after in pairwise(at)]
        # What is lost on a machine that stands still leaves a gap, never a shorter step.
        assert min(steps) == period_ns
        assert sorted(steps)[len(steps) // 2] == period_ns
    assert imu.samples == []


@pytest.mark.parametrize("rate", ["/odom", "/odom=-1", "/odom=x", "/nothing=10", "/odom=1e9"])
def test_a_rate_that_is_none_is_one_line(rate, domain):
    one = Run("flat", "--duration", "1", "--topic-rate", rate, domain=domain, ready=False)
    try:
        assert one.ended() == 2
        assert "--topic-rate" in one.said
        assert re.search(re.escape(rate.split("=")[0]), one.said)
    finally:
        one.close()
