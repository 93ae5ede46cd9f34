"""Start the gait optimiser, the gait library and the reference publisher, and what shows the walk."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.condition import Condition
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, OrSubstitution, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

NODES = ("gait_optimizer", "gait_library", "reference_publisher")
# Those of security/walk_optimizer.policy.xml.
ENCLAVES = "/walk_optimizer"


def shared_file(*names: str) -> PathJoinSubstitution:
    """Return the path of a file that ships with the package."""
    return PathJoinSubstitution([FindPackageShare("walk_optimizer"), *names])


def switches(*names: str) -> dict[str, ParameterValue]:
    """Return the parameters that have launch arguments of the same names."""
    return {name: ParameterValue(LaunchConfiguration(name), value_type=bool) for name in names}


def walker_node(name: str, condition: Condition | None = None) -> Node:
    """Return the node `name` with the parameter file of the same name."""
    return Node(
        package="walk_optimizer",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        # Nodes without a life cycle have no parameter autostart, and ROS does not mind.
        parameters=[shared_file("config", f"{name}.yaml"), switches("use_sim_time", "autostart")],
        # Without SROS2 an enclave is but a name.
        ros_arguments=["--log-level", LaunchConfiguration("log_level"), "--enclave", f"{ENCLAVES}/{name}"],
        output="screen",
        condition=condition,
    )


def rviz_node() -> Node:
    """Return RViz with everything in place; it sees the transforms of the namespace that it is in."""
    return Node(
        package="rviz2",
        executable="rviz2",
        name="rviz",
        namespace=LaunchConfiguration("namespace"),
        arguments=["-d", shared_file("rviz", "walker.rviz")],
        ros_arguments=["--enclave", f"{ENCLAVES}/operator"],
        parameters=[switches("use_sim_time")],
        remappings=[("/tf", "tf"), ("/tf_static", "tf_static")],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )


def generate_launch_description() -> LaunchDescription:
    """Return the nodes and the launch arguments they share."""
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="Namespace of the nodes."),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="Take time from /clock."),
        DeclareLaunchArgument(
            "autostart", default_value="true", description="false: a manager starts library and publisher."
        ),
        DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn or error."),
        DeclareLaunchArgument("visualize", default_value="false", description="Also walker_visualizer."),
        DeclareLaunchArgument("rviz", default_value="false", description="Also walker_visualizer and RViz."),
    ]
    shown = IfCondition(OrSubstitution(LaunchConfiguration("visualize"), LaunchConfiguration("rviz")))
    return LaunchDescription(
        [*arguments, *map(walker_node, NODES), walker_node("walker_visualizer", shown), rviz_node()]
    )
