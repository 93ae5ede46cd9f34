"""Each node may do exactly what it does: the policies beside the graph of the running nodes."""

import os
import subprocess
import sys
from fnmatch import fnmatchcase

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("tf2_msgs")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist
from nodes.graph import PATIENCE, SETTLING
from rclpy.action import get_action_server_names_and_types_by_node
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from security.policies import enclaves
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage
from walk_optimizer_interfaces.srv import StopRecording

from walk_optimizer.cli.processes import NodeProcess

NODES = ("gait_optimizer", "gait_library", "reference_publisher", "walker_visualizer")
PARTS = ("send_goal", "cancel_goal", "get_result", "feedback", "status")


@pytest.fixture(scope="module")
def nodes(start_for_module, tmp_path_factory):
    """The nodes at work: all of them in a simulation, and one recording topics of the others."""
    recording = {"record": True, "recording_folder": tmp_path_factory.mktemp("bags")}
    for name in NODES:
        start_for_module(name, use_sim_time=True, **(recording if name == "reference_publisher" else {}))


def split_actions(names):
    """Names without the parts of actions, and the actions that they are parts of."""
    parts = {name for name in names if "/_action/" in name}
    actions = {name.split("/_action/")[0] for name in parts}
    assert all(name.split("/_action/")[1] in PARTS for name in parts)
    return names - parts, actions


def done_by(node, name):
    """What a node does, as the graph tells: full names by what is done with them."""
    asked = {
        "publish": node.get_publisher_names_and_types_by_node,
        "subscribe": node.get_subscriber_names_and_types_by_node,
        "reply": node.get_service_names_and_types_by_node,
        "request": node.get_client_names_and_types_by_node,
    }
    done = {}
    for rule, ask in asked.items():
        done[rule], _ = split_actions({topic for topic, _ in ask(name, "/")})
    done["execute"] = {action for action, _ in get_action_server_names_and_types_by_node(node, name, "/")}
    done["call"] = split_actions({topic for topic, _ in asked["request"](name, "/")})[1]
    return done


def require_exactly_what_it_does(graph, enclave, node):
    """Wait until a node does what its enclave may do, and nothing else."""
    allowed = enclaves()[f"/walk_optimizer/{enclave}"]

    def differences():
        if (node, "/") not in graph.node.get_node_names_and_namespaces():
            return {"node": "not there"}
        done = done_by(graph.node, node)
        return {
            rule: {"not allowed": done[rule] - allowed[rule], "not done": allowed[rule] - done[rule]}
            for rule in allowed
            if done[rule] != allowed[rule]
        }

    try:
        graph.spin_until(lambda: not differences(), f"the policy of {node}", patience=PATIENCE / 6)
    except AssertionError:
        assert differences() == {}


@pytest.fixture
def clock(graph):
    """Simulated time that has begun, without which nothing is recorded, and stands still."""
    publisher = graph.node.create_publisher(Clock, "/clock", 1)
    graph.node.create_timer(0.1, lambda: publisher.publish(Clock(clock=Time(sec=1))))


@pytest.mark.ros
@pytest.mark.parametrize("name", NODES)
def test_a_node_may_do_exactly_what_it_does(graph, clock, nodes, name):
    # Of robot_state_publisher: a recorder takes it where there is one.
    graph.node.create_publisher(TFMessage, "/tf_static", 1)
    require_exactly_what_it_does(graph, name, name)


@pytest.mark.ros
def test_the_bag_player_may_do_exactly_what_playing_takes(graph, clock, nodes):
    transforms = graph.node.create_publisher(TFMessage, "/tf_static", 1)
    graph.spin_until(transforms.get_subscription_count, "a recording of /tf_static")
    # Commands are in a bag when some have come; simulated time stands still, so nobody walks.
    for kind, name in ((Float64, "target_speed"), (Twist, "cmd_vel")):
        graph.publisher(kind, f"reference_publisher/{name}").publish(kind())
    graph.spin_for(SETTLING)
    bag = graph.call(StopRecording, "reference_publisher/stop_recording").directory
    command = [sys.executable, "-m", "walk_optimizer.cli.main", "bag", "play", bag, "--delay", str(PATIENCE)]
    player = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        require_exactly_what_it_does(graph, "bag_player", "walk_optimizer_bag_player")
    finally:
        player.kill()
        player.wait()


# Nodes that people start, with the enclaves of their policies.
TOOLS = {
    "operator": "operator",
    "_ros2cli_1234": "operator",
    "_ros2cli_requester_std_srvs_Trigger": "operator",
    "foxglove_bridge": "operator",
    "rviz": "operator",
    "teleop_twist_keyboard": "operator",
    "transform_listener_impl_55d0c8a3b2f0": "operator",
    "controller": "controller",
}


@pytest.mark.ros
@pytest.mark.parametrize("name", TOOLS)
def test_tools_may_do_what_any_node_does_at_its_start(graph, name):
    allowed = enclaves()[f"/walk_optimizer/{TOOLS[name]}"]
    node = Node(name)
    done = done_by(node, name)
    node.destroy_node()
    assert len(done["reply"]) == 7
    for rule, names in done.items():
        assert all(any(fnmatchcase(one, pattern) for pattern in allowed[rule]) for one in names), rule


# What the other side of a name does.
OPPOSITE = {"publish": "subscribe", "subscribe": "publish", "request": "reply", "call": "execute"}
COMMON = {"/clock", "/parameter_events", "/rosout", "/diagnostics", "/tf_static"}


@pytest.mark.parametrize("enclave", ["operator", "controller"])
def test_people_and_controllers_may_do_only_what_a_node_is_there_for(enclave):
    everybody = enclaves()
    own = everybody[f"/walk_optimizer/{enclave}"]
    suite = [everybody[f"/walk_optimizer/{name}"] for name in NODES]
    for rule, other in OPPOSITE.items():
        offered = set().union(*(allowed[other] for allowed in suite))
        assert own[rule] <= offered | COMMON
    assert not own["execute"]


@pytest.mark.parametrize("enclave", ["operator", "controller"])
def test_people_and_controllers_can_not_pose_as_a_node(enclave):
    everybody = enclaves()
    patterns = everybody[f"/walk_optimizer/{enclave}"]["reply"]
    offered = set().union(*(everybody[f"/walk_optimizer/{name}"]["reply"] for name in NODES))
    assert not [name for name in offered for pattern in patterns if fnmatchcase(name, pattern)]


def test_nobody_but_publisher_and_bag_player_publishes_references():
    for enclave, allowed in enclaves().items():
        publishes = {name for name in allowed["publish"] if name.startswith("/reference_publisher/")}
        if enclave == "/walk_optimizer/operator":
            assert publishes == {"/reference_publisher/cmd_vel", "/reference_publisher/target_speed"}
        elif enclave not in ("/walk_optimizer/reference_publisher", "/walk_optimizer/bag_player"):
            assert not publishes


@pytest.mark.ros
def test_a_node_that_must_be_secure_does_not_start_without_its_keys(isolated_graph, tmp_path):
    environment = os.environ | {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_SECURITY_KEYSTORE": str(tmp_path),
    }
    enclave = ["--enclave", "/walk_optimizer/walker_visualizer"]
    node = NodeProcess("walker_visualizer", tmp_path / "log", enclave, environment)
    try:
        assert node.process.wait(PATIENCE) == 1
    finally:
        node.kill()
    assert "can't start: failed to initialize rcl: SECURITY ERROR" in node.output()
