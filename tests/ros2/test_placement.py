"""A foreign peer places the vehicle, as RViz does with *2D Pose Estimate*."""

import math

import pytest
from messages import Header, Time, first_of_another_run, message, pose, stamp_ns
from peers import until

TYPE = "geometry_msgs/msg/PoseWithCovarianceStamped"


def place(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> object:
    """What RViz sends: of the covariance nothing is read."""
    known = message("geometry_msgs/msg/PoseWithCovariance")(pose=pose(x, y, yaw), covariance=[0.0] * 36)
    return message(TYPE)(header=Header(stamp=Time(sec=0, nanosec=0), frame_id=frame), pose=known)


def planar(sample: object) -> tuple[float, float, float]:
    """Where an odometry message has the vehicle [m, rad]."""
    at, q = sample.pose.pose.position, sample.pose.pose.orientation
    return at.x, at.y, 2 * math.atan2(q.z, q.w)


def test_the_run_begins_anew_where_the_vehicle_is_placed(cyclone, run):
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    one = run("step", "--publish-map-frame")
    places = cyclone.write("/initialpose", TYPE)
    until(lambda: truth.samples and planar(truth.samples[-1])[0] > 0.1, "a drive of 0.1 m")
    # On the riser of the step there is no start: it drives on.
    places.write(place(0.6, 0.0))
    until(lambda: "/initialpose: " in one.said, "the reason")
    assert "terrain.start_x_m" in one.said
    places.write(place(0.0, 0.0, frame="base_link"))
    until(lambda: 'the frame "base_link", allowed: map, odom' in one.said, "the line about the frame")
    stamps = [stamp_ns(sample) for sample in truth.samples]
    assert stamps == sorted(stamps), "nothing began anew"
    places.write(place(-1.5, 0.4, 0.2))
    (begun,) = until(lambda: first_of_another_run(truth.samples), "another run")
    assert stamp_ns(begun) < 200_000_000  # messages may be lost on a machine that stands still
    assert planar(begun) == pytest.approx((-1.5, 0.4, 0.2), abs=0.03)  # 0.1 s at 0.3 m/s
    assert one.stop() == 0, one.said


def test_a_run_with_a_log_is_not_placed(cyclone, run, tmp_path):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    run("flat", "--log", str(tmp_path / "run.mcap"))
    places = cyclone.write("/initialpose", TYPE, matched=False)
    clock.after(100)
    assert not places.get_matched_subscriptions()
