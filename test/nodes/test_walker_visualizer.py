"""What the visualizer publishes is the walk: an independent library finds the feet where the gait is."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("tf2_msgs")

import pinocchio as pin
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nodes.graph import assert_left_cleanly
from nodes.made_up_walk import NODE, Walk, nanoseconds_of, packaged_gait, stamp_of
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf.described_walker import DescribedWalker
from visualization_msgs.msg import Marker

from walk_optimizer.description.skeleton import FEET
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.conversions import gait_to_message
from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.nodes.walker_visualizer import _velocity_of
from walk_optimizer.recording.definitions import type_hash
from walk_optimizer.references import JOINTS

pytestmark = pytest.mark.ros

LINKS = {
    "pelvis",
    *(f"{side}_{part}" for side in ("left", "right") for part in ("upper_leg", "lower_leg", "foot")),
}


@pytest.fixture(scope="module")
def shared(start_for_module):
    """The namespace of a node that several tests use."""
    start_for_module(NODE, namespace="shared")
    return "shared"


@pytest.fixture
def walk(graph, shared):
    return Walk(graph, shared)


def placement(transforms, child):
    """Where a frame is in the fixed frame, (4, 4), through all its parents."""
    total = pin.SE3.Identity()
    while child in transforms:
        message = transforms[child]
        t, r = message.transform.translation, message.transform.rotation
        own = pin.XYZQUATToSE3(np.array([t.x, t.y, t.z, r.x, r.y, r.z, r.w]))
        total, child = own * total, message.header.frame_id
    assert child == "odom"
    return total


def test_transforms_are_those_of_the_described_robot_on_the_way(walk, graph):
    walk.announce()
    descriptions = graph.subscribe(String, "/shared/robot_description", LATCHED)
    graph.spin_until(lambda: descriptions, "the description, by a late joiner")
    robot = DescribedWalker(descriptions[0].data)
    begin = None
    for time in np.arange(0.2, 3.0, 0.11):
        reference = walk.send(float(time))
        transforms, _ = walk.picture()
        assert set(transforms) == {"base_link", *LINKS}
        stamp = nanoseconds_of(transforms["base_link"].header.stamp)
        assert all(nanoseconds_of(one.header.stamp) == stamp for one in transforms.values())
        _, way = walk.references[stamp]
        base = transforms["base_link"].transform.translation
        begin = base.x - way if begin is None else begin
        assert (base.x, base.y, base.z) == pytest.approx((begin + way, 0.0, reference.base[1]), abs=1e-4)
        q = np.array([base.x, base.z, *reference.position])
        for link in LINKS:
            difference = placement(transforms, link).homogeneous - robot.placement(link, q)
            assert np.abs(difference).max() < 1e-9


def test_markers_are_paths_reactions_and_ground_of_the_gait(walk):
    walk.announce()
    trajectory = packaged_gait().refined.trajectory
    for time in np.arange(0.1, 2.0, 0.07):
        reference = walk.send(float(time))
        transforms, markers = walk.picture()
        assert all(one.header.frame_id == "odom" for one in markers.values())
        stance = reference.step % 2
        arrow, label = markers["ground_reaction", stance], markers["ground_reaction_size", stance]
        assert markers["ground_reaction", 1 - stance].action == Marker.DELETE
        force = trajectory.force(*trajectory.locate(reference.time))[:2]
        tail, tip = (np.array([point.x, point.y, point.z]) for point in arrow.points)
        foot = placement(transforms, ("left_foot", "right_foot")[stance]).translation
        assert tail == pytest.approx(foot, abs=1e-6)
        assert tip - tail == pytest.approx([0.0008 * force[0], 0.0, 0.0008 * force[1]], abs=1e-4)
        assert float(label.text.removesuffix(" N")) == pytest.approx(np.hypot(*force), abs=1.0)
        for side, name in enumerate(("left_foot", "right_foot")):
            ahead = [[point.x, point.z] for point in markers["feet_ahead", side].points]
            walked = markers["feet_walked", side].points
            foot = placement(transforms, name).translation
            assert ahead[0] == pytest.approx([foot[0], foot[2]], abs=1e-4)
            assert ahead[-1][1] == pytest.approx(0.0, abs=1e-4)
            if walked:
                assert [walked[-1].x, walked[-1].y, walked[-1].z] == pytest.approx(foot, abs=1e-6)
        labels = [markers["joint_torque_sizes", number].text for number in range(4)]
        assert labels == [f"{round(torque, 1) + 0.0:.1f} N m" for torque in reference.effort]
        surface = markers["ground", 0].points
        assert facing_up(surface)
        assert len(markers["ground", 0].colors) == len(surface)
        base = transforms["base_link"].transform.translation.x
        assert min(point.x for point in surface) < base - 1 < base + 1 < max(point.x for point in surface)
        assert {point.z for point in surface} == {0.0}


def facing_up(points):
    """Whether all triangles of a list do: RViz draws the others black."""
    corners = np.array([[point.x, point.y, point.z] for point in points]).reshape(-1, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return len(normals) > 0 and (normals[:, 2] > 0).all()


def test_labels_are_beside_the_legs_and_spaced_like_their_letters(walk):
    # RViz takes a space's width from scale.x, and more than a metre if that is 0.
    walk.announce()
    for time in np.arange(0.5, 2.0, 0.13):
        walk.send(float(time))
        transforms, markers = walk.picture()
        labels = [one for one in markers.values() if one.type == Marker.TEXT_VIEW_FACING and one.text]
        assert {one.ns for one in labels} == {"ground_metres", "ground_reaction_size", "joint_torque_sizes"}
        assert all(0.25 <= one.scale.x / one.scale.z <= 1.0 for one in labels)
        knees = [placement(transforms, f"{side}_lower_leg").translation[0] for side in ("left", "right")]
        behind, ahead = (
            [markers["joint_torque_sizes", number].pose.position.x for number in numbers]
            for numbers in ((0, 1), (2, 3))
        )
        assert max(behind) < min(knees) - 0.15 < max(knees) + 0.15 < min(ahead)


def told(graph, reports):
    """The next diagnosis of the node's references."""
    found = []

    def look():
        found[:] = [one for report in reports for one in report.status if one.name == f"{NODE}: references"]
        return found

    graph.spin_until(look, "diagnostics")
    return found[-1]


def test_without_a_gait_there_are_links_but_no_forces_and_no_step_ahead(start, graph):
    start(NODE)
    walk = Walk(graph)
    reports = graph.subscribe(DiagnosticArray, "/diagnostics")
    silent = told(graph, reports)
    assert silent.level == DiagnosticStatus.WARN
    assert "no joint reference on /reference_publisher/joint_reference yet" in silent.message
    walk.send(0.1)
    walk.send(0.2)
    reports.clear()
    assert "not those of a gait" in told(graph, reports).message
    transforms, markers = walk.picture()
    assert set(transforms) == {"base_link", *LINKS}
    for namespace in ("ground_reaction", "ground_reaction_size", "feet_ahead"):
        assert all(markers[namespace, side].action == Marker.DELETE for side in range(2))
    assert markers["feet_walked", 0].action == Marker.ADD


def test_joints_are_matched_by_name_and_a_message_without_them_is_refused(walk):
    walk.announce()
    straight = walk.send(0.3)
    placed = placement(walk.picture()[0], "right_foot").translation
    walk.send(0.3 + 2 * walk.profile.step_time, order=(2, 0, 3, 1))
    moved = placement(walk.picture()[0], "right_foot").translation
    assert moved[2] == pytest.approx(placed[2], abs=1e-6)
    for message in (
        JointState(name=["left_hip"], position=[0.1]),
        JointState(name=list(JOINTS), position=[0.1, float("nan"), 0.1, 3.0]),
        JointState(name=list(JOINTS), position=[]),
    ):
        message.header.stamp = stamp_of(10**13)
        walk.joints.publish(message)
    walk.graph.spin_for(0.5)
    assert walk.send(0.6) is not straight


@pytest.mark.parametrize("velocity", [[], [1.0], [math.nan] * 4])
def test_velocities_that_are_none_hide_no_walker(velocity):
    message = JointState(name=list(JOINTS), position=[0.1, 3.0, 0.1, 3.0], velocity=velocity)
    assert _velocity_of(message) is None


def test_a_gait_that_is_none_is_refused_and_the_former_one_stays(walk):
    walk.announce()
    for field, value in (
        ("step_time", 0.0),
        ("step_time", 1e12),
        ("step_length", float("nan")),
        ("points", 7),
    ):
        message = gait_to_message(packaged_gait())
        setattr(message, field, value)
        walk.gaits.publish(message)
    walk.graph.spin_for(0.5)
    reference = walk.send(0.3)
    _, markers = walk.picture()
    assert markers["ground_reaction", reference.step % 2].action == Marker.ADD


def test_pictures_come_at_the_rate_of_the_parameter_by_the_stamps(walk, graph):
    walk.send(0.0)
    (answer,) = graph.set_parameters(f"/shared/{NODE}", Parameter("rate", value=10.0))
    assert answer.successful
    message = JointState(name=list(JOINTS), position=[0.1, 3.0, -0.1, 3.0])
    before = len(walk.markers)
    for step in range(1, 101):
        message.header.stamp = stamp_of(10**12 + step * 10**7)
        walk.joints.publish(message)
        graph.spin_for(0.01)
    graph.spin_until(lambda: len(walk.markers) >= before + 10, "ten pictures")
    graph.spin_for(0.5)
    assert len(walk.markers) == before + 10


def test_links_can_be_left_to_robot_state_publisher(start, graph):
    node = start(NODE, link_transforms=False, fixed_frame="map")
    walk = Walk(graph)
    walk.send(0.2)
    transforms, markers = walk.picture()
    assert set(transforms) == {"base_link"}
    assert transforms["base_link"].header.frame_id == "map"
    assert markers["ground", 0].header.frame_id == "map"
    assert_left_cleanly(node, node.stop())


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("fixed_frame", "/odom", "fixed_frame"),
        ("walker_file", "no.yaml", "no.yaml"),
        ("gait", "bad name", "'bad name' is no name of a topic"),
        ("joint_reference", "a//b", "'a//b' is no name of a topic"),
    ],
)
def test_a_parameter_that_cannot_be_followed_stops_the_start(start, name, value, text):
    node = start(NODE, **{name: value})
    assert node.process.wait(60) == 1
    assert text in node.output()
    assert "Traceback" not in node.output()


def test_one_picture_a_second_loses_no_step_of_a_fast_walk(start, graph):
    start(NODE, rate=1.0)
    walk = Walk(graph, gait=packaged_gait(1.087))
    assert 2 * walk.profile.step_time < 1.0, "its cycle is shorter than the time from picture to picture"
    walk.announce()
    ways = []
    for second in np.arange(0.0, 10.5, 1.05):
        # References without velocities are shown too.
        walk.send(second, fields=("position", "effort"))
        base = walk.picture()[0]["base_link"]
        _, way = walk.references[nanoseconds_of(base.header.stamp)]
        ways.append(base.transform.translation.x - way)
        for between in np.arange(0.105, 1.0, 0.105):
            walk.publish(second + between, fields=("position", "effort"))
    assert np.ptp(ways) < 1e-3


def test_names_are_relative_so_that_several_walkers_share_a_graph(shared, graph):
    graph.spin_until(lambda: (NODE, f"/{shared}") in graph.node.get_node_names_and_namespaces(), "the node")
    offered = {}

    def look():
        offered.update(graph.node.get_publisher_names_and_types_by_node(NODE, f"/{shared}"))
        return f"/{shared}/{NODE}/markers" in offered

    graph.spin_until(look, "its topics")
    assert offered[f"/{shared}/tf"] == ["tf2_msgs/msg/TFMessage"]
    assert offered[f"/{shared}/robot_description"] == ["std_msgs/msg/String"]
    (endpoint,) = graph.node.get_publishers_info_by_topic(f"/{shared}/robot_description")
    assert endpoint.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    absolute = {name for name in offered if not name.startswith(f"/{shared}/")}
    assert absolute <= {"/rosout", "/parameter_events", "/diagnostics"}


def test_the_robot_stands_where_the_real_publisher_lets_it_stand(start, graph):
    start("reference_publisher", namespace="real", rate=50.0)
    start(NODE, namespace="real")
    pictures = graph.subscribe(TFMessage, "/real/tf")
    graph.spin_until(lambda: len(pictures) > 5, "pictures")
    transforms = {one.child_frame_id: one for one in pictures[-1].transforms}
    walker = WalkerParameters.from_yaml()
    height = placement(transforms, "base_link").translation[2]
    assert 0.9 * walker.leg_length < height <= walker.leg_length + 1e-9
    for foot in FEET:
        assert placement(transforms, foot).translation[2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["tf2_msgs/msg/TFMessage", "visualization_msgs/msg/MarkerArray"])
def test_message_types_are_those_of_a_distribution(name):
    assert type_hash(name) == get_typestore(Stores.ROS2_JAZZY).hash_rihs01(name)
