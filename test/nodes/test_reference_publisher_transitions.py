"""The publisher with real gaits: it walks by certified steps, and refuses what has none."""

import gc

import numpy as np
import pytest

pytest.importorskip("rclpy")

from nodes.conftest import stock
from nodes.walking import NODE, Walker, assert_continuous, stamp_ns
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from walk_optimizer_interfaces.srv import GetGait

from walk_optimizer.nodes import transition_planner
from walk_optimizer.nodes.reference_publisher import ReferencePublisherNode

pytestmark = pytest.mark.ros

SLOW_TABLE, FASTER_TABLE = 0.25 / 0.785, 0.30 / 0.72


def test_it_starts_speeds_up_and_stops_by_certified_steps(graph, start, tmp_path):
    start("gait_library", cache_folder=tmp_path)
    start(NODE, cache_folder=tmp_path, rate=200.0, longest_gap=10.0)
    walker = Walker(graph)
    walker.wait_for("standing")
    joints = walker.listen(JointState, "joint_reference")
    walker.walk(SLOW_TABLE)
    walker.walk(FASTER_TABLE)
    walker.trigger("stop")
    walker.wait_for("standing")
    graph.spin_for(0.2)
    assert_continuous(joints)
    assert not any(joints[-1].velocity)
    # Two steps from a stand, two between the gaits, two to the stand: longer than one blended step each.
    starting, walking = (
        next(state for state in walker.states if state.state == name) for name in ("starting", "walking")
    )
    seconds = walking.stamp.sec - starting.stamp.sec + (walking.stamp.nanosec - starting.stamp.nanosec) * 1e-9
    assert seconds > 1.2
    assert stamp_ns(joints[-1]) > stamp_ns(joints[0])
    assert np.abs([joint.effort for joint in joints]).max() < 30


def test_a_gait_is_stopped_by_the_steps_that_it_was_begun_with(graph, start, tmp_path, monkeypatch):
    """Whatever has been planned since, and however steps are planned by now."""
    monkeypatch.setattr(transition_planner, "_KEPT", 1)
    start("gait_library", cache_folder=tmp_path)
    graph.client(GetGait, "gait_library/get_gait")
    node = ReferencePublisherNode()
    node.begin()
    graph.executor.add_node(node)
    try:
        graph.set_parameters(NODE, Parameter("longest_gap", value=10.0), Parameter("rate", value=200.0))
        walker = Walker(graph)
        walker.wait_for("standing")
        for transitions in ("certified", "blended"):
            walker.walk(SLOW_TABLE)
            assert graph.set_parameters(NODE, Parameter("transitions", value=transitions))[0].successful
            walker.trigger("stop")
            walker.wait_for("standing")
            begun = next(one for one in reversed(walker.states) if one.state == "stopping")
            # Certified steps to a stand are two, a blended one is one.
            assert walker.states[-1].step - begun.step == 2
    finally:
        graph.executor.remove_node(node)
        node.close()
        node.destroy_node()
        del node
        gc.collect()  # Or what is left of the node takes the log of the next one of its name with it.


def test_what_has_no_certified_steps_is_refused_and_the_stand_goes_on(graph, start, other_walker, tmp_path):
    """Gaits that are not refined have no state that steps could lead to."""
    stocked = stock(tmp_path, other_walker)
    start("gait_library", **stocked)
    start(NODE, cache_folder=tmp_path, walker_file=other_walker, rate=100.0)
    walker = Walker(graph)
    walker.wait_for("standing")
    answer = walker.set_gait(0.25 / 0.785)
    assert not answer.success
    assert "no certified steps from" in answer.message
    assert "set transitions to blended" in answer.message
    assert walker.states[-1].state == "standing"
