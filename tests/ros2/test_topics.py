"""Every topic of a run, as Cyclone DDS receives it: types, rates, stamps and what the messages say."""

import math
import xml.etree.ElementTree as ElementTree
from itertools import pairwise

import numpy as np
import pytest
from conftest import domains
from messages import stamp_ns
from peers import Cyclone, until
from program import Run

# Of docs/ros2.md: topic, type, rate [Hz].
STREAMS = {
    "/clock": ("rosgraph_msgs/msg/Clock", 100),
    "/odom": ("nav_msgs/msg/Odometry", 50),
    "/ground_truth/odom": ("nav_msgs/msg/Odometry", 50),
    "/tf": ("tf2_msgs/msg/TFMessage", 50),
    "/joint_states": ("sensor_msgs/msg/JointState", 50),
    "/vehicle_state": ("omnistep_msgs/msg/VehicleState", 50),
    "/imu": ("sensor_msgs/msg/Imu", 100),
}
ONCE = {
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/robot_description": "std_msgs/msg/String",
    "/terrain/robot_description": "std_msgs/msg/String",
}
SECONDS = 5  # the scenario's four, and one at rest


@pytest.fixture(scope="module")
def whole():
    """All that a run over flat ground says, from its first reader on, and how long it had no processor [s]."""
    domain = next(domains)
    cyclone = Cyclone(domain)
    topics = {topic: cyclone.read(topic, kind) for topic, (kind, _) in STREAMS.items()}
    topics |= {topic: cyclone.read(topic, kind, transient=True, depth=1) for topic, kind in ONCE.items()}
    run = Run("flat", "--wait", "--duration", str(SECONDS), domain=domain)
    try:
        assert run.ended() == 0, run.said
        until(lambda: all(topic.samples for topic in topics.values()), "a message of every topic")
        yield topics, run.starved_s
    finally:
        run.close()
        cyclone.close()


@pytest.fixture
def received(whole):
    """What it says."""
    return whole[0]


def stamps(topic) -> np.ndarray:
    return np.array([stamp_ns(sample) for sample in topic.samples])


@pytest.mark.parametrize("topic", STREAMS)
def test_every_topic_comes_at_its_rate_of_simulated_time(received, topic):
    period_ns = 1_000_000_000 // STREAMS[topic][1]
    at = stamps(received[topic])
    # The first message may tell the start, off the grid.
    assert np.all(at[1:] % period_ns == 0), at[1:][at[1:] % period_ns != 0]
    assert np.all(np.diff(at) > 0), "stamps go on"
    # A writer keeps ten messages for a reader that is late: a machine that stands still for longer loses some.
    span = at[-1] - at[1]
    assert len(at) - 1 >= 0.95 * (span / period_ns + 1)
    # The topics find each other in one or two seconds; without a reader nothing is sent.
    assert span > 2_000_000_000
    assert at[-1] >= (SECONDS - 0.1) * 1e9


def test_stamps_are_those_of_the_clock(received):
    clock = stamps(received["/clock"])
    known = set(clock.tolist())
    for topic in STREAMS:
        at = stamps(received[topic])[1:]
        at = at[(at >= clock[1]) & (at <= clock[-1])]
        missing = [stamp for stamp in at.tolist() if stamp not in known]
        # Both topics may lose messages on a machine that stands still.
        assert len(missing) <= 0.05 * len(at), (topic, missing)


def test_simulated_time_goes_as_that_of_the_wall(whole):
    clock, starved_s = whole[0]["/clock"], whole[1]
    simulated, wall = stamps(clock) / 1e9, np.array(clock.times_s)
    ahead = simulated - wall
    # What was late by up to half a second is caught up with.
    assert ahead.max() < ahead[:100].max() + 0.6
    span = wall[-1] - wall[0]
    late = span - (simulated[-1] - simulated[0]) - starved_s
    assert late < 0.1 * span  # the last message may wait for this process to have a processor, too


def test_odometry_is_near_the_truth_and_both_drive_as_the_scenario_says(received):
    truth = {stamp_ns(sample): sample for sample in received["/ground_truth/odom"].samples}
    both = [(sample, truth[stamp_ns(sample)]) for sample in received["/odom"].samples if stamp_ns(sample) in truth]
    assert len(both) > 50
    for odom, true in both:
        assert (odom.header.frame_id, odom.child_frame_id) == ("odom", "base_link")
        assert (true.header.frame_id, true.child_frame_id) == ("world", "base_link")
        seen, real = odom.pose.pose.position, true.pose.pose.position
        # The row of the run says 0.3 mm after 1.155 m; wheels of rubber without slip cannot do much worse.
        assert math.hypot(seen.x - real.x, seen.y - real.y) < 0.002
        assert min(np.diag(np.reshape(odom.pose.covariance, (6, 6)))) >= 0.0
    position = both[-1][1].pose.pose.position
    # 0.3 m/s for 4 s, less half of the ramp of 0.3 s; at the end the vehicle brakes from 0.3 m/s within 0.1 m.
    assert 1.15 < position.x < 1.26
    assert abs(position.y) < 0.001
    # The last second is rest.
    assert abs(both[-1][1].twist.twist.linear.x) < 0.01


def test_the_twist_of_odometry_has_a_covariance_that_says_what_is_not_known(received):
    driving = [sample for sample in received["/odom"].samples if 1e9 < stamp_ns(sample) < 4e9]
    for sample in driving:
        covariance = np.reshape(sample.twist.covariance, (6, 6))
        assert np.array_equal(covariance, covariance.T)
        assert np.all(np.diag(covariance)[2:5] == 1e6)  # z, roll and pitch
        # Five wheels at 4.5 rad/s: 0.02 rad per root of rad over 0.02 s are 0.3 rad/s, a fifth of whose square counts.
        vx, vy, wz = np.diag(covariance)[[0, 1, 5]]
        assert 1e-5 < vx < 1e-3
        assert 0.0 <= vy < 1e-2  # the wheels that point aside may stand still, and their encoders have no error here
        assert 0.0 < wz < 1e-1
    assert driving
    exact = received["/ground_truth/odom"].samples[-1]
    assert not np.any(exact.twist.covariance)


def test_quaternions_have_the_length_one(received):
    poses = received["/odom"].samples + received["/ground_truth/odom"].samples
    frames = [one for sample in received["/tf"].samples + received["/tf_static"].samples for one in sample.transforms]
    for q in [sample.pose.pose.orientation for sample in poses] + [one.transform.rotation for one in frames]:
        assert abs(math.hypot(q.x, q.y, q.z, q.w) - 1.0) < 1e-9  # rounding of a few products


def test_joints_are_those_of_the_description(received):
    robot = ElementTree.fromstring(received["/robot_description"].samples[0].data)
    moving = [joint.get("name") for joint in robot.iter("joint") if joint.get("type") != "fixed"]
    assert len([name for name in moving if name.startswith("wheel_")]) == 7
    for sample in received["/joint_states"].samples:
        assert list(sample.name) == moving
        assert len(sample.position) == len(sample.velocity) == len(sample.effort) == len(moving)
    # Positions are the integrals of velocities: over a message the mean lies between the first and the last, but for
    # what contacts rattle; the test's error would be a turn of 0.001 rad.
    for before, after in pairwise(received["/joint_states"].samples):
        dt = (stamp_ns(after) - stamp_ns(before)) / 1e9
        if dt > 0.021:
            continue  # one was lost
        moved = np.subtract(after.position, before.position)
        assert np.all(moved > np.minimum(after.velocity, before.velocity) * dt - 0.001)
        assert np.all(moved < np.maximum(after.velocity, before.velocity) * dt + 0.001)


def test_the_frames_are_one_tree_from_odom_to_every_link(received):
    robot = ElementTree.fromstring(received["/robot_description"].samples[0].data)
    links = {link.get("name") for link in robot.iter("link")}
    static = {one.child_frame_id: one.header.frame_id for one in received["/tf_static"].samples[0].transforms}
    assert static == {"imu_link": "base_link"}
    for sample in received["/tf"].samples:
        parents = dict(static)
        for one in sample.transforms:
            assert one.child_frame_id not in parents, f"two parents of {one.child_frame_id}"
            assert stamp_ns(one) == stamp_ns(sample)
            parents[one.child_frame_id] = one.header.frame_id
        assert links <= parents.keys()
        for link in parents:
            way = [link]
            while way[-1] in parents:
                way.append(parents[way[-1]])
                assert len(way) <= len(parents) + 1, f"a circle: {way}"
            assert way[-1] == "odom", way


def test_the_frame_of_the_base_is_where_odometry_says(received):
    odom = {stamp_ns(sample): sample.pose.pose for sample in received["/odom"].samples}
    compared = 0
    for sample in received["/tf"].samples:
        base = next(one.transform for one in sample.transforms if one.child_frame_id == "base_link")
        if pose := odom.get(stamp_ns(sample)):
            compared += 1
            place, turned = pose.position, pose.orientation
            assert (base.translation.x, base.translation.y) == pytest.approx((place.x, place.y), abs=1e-9)
            assert base.rotation.z == pytest.approx(turned.z, abs=1e-9)
    assert compared > 50


def test_the_imu_feels_gravity_and_no_turn(received):
    samples = received["/imu"].samples[
        10:
    ]  # the first tenth of a second is the settling on the springs of the contacts
    assert {sample.header.frame_id for sample in samples} == {"imu_link"}
    force = np.mean([(a.x, a.y, a.z) for a in (sample.linear_acceleration for sample in samples)], axis=0)
    # Driving off and braking cancel; what a vehicle at rest measures is 9.81 m/s2 upwards.
    assert force == pytest.approx([0.0, 0.0, 9.81], abs=0.1)
    turn = np.mean([(w.x, w.y, w.z) for w in (sample.angular_velocity for sample in samples)], axis=0)
    assert turn == pytest.approx([0.0, 0.0, 0.0], abs=0.01)


def test_the_state_tells_what_was_asked(received):
    samples = received["/vehicle_state"].samples
    assert {len(sample.wheels) for sample in samples} == {7}
    assert {sample.policy for sample in samples} == {"traction"}
    driving = [sample for sample in samples if 1e9 < stamp_ns(sample) < 4e9]
    assert driving
    assert {sample.asked_twist.linear.x for sample in driving} == {0.3}


def test_the_ground_has_a_description(received):
    ground = ElementTree.fromstring(received["/terrain/robot_description"].samples[0].data)
    assert ground.get("name") == "ground"
    assert ground.find("link") is not None
