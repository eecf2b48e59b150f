"""The types of the messages for Cyclone DDS, from what ROS 2 Jazzy itself defines (as `rosbags` ships it).

Only `omnistep_msgs` is taken from this repository: no other package defines it.
"""

import itertools
import math
import types
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

SCHEMAS = Path(__file__).parents[2] / "crates/omni-log/src/schemas"
BASES = {"string": str, "bool": bool, "byte": idl.uint8, "float32": idl.float32, "float64": idl.float64} | {
    name: getattr(idl, name) for name in ("int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
}


@cache
def definitions() -> Typestore:
    """What ROS 2 Jazzy defines, and the messages of omnistep."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types_of_omnistep = get_types_from_msg((SCHEMAS / "VehicleState.msg").read_text(), "omnistep_msgs/msg/VehicleState")
    store.register({name: fields for name, fields in types_of_omnistep.items() if name.startswith("omnistep_msgs/")})
    return store


def dds_name(name: str) -> str:
    """The name of a type on the wire: `nav_msgs/msg/Odometry` is `nav_msgs::msg::dds_::Odometry_`."""
    package, _, kind = name.split("/")
    return f"{package}::msg::dds_::{kind}_"


@cache
def message(name: str) -> type:
    """The class of a message, as `nav_msgs/msg/Odometry`, for Cyclone DDS."""
    _, fields = definitions().fielddefs[name]
    annotations = {field: annotation(kind) for field, kind in fields}
    body = types.new_class(
        name.rsplit("/", 1)[1],
        (IdlStruct,),
        {"typename": dds_name(name).replace("::", ".")},
        lambda namespace: namespace["__annotations__"].update(annotations),
    )
    return dataclass(body)


def annotation(kind: tuple) -> type:
    """A field of a message as Cyclone DDS has it."""
    node, what = kind
    match node.name:
        case "BASE":
            return BASES[what[0]]
        case "NAME":
            return message(what)
        case "ARRAY":
            return idl.array[annotation(what[0]), what[1]]
        case _:
            return idl.sequence[annotation(what[0])]


Time = message("builtin_interfaces/msg/Time")
Header = message("std_msgs/msg/Header")
Vector3 = message("geometry_msgs/msg/Vector3")
Twist = message("geometry_msgs/msg/Twist")
TwistStamped = message("geometry_msgs/msg/TwistStamped")
JointState = message("sensor_msgs/msg/JointState")


def twist(vx: float = 0.0, vy: float = 0.0, wz: float = 0.0) -> object:
    """A velocity command [m/s, rad/s]: forward, left, counter-clockwise."""
    return Twist(linear=Vector3(x=vx, y=vy, z=0.0), angular=Vector3(x=0.0, y=0.0, z=wz))


def twist_stamped(vx: float = 0.0, vy: float = 0.0, wz: float = 0.0) -> object:
    """The same with a header; its stamp is 0, as of a sender without a clock."""
    header = Header(stamp=Time(sec=0, nanosec=0), frame_id="base_link")
    return TwistStamped(header=header, twist=twist(vx, vy, wz))


def pose(x: float, y: float, yaw: float = 0.0) -> object:
    """A pose on the plane [m, rad]."""
    return message("geometry_msgs/msg/Pose")(
        position=message("geometry_msgs/msg/Point")(x=x, y=y, z=0.0),
        orientation=message("geometry_msgs/msg/Quaternion")(x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2)),
    )


def stamp_ns(sample: object) -> int:
    """Simulated time of a message [ns], wherever its type has it."""
    if hasattr(sample, "transforms"):
        sample = sample.transforms[0]
    stamp = sample.clock if hasattr(sample, "clock") else sample.header.stamp
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def first_of_another_run(samples: list) -> list:
    """The first sample that is older than the one before it, once there is one: at most one sample."""
    return [after for before, after in itertools.pairwise(samples) if stamp_ns(after) < stamp_ns(before)]
