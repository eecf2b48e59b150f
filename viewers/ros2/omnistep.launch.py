"""A run of omnistep, its robot_state_publisher and RViz.

`ros2 launch ./omnistep.launch.py scenario:=bumps vehicle:=mecanum4`, in the folder of this file; `rviz:=false` for
no picture. `omnistep` has to be on the PATH.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SIMULATED_TIME = {"use_sim_time": True}


def generate_launch_description():
    """The three programs."""
    scenario, vehicle = LaunchConfiguration("scenario"), LaunchConfiguration("vehicle")
    urdf = ParameterValue(Command(["omnistep export ", vehicle, " --format urdf"]), value_type=str)
    run = ["omnistep", "run", scenario, "--vehicle", vehicle, "--ros2", "--quiet"]
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="flat", description="built-in scenario, or a .toml file"),
            DeclareLaunchArgument("vehicle", default_value="mecanum4", description="built-in vehicle, or a .toml file"),
            DeclareLaunchArgument("rviz", default_value="true", description="whether RViz is started"),
            # Frames of hinges and wheels are robot_state_publisher's: a frame has one publisher.
            ExecuteProcess(cmd=[*run, "--tf", "odom"], output="screen", on_exit=Shutdown()),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                parameters=[SIMULATED_TIME, {"robot_description": urdf}],
                # The run publishes it already.
                remappings=[("robot_description", "~/robot_description")],
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", str(Path(__file__).resolve().with_name("omnistep.rviz"))],
                parameters=[SIMULATED_TIME],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
