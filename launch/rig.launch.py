"""The real rig: sensors, tracker, preprocessor, identifier and recorder."""

from __future__ import annotations

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

PACKAGE = "rig_identification"
NODES = ("load_cells", "imu", "inclinometer", "tracker", "preprocessor", "identifier", "recorder")


def generate_launch_description() -> LaunchDescription:
    """Everything under one namespace."""
    nodes = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "rig_nodes.yaml"])
    arguments = [
        DeclareLaunchArgument("rig", description="rig description"),
        DeclareLaunchArgument("nodes", default_value=nodes, description="the nodes' parameters"),
        DeclareLaunchArgument("namespace", default_value="rig", description="namespace of the graph"),
    ]
    started = [
        Node(
            package=PACKAGE,
            executable=name,
            namespace=LaunchConfiguration("namespace"),
            parameters=[LaunchConfiguration("rig"), LaunchConfiguration("nodes")],
            output="screen",
        )
        for name in NODES
    ]
    return LaunchDescription([*arguments, *started])
