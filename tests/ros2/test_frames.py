"""Frames as RViz and a localisation want them, where odometry is off: on bumps."""

import numpy as np
import pytest
from conftest import domains
from messages import stamp_ns
from peers import Cyclone, until
from program import Run


def matrix(place, q) -> np.ndarray:
    """A pose as a matrix."""
    x, y, z, w = q.x, q.y, q.z, q.w
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, (place.x, place.y, place.z)
    return pose


@pytest.fixture(scope="module", params=[(), ("--publish-map-frame",)], ids=["odom", "map"])
def frames(request):
    """The truth, and the frames of the same time by name, with what is above each."""
    domain = next(domains)
    cyclone = Cyclone(domain)
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    tf = cyclone.read("/tf", "tf2_msgs/msg/TFMessage")
    run = Run("bumps", "--wait", "--duration", "5", *request.param, domain=domain)
    try:
        assert run.ended() == 0, run.said
        until(lambda: len(truth.samples) > 75 and len(tf.samples) > 75, "1.5 s at 50 Hz")
        poses = {stamp_ns(one): matrix(one.pose.pose.position, one.pose.pose.orientation) for one in truth.samples}
        both = []
        for message in tf.samples:
            named = {
                one.child_frame_id: (one.header.frame_id, matrix(one.transform.translation, one.transform.rotation))
                for one in message.transforms
            }
            if (true := poses.get(stamp_ns(message))) is not None:
                both.append((true, named))
        assert len(both) > 70
        yield bool(request.param), both
    finally:
        run.close()
        cyclone.close()


def test_the_ground_is_shown_where_the_vehicle_truly_is_on_it(frames):
    off = 0.0
    for true, named in frames[1]:
        assert named["world"][0] == named["base_link"][0] == "odom"
        world, base = named["world"][1], named["base_link"][1]
        assert world @ true == pytest.approx(base, abs=1e-9)  # products of a few numbers near 1
        off = max(off, np.abs(world - np.eye(4)).max())
    assert off > 0.001, "odometry was never off: this shows nothing"


def test_a_map_is_there_if_it_is_asked_for_and_has_the_vehicle_where_it_is(frames):
    asked, both = frames
    for true, named in both:
        assert ("odom" in named) == asked
        if asked:
            above, odom = named["odom"]
            assert above == "map"
            assert odom @ named["base_link"][1] == pytest.approx(true, abs=1e-9)
