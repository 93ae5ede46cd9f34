"""The publisher as a managed node, and several walkers in one graph."""

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nodes.conftest import FAST, SLOW
from nodes.graph import SETTLING, assert_left_cleanly
from nodes.walking import NODE, Walker, assert_continuous
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray
from walk_optimizer_interfaces.srv import StartRecording

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.recording import describe_bag
from walk_optimizer.transition.standing import standing_pose

pytestmark = pytest.mark.ros

STANDING = pytest.approx(list(standing_pose(WalkerParameters(), 0.10, 0.05).q[2:]))


def change(graph, transition):
    request = Transition(id=transition)
    return graph.call(ChangeState, f"{NODE}/change_state", transition=request).success


def state(graph):
    return graph.call(GetState, f"{NODE}/get_state").current_state.label


def test_a_manager_decides_when_references_are_streamed(graph, start, stocked, tmp_path):
    start("gait_library", **stocked)
    walker_file = stocked["walker_file"]
    node = start(NODE, autostart=False, longest_gap=10.0, transitions="blended", walker_file=walker_file)
    assert state(graph) == "unconfigured"
    assert change(graph, Transition.TRANSITION_CONFIGURE)
    walker = Walker(graph)
    joints = walker.listen(JointState, "joint_reference")
    refused = walker.set_gait(FAST)
    assert (refused.success, "is inactive" in refused.message) == (False, True)
    graph.spin_for(0.3)
    assert not joints
    assert change(graph, Transition.TRANSITION_ACTIVATE)
    graph.spin_until(lambda: joints, "the stand")
    assert list(joints[0].position) == STANDING
    walker.walk(FAST)
    bag = tmp_path / "bag"
    assert graph.call(StartRecording, f"{NODE}/start_recording", directory=str(bag)).success
    assert change(graph, Transition.TRANSITION_DEACTIVATE)
    assert describe_bag(bag).is_whole
    walker.wait_for("inactive")
    assert walker.states[-1].message == "nothing is streamed, the node is not active"
    diagnostics = graph.subscribe(DiagnosticArray, "/diagnostics")

    def told(check, message):
        found = [one for array in diagnostics for one in array.status if one.name == f"{NODE}: {check}"]
        return found and found[-1].message == message

    graph.spin_until(lambda: told("walk", walker.states[-1].message), "the diagnostics of the walk")
    graph.spin_until(lambda: told("timing", "nothing is streamed"), "the diagnostics of the timing")
    graph.spin_for(0.3)
    joints.clear()
    graph.spin_for(0.3)
    assert not joints
    # From the beginning, with what was set meanwhile: nobody knows where the robot has gone meanwhile.
    assert change(graph, Transition.TRANSITION_CLEANUP)
    assert change(graph, Transition.TRANSITION_CONFIGURE)
    (answer,) = graph.set_parameters(NODE, Parameter("initial_speed", value=SLOW))
    assert answer.successful
    assert change(graph, Transition.TRANSITION_ACTIVATE)
    graph.spin_until(lambda: joints, "the stand again")
    assert list(joints[0].position) == STANDING
    walker.wait_for("walking", SLOW)
    (answer,) = graph.set_parameters(NODE, Parameter("initial_speed", value=FAST))
    assert (answer.successful, "it only counts when the node is activated" in answer.reason) == (False, True)
    assert_left_cleanly(node, node.stop())


@pytest.mark.parametrize(
    "between",
    [
        (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE),
        (
            Transition.TRANSITION_DEACTIVATE,
            Transition.TRANSITION_CLEANUP,
            Transition.TRANSITION_CONFIGURE,
            Transition.TRANSITION_ACTIVATE,
        ),
    ],
)
def test_an_emergency_stop_is_in_force_until_somebody_releases_it(graph, start, stocked, between):
    start("gait_library", **stocked)
    own = {"initial_speed": SLOW, "walker_file": stocked["walker_file"]}
    node = start(NODE, longest_gap=10.0, transitions="blended", **own)
    walker = Walker(graph)
    walker.wait_for("walking", SLOW)
    walker.trigger("emergency_stop")
    walker.wait_for("emergency_stop")
    walker.states.clear()
    joints = walker.listen(JointState, "joint_reference")
    for transition in between:
        joints.clear()
        assert change(graph, transition)
    walker.wait_for("emergency_stop")
    graph.spin_until(lambda: len(joints) > 100, "references")
    assert {tuple(message.position) for message in joints} == {tuple(joints[0].position)}
    assert list(joints[0].position) == STANDING
    assert not any(any(message.velocity) or any(message.effort) for message in joints)
    assert "initial_speed refused: emergency stop; call ~/resume to release it" in node.output()
    assert "released, and paused" in walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("standing")
    walker.walk(FAST)


def test_parameters_count_from_the_first_reference_on(graph, start):
    order = ["right_knee", "left_hip", "left_knee", "right_hip"]
    start(NODE, autostart=False, command_interface="effort", joint_names=order)
    assert change(graph, Transition.TRANSITION_CONFIGURE)
    walker = Walker(graph)
    joints, commands = (
        walker.listen(kind, name)
        for kind, name in ((JointState, "joint_reference"), (Float64MultiArray, "commands"))
    )
    for _ in range(5):
        graph.spin_for(SETTLING)
        joints.clear()
        commands.clear()
        assert change(graph, Transition.TRANSITION_ACTIVATE)
        graph.spin_until(lambda: len(joints) > 5 and len(commands) > 5, "references")
        assert {tuple(message.name) for message in joints} == {tuple(order)}
        assert commands[0].layout.dim[0].label == ",".join(order)
        assert list(commands[0].data) == list(joints[0].effort)
        assert change(graph, Transition.TRANSITION_DEACTIVATE)
    (answer,) = graph.set_parameters(NODE, Parameter("streaming", value=False))
    assert answer.successful
    for _ in range(3):
        graph.spin_for(SETTLING)
        joints.clear()
        assert change(graph, Transition.TRANSITION_ACTIVATE)
        graph.spin_for(SETTLING)
        assert not joints
        assert change(graph, Transition.TRANSITION_DEACTIVATE)


def test_a_configuration_that_fails_says_why(graph, start, tmp_path):
    walker_file = tmp_path / "walker.yaml"
    walker_file.write_text("hip_mass: 45.0\n")
    node = start(NODE, autostart=False, walker_file=walker_file)
    assert state(graph) == "unconfigured"
    walker_file.unlink()
    assert not change(graph, Transition.TRANSITION_CONFIGURE)
    assert state(graph) == "unconfigured"
    graph.spin_until(lambda: f"can't configure: {walker_file}" in node.output(), "the reason")
    walker_file.write_text("hip_mass: 45.0\n")
    assert change(graph, Transition.TRANSITION_CONFIGURE)
    assert_left_cleanly(node, node.stop())


def test_a_walker_on_a_slope_is_refused_with_what_is_possible(graph, start, tmp_path):
    walker_file = tmp_path / "walker.yaml"
    walker_file.write_text("terrain: {slope: 0.05}\n")
    node = start(NODE, autostart=False, walker_file=walker_file)
    assert not change(graph, Transition.TRANSITION_CONFIGURE)
    assert state(graph) == "unconfigured"
    refusal = "can't configure: the walker's terrain is a slope or stairs; gaits there are solved, exported"
    graph.spin_until(lambda: refusal in node.output(), "the reason")
    assert_left_cleanly(node, node.stop())


def test_two_walkers_in_one_graph_walk_each_for_itself(graph, start, stocked):
    names = ("one", "two")
    for name in names:
        start("gait_library", namespace=name, **stocked)
        own = {"walker_file": stocked["walker_file"], "transitions": "blended"}
        start(NODE, namespace=name, longest_gap=10.0, rate=100.0, **own)
    one, two = (Walker(graph, name) for name in names)
    joints = [walker.listen(JointState, "joint_reference") for walker in (one, two)]
    one.talk(Float64, "target_speed").publish(Float64(data=SLOW))
    two.talk(Float64, "target_speed").publish(Float64(data=FAST))
    one.wait_for("walking", SLOW)
    two.wait_for("walking", FAST)
    two.trigger("emergency_stop")
    two.wait_for("emergency_stop")
    graph.spin_for(0.3)
    assert one.states[-1].state == "walking"
    for stream in joints:
        assert_continuous(stream)
    assert any(joints[0][-1].velocity)
    assert not any(joints[1][-1].velocity)
