"""What clients and the log are told of mistakes in the optimiser's own program."""

import gc
from concurrent.futures import Future

import pytest

pytest.importorskip("rclpy")

from action_msgs.msg import GoalStatus
from rcl_interfaces.msg import Log
from walk_optimizer_interfaces.action import OptimizeGait as OptimizeGaitAction
from walk_optimizer_interfaces.srv import OptimizeGait

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.jobs.gaits import outcome_of
from walk_optimizer.nodes import gait_optimizer
from walk_optimizer.nodes.gait_optimizer import GaitOptimizerNode
from walk_optimizer.optimizer import Outcome

pytestmark = pytest.mark.ros


FIELDS = {"speed": 0.3, "spring_mode": "none", "points": 20, "time_limit": 0.1}


@pytest.fixture
def optimizer(graph):
    """A node of this process."""
    gc.collect()  # Or what is left of another node of its name takes its log with it.
    node = GaitOptimizerNode()
    graph.executor.add_node(node)
    yield node
    graph.executor.remove_node(node)
    node.close()
    node.destroy_node()


@pytest.fixture
def told(graph):
    return graph.subscribe(Log, "/rosout")


def broken(_future):
    raise KeyError("a mistake in the program")


def test_an_error_that_nobody_foresaw_has_a_status_and_a_traceback_in_the_log(
    graph, optimizer, told, monkeypatch
):
    monkeypatch.setattr(gait_optimizer, "outcome_of", broken)
    answer = graph.call(OptimizeGait, "gait_optimizer/optimize_gait", **FIELDS)
    client = graph.action(OptimizeGaitAction, "gait_optimizer/optimize")
    goal = graph.result(client.send_goal_async(OptimizeGaitAction.Goal(**FIELDS)))
    ended = graph.result(goal.get_result_async())
    assert ended.status == GoalStatus.STATUS_ABORTED
    for one in (answer, ended.result):
        assert (one.success, one.report.status) == (False, "solver_error")
        assert one.message.startswith("internal error: KeyError('a mistake in the program')")
        assert one.report.message == one.message
    graph.spin_until(lambda: sum("Traceback" in one.msg for one in told) == 2, "the tracebacks")


def test_what_went_wrong_within_a_worker_is_logged_too(graph, optimizer, told, monkeypatch):
    failed: Future[Outcome] = Future()
    failed.set_exception(SolveFailedError("the solve failed unexpectedly: ValueError()"))
    monkeypatch.setattr(gait_optimizer, "outcome_of", lambda _: outcome_of(failed))
    answer = graph.call(OptimizeGait, "gait_optimizer/optimize_gait", **FIELDS)
    assert (answer.success, answer.report.status) == (False, "solver_error")
    assert "the solve failed unexpectedly: ValueError()" in answer.message
    graph.spin_until(lambda: answer.report.message in [one.msg for one in told], "the log")
