"""Starts the node with a file of parameters, if there is one."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Returns the launch arguments ``params_file`` and ``namespace``, and the node."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file", default_value="", description="YAML file with the options."
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of the node."
            ),
            OpaqueFunction(function=_node),
        ]
    )


def _node(context: object) -> list[Node]:
    parameters = LaunchConfiguration("params_file").perform(context)
    return [
        Node(
            package="tactid_ros",
            executable="live",
            name="tactid",
            namespace=LaunchConfiguration("namespace"),
            parameters=[parameters] if parameters else [],
            output="screen",
        )
    ]
