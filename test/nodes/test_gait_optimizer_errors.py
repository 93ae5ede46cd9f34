"""What clients and the log are told of mistakes in the optimiser's own program."""

import pytest

pytest.importorskip("rclpy")

from action_msgs.msg import GoalStatus
from rcl_interfaces.msg import Log
from walk_optimizer_interfaces.action import OptimizeGait as OptimizeGaitAction
from walk_optimizer_interfaces.srv import OptimizeGait

from walk_optimizer.nodes import gait_optimizer
from walk_optimizer.nodes.gait_optimizer import GaitOptimizerNode

pytestmark = pytest.mark.ros


@pytest.fixture
def broken_optimizer(graph, monkeypatch):
    """A node of this process that can't read how its solves ended."""

    def broken(_future):
        raise KeyError("a mistake in the program")

    monkeypatch.setattr(gait_optimizer, "outcome_of", broken)
    node = GaitOptimizerNode()
    graph.executor.add_node(node)
    yield node
    graph.executor.remove_node(node)
    node.close()
    node.destroy_node()


def test_an_error_that_nobody_foresaw_has_a_status_and_a_traceback_in_the_log(graph, broken_optimizer):
    told = graph.subscribe(Log, "/rosout")
    fields = {"speed": 0.3, "spring_mode": "none", "points": 20, "time_limit": 0.1}
    answer = graph.call(OptimizeGait, "gait_optimizer/optimize_gait", **fields)
    client = graph.action(OptimizeGaitAction, "gait_optimizer/optimize")
    goal = graph.result(client.send_goal_async(OptimizeGaitAction.Goal(**fields)))
    ended = graph.result(goal.get_result_async())
    assert ended.status == GoalStatus.STATUS_ABORTED
    for one in (answer, ended.result):
        assert (one.success, one.report.status) == (False, "solver_error")
        assert one.message.startswith("internal error: KeyError('a mistake in the program')")
        assert one.report.message == one.message
    graph.spin_until(lambda: sum("Traceback" in one.msg for one in told) == 2, "the tracebacks")
