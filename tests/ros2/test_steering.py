"""Velocity commands of a foreign peer: the vehicle obeys, and rests when they end."""

import math
import threading
import time

import pytest
from messages import stamp_ns, twist, twist_stamped
from peers import until

COMMANDS = {"geometry_msgs/msg/Twist": twist, "geometry_msgs/msg/TwistStamped": twist_stamped}


class Sender:
    """Sends one command at 20 Hz, as a person with a gamepad would, until it gets another or ends."""

    def __init__(self, write, command):
        self.write, self.command, self.going = write, command, True
        self.thread = threading.Thread(target=self._send)
        self.thread.start()

    def _send(self):
        while self.going:
            self.write(self.command)
            time.sleep(0.05)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.going = False
        self.thread.join()


def yaw(sample) -> float:
    q = sample.pose.pose.orientation
    return math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def now_s(subscription) -> float:
    return stamp_ns(subscription.samples[-1]) / 1e9


@pytest.mark.parametrize("kind", COMMANDS)
def test_commands_move_the_vehicle_sideways_until_half_a_second_after_the_last(cyclone, run, kind):
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    run("flat")
    writer = cyclone.write("/cmd_vel", kind)
    truth.first()
    with Sender(writer.write, COMMANDS[kind](vy=0.2)):
        # The scenario's own 0.3 m/s forward are over with the first command.
        until(lambda: abs(truth.samples[-1].twist.twist.linear.y - 0.2) < 0.01, "0.2 m/s to the left")
        until(lambda: abs(truth.samples[-1].twist.twist.linear.x) < 0.01, "no longer forward")
        start = len(truth.samples) - 1
        until(lambda: now_s(truth) > stamp_ns(truth.samples[start]) / 1e9 + 1.0, "a second of it")
    last = len(truth.samples) - 1
    gone = truth.samples[last].pose.pose.position.y - truth.samples[start].pose.pose.position.y
    # By the stamps, because a busy machine reads more than a second of messages. The second begins as the speed passes
    # 0.2 m/s for the first time, and has the overshoot of the loops in it: 8 % of its mean.
    elapsed_s = (stamp_ns(truth.samples[last]) - stamp_ns(truth.samples[start])) / 1e9
    assert gone / elapsed_s == pytest.approx(0.2, rel=0.1)
    # The command holds for 0.5 s, then the vehicle brakes from 0.2 m/s, well within another second.
    until(lambda: now_s(truth) > stamp_ns(truth.samples[last]) / 1e9 + 2.0, "two seconds without a command")
    held = [s for s in truth.samples[last:] if stamp_ns(s) - stamp_ns(truth.samples[last]) < 0.3e9]
    assert all(sample.twist.twist.linear.y > 0.18 for sample in held), "the command holds between messages"
    rest = truth.samples[-1].twist.twist
    assert math.hypot(rest.linear.x, rest.linear.y) < 0.005
    assert abs(rest.angular.z) < 0.01


def test_the_last_command_counts_whichever_type_it_has(cyclone, run):
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    run("flat")
    plain = cyclone.write("/cmd_vel", "geometry_msgs/msg/Twist")
    with Sender(plain.write, twist(wz=0.5)):
        until(lambda: truth.samples and abs(truth.samples[-1].twist.twist.angular.z - 0.5) < 0.03, "a turn to the left")
    stamped = cyclone.write("/cmd_vel", "geometry_msgs/msg/TwistStamped")
    with Sender(stamped.write, twist_stamped(vx=-0.2)):
        until(lambda: abs(truth.samples[-1].twist.twist.linear.x + 0.2) < 0.01, "backward")
        until(lambda: abs(truth.samples[-1].twist.twist.angular.z) < 0.03, "straight")


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e300])
def test_a_command_that_is_no_number_or_beyond_any_vehicle_moves_nothing(cyclone, run, wrong):
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    one = run("flat", "--set", "command.vx_m_s=0")
    writer = cyclone.write("/cmd_vel", "geometry_msgs/msg/Twist")
    truth.first()
    with Sender(writer.write, twist(vx=wrong)):
        start = now_s(truth)
        until(lambda: now_s(truth) > start + 1.0, "a second of it")
    assert one.process.poll() is None
    assert all(math.isfinite(sample.pose.pose.position.x) for sample in truth.samples)
    limit = 1.0  # beyond what the vehicle may ask of its motors
    assert all(abs(sample.twist.twist.linear.x) < limit for sample in truth.samples)


def test_a_command_that_is_rejected_is_said_on_rosout_once(cyclone, run):
    lines = cyclone.read("/rosout", "rcl_interfaces/msg/Log", transient=True, depth=10)
    one = run("flat", "--namespace", "fleet/robot1")
    writer = cyclone.write("/fleet/robot1/cmd_vel", "geometry_msgs/msg/Twist")
    with Sender(writer.write, twist(vx=math.nan)):
        line = lines.first()
        time.sleep(1.0)
    assert (line.level, line.name) == (30, "fleet.robot1.omnistep")  # a warning
    assert line.msg.startswith("/cmd_vel: ") and "vx_m_s" in line.msg
    assert len(lines.samples) == 1
    assert abs(line.stamp.sec - time.time()) < 60.0
    assert one.said.count(line.msg) == 1


def test_the_vehicle_turns_as_commanded(cyclone, run):
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    odom = cyclone.read("/odom", "nav_msgs/msg/Odometry")
    run("flat", "--set", "vehicle=mecanum4")
    writer = cyclone.write("/cmd_vel", "geometry_msgs/msg/Twist")
    truth.first()
    with Sender(writer.write, twist(wz=1.0)):
        until(lambda: yaw(truth.samples[-1]) > math.pi / 2, "a quarter turn to the left")
    # It goes on for the 0.5 s that the command holds and until it has braked, and both know.
    end = now_s(truth)
    until(lambda: now_s(truth) > end + 2.0 and now_s(odom) > end + 2.0, "two seconds more")
    assert math.pi / 2 + 0.3 < yaw(truth.samples[-1]) < math.pi
    assert yaw(odom.samples[-1]) == pytest.approx(yaw(truth.samples[-1]), abs=0.05)
