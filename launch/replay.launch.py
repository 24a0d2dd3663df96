"""A recorded session played into tracker, preprocessor and identifier."""

from __future__ import annotations

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription

PACKAGE = "rig_identification"
LISTENERS = ("tracker", "preprocessor", "identifier")


def generate_launch_description() -> LaunchDescription:
    """Listeners on simulated time, and the replay that drives them."""
    arguments = [
        DeclareLaunchArgument("session", description="folder of the session"),
        DeclareLaunchArgument("rig", description="its rig description"),
        DeclareLaunchArgument("rate", default_value="1.0", description="seconds of recording a second"),
        DeclareLaunchArgument("namespace", default_value="rig", description="namespace of the graph"),
    ]
    namespace = LaunchConfiguration("namespace")
    listeners = [
        Node(
            package=PACKAGE,
            executable=name,
            namespace=namespace,
            parameters=[LaunchConfiguration("rig"), {"use_sim_time": True}],
            output="screen",
        )
        for name in LISTENERS
    ]
    replay = Node(
        package=PACKAGE,
        executable="replay",
        namespace=namespace,
        parameters=[
            {
                "session": LaunchConfiguration("session"),
                "rate": ParameterValue(LaunchConfiguration("rate"), value_type=float),
                "operate": "identifier",
            }
        ],
        output="screen",
    )
    return LaunchDescription([*arguments, *listeners, replay])
