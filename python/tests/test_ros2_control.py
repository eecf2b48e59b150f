"""What ros2_control reads of a vehicle, by readers of YAML and XML that are not ours."""

from xml.etree import ElementTree

import pytest
import yaml

import omnistep


def turned_round(name):
    """The same vehicle, the joints of its wheels turned round."""
    vehicle = omnistep.Vehicle(name)
    keys = [f"wheel.{i}.rolling_direction" for i in range(len(vehicle.layout))]
    return omnistep.Vehicle(vehicle, overrides={key: [-part for part in vehicle[key]] for key in keys})


def numbers(node):
    """Every number below a node of a file, with its key."""
    for key, value in node.items():
        if isinstance(value, dict):
            yield from numbers(value)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield key, value


@pytest.mark.parametrize(
    ("vehicle", "controller", "plugin"),
    [
        (omnistep.Vehicle("mecanum4"), "mecanum_drive_controller", "MecanumDriveController"),
        (turned_round("omni3"), "omni_wheel_drive_controller", "OmniWheelDriveController"),
    ],
    ids=["mecanum4", "omni3"],
)
def test_the_yaml_names_joints_of_the_urdf_and_has_numbers_that_are_doubles(vehicle, controller, plugin):
    read = yaml.safe_load(vehicle.ros2_controllers())
    assert set(read) == {"controller_manager", "joint_state_broadcaster", controller}
    manager, given = (read[node]["ros__parameters"] for node in ("controller_manager", controller))
    assert manager[controller] == {"type": f"{controller}/{plugin}"}
    assert manager["joint_state_broadcaster"] == {"type": "joint_state_broadcaster/JointStateBroadcaster"}
    # Else the broadcaster too would be on /joint_states, and the component would hear what it said itself.
    assert read["joint_state_broadcaster"]["ros__parameters"] == {"use_local_topics": True}
    # A parameter of type double is not given by an integer.
    assert [key for key, value in numbers(given) if not isinstance(value, float)] == []
    assert type(manager["update_rate"]) is int

    block = ElementTree.fromstring(vehicle.urdf(ros2_control="velocity")).find("ros2_control")
    assert block is not None
    wheels = {joint.get("name") for joint in block.findall("joint")}
    named = given.get("wheel_names") or [value for key, value in given.items() if key.endswith("_joint_name")]
    assert len(named) == len(wheels) == len(vehicle.layout)
    assert set(named) == wheels


def test_the_numbers_of_omni3_are_those_of_its_file():
    given = yaml.safe_load(turned_round("omni3").ros2_controllers())
    given = given["omni_wheel_drive_controller"]["ros__parameters"]
    assert given["wheel_names"] == ["wheel_1", "wheel_2", "wheel_3"]
    assert given["wheel_radius"] == 0.05
    assert (given["cmd_vel_timeout"], given["odom_frame_id"], given["base_frame_id"]) == (0.5, "odom", "base_link")
    # Places in the file have nine digits: 0.155884573 m for 0.18 m times the sine of 60 degrees.
    assert given["robot_radius"] == pytest.approx(0.18, abs=1e-9)
    assert given["wheel_offset"] == pytest.approx(0.0, abs=1e-8)


def test_what_cannot_be_written_is_said():
    vehicle = omnistep.Vehicle("chugo7")
    with pytest.raises(omnistep.ConfigError, match=r"^vehicle chugo7: wheel\[0\]\.position_m: "):
        vehicle.ros2_controllers()
    with pytest.raises(omnistep.ConfigError, match=r'^ros2_control = "force".*, allowed: velocity, effort$'):
        vehicle.urdf(ros2_control="force")
    # Its URDF it has all the same: any controller of ros2_control may drive the seven wheels, and no hinge.
    block = ElementTree.fromstring(vehicle.urdf(ros2_control="effort")).find("ros2_control")
    assert block is not None
    assert [joint.get("name") for joint in block.findall("joint")] == [f"wheel_{i}" for i in range(1, 8)]
