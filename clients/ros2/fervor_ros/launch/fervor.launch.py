"""Starts the node: `ros2 launch fervor_ros fervor.launch.py service:=ws://robot.local:8080`."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

PACKAGED = Path(get_package_share_directory("fervor_ros")) / "config" / "fervor.yaml"


def generate_launch_description() -> LaunchDescription:
    """The node, its parameters from a file, and the ones that change most as arguments."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file", default_value=str(PACKAGED), description="Parameters of the node (YAML)."
            ),
            DeclareLaunchArgument(
                "service", default_value="", description="Where the service is, in place of the file's."
            ),
            DeclareLaunchArgument("use_sim_time", default_value="", description="true: the time comes from /clock."),
            OpaqueFunction(function=_node),
        ]
    )


def _node(context: LaunchContext) -> list[Node]:
    """The node; an argument that was not given leaves what the file says."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ("service", "use_sim_time")}
    over: dict[str, str | bool] = {}
    if given["service"]:
        over["service"] = given["service"]
    if given["use_sim_time"]:
        over["use_sim_time"] = given["use_sim_time"].lower() == "true"
    parameters = [LaunchConfiguration("params_file"), *([over] if over else [])]
    return [Node(package="fervor_ros", executable="fervor_node", name="fervor", output="screen", parameters=parameters)]
