"""What a user of ros2_control has at the other end of the two topics of joints.

`JointStateTopicSystem` does what the plugin of `joint_state_topic_hardware_interface` does, `OmniWheelDrive` and
`MecanumDrive` what `omni_wheel_drive_controller` and `mecanum_drive_controller` do; names of parameters are theirs.
Their formulas are public, the code here is our own: tests/vectors/outside_vectors.json has figures of their tests.
"""

import math
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import yaml
from messages import Header, JointState, Time, stamp_ns
from peers import PATIENCE_S, Cyclone


class Controller(Protocol):
    """From a twist to wheel velocities, and from what wheels did to a pose."""

    joints: list[str]
    pose: list[float]

    def commands(self, vx: float, vy: float, wz: float) -> list[float]:
        """Velocities of the joints [rad/s] for a twist [m/s, rad/s]."""

    def update(self, positions: list[float], velocities: list[float], dt: float) -> bool:
        """Takes in what the joints did [rad, rad/s] in the last `dt` seconds."""


@dataclass
class OmniWheelDrive:
    """Wheels at equal angles on a circle, counter-clockwise; positive turning drives the vehicle clockwise."""

    wheel_names: list[str]
    wheel_offset: float
    robot_radius: float
    wheel_radius: float
    pose: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    before: np.ndarray | None = None

    @property
    def joints(self) -> list[str]:
        """In the order of the parameter."""
        return self.wheel_names

    def _rows(self) -> np.ndarray:
        count = len(self.wheel_names)
        angles = self.wheel_offset + 2 * math.pi * np.arange(count) / count
        return np.column_stack([np.sin(angles), -np.cos(angles), np.full(count, -self.robot_radius)])

    def commands(self, vx: float, vy: float, wz: float) -> list[float]:
        """Velocities of the joints [rad/s] for a twist [m/s, rad/s]."""
        return list(self._rows() @ [vx, vy, wz] / self.wheel_radius)

    def update(self, positions: list[float], velocities: list[float], dt: float) -> bool:
        """From positions, as `position_feedback` is by default; the first update only remembers them."""
        if abs(dt) < 1e-6:
            return False
        now = np.array(positions)
        before, self.before = self.before, now
        if before is None:
            return False
        self.move(np.linalg.lstsq(self._rows(), (now - before) / dt * self.wheel_radius, rcond=None)[0], dt)
        return True

    def move(self, twist: np.ndarray, dt: float):
        """Along the arc of a constant twist."""
        x, y, heading = self.pose
        dx, dy, turn = np.asarray(twist) * dt
        if abs(turn) < 1e-6:
            s, c = math.sin(heading), math.cos(heading)
            ahead, left = dx, dy
        else:
            # The chord of the arc, in the axes at its start.
            s, c = math.sin(heading), math.cos(heading)
            ahead = (dx * math.sin(turn) + dy * (math.cos(turn) - 1)) / turn
            left = (dy * math.sin(turn) - dx * (math.cos(turn) - 1)) / turn
        self.pose = [x + c * ahead - s * left, y + s * ahead + c * left, heading + turn]


@dataclass
class MecanumDrive:
    """Four mecanum wheels; positive turning drives the vehicle forward."""

    front_left_wheel_command_joint_name: str
    front_right_wheel_command_joint_name: str
    rear_right_wheel_command_joint_name: str
    rear_left_wheel_command_joint_name: str
    wheels_radius: float
    sum_of_robot_center_projection_on_X_Y_axis: float
    pose: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    @property
    def joints(self) -> list[str]:
        """Clockwise from the front left."""
        return [
            self.front_left_wheel_command_joint_name,
            self.front_right_wheel_command_joint_name,
            self.rear_right_wheel_command_joint_name,
            self.rear_left_wheel_command_joint_name,
        ]

    def _rows(self) -> np.ndarray:
        k = self.sum_of_robot_center_projection_on_X_Y_axis
        return np.array([[1.0, -1.0, -k], [1.0, 1.0, k], [1.0, -1.0, k], [1.0, 1.0, -k]])

    def commands(self, vx: float, vy: float, wz: float) -> list[float]:
        """Velocities of the joints [rad/s] for a twist [m/s, rad/s]."""
        return list(self._rows() @ [vx, vy, wz] / self.wheels_radius)

    def update(self, positions: list[float], velocities: list[float], dt: float) -> bool:
        """From velocities, by a step along the new heading."""
        if dt < 1e-4:
            return False
        rows = self._rows()
        vx, vy, wz = rows.T @ velocities * self.wheels_radius / np.sum(rows**2, axis=0)
        x, y, heading = self.pose
        heading += wz * dt
        s, c = math.sin(heading), math.cos(heading)
        self.pose = [x + (c * vx - s * vy) * dt, y + (s * vx + c * vy) * dt, heading]
        return True


def controller(parameters: str) -> Controller:
    """The one that the yaml of a controller manager is for."""
    nodes = yaml.safe_load(parameters)
    (name,) = nodes.keys() - {"controller_manager", "joint_state_broadcaster"}
    given = nodes[name]["ros__parameters"]
    if name == "omni_wheel_drive_controller":
        return OmniWheelDrive(*(given[key] for key in ("wheel_names", "wheel_offset", "robot_radius", "wheel_radius")))
    assert name == "mecanum_drive_controller"
    kinematics = given["kinematics"]
    assert set(kinematics.pop("base_frame_offset").values()) == {0.0}, "not done here"
    joints = {key: value for key, value in given.items() if key.endswith("_command_joint_name")}
    return MecanumDrive(**joints, **kinematics)


class JointStateTopicSystem:
    """Two topics of joints: what comes is the state, what is written is the command.

    As the plugin does it: what is read is best effort, what is written reliable with a depth of 1. The plugin keeps 5
    states that its executor takes at once; here all are kept until this process comes round to them.
    A command that differs from the state by no more than `trigger_joint_command_threshold` in all is not written.
    """

    @classmethod
    def of(cls, cyclone: Cyclone, urdf: str) -> "JointStateTopicSystem":
        """As the block in a vehicle's URDF says."""
        block = ElementTree.fromstring(urdf).find("ros2_control")
        assert block.find("hardware/plugin").text == "joint_state_topic_hardware_interface/JointStateTopicSystem"
        values = {one.get("name"): one.text for one in block.findall("hardware/param")}
        topics = {name: f"/{values.pop(name).lstrip('/')}" for name in ("joint_commands_topic", "joint_states_topic")}
        joints = {one.get("name"): one.find("command_interface").get("name") for one in block.findall("joint")}
        (interface,) = set(joints.values())
        return cls(cyclone, list(joints), interface, **topics, **{name: float(value) for name, value in values.items()})

    def __init__(
        self,
        cyclone: Cyclone,
        joints: list[str],
        interface: str,
        joint_commands_topic: str = "/robot_joint_commands",
        joint_states_topic: str = "/robot_joint_states",
        trigger_joint_command_threshold: float = 1e-5,
    ):
        self.joints, self.interface, self.threshold = joints, interface, trigger_joint_command_threshold
        self.states = cyclone.read(joint_states_topic, "sensor_msgs/msg/JointState", reliable=False)
        self.writer = cyclone.write(joint_commands_topic, "sensor_msgs/msg/JointState", depth=1)

    def read(self, joints: list[str] | None = None, now_ns: int | None = None) -> dict[str, list[float]]:
        """The latest position, velocity and effort of joints, in their order; none from after that time."""
        states = reversed(self.states.samples)
        state = next((one for one in states if now_ns is None or stamp_ns(one) <= now_ns), self.states.samples[0])
        places = [list(state.name).index(joint) for joint in joints or self.joints]
        return {name: [getattr(state, name)[k] for k in places] for name in ("position", "velocity", "effort")}

    def write(self, commands: list[float], now_ns: int):
        """A command for every joint."""
        state = self.read()[self.interface]
        if sum(abs(is_ - wanted) for is_, wanted in zip(state, commands, strict=True)) <= self.threshold:
            return
        stamp = Time(sec=now_ns // 1_000_000_000, nanosec=now_ns % 1_000_000_000)
        values = {"position": [], "velocity": [], "effort": []} | {self.interface: [float(c) for c in commands]}
        self.writer.write(JointState(header=Header(stamp=stamp, frame_id=""), name=self.joints, **values))


class ControllerManager:
    """Reads, updates and writes with each message of the clock, as with `use_sim_time`.

    Where this process comes too late it goes through all that it missed, as if it had been there: what is looked at is
    the plant, and no real-time system.
    """

    def __init__(self, cyclone: Cyclone, system: JointStateTopicSystem, controller: Controller):
        self.system, self.controller = system, controller
        self.clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
        self.clock.first()
        system.states.first()
        self.at_ns = stamp_ns(self.clock.samples[-1])
        self.done = len(self.clock.samples)
        self.late_ns: list[int] = []  # when it had not been there for so long that the plant may have taken it for gone

    def spin(self, twist: Callable[[float], tuple[float, float, float] | None]):
        """Drives by a twist for the simulated time since now [s], until that is none."""
        start_ns = self.at_ns
        there = time.monotonic()
        end = there + 4 * PATIENCE_S
        while True:
            assert time.monotonic() < end, "it takes too long"
            if self.done == len(self.clock.samples):
                time.sleep(0.001)
                continue
            now_ns = stamp_ns(self.clock.samples[self.done])
            self.done += 1
            if time.monotonic() - there > 0.3:
                self.late_ns.append(stamp_ns(self.clock.samples[-1]))
            there = time.monotonic()
            state = self.system.read(self.controller.joints, now_ns)
            self.controller.update(state["position"], state["velocity"], (now_ns - self.at_ns) / 1e9)
            self.at_ns = now_ns
            wanted = twist((now_ns - start_ns) / 1e9)
            if wanted is None:
                return
            commands = dict(zip(self.controller.joints, self.controller.commands(*wanted), strict=True))
            self.system.write([commands[joint] for joint in self.system.joints], now_ns)
