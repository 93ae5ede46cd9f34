"""Start the gait optimiser, the gait library and the reference publisher."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

NODES = ("gait_optimizer", "gait_library", "reference_publisher")


def walker_node(name: str) -> Node:
    """Return the node `name` with the parameter file of the same name."""
    use_sim_time = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return Node(
        package="walk_optimizer",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        parameters=[
            PathJoinSubstitution([FindPackageShare("walk_optimizer"), "config", f"{name}.yaml"]),
            {"use_sim_time": use_sim_time},
        ],
        ros_arguments=["--log-level", LaunchConfiguration("log_level")],
        output="screen",
    )


def generate_launch_description() -> LaunchDescription:
    """Return the three nodes and the launch arguments they share."""
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="Namespace of the nodes."),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="Take time from /clock."),
        DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn or error."),
    ]
    return LaunchDescription([*arguments, *map(walker_node, NODES)])
