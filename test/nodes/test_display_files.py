"""RViz and Foxglove open with everything in place: what their files name is what the nodes publish."""

import json
import re
from xml.etree import ElementTree as ET

import pytest
import yaml

pytest.importorskip("rclpy")
pytest.importorskip("tf2_msgs")

from nodes.made_up_walk import NODE, Walk
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from sensor_msgs.msg import JointState

from walk_optimizer.description.settings import description_settings
from walk_optimizer.description.urdf import walker_urdf
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.references import JOINTS
from walk_optimizer.resources import config_file

pytestmark = pytest.mark.ros

CHECKOUT = config_file("walker.yaml").resolve().parents[1]
RVIZ_FILE = yaml.safe_load((CHECKOUT / "rviz" / "walker.rviz").read_text())
RVIZ = RVIZ_FILE["Visualization Manager"]
FOXGLOVE = json.loads((CHECKOUT / "foxglove" / "walker.json").read_text())
# What each display of RViz takes.
DISPLAYS = {
    "rviz_default_plugins/RobotModel": ("Description Topic", "std_msgs/msg/String"),
    "rviz_default_plugins/MarkerArray": ("Topic", "visualization_msgs/msg/MarkerArray"),
    "rviz_default_plugins/TF": (None, "tf2_msgs/msg/TFMessage"),
}


@pytest.fixture(scope="module")
def nodes(start_for_module):
    start_for_module("reference_publisher")
    start_for_module(NODE)


@pytest.fixture
def walk(graph, nodes):
    walk = Walk(graph)
    walk.announce()
    walk.send(0.3)
    walk.send(0.4)
    return walk


def endpoint(graph, topic):
    """The one publisher of a topic that is a node of the suite."""
    found = []

    def look():
        infos = graph.node.get_publishers_info_by_topic(topic)
        found[:] = [info for info in infos if info.node_name != graph.node.get_name()]
        return found

    graph.spin_until(look, f"a publisher of {topic}")
    (info,) = found
    return info


def test_rviz_displays_take_topics_that_are_published_with_their_type_and_quality(graph, walk):
    displays = {display["Class"]: display for display in RVIZ["Displays"]}
    assert displays.keys() == DISPLAYS.keys()
    for kind, (key, message_type) in DISPLAYS.items():
        assert displays[kind]["Enabled"]
        topic = displays[kind][key] if key else {"Value": "tf"}
        assert not topic["Value"].startswith("/"), "relative, so that it works in a namespace"
        info = endpoint(graph, f"/{topic['Value']}")
        assert info.topic_type == message_type
        if topic.get("Durability Policy") == "Transient Local":
            assert info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        assert topic.get("Reliability Policy", "Reliable") == "Reliable"
        assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE


def test_rviz_looks_at_frames_and_namespaces_that_there_are(walk):
    transforms, markers = walk.picture()
    frames = set(transforms) | {one.header.frame_id for one in transforms.values()}
    assert RVIZ["Global Options"]["Fixed Frame"] in frames - set(transforms)
    assert RVIZ["Views"]["Current"]["Target Frame"] in frames
    (display,) = (one for one in RVIZ["Displays"] if one["Class"].endswith("MarkerArray"))
    assert display["Namespaces"] == {namespace: True for namespace, _ in markers}
    robot = ET.fromstring(walker_urdf(WalkerParameters.from_yaml(), description_settings()))
    assert {link.get("name") for link in robot.iter("link")} == set(transforms)


def test_rviz_shows_the_newest_markers_not_a_queue_of_them():
    (display,) = (one for one in RVIZ["Displays"] if one["Class"].endswith("MarkerArray"))
    assert display["Topic"]["Depth"] == 1, "markers would lag behind the robot model"


def test_rviz_has_a_place_for_every_panel():
    # Panels that the state of the window does not name fill its left half. Qt writes names in UTF-16.
    state = bytes.fromhex(RVIZ_FILE["Window Geometry"]["QMainWindow State"])
    names = [panel["Name"] for panel in RVIZ_FILE["Panels"]]
    assert names
    assert all(name.encode("utf-16-be") in state for name in names)


def test_foxglove_takes_topics_frames_and_namespaces_that_there_are(graph, walk):
    (panel,) = (panel for name, panel in FOXGLOVE["configById"].items() if name.startswith("3D!"))
    transforms, markers = walk.picture()
    assert panel["followTf"] in transforms
    assert panel["fixedFrame"] == transforms["base_link"].header.frame_id
    (layer,) = panel["layers"].values()
    assert endpoint(graph, layer["topic"]).topic_type == "std_msgs/msg/String"
    drawn = {topic: settings for topic, settings in panel["topics"].items() if settings["visible"]}
    ((topic, settings),) = drawn.items()
    assert endpoint(graph, topic).topic_type == "visualization_msgs/msg/MarkerArray"
    assert settings["namespaces"] == {namespace: {"visible": True} for namespace, _ in markers}


def test_foxglove_plots_joints_by_their_names(graph, walk):
    plots = [panel for name, panel in FOXGLOVE["configById"].items() if name.startswith("Plot!")]
    plotted = set()
    for line in (line for plot in plots for line in plot["paths"]):
        topic, field, index = re.fullmatch(r"(/[\w/]+)\.(\w+)\[(\d)\]", line["value"]).groups()
        assert endpoint(graph, topic).topic_type == "sensor_msgs/msg/JointState"
        assert JointState.get_fields_and_field_types()[field] == "sequence<double>"
        assert line["label"] == JOINTS[int(index)]
        plotted.add((field, line["label"]))
    assert plotted == {(field, joint) for field in ("effort", "position", "velocity") for joint in JOINTS}


def test_foxglove_lays_out_every_panel_once():
    def panels(part):
        return [part] if isinstance(part, str) else panels(part["first"]) + panels(part["second"])

    assert sorted(panels(FOXGLOVE["layout"])) == sorted(FOXGLOVE["configById"])
