"""Start the gait optimiser, the gait library and the reference publisher, and what shows the walk."""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.condition import Condition
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, OrSubstitution, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

MANAGED_NODES = ("gait_library", "reference_publisher")
NODES = ("gait_optimizer", *MANAGED_NODES)
# Those of security/walk_optimizer.policy.xml.
ENCLAVES = "/walk_optimizer"
# Arguments that are parameters too.
KINDS = {"use_sim_time": bool, "autostart": bool, "walker_file": str}
ARGUMENTS = {
    "namespace": ("", "Namespace of the nodes."),
    "params_file": ("", "Your parameters, a YAML file for all nodes; they count before those that ship."),
    "walker_file": ("", "YAML file of the walker, for all nodes; config/walker.yaml is the one that ships."),
    "use_sim_time": ("", "true: take time from /clock; false unless your parameters say so."),
    "autostart": ("", "false: a manager starts library and publisher. The parameter files say true."),
    "log_level": ("info", "debug, info, warn or error."),
    "visualize": ("false", "Also walker_visualizer."),
    "rviz": ("false", "Also walker_visualizer and RViz."),
}


def shared_file(*names: str) -> PathJoinSubstitution:
    """Return the path of a file that ships with the package."""
    return PathJoinSubstitution([FindPackageShare("walk_optimizer"), *names])


def given(context: LaunchContext, *names: str) -> dict[str, ParameterValue]:
    """Return the parameters that are given as launch arguments: these count before all files."""
    return {
        name: ParameterValue(LaunchConfiguration(name), value_type=KINDS[name])
        for name in names
        if LaunchConfiguration(name).perform(context)
    }


def own_files(context: LaunchContext) -> list[Path]:
    """Return the user's parameter file, if one is given; launch itself would only warn of a missing one."""
    path = LaunchConfiguration("params_file").perform(context)
    if path and not Path(path).expanduser().is_file():
        raise FileNotFoundError(f"params_file: there is no file {path}")
    return [Path(path).expanduser()] if path else []


def walker_node(context: LaunchContext, name: str, condition: Condition | None = None) -> Node:
    """Return the node `name` with the parameter file of the same name."""
    names = [one for one in KINDS if one != "autostart" or name in MANAGED_NODES]
    return Node(
        package="walk_optimizer",
        executable=name,
        name=name,
        namespace=LaunchConfiguration("namespace"),
        parameters=[shared_file("config", f"{name}.yaml"), *own_files(context), given(context, *names)],
        # Without SROS2 an enclave is but a name.
        ros_arguments=["--log-level", LaunchConfiguration("log_level"), "--enclave", f"{ENCLAVES}/{name}"],
        output="screen",
        condition=condition,
    )


def rviz_node(context: LaunchContext) -> Node:
    """Return RViz with everything in place; it sees the transforms of the namespace that it is in."""
    return Node(
        package="rviz2",
        executable="rviz2",
        name="rviz",
        namespace=LaunchConfiguration("namespace"),
        arguments=["-d", shared_file("rviz", "walker.rviz")],
        ros_arguments=["--enclave", f"{ENCLAVES}/operator"],
        parameters=[given(context, "use_sim_time")],
        remappings=[("/tf", "tf"), ("/tf_static", "tf_static")],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )


def nodes(context: LaunchContext) -> list[Node]:
    """Return all nodes, as the launch arguments want them."""
    shown = IfCondition(OrSubstitution(LaunchConfiguration("visualize"), LaunchConfiguration("rviz")))
    return [
        *(walker_node(context, name) for name in NODES),
        walker_node(context, "walker_visualizer", shown),
        rviz_node(context),
    ]


def generate_launch_description() -> LaunchDescription:
    """Return the nodes and the launch arguments they share."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])
