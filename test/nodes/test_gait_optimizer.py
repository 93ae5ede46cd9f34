import os
import signal
import time

import numpy as np
import pytest

pytest.importorskip("rclpy")

from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nodes.graph import assert_left_cleanly, children_of, exists, workers_of
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from walk_optimizer_interfaces.action import OptimizeGait as OptimizeGaitAction
from walk_optimizer_interfaces.srv import OptimizeGait

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.jobs.gaits import GaitJob, submit_gait
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.nodes.gait_optimizer import GaitOptimizerNode
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
        self._graph, self.feedback, self.on_feedback = graph, [], lambda: None
        client = graph.action(OptimizeGaitAction, namespace + ACTION)
        goal = OptimizeGaitAction.Goal(**fields)
        sent = client.send_goal_async(goal, self._hear)
        self.handle = graph.result(sent)
        assert self.handle.accepted
        self._result = self.handle.get_result_async()

    def _hear(self, message):
        self.feedback.append(message.feedback)
        self.on_feedback()

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
        assert (answer.report.status, answer.report.message) == ("refused", answer.message)
        status, result = Goal(graph, **fields).result()
        assert status == GoalStatus.STATUS_ABORTED
        assert (result.success, result.message) == (False, str(refusal.value))
        assert (result.report.status, result.report.message) == ("refused", result.message)
    answer = graph.call(OptimizeGait, SERVICE, speed=SPEED, spring_mode="none", time_limit=-1.0)
    assert (answer.success, "time limit is -1 s" in answer.message) == (False, True)
    assert optimizer.exit_code is None


def test_the_node_answers_during_a_solve_and_cancel_ends_the_worker(graph, optimizer):
    goal = Goal(graph, **ENDLESS)
    progress = goal.wait_for_progress()
    assert progress.stage
    assert progress.elapsed >= 0
    workers = workers_of(optimizer.process.pid)
    refused = graph.call(OptimizeGait, SERVICE, speed=-1.0, spring_mode="none")
    assert not refused.success
    assert graph.get_parameter("gait_optimizer", "queue_limit").integer_value == 2
    graph.result(goal.handle.cancel_goal_async())
    status, result = goal.result()
    assert status == GoalStatus.STATUS_CANCELED
    assert (result.success, result.report.status) == (False, "cancelled")
    graph.spin_until(lambda: not set(workers) & set(children_of(optimizer.process.pid)), "the worker's end")


@pytest.mark.slow
def test_service_and_action_give_the_same_result(graph, optimizer):
    fields = {"speed": 0.9, "spring_mode": "none", "points": 20}
    answer = graph.call(OptimizeGait, SERVICE, **fields)
    status, result = Goal(graph, **fields).result()
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert (result.success, result.message) == (answer.success, answer.message)
    assert result.gait == answer.gait
    answer.report.solve_time = result.report.solve_time
    assert result.report == answer.report


def test_a_goal_hears_of_its_solve_every_second_and_how_much_time_is_left(graph, optimizer):
    limit = 5.0
    goal = Goal(graph, **ENDLESS, time_limit=limit)
    behind = Goal(graph, **ENDLESS | {"points": 1999}, time_limit=limit)
    behind.wait_for_progress()
    assert (behind.feedback[0].stage, behind.feedback[0].time_left) == ("queued", limit)
    arrivals = []
    goal.on_feedback = lambda: arrivals.append(time.monotonic())
    status, result = goal.result()
    assert (status, result.report.status) == (GoalStatus.STATUS_ABORTED, "time_limit")
    assert "starting" in {one.stage for one in goal.feedback} or goal.feedback[0].elapsed < 1.0
    assert all(one.time_left == pytest.approx(max(limit - one.elapsed, 0)) for one in goal.feedback)
    # As a count: one message may be late on a busy machine, but not most of them.
    assert len(arrivals) >= arrivals[-1] - arrivals[0]
    graph.result(behind.handle.cancel_goal_async())
    assert behind.result()[0] == GoalStatus.STATUS_CANCELED


def test_timers_of_the_node_are_on_time_during_a_solve(graph, isolated_graph):
    """In one process with the node: the same timer, with and without a solve, in the same run."""
    node = GaitOptimizerNode()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    ticks = []
    node.create_timer(0.01, lambda: ticks.append(time.monotonic()))

    def intervals():
        """Median and 90th percentile of the times between two ticks in [s], over 2 s."""
        ticks.clear()
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            executor.spin_once(timeout_sec=0.01)
        return np.percentile(np.diff(ticks), [50, 90])

    try:
        intervals()
        idle = intervals()
        job = GaitJob(GaitRequest.for_speed(**ENDLESS), WalkerParameters.from_yaml(), 60.0)
        ticket = submit_gait(node._pool, job)
        node.later(node.finished, ticket.future)
        while ticket.progress.iteration == 0:
            executor.spin_once(timeout_sec=0.01)
        busy = intervals()
        assert not ticket.future.done()
        # A machine that is busy otherwise is so in both; half of the ticks lost would be a median of 20 ms.
        assert busy[0] < 1.5 * idle[0]
        assert busy[1] < max(0.02, 2 * idle[1])
        ticket.cancel()
    finally:
        node.close()
        executor.shutdown()
        node.destroy_node()


def test_diagnostics_tell_of_workers_queue_and_the_last_outcome(graph, own_optimizer):
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    name = "own/gait_optimizer"

    def finding(check):
        statuses = [one for array in heard for one in array.status if one.name == f"{name}: {check}"]
        return statuses[-1] if statuses else None

    def own_stamps():
        stamps = [one.header.stamp for one in heard if one.status[0].name.startswith(name)]
        return [stamp.sec + stamp.nanosec * 1e-9 for stamp in stamps]

    def wait_for(check, words, level):
        graph.spin_until(lambda: (one := finding(check)) and words in one.message, f"{check}: {words}")
        assert finding(check).level == level
        return {pair.key: pair.value for pair in finding(check).values}

    assert wait_for("workers", "waiting for requests", DiagnosticStatus.OK)["workers"] == "1"
    goal = Goal(graph, "own/", **ENDLESS)
    goal.wait_for_progress()
    graph.send(OptimizeGait, f"own/{SERVICE}", **ENDLESS | {"points": 1999})
    values = wait_for("workers", "solving", DiagnosticStatus.OK)
    assert (values["running"], values["queue_limit"]) == ("1", "2")
    graph.send(OptimizeGait, f"own/{SERVICE}", **ENDLESS | {"points": 1998})
    wait_for("workers", "the queue is full", DiagnosticStatus.WARN)
    (worker,) = workers_of(own_optimizer.process.pid)
    os.kill(worker, signal.SIGKILL)
    values = wait_for("solves", "the worker process ended before it answered", DiagnosticStatus.WARN)
    assert (values["failed"], values["last_status"]) == ("1", "worker_lost")
    graph.spin_until(lambda: len(own_stamps()) >= 6, "diagnostics of 5 s")
    # A stalled machine may delay some of them, and those after these come sooner.
    assert np.median(np.diff(own_stamps())) == pytest.approx(1.0, abs=0.1)


def test_two_clients_share_a_solve_and_a_killed_worker_is_told_to_both(graph, optimizer):
    goal = Goal(graph, **ENDLESS)
    goal.wait_for_progress()
    other = graph.send(OptimizeGait, SERVICE, **ENDLESS)
    graph.spin_for(0.5)
    (worker,) = workers_of(optimizer.process.pid)
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
    assert (answer.report.status, answer.report.message) == ("refused", answer.message)


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
    for name, value, told in (
        ("points", 5, "points"),
        ("time_limit", -1.0, "time_limit"),
        ("time_limit", 5, "'DOUBLE': time_limit; real numbers need a point"),
        ("walker_file", "/none.yaml", "walker_file"),
    ):
        node = start("gait_optimizer", **{name: value})
        assert node.process.wait(60) == 1
        assert told in node.output()
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
