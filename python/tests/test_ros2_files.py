"""The files of viewers/ros2 for ROS's own programs: they parse, and what they name exists."""

import re
import runpy
import subprocess
import sys
import types
from pathlib import Path
from unittest.mock import MagicMock
from xml.etree import ElementTree

import pytest
import yaml
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import omnistep

ROOT = Path(__file__).resolve().parents[2]
FILES = ROOT / "viewers" / "ros2"
COMMAND = str(Path(sys.executable).with_name("omnistep"))
TOPIC = re.compile(r"^\| `(/[\w/]+)`[^|]* \| `(\w+/msg/\w+)`", re.MULTILINE)


@pytest.fixture(scope="module")
def topics():
    """What a run publishes, and the types: the table of the guide."""
    return dict(TOPIC.findall((ROOT / "docs/ros2.md").read_text()))


def below(node, key):
    """Every value of a key, at any depth."""
    if isinstance(node, dict):
        yield from (value for name, value in node.items() if name == key)
        for value in node.values():
            yield from below(value, key)
    elif isinstance(node, list):
        for value in node:
            yield from below(value, key)


def test_rviz_shows_topics_of_a_run_in_its_frames(topics):
    manager = yaml.safe_load((FILES / "omnistep.rviz").read_text())["Visualization Manager"]
    kinds = {"rviz_default_plugins/Odometry": "nav_msgs/msg/Odometry"}
    kinds["rviz_default_plugins/RobotModel"] = "std_msgs/msg/String"
    kinds["rviz_default_plugins/Path"] = "nav_msgs/msg/Path"
    shown = {}
    for display in manager["Displays"]:
        for topic in (display.get("Topic"), display.get("Description Topic")):
            if topic:
                shown[topic["Value"]] = topic["Durability Policy"]
                assert topics[topic["Value"]] == kinds[display["Class"]]
    # Descriptions are sent once: who comes later receives them only by this policy.
    assert shown == {
        "/robot_description": "Transient Local",
        "/terrain/robot_description": "Transient Local",
        "/odom": "Volatile",
        "/ground_truth/odom": "Volatile",
        "/plan": "Transient Local",
    }
    for kind, expected in [("SetGoal", "PoseStamped"), ("SetInitialPose", "PoseWithCovarianceStamped")]:
        (tool,) = (tool for tool in manager["Tools"] if tool["Class"] == f"rviz_default_plugins/{kind}")
        assert topics[tool["Topic"]["Value"]] == f"geometry_msgs/msg/{expected}"
    assert manager["Global Options"]["Fixed Frame"] == "odom"
    assert set(below(manager, "Target Frame")) == {"base_link"}
    assert all(name.startswith("rviz_default_plugins/") for name in below(manager["Displays"], "Class"))


def test_plotjuggler_plots_fields_of_messages(topics, tmp_path):
    log = tmp_path / "run.mcap"
    omnistep.run("flat", mcap=log, overrides={"duration_s": 0.01})
    from rosbags.highlevel import AnyReader

    store = get_typestore(Stores.ROS2_JAZZY)
    with AnyReader([log]) as reader:
        for connection in reader.connections:
            own = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            store.register({name: fields for name, fields in own.items() if name.startswith("omnistep_msgs/")})
    layout = ElementTree.parse(FILES / "plotjuggler.xml").getroot()
    curves = [curve.get("name") for curve in layout.iter("curve")]
    assert len(curves) == len(set(curves)) == 25
    used = set()
    for curve in curves:
        topic = max((topic for topic in topics if curve.startswith(f"{topic}/")), key=len)
        used.add(topic)
        kind = topics[topic]
        for step in curve.removeprefix(f"{topic}/").split("/"):
            name, index = re.fullmatch(r"(\w+)(\[\d+\])?", step).groups()
            node, what = dict(store.fielddefs[kind][1])[name]
            assert (node.name == "SEQUENCE") == bool(index), curve
            if index:
                node, what = what[0]
            kind = what if node.name == "NAME" else what[0]
        assert kind == "float64", curve
    assert {topic.get("name") for topic in layout.iter("topic")} == used
    for splitter in layout.iter("DockSplitter"):
        count = int(splitter.get("count"))
        assert len(splitter) == count == len(splitter.get("sizes").split(";"))


def test_the_launch_file_starts_a_run_whose_options_exist(monkeypatch):
    named = ["launch", "launch.actions", "launch.conditions", "launch.substitutions"]
    named += ["launch_ros", "launch_ros.actions", "launch_ros.parameter_descriptions"]
    modules = {name: types.ModuleType(name) for name in named}
    called = MagicMock()
    for name in modules:
        monkeypatch.setitem(sys.modules, name, modules[name])
        modules[name].__getattr__ = lambda what: getattr(called, what)
    called.LaunchConfiguration.side_effect = lambda name: f"<{name}>"
    called.Command.side_effect = "".join
    runpy.run_path(str(FILES / "omnistep.launch.py"))["generate_launch_description"]()

    arguments = {call.args[0]: call.kwargs["default_value"] for call in called.DeclareLaunchArgument.call_args_list}
    assert arguments == {"scenario": "flat", "vehicle": "mecanum4", "rviz": "true"}
    (run,) = called.ExecuteProcess.call_args_list
    command = run.kwargs["cmd"]
    assert command[:2] == ["omnistep", "run"]
    assert command[-2:] == ["--tf", "odom"]
    options = {word for word in command if word.startswith("--")}
    shown = subprocess.run([COMMAND, "run", "--help"], capture_output=True, text=True, check=True).stdout
    assert options <= set(re.findall(r"--[\w-]+", shown))
    assert arguments["scenario"] in omnistep.list_scenarios()
    assert arguments["vehicle"] in omnistep.list_vehicles()
    (urdf,) = called.ParameterValue.call_args_list
    urdf = urdf.args[0].replace("<vehicle>", arguments["vehicle"]).split()
    urdf = subprocess.run([COMMAND, *urdf[1:]], capture_output=True, text=True, check=True).stdout
    assert ElementTree.fromstring(urdf).get("name") == "mecanum4"
    nodes = {call.kwargs["package"]: call.kwargs for call in called.Node.call_args_list}
    assert nodes.keys() == {"robot_state_publisher", "rviz2"}
    assert Path(nodes["rviz2"]["arguments"][1]).is_file()
