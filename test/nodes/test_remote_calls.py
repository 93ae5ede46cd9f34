"""A node that asks another one waits for as long as it is worth it, and no longer."""

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from nodes.graph import SETTLING
from nodes.silent_node import FOREVER, Silent
from std_msgs.msg import String
from std_srvs.srv import Trigger

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.nodes.remote_service import LEASE
from walk_optimizer.nodes.suite_node import ServiceUnavailableError, SuiteNode
from walk_optimizer.nodes.walk_order import SupersededError

pytestmark = pytest.mark.ros


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
        self.service = node.connect(Trigger, service)
        self.task = graph.executor.create_task(self._end, node)

    async def _end(self, node):
        try:
            return await node.call(self.service, Trigger.Request(), FOREVER, self._require)
        except WalkOptimizerError as error:
            return error

    def _require(self):
        if self._reasons:
            raise SupersededError(self._reasons[0])

    def supersede(self):
        self._reasons.append("superseded")


@contextmanager
def silent_node(graph, announced=True):
    """Have the silent node in this process, until its end has been told to those that listen."""
    silent = Silent(announced)
    graph.executor.add_node(silent)
    yield silent
    graph.executor.remove_node(silent)
    silent.destroy_node()
    graph.spin_for(SETTLING)


def test_a_call_that_nobody_wants_any_more_ends_before_its_answer(graph, asking):
    with silent_node(graph) as silent:
        call = Call(graph, asking, "/silent/ask")
        graph.spin_until(lambda: silent.asked or call.task.done(), "the question")
        graph.spin_for(0.3)
        assert not call.task.done()
        call.supersede()
        assert isinstance(graph.result(call.task), SupersededError)


def test_a_call_that_nobody_wants_any_more_does_not_wait_for_a_service_that_may_still_come(graph, asking):
    call = Call(graph, asking, "/nobody/ask")
    graph.spin_for(0.3)
    assert not call.task.done()
    call.supersede()
    assert isinstance(graph.result(call.task), SupersededError)


class SilentProcess:
    """The silent node in a process of its own."""

    def __init__(self, log):
        self._log = log
        with log.open("w") as output:
            script = Path(__file__).with_name("silent_node.py")
            self.process = subprocess.Popen([sys.executable, script], stdout=output)

    def said(self, word):
        return word in self._log.read_text()


@pytest.fixture
def start(tmp_path):
    """Starts processes of the silent node, and leaves none behind."""
    started = []

    def start_one():
        started.append(SilentProcess(tmp_path / f"{len(started)}.log"))
        return started[-1]

    yield start_one
    for one in started:
        one.process.kill()
        one.process.wait()


# A node's first assertion of liveliness takes seconds.
@pytest.mark.parametrize("life", [0.0, LEASE], ids=["at once", "later"])
def test_a_call_ends_when_its_node_is_killed_also_if_another_is_there_at_once(graph, asking, start, life):
    first = start()
    call = Call(graph, asking, "/silent/ask")
    graph.spin_until(lambda: first.said("asked") or call.task.done(), "the question")
    assert not call.task.done(), call.task.result()
    graph.spin_for(life)
    first.process.kill()
    start()
    error = graph.result(call.task)
    assert isinstance(error, ServiceUnavailableError)
    assert "went away; ask again" in str(error)


def test_a_service_is_called_once_its_node_has_told_of_its_life(graph, asking, monkeypatch):
    monkeypatch.setattr("walk_optimizer.nodes.suite_node._DISCOVERY", FOREVER)
    with silent_node(graph, announced=False) as silent:
        call = Call(graph, asking, "/silent/ask")
        graph.spin_until(lambda: call.service.available, "the service")
        graph.spin_for(1.0)
        assert not silent.asked
        silent.announce()
        graph.spin_until(lambda: silent.asked, "the question")


def test_a_service_whose_node_tells_no_life_is_called_none_the_less(graph, asking):
    with silent_node(graph, announced=False) as silent:
        Call(graph, asking, "/silent/ask")
        graph.spin_until(lambda: silent.asked, "the question")


def test_a_death_counts_once_whatever_tells_of_it_first(asking):
    service = asking.connect(Trigger, "/silent/ask")
    lapse = SimpleNamespace(alive_count=0, alive_count_change=-1, not_alive_count_change=1)
    service._on_start(String(data="first"))
    service._on_liveliness(lapse)
    service._on_start(String(data="second"))
    assert service.losses == 1
    service._on_start(String(data="third"))
    assert service.losses == 2
