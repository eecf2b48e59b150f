"""Goals of a foreign peer: the way is planned by the chart, published, and driven over the step."""

import math
from pathlib import Path

import pytest
from messages import Header, Time, message, pose, stamp_ns, twist
from peers import until

CHART = Path(__file__).parents[2] / "crates/omni-plan/tests/charts/chugo7.toml"
PoseStamped = message("geometry_msgs/msg/PoseStamped")


def goal(x: float, y: float, yaw: float = 0.0, frame: str = "map") -> object:
    """What RViz sends for a click."""
    return PoseStamped(header=Header(stamp=Time(sec=0, nanosec=0), frame_id=frame), pose=pose(x, y, yaw))


@pytest.fixture
def vehicle(cyclone, run):
    """A run over a step of 30 mm at x = 0.7 m, its truth, its plans, and where goals go."""

    class Vehicle:
        truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
        plans = cyclone.read("/plan", "nav_msgs/msg/Path", transient=True)
        run = None
        goals = None

        def at(self) -> tuple[float, float, float]:
            place = self.truth.samples[-1].pose.pose.position
            return place.x, place.y, place.z

        def speed(self) -> float:
            linear = self.truth.samples[-1].twist.twist.linear
            return math.hypot(linear.x, linear.y)

        def now_s(self) -> float:
            return stamp_ns(self.truth.samples[-1]) / 1e9

    one = Vehicle()
    options = ["--chart", str(CHART), "--publish-map-frame", "--real-time-factor", "4"]
    one.run = run("step", *options, "--set", "terrain.height_m=0.03")
    one.goals = cyclone.write("/goal_pose", "geometry_msgs/msg/PoseStamped")
    one.truth.first()
    return one


def test_a_goal_behind_a_step_is_planned_published_and_reached(vehicle):
    # Where clients say where to go, the scenario's own 0.3 m/s do not count.
    until(lambda: vehicle.now_s() > 1.0, "a second")
    assert abs(vehicle.at()[0]) < 0.01
    low = vehicle.at()[2]
    # RViz sends goals in its fixed frame.
    vehicle.goals.write(goal(2.5, 0.3, math.pi / 2, frame="odom"))
    plan = vehicle.plans.first()
    assert plan.header.frame_id == "map"
    # Ten a second of a way of some ten seconds.
    assert len(plan.poses) > 50, vehicle.run.said
    ends = [(one.pose.position.x, one.pose.position.y) for one in (plan.poses[0], plan.poses[-1])]
    assert ends[0] == pytest.approx((0.0, 0.0), abs=0.02)
    assert ends[1] == pytest.approx((2.5, 0.3), abs=0.01)  # as far as odometry is off at the start

    def there() -> bool:
        x, y, _ = vehicle.at()
        return math.hypot(x - 2.5, y - 0.3) < 0.02 and vehicle.speed() < 0.01

    until(there, "the goal", 90)
    z = vehicle.at()[2]
    assert z - low == pytest.approx(0.03, abs=0.002)  # it stands on the step
    q = vehicle.truth.samples[-1].pose.pose.orientation
    assert 2 * math.atan2(q.z, q.w) == pytest.approx(math.pi / 2, abs=math.radians(3))


def test_a_command_ends_the_drive_and_a_goal_without_a_way_does_not(cyclone, vehicle):
    vehicle.goals.write(goal(-1.0, 0.0))
    until(lambda: vehicle.at()[0] < -0.1, "the way back")
    commands = cyclone.write("/cmd_vel", "geometry_msgs/msg/Twist")
    commands.write(twist(vx=0.1))
    until(lambda: vehicle.truth.samples[-1].twist.twist.linear.x > 0.05, "forward, as commanded")
    # After the command it rests, and does not go on to its goal. The plan is over, for late readers too.
    end = vehicle.now_s()
    until(lambda: vehicle.now_s() > end + 6.0, "six seconds")
    assert vehicle.speed() < 0.01
    assert vehicle.at()[0] > -0.9
    assert "/goal_pose: a command ended the drive to the goal" in vehicle.run.said
    until(lambda: len(vehicle.plans.samples) == 2, "the empty plan")
    assert not vehicle.plans.samples[-1].poses
    # On its way again, then a goal in the edge, to which there is no way.
    vehicle.goals.write(goal(-1.0, 0.0))
    until(lambda: vehicle.speed() > 0.1, "the way again")
    vehicle.goals.write(goal(0.7, 0.0))
    until(lambda: "/goal_pose: to 0.70, 0.00: " in vehicle.run.said, "the reason")
    until(lambda: abs(vehicle.at()[0] + 1.0) < 0.02 and vehicle.speed() < 0.01, "the goal before")
    assert len(vehicle.plans.samples) == 3
    assert vehicle.run.stop() == 0, vehicle.run.said


def test_what_is_no_goal_is_refused_in_a_line_and_moves_nothing(vehicle):
    vehicle.goals.write(goal(1.0, 0.0, frame="base_link"))
    until(lambda: 'the frame "base_link", allowed: map, odom' in vehicle.run.said, "the line about the frame")
    vehicle.goals.write(goal(math.nan, 0.0))
    until(lambda: "a goal at NaN, 0, allowed: within 50 m" in vehicle.run.said, "the line about the number")
    end = vehicle.now_s()
    until(lambda: vehicle.now_s() > end + 2.0, "two seconds")
    assert abs(vehicle.at()[0]) < 0.01
    assert not vehicle.plans.samples
