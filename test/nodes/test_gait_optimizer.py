import os
import signal

import pytest

pytest.importorskip("rclpy")

from action_msgs.msg import GoalStatus
from nodes.graph import assert_left_cleanly, children_of, exists, is_worker
from rclpy.parameter import Parameter
from walk_optimizer_interfaces.action import OptimizeGait as OptimizeGaitAction
from walk_optimizer_interfaces.srv import OptimizeGait

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.nodes.qos import SERVICE as SERVICE_QOS
from walk_optimizer.request import GaitRequest

pytestmark = pytest.mark.ros

SERVICE = "gait_optimizer/optimize_gait"
ACTION = "gait_optimizer/optimize"
SPEED = 1.15 / 3.6
# A grid so fine that the solve lasts until it is stopped.
ENDLESS = {"speed": SPEED, "spring_mode": "none", "points": 2000}


@pytest.fixture(scope="module")
def optimizer(start_for_module):
    """One node for all tests: whatever they do to it, it has to go on."""
    return start_for_module("gait_optimizer", queue_limit=2)


@pytest.fixture
def own_optimizer(start, isolated_graph, optimizer):
    """A node that ends with the test, in a namespace of its own."""
    return start("gait_optimizer", namespace="own", queue_limit=2)


class Goal:
    """A goal of the action, accepted and running."""

    def __init__(self, graph, namespace="", **fields):
        self._graph, self.feedback = graph, []
        client = graph.action(OptimizeGaitAction, namespace + ACTION)
        goal = OptimizeGaitAction.Goal(**fields)
        sent = client.send_goal_async(goal, lambda message: self.feedback.append(message.feedback))
        self.handle = graph.result(sent)
        assert self.handle.accepted
        self._result = self.handle.get_result_async()

    def wait_for_progress(self):
        self._graph.spin_until(lambda: self.feedback, "progress")
        return self.feedback[0]

    def result(self):
        answer = self._graph.result(self._result)
        return answer.status, answer.result


@pytest.mark.slow
@pytest.mark.parametrize("mode", list(SpringMode))
def test_a_client_gets_a_certified_gait_in_every_mode(graph, optimizer, mode):
    answer = graph.call(OptimizeGait, SERVICE, speed=SPEED, spring_mode=mode, points=20)
    assert answer.success, answer.message
    gait = answer.gait
    assert gait.certificate.certified
    assert gait.speed == pytest.approx(SPEED, rel=1e-6)
    assert (gait.spring_mode, gait.points, answer.report.status) == (mode, 20, "solved")
    assert gait.objective == pytest.approx(sum(value**2 for value in gait.u) / 2)
    assert (gait.stiffness == 0) == (mode is SpringMode.NONE)


def test_refusals_say_what_the_core_says_and_the_node_lives_on(graph, optimizer):
    for fields in (
        {"speed": float("nan"), "spring_mode": "none"},
        {"speed": float("inf"), "spring_mode": "none"},
        {"speed": 0.0, "spring_mode": "none"},
        {"speed": -0.3, "spring_mode": "none"},
        {"speed": 50.0, "spring_mode": "none"},
        {"speed": SPEED, "spring_mode": "rubber"},
        {"speed": SPEED, "spring_mode": "none", "points": 3},
        {"speed": SPEED, "spring_mode": "none", "points": 10_000_000},
    ):
        with pytest.raises(InvalidRequestError) as refusal:
            GaitRequest.for_speed(**fields)
        answer = graph.call(OptimizeGait, SERVICE, **fields)
        assert (answer.success, answer.message) == (False, str(refusal.value))
        status, result = Goal(graph, **fields).result()
        assert status == GoalStatus.STATUS_ABORTED
        assert (result.success, result.message) == (False, str(refusal.value))
    answer = graph.call(OptimizeGait, SERVICE, speed=SPEED, spring_mode="none", time_limit=-1.0)
    assert (answer.success, "time limit is -1 s" in answer.message) == (False, True)
    assert optimizer.exit_code is None


def test_the_node_answers_during_a_solve_and_cancel_ends_the_worker(graph, optimizer):
    goal = Goal(graph, **ENDLESS)
    progress = goal.wait_for_progress()
    assert progress.stage
    assert progress.elapsed >= 0
    workers = [pid for pid in children_of(optimizer.process.pid) if is_worker(pid)]
    refused = graph.call(OptimizeGait, SERVICE, speed=-1.0, spring_mode="none")
    assert not refused.success
    assert graph.get_parameter("gait_optimizer", "queue_limit").integer_value == 2
    graph.result(goal.handle.cancel_goal_async())
    status, result = goal.result()
    assert status == GoalStatus.STATUS_CANCELED
    assert (result.success, result.report.status) == (False, "cancelled")
    graph.spin_until(lambda: not set(workers) & set(children_of(optimizer.process.pid)), "the worker's end")


def test_two_clients_share_a_solve_and_a_killed_worker_is_told_to_both(graph, optimizer):
    goal = Goal(graph, **ENDLESS)
    goal.wait_for_progress()
    other = graph.send(OptimizeGait, SERVICE, **ENDLESS)
    graph.spin_for(0.5)
    (worker,) = (pid for pid in children_of(optimizer.process.pid) if is_worker(pid))
    os.kill(worker, signal.SIGKILL)
    status, result = goal.result()
    assert status == GoalStatus.STATUS_ABORTED
    answer = graph.result(other)
    assert result.report.status == answer.report.status == "worker_lost"
    assert answer.message == "worker_lost: the worker process ended before it answered; ask again"
    again = graph.call(OptimizeGait, SERVICE, speed=SPEED, spring_mode="none", points=20)
    assert again.success, again.message


def test_the_same_request_of_two_clients_is_solved_once(graph, optimizer):
    fields = {"speed": SPEED, "spring_mode": "none", "points": 20}
    goal = Goal(graph, **ENDLESS)
    goal.wait_for_progress()  # Both wait behind this one, so neither can be done before the other comes.
    answers = [graph.send(OptimizeGait, SERVICE, **fields) for _ in range(2)]
    graph.spin_for(0.5)
    graph.result(goal.handle.cancel_goal_async())
    first, second = (graph.result(answer) for answer in answers)
    assert first.success
    assert first.report.solve_time == second.report.solve_time


def test_a_full_queue_is_answered_politely(graph, own_optimizer):
    goal = Goal(graph, "own/", **ENDLESS)
    goal.wait_for_progress()
    for points in (1999, 1998):
        graph.send(OptimizeGait, f"own/{SERVICE}", **ENDLESS | {"points": points})
    graph.spin_for(0.5)
    answer = graph.call(OptimizeGait, f"own/{SERVICE}", **ENDLESS | {"points": 1997})
    assert not answer.success
    assert answer.message == "busy: 2 solves are waiting, no more than 2 may; ask again later"


def test_a_flood_is_answered_to_the_last_request(graph, own_optimizer):
    Goal(graph, "own/", **ENDLESS).wait_for_progress()
    graph.client(OptimizeGait, f"own/{SERVICE}")  # Waits until the service is there.
    client = graph.node.create_client(OptimizeGait, f"own/{SERVICE}", qos_profile=SERVICE_QOS)
    graph.spin_until(client.service_is_ready, "the service")
    graph.spin_for(0.5)
    requests = [OptimizeGait.Request(**ENDLESS | {"points": 999 + number}) for number in range(1000)]
    answers = [client.call_async(request) for request in requests]
    # Two wait for the worker; all others are told at once.
    graph.spin_until(lambda: sum(answer.done() for answer in answers) >= 998, "998 answers")
    told = [answer.result().message for answer in answers if answer.done()]
    assert sum(message.startswith("busy: 2 solves are waiting") for message in told) == 998
    assert own_optimizer.exit_code is None


def test_a_time_limit_is_kept(graph, optimizer):
    answer = graph.call(OptimizeGait, SERVICE, **ENDLESS, time_limit=0.5)
    assert (answer.success, answer.report.status) == (False, "time_limit")
    assert answer.message.startswith("time_limit: stopped at the time limit")


@pytest.mark.parametrize(("number", "solving"), [(signal.SIGINT, True), (signal.SIGTERM, False)])
def test_a_signal_ends_the_node_cleanly_with_its_worker(graph, own_optimizer, number, solving):
    graph.client(OptimizeGait, f"own/{SERVICE}")
    if solving:
        goal = Goal(graph, "own/", **ENDLESS)
        goal.wait_for_progress()
        waiting = graph.send(OptimizeGait, f"own/{SERVICE}", **ENDLESS)
        graph.spin_for(0.5)
    children = children_of(own_optimizer.process.pid)
    assert children
    assert_left_cleanly(own_optimizer, own_optimizer.stop(number))
    graph.spin_until(lambda: not any(map(exists, children)), "the workers' end")
    if solving:
        assert graph.result(waiting).report.status == "cancelled"


def test_parameters_out_of_range_or_of_a_wrong_type_stop_the_start(start):
    for name, value in (
        ("points", 5),
        ("time_limit", -1.0),
        ("time_limit", 5),
        ("walker_file", "/none.yaml"),
    ):
        node = start("gait_optimizer", **{name: value})
        assert node.process.wait(60) == 1
        assert name in node.output()
        assert "Traceback" not in node.output()


def test_a_parameter_out_of_range_keeps_its_value(graph, optimizer):
    node = "gait_optimizer"
    refused, accepted, frozen = (
        graph.set_parameters(node, Parameter(name, value=value))[0]
        for name, value in (("time_limit", -1.0), ("time_limit", 7.0), ("workers", 3))
    )
    assert not refused.successful
    assert "time_limit" in refused.reason
    assert accepted.successful
    assert not frozen.successful
    assert graph.get_parameter(node, "time_limit").double_value == 7.0
