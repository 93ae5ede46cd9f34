"""A node that asks another one waits for as long as it is worth it, and no longer."""

import pytest

pytest.importorskip("rclpy")

from std_srvs.srv import Trigger

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


def test_a_call_that_nobody_wants_any_more_ends_before_its_answer(graph):
    silent, asking = Silent(), SuiteNode("asking", [])
    for node in (silent, asking):
        graph.executor.add_node(node)
    reasons = []

    def require_wanted():
        if reasons:
            raise SupersededError(reasons[0])

    async def end_of_call():
        service = asking.connect(Trigger, "/silent/ask")
        try:
            return await asking.call(service, Trigger.Request(), FOREVER, require_wanted)
        except SupersededError as error:
            return error

    call = graph.executor.create_task(end_of_call)
    graph.spin_until(lambda: silent.asked or call.done(), "the question")
    graph.spin_for(0.3)
    assert not call.done()
    reasons.append("a later command came first")
    graph.spin_until(call.done, "the end of the wait")
    assert isinstance(call.result(), SupersededError)
    for node in (silent, asking):
        graph.executor.remove_node(node)
        node.destroy_node()
