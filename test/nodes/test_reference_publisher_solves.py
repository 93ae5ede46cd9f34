"""The publisher with real gaits while steps between them are solved for, by its default of `longest_gap`."""

import os
import signal
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from geometry_msgs.msg import Twist, Vector3
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nodes.graph import SETTLING, exists, workers_of
from nodes.walking import MODE, NODE, standing_walker
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from walk_optimizer_interfaces.srv import SetGait

pytestmark = pytest.mark.ros

# Of the packaged table, which has no steps from the one to the other: they take seconds to solve for.
SLOWEST, FASTEST = 0.20 / 0.85, 0.50 / 0.46
SLOW, MEDIUM, FASTER = 0.25 / 0.785, 0.35 / 0.655, 0.40 / 0.59


@pytest.fixture(scope="module")
def publisher(start_for_module, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cache")
    start_for_module("gait_library", cache_folder=folder)
    return start_for_module(NODE, cache_folder=folder, rate=200.0)


@pytest.fixture
def walker(graph, publisher):
    """A publisher that stands, and stands again after the test."""
    with standing_walker(graph, publisher) as walker:
        yield walker


def ask_for_a_solve(walker, publisher):
    """Return the future answer of a command, once the worker process solves for it."""
    answer = walker.graph.send(SetGait, walker.topic("set_gait"), speed=FASTEST, spring_mode=MODE)
    hold_the_solve(walker, publisher)
    return answer


def hold_the_solve(walker, publisher, meanwhile=lambda: None):
    """Stop the worker process as soon as it solves: it might come to its end before a test goes on."""

    def solving():
        meanwhile()
        return [worker for worker in workers_of(publisher.process.pid) if solves(worker)]

    walker.graph.spin_until(solving, "the solve")
    for worker in solving():
        os.kill(worker, signal.SIGSTOP)


def solves(worker):
    """Whether a worker process has begun to solve: it loads the factorisation for that."""
    return "multifrontal" in Path(f"/proc/{worker}/maps").read_text()


def test_stops_and_emergency_stops_end_the_command_under_way(graph, walker, publisher):
    walker.walk(SLOWEST)
    answer = ask_for_a_solve(walker, publisher)
    walker.trigger("emergency_stop")
    refused = graph.result(answer)
    assert (refused.success, "given up because of the emergency stop" in refused.message) == (False, True)
    walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("walking", SLOWEST)
    assert walker.states[-1].target_speed == walker.states[-1].speed

    answer = ask_for_a_solve(walker, publisher)
    workers = workers_of(publisher.process.pid)
    walker.trigger("stop")
    refused = graph.result(answer)
    assert (refused.success, refused.message) == (
        False,
        "superseded by a newer command",
    )
    # Not one that was let run to its end: its process is gone.
    graph.spin_until(lambda: not any(exists(worker) for worker in workers), "the end of the worker")


def test_a_deactivation_ends_the_command_under_way(graph, walker, publisher):
    walker.walk(SLOWEST)
    answer = ask_for_a_solve(walker, publisher)
    workers = workers_of(publisher.process.pid)
    for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE):
        request = Transition(id=transition)
        assert graph.call(ChangeState, f"{NODE}/change_state", transition=request).success
    refused = graph.result(answer)
    assert (refused.success, "was deactivated; activate it and ask again" in refused.message) == (False, True)
    graph.spin_until(lambda: not any(exists(worker) for worker in workers), "the end of the worker", 30.0)


def test_of_two_clients_the_older_one_is_told_at_once_that_a_newer_command_counts(graph, walker, publisher):
    walker.walk(SLOWEST)
    answers = []
    older = ask_for_a_solve(walker, publisher)
    older.add_done_callback(answers.append)
    other = Node("other_client")
    graph.executor.add_node(other)
    try:
        client = other.create_client(SetGait, walker.topic("set_gait"))
        graph.spin_until(client.service_is_ready, "the service")
        graph.spin_for(SETTLING)
        newer = client.call_async(SetGait.Request(speed=SLOW, spring_mode=MODE))
        newer.add_done_callback(answers.append)
        graph.spin_until(lambda: len(answers) == 2, "both answers")
    finally:
        graph.executor.remove_node(other)
        other.destroy_node()
    # The older one first: it waits neither for its own solve nor for the way of the newer one.
    assert answers == [older, newer]
    refused, accepted = older.result(), newer.result()
    assert (refused.success, refused.message) == (
        False,
        "superseded by a newer command",
    )
    assert accepted.success, accepted.message
    walker.wait_for("walking", SLOW)
    assert not any(state.target_speed == pytest.approx(FASTEST) for state in walker.states)


def test_an_emergency_stop_drops_a_gait_that_has_not_begun(walker):
    walker.pause()
    assert walker.set_gait(SLOWEST).success
    walker.trigger("emergency_stop")
    walker.trigger("resume")
    walker.trigger("resume")
    walker.wait_for("standing")
    assert walker.states[-1].target_speed == 0


def test_a_newer_speed_ends_the_work_on_the_one_before(walker, publisher):
    walker.walk(SLOWEST)
    speed = walker.talk(Float64, "target_speed")
    speed.publish(Float64(data=FASTEST))
    hold_the_solve(walker, publisher)
    speed.publish(Float64(data=SLOW))
    walker.wait_for("walking", SLOW)
    assert not any(state.target_speed == pytest.approx(FASTEST) for state in walker.states)


def test_a_newer_speed_of_a_stream_ends_the_work_on_the_one_before(graph, walker, publisher):
    walker.walk(SLOWEST)
    velocity = walker.talk(Twist, "cmd_vel")

    def ask(speed):
        velocity.publish(Twist(linear=Vector3(x=speed)))

    def walks(speed):
        ask(speed)
        return (walker.states[-1].state, walker.states[-1].speed) == ("walking", pytest.approx(speed))

    hold_the_solve(walker, publisher, meanwhile=lambda: ask(FASTEST))
    graph.spin_until(lambda: walks(SLOW), "the other speed")
    assert not any(state.target_speed == pytest.approx(FASTEST) for state in walker.states)


@pytest.fixture
def limit(graph):
    """Sets a limit for all joints, and takes all limits away after the test."""
    names = ("joint_torque_limits", "joint_speed_limits")

    def limit(name, value):
        (answer,) = graph.set_parameters(NODE, Parameter(name, value=[value]))
        return answer

    yield limit
    for name in names:
        assert limit(name, 0.0).successful


def test_limits_hold_for_the_steps_to_a_gait_and_for_those_that_stop_it(walker, limit):
    # In rad/s at the most: FASTER 7.9, its stop 10.52; MEDIUM 4.9, its stop 6.6, its start 9.70.
    assert limit("joint_speed_limits", 10.2).successful
    answer = walker.set_gait(FASTER)
    assert not answer.success
    assert "to stop from 0.6780 m/s, left_knee needs 10.52 rad/s, its limit is 10.2 rad/s" in answer.message
    assert limit("joint_speed_limits", 9.0).successful
    answer = walker.set_gait(MEDIUM)
    assert not answer.success
    assert "to get to 0.5344 m/s, left_knee needs 9.697 rad/s, its limit is 9 rad/s" in answer.message
    assert walker.states[-1].state == "standing"


def test_limits_are_not_lowered_below_what_is_about_to_be_walked_or_its_stop_needs(walker, limit):
    # In N m at the most: MEDIUM 3.8, its stop 11.4, its start 24.8.
    walker.pause()
    assert walker.set_gait(MEDIUM).success
    refused = limit("joint_torque_limits", 15.0)
    assert not refused.successful
    assert "to get to 0.5344 m/s, left_knee needs 24.79 N m, its limit is 15 N m" in refused.reason
    walker.trigger("resume")
    walker.wait_for("walking", MEDIUM)
    refused = limit("joint_torque_limits", 11.0)
    assert not refused.successful
    assert "to stop from 0.5344 m/s, left_knee needs 11.44 N m, its limit is 11 N m" in refused.reason
    assert limit("joint_torque_limits", 15.0).successful


def test_steps_are_solved_for_again_where_the_known_ones_need_too_much(walker, limit):
    # The packaged steps to a stand need 10.69 N m.
    joints = walker.listen(JointState, "joint_reference")
    assert limit("joint_torque_limits", 10.4).successful
    walker.walk(SLOWEST)
    walker.trigger("stop")
    walker.wait_for("standing")
    assert max(abs(effort) for message in joints for effort in message.effort) <= 10.4
