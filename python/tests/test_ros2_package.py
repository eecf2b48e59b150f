"""The ROS 2 package of the messages, by readers of definitions and XML that are not ours."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import omnistep

COMMAND = str(Path(sys.executable).with_name("omnistep"))


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The folder that the command writes."""
    folder = tmp_path_factory.mktemp("ros2") / "omnistep_msgs"
    subprocess.run([COMMAND, "export", "--format", "ros2-msgs", "-o", str(folder)], check=True)
    return folder


@pytest.fixture(scope="module")
def types(package):
    """The types of its files, by their names: constants and fields."""
    read = {}
    for file in sorted(package.glob("msg/*.msg")):
        read |= get_types_from_msg(file.read_text(), f"omnistep_msgs/msg/{file.stem}")
    return read


def named(field):
    """The name of another type in a field's definition, if there is one."""
    node, what = field
    match node.name:
        case "BASE":
            return None
        case "NAME":
            return what
        case _:
            return named(what[0])


def test_the_definitions_are_those_inside_a_log(types, tmp_path):
    log = tmp_path / "run.mcap"
    omnistep.run("flat", mcap=log, overrides={"duration_s": 0.01})
    logged = {}
    with AnyReader([log]) as reader:
        for connection in reader.connections:
            logged |= get_types_from_msg(connection.msgdef.data, connection.msgtype)
    own = {name: fields for name, fields in logged.items() if name.startswith("omnistep_msgs/")}
    # This controller has no signals of its own, so the log has no message of that type.
    assert types.keys() - own.keys() <= {"omnistep_msgs/msg/ControllerSignals"}
    assert len(own) >= 3
    assert all(types[name] == fields for name, fields in own.items())


def test_every_other_type_is_one_of_ros_and_its_package_a_dependency(package, types):
    store = get_typestore(Stores.ROS2_JAZZY)
    fields = [field for _, fields in types.values() for _, field in fields]
    others = {name for name in map(named, fields) if name and name not in types}
    assert others == {"std_msgs/msg/Header", "geometry_msgs/msg/Twist", "geometry_msgs/msg/Vector3"}
    assert others <= store.fielddefs.keys()
    packages = {name.split("/")[0] for name in others}
    # It takes them, too: their hash is that of ROS 2.
    store.register(types)
    assert all(store.hash_rihs01(name).startswith("RIHS01_") for name in types)

    manifest = ElementTree.parse(package / "package.xml").getroot()
    assert (manifest.tag, manifest.get("format"), manifest.findtext("name")) == ("package", "3", "omnistep_msgs")
    assert {depend.text for depend in manifest.findall("depend")} == packages
    assert manifest.findtext("version") == omnistep.__version__
    assert manifest.findtext("member_of_group") == "rosidl_interface_packages"

    cmake = (package / "CMakeLists.txt").read_text()
    found = set(re.findall(r"find_package\((\w+) REQUIRED\)", cmake))
    assert found == packages | {"ament_cmake", "rosidl_default_generators"}
    generated = re.search(r"rosidl_generate_interfaces\((.*?)\n\)", cmake, re.DOTALL)[1]
    assert set(re.findall(r'"(.*?)"', generated)) == {f"msg/{name.split('/')[2]}.msg" for name in types}
    assert set(generated.split("DEPENDENCIES")[1].split()) == packages
