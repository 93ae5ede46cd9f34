"""Commands while the publisher runs: speeds, stops, pauses, emergencies, limits, formats."""

import math
from functools import partial

import numpy as np
import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, Vector3
from nodes.conftest import FAST, SLOW, stock
from nodes.walking import BLENDED, MARGIN, NODE, assert_continuous, standing_walker
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray
from walk_optimizer_interfaces.msg import KneeSpring

from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.references import JOINTS

pytestmark = pytest.mark.ros

TIMEOUT = 0.5


@pytest.fixture(scope="module")
def publisher(start_for_module, other_walker, tmp_path_factory):
    start_for_module("gait_library", **stock(tmp_path_factory.mktemp("stock"), other_walker))
    return start_for_module(NODE, walker_file=other_walker, command_timeout=TIMEOUT, **BLENDED)


@pytest.fixture
def walker(graph, publisher):
    """A publisher that stands, and stands again after the test."""
    with standing_walker(graph, publisher) as walker:
        yield walker


@pytest.fixture
def joints(walker):
    """All references of the test: none of them jumps."""
    joints = walker.listen(JointState, "joint_reference")
    yield joints
    assert len(joints) > 50
    assert_continuous(joints)


def test_a_speed_that_was_sent_once_holds_and_speed_0_stops(graph, walker, joints):
    speed = walker.talk(Float64, "target_speed")
    speed.publish(Float64(data=FAST))
    walker.wait_for("walking", FAST)
    walker.graph.spin_for(2 * TIMEOUT)
    assert walker.states[-1].state == "walking"
    speed.publish(Float64(data=SLOW))
    walker.wait_for("walking", SLOW)
    speed.publish(Float64(data=0.0))
    walker.wait_for("standing")
    assert {state.state for state in walker.states} >= {"starting", "changing", "stopping"}


def findings(diagnostics, check):
    """What the publisher's diagnostics have said, newest first."""
    statuses = [status for array in diagnostics for status in array.status]
    return [status for status in reversed(statuses) if status.name == f"{NODE}: {check}"]


def test_a_stream_of_speeds_that_falls_silent_ends_in_a_stand(graph, walker, joints, publisher):
    diagnostics = graph.subscribe(DiagnosticArray, "/diagnostics")
    velocity = walker.talk(Twist, "cmd_vel")

    def send(speed):
        velocity.publish(Twist(linear=Vector3(x=speed)))

    def walks():
        send(FAST)
        return walker.states[-1].state == "walking" and walker.states[-1].speed == pytest.approx(FAST)

    graph.spin_until(walks, "the walk")
    silent = f"no speed on {velocity.topic_name} for 0.5 s"
    refused = "a velocity has linear.x=nan, allowed are finite numbers in all its parts"

    def told(check, message):
        found = findings(diagnostics, check)
        return found and message in found[0].message and found[0].level == b"\x01"

    # Speeds that are refused don't keep the stream alive.
    graph.spin_until(lambda: send(math.nan) or walker.states[-1].state == "standing", "the stand")
    assert f"coming to a stand: {silent}" in publisher.output()
    reason = f"{silent} that can be followed: {refused}"
    graph.spin_until(lambda: send(math.nan) or told("walk", reason), "why it is refused")
    assert told("commands", f"the last speed was refused: {refused}")
    graph.spin_until(walks, "the walk again")
    graph.spin_until(lambda: told("walk", f"{silent}, send speeds again"), "the silence")
    assert findings(diagnostics, "commands")[0].level == b"\x00"


def test_parts_of_a_velocity_that_a_planar_walker_can_not_follow_are_ignored_and_told(
    graph, walker, publisher
):
    velocity = walker.talk(Twist, "cmd_vel")
    turning = Twist(linear=Vector3(x=FAST, y=0.25), angular=Vector3(z=-0.5))

    def walks():
        velocity.publish(turning)
        return walker.states[-1].state == "walking" and walker.states[-1].speed == pytest.approx(FAST)

    graph.spin_until(walks, "the walk")
    told = (
        f"{velocity.topic_name}: linear.y=0.25, angular.z=-0.5 ignored: the walker is planar, it can only "
        "follow linear.x"
    )
    assert publisher.output().count(told) == 1

    # A speed in a message that is wrong elsewhere neither counts nor keeps the stream alive.
    broken = Twist(linear=Vector3(x=FAST), angular=Vector3(y=math.inf))
    graph.spin_until(lambda: velocity.publish(broken) or walker.states[-1].state == "standing", "the stand")
    refused = (
        "target speed refused: a velocity has angular.y=inf, allowed are finite numbers in all its parts"
    )
    assert refused in publisher.output()


def test_pause_and_resume(graph, walker, joints):
    walker.walk(FAST)
    walker.trigger("pause")
    walker.wait_for("paused")
    graph.spin_until(lambda: not any(joints[-1].velocity), "rest")
    held = len(joints)
    graph.spin_until(lambda: len(joints) > held + 20, "the hold")
    assert (
        "m/s (implicit_euler) from the next step on, once ~/resume is called; "
        in walker.set_gait(SLOW).message
    )
    assert walker.trigger("stop") == "comes to a stand after the running step, once ~/resume is called"
    assert walker.set_gait(FAST).success
    assert len({tuple(message.position) for message in joints[held:]}) == 1
    assert not any(any(message.velocity) or any(message.effort) for message in joints[held:])
    assert walker.trigger("resume") == "goes on"
    walker.wait_for("walking")
    graph.spin_until(lambda: any(joints[-1].velocity), "the walk going on")


def test_where_nothing_is_to_be_streamed_the_walk_is_held_and_goes_on_from_there(graph, walker, joints):
    walker.walk(FAST)
    assert graph.set_parameters(NODE, Parameter("streaming", value=False))[0].successful
    walker.wait_for("paused")
    assert "nothing is streamed; set `streaming` to true" in walker.states[-1].message
    graph.spin_until(lambda: not any(joints[-1].velocity), "rest")
    held = len(joints)
    graph.spin_for(1.0)
    assert len(joints) == held
    assert "from the next step on, once `streaming` is true; " in walker.set_gait(SLOW).message
    assert graph.set_parameters(NODE, Parameter("streaming", value=True))[0].successful
    walker.wait_for("walking", SLOW)
    moved = np.abs(np.subtract(joints[held].position, joints[held - 1].position))
    assert moved.max() < 0.01
    assert not any(joints[held - 1].velocity)
    assert np.abs(joints[held].velocity).max() < MARGIN


def test_an_emergency_stop_is_told_also_while_nothing_is_streamed(graph, walker):
    diagnostics = graph.subscribe(DiagnosticArray, "/diagnostics")
    walker.walk(FAST)
    assert graph.set_parameters(NODE, Parameter("streaming", value=False))[0].successful
    walker.wait_for("paused")
    walker.trigger("emergency_stop")
    walker.wait_for("emergency_stop")
    diagnostics.clear()
    graph.spin_until(lambda: findings(diagnostics, "walk"), "the diagnostics")
    assert findings(diagnostics, "walk")[0].level == b"\x02"
    assert graph.set_parameters(NODE, Parameter("streaming", value=True))[0].successful
    walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("walking", FAST)


def test_an_emergency_stop_is_latched(graph, walker, joints):
    walker.walk(FAST)
    walker.trigger("emergency_stop")
    walker.wait_for("emergency_stop")
    graph.spin_for(0.3)
    stopped = joints[-1]
    assert not any(stopped.velocity)
    assert not any(stopped.effort)
    refused = walker.set_gait(SLOW)
    assert (refused.success, "call ~/resume to release it" in refused.message) == (False, True)
    assert walker.trigger("stop") == "comes to a stand after the running step, once ~/resume is called twice"
    assert "emergency stop, holds its pose already" in walker.trigger("pause")
    assert "released, and paused" in walker.trigger("resume")
    walker.wait_for("paused")
    graph.spin_for(0.3)
    assert list(joints[-1].position) == list(stopped.position)
    assert walker.trigger("resume") == "goes on"
    walker.wait_for("standing")
    assert walker.trigger("stop") == "stands already"


def test_a_speed_may_be_sent_again_as_soon_as_an_emergency_stop_is_released(graph, walker):
    speed = walker.talk(Float64, "target_speed")
    walker.trigger("emergency_stop")
    walker.wait_for("emergency_stop")
    speed.publish(Float64(data=SLOW))
    graph.spin_for(0.2)
    walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("standing")
    speed.publish(Float64(data=SLOW))
    walker.wait_for("walking", SLOW)


def test_a_stream_that_ends_in_an_emergency_ends_the_walk_that_goes_on_after_it(graph, walker):
    velocity = walker.talk(Twist, "cmd_vel")
    send = partial(velocity.publish, Twist(linear=Vector3(x=FAST)))
    graph.spin_until(lambda: send() or walker.states[-1].state == "walking", "the walk")
    walker.trigger("emergency_stop")
    graph.spin_for(2 * TIMEOUT)
    walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("standing")


def test_a_gait_beyond_the_limits_is_refused_and_the_walk_goes_on(graph, walker):
    # Torques at the most: SLOW 2 and 1, FAST 4 and 2 N m (hip, knee); of a stand 0.5 and 4.
    limits = Parameter("joint_torque_limits", value=[50.0, 50.0, 3.0, 50.0])
    assert graph.set_parameters(NODE, limits)[0].successful
    walker.walk(SLOW)
    answer = walker.set_gait(FAST)
    assert not answer.success
    assert "right_hip needs 4.107 N m" in answer.message
    assert "its limit is 3 N m" in answer.message
    assert walker.states[-1].state == "walking"
    (tight,) = graph.set_parameters(NODE, Parameter("joint_speed_limits", value=[0.1]))
    assert not tight.successful
    assert "left_hip needs" in tight.reason
    assert "joint_speed_limits" in tight.reason
    for wrong in ([1.0, 2.0], [-1.0], [math.nan]):
        (answer,) = graph.set_parameters(NODE, Parameter("joint_torque_limits", value=wrong))
        assert not answer.successful
    assert graph.set_parameters(NODE, Parameter("joint_torque_limits", value=[0.0]))[0].successful
    walker.walk(FAST)


def test_the_order_of_joints_and_what_commands_hold_are_parameters(graph, walker):
    order = ["right_knee", "left_hip", "left_knee", "right_hip"]
    rows = [order.index(name) for name in JOINTS]
    joints, commands = (
        walker.listen(JointState, "joint_reference"),
        walker.listen(Float64MultiArray, "commands"),
    )
    walker.walk(FAST)
    graph.set_parameters(
        NODE, Parameter("joint_names", value=order), Parameter("command_interface", value="effort")
    )
    graph.spin_until(lambda: joints[-1].name == order and len(commands) > 10, "the other order")
    commands.clear()
    graph.spin_until(lambda: len(commands) > 10, "commands")
    efforts = {tuple(message.effort) for message in joints}
    assert all(tuple(command.data) in efforts for command in commands[:-2])
    assert commands[0].layout.dim[0].label == ",".join(order)
    effort = np.array(joints[-1].effort)[rows]
    assert effort[0] == -effort[2]  # The hips, wherever they are in the message.
    graph.set_parameters(
        NODE, Parameter("joint_names", value=list(JOINTS)), Parameter("command_interface", value="position")
    )
    (answer,) = graph.set_parameters(NODE, Parameter("joint_names", value=["left_hip"]))
    assert "is no order of left_hip, left_knee" in answer.reason


def test_the_knee_springs_are_there_for_a_late_joiner(graph, walker):
    walker.walk(FAST)
    springs = graph.subscribe(KneeSpring, walker.topic("knee_spring"), LATCHED)
    graph.spin_until(lambda: springs, "the springs")
    assert (springs[0].stiffness, springs[0].equilibrium) == (12.5, 3.11)


def test_punctuality_is_told(graph, walker):
    diagnostics = graph.subscribe(DiagnosticArray, "/diagnostics")
    graph.spin_until(lambda: findings(diagnostics, "timing"), "diagnostics")
    values = {entry.key: float(entry.value) for entry in findings(diagnostics, "timing")[0].values}
    assert 0 < values["rate"] < 101
    assert values["lateness_median_ms"] <= values["lateness_99_percent_ms"] <= values["lateness_max_ms"]
    assert {"jitter_max_ms", "missed", "missed_last_second"} <= values.keys()
    assert "not recording" in findings(diagnostics, "recording")[0].message


def test_peers_whose_quality_of_service_does_not_fit_are_named_with_both_policies(graph, walker, publisher):
    late = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    graph.subscribe(JointState, walker.topic("joint_reference"), late)
    unreliable = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    graph.node.create_publisher(Float64, walker.topic("target_speed"), unreliable)
    for text in (
        "joint_reference does not reach /test_client: durability offered volatile, requested transient_local",
        "target_speed is not heard from /test_client: reliability offered best_effort, requested reliable",
    ):
        graph.spin_until(lambda text=text: text in publisher.output(), text)


def test_a_stop_works_whatever_was_blended_before(graph, walker, joints):
    """A gait that is not refined has no certified steps, but was begun while none were asked for."""
    walker.walk(SLOW)
    assert graph.set_parameters(NODE, Parameter("transitions", value="certified"))[0].successful
    walker.trigger("stop")
    walker.wait_for("standing")
    assert graph.set_parameters(NODE, Parameter("transitions", value="blended"))[0].successful
