"""The simulated rig: plant, sensors, tracker, preprocessor, identifier and recorder."""

from __future__ import annotations

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

PACKAGE = "rig_identification"
NODES = (
    "rig_simulator",
    "load_cells",
    "imu",
    "inclinometer",
    "tracker",
    "preprocessor",
    "identifier",
    "recorder",
)


def generate_launch_description() -> LaunchDescription:
    """Everything under one namespace."""
    share = FindPackageShare(PACKAGE)
    rig = PathJoinSubstitution([share, "config", "simulated_rig_node_description.yaml"])
    nodes = PathJoinSubstitution([share, "config", "simulated_rig_nodes.yaml"])
    arguments = [
        DeclareLaunchArgument("rig", default_value=rig, description="rig description"),
        DeclareLaunchArgument("nodes", default_value=nodes, description="the nodes' parameters"),
        DeclareLaunchArgument("namespace", default_value="rig", description="namespace of the graph"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="where speed is not 1"),
    ]
    started = [
        Node(
            package=PACKAGE,
            executable=name,
            namespace=LaunchConfiguration("namespace"),
            parameters=[
                LaunchConfiguration("rig"),
                LaunchConfiguration("nodes"),
                {"use_sim_time": LaunchConfiguration("use_sim_time") if name != "rig_simulator" else False},
            ],
            output="screen",
        )
        for name in NODES
    ]
    return LaunchDescription([*arguments, *started])
