"""A node that asks another one waits for as long as it is worth it, and no longer."""

import pytest

pytest.importorskip("rclpy")

from std_srvs.srv import Trigger

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.nodes.walk_order import SupersededError

pytestmark = pytest.mark.ros

FOREVER = 3600.0


class Silent(SuiteNode):
    """A node that lives and never answers."""

    def __init__(self):
        super().__init__("silent", [])
        self.asked = 0
        self.serve(Trigger, "~/ask", self._keep_silent)
        self.announce()

    async def _keep_silent(self, _request, _response):
        self.asked += 1
        await self.sleep(FOREVER)


@pytest.fixture
def asking(graph):
    node = SuiteNode("asking", [])
    graph.executor.add_node(node)
    yield node
    graph.executor.remove_node(node)
    node.destroy_node()


class Call:
    """A call of a service that is superseded at some time."""

    def __init__(self, graph, node, service):
        self._reasons = []
        self.task = graph.executor.create_task(self._end, node, service)

    async def _end(self, node, service):
        try:
            return await node.call(node.connect(Trigger, service), Trigger.Request(), FOREVER, self._require)
        except WalkOptimizerError as error:
            return error

    def _require(self):
        if self._reasons:
            raise SupersededError(self._reasons[0])

    def supersede(self):
        self._reasons.append("superseded")


def test_a_call_that_nobody_wants_any_more_ends_before_its_answer(graph, asking):
    silent = Silent()
    graph.executor.add_node(silent)
    call = Call(graph, asking, "/silent/ask")
    graph.spin_until(lambda: silent.asked or call.task.done(), "the question")
    graph.spin_for(0.3)
    assert not call.task.done()
    call.supersede()
    assert isinstance(graph.result(call.task), SupersededError)
    graph.executor.remove_node(silent)
    silent.destroy_node()


def test_a_call_that_nobody_wants_any_more_does_not_wait_for_a_service_that_may_still_come(graph, asking):
    call = Call(graph, asking, "/nobody/ask")
    graph.spin_for(0.3)
    assert not call.task.done()
    call.supersede()
    assert isinstance(graph.result(call.task), SupersededError)
