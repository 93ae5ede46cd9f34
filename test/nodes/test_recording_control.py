"""Recording beside everything else: the disk may take its time, the node answers meanwhile."""

import os
import threading

import pytest

pytest.importorskip("rclpy")

from nodes.walking import NODE
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger
from walk_optimizer_interfaces.msg import WalkState
from walk_optimizer_interfaces.srv import StartRecording, StopRecording

from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.nodes.reference_publisher import ReferencePublisherNode
from walk_optimizer.recording import describe_bag

pytestmark = pytest.mark.ros

START, STOP = f"{NODE}/start_recording", f"{NODE}/stop_recording"


class SlowDisk:
    """A disk that brings nothing home until it is released."""

    def __init__(self, monkeypatch):
        self._free = threading.Event()
        self._free.set()
        self.waited_for = threading.Event()
        monkeypatch.setattr(os, "fsync", self._sync)

    def _sync(self, _descriptor):
        if not self._free.is_set():
            self.waited_for.set()
        self._free.wait()

    def hold(self):
        self.waited_for.clear()
        self._free.clear()

    def release(self):
        self._free.set()


@pytest.fixture
def disk(monkeypatch):
    disk = SlowDisk(monkeypatch)
    yield disk
    disk.release()


class Running:
    """A publisher in this process, whose executor runs in a thread."""

    def __init__(self):
        self.node = ReferencePublisherNode()
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._end = threading.Event()
        self.node.begin()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self):
        while not self._end.is_set():
            self._executor.spin_once(timeout_sec=0.05)
        self.node.close()
        for _ in range(5):  # Those who wait get an answer.
            self._executor.spin_once(timeout_sec=0.05)

    def close(self):
        """Shut the node down as a signal does."""
        self._end.set()
        self._thread.join()

    def destroy(self):
        self.close()
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def publisher(disk, graph):
    """A publisher on that disk."""
    running = Running()
    yield running
    disk.release()
    running.destroy()


def emergency_stop_holds(graph):
    """Have an emergency stop carried out, and released again."""
    states = graph.subscribe(WalkState, f"{NODE}/state", LATCHED)
    stopped = graph.result(graph.send(Trigger, f"{NODE}/emergency_stop"), "the emergency stop", 30.0)
    assert stopped.success
    graph.spin_until(lambda: states and states[-1].state == "emergency_stop", "the state", 30.0)
    for _ in range(2):
        graph.call(Trigger, f"{NODE}/resume")


@pytest.mark.parametrize("way", ["services", "parameter"])
def test_an_emergency_stop_does_not_wait_for_a_disk_that_a_bag_waits_for(
    graph, disk, publisher, tmp_path, way
):
    graph.client(Trigger, f"{NODE}/emergency_stop")
    graph.client(Trigger, f"{NODE}/resume")

    def ask(kind, name, record):
        if way == "services":
            return graph.send(kind, name)
        (answer,) = graph.set_parameters(NODE, Parameter("record", value=record))
        assert answer.successful
        return None

    graph.set_parameters(NODE, Parameter("recording_folder", value=str(tmp_path)))
    for kind, name, record in ((StartRecording, START, True), (StopRecording, STOP, False)):
        disk.hold()
        answer = ask(kind, name, record)
        graph.spin_until(disk.waited_for.is_set, f"the disk, after {name}")
        emergency_stop_holds(graph)
        assert answer is None or not answer.done()
        disk.release()
        if answer is not None:
            assert graph.result(answer).success
    (bag,) = tmp_path.iterdir()
    graph.spin_until(lambda: (bag / "metadata.yaml").exists() and describe_bag(bag).is_whole, "the whole bag")


def test_a_node_that_ends_while_a_bag_is_being_begun_leaves_a_whole_one(graph, disk, publisher, tmp_path):
    graph.client(StartRecording, START)
    disk.hold()
    answer = graph.send(StartRecording, START, directory=str(tmp_path / "bag"))
    graph.spin_until(disk.waited_for.is_set, "the disk")
    threading.Timer(0.3, disk.release).start()
    publisher.close()
    assert "is shutting down" in graph.result(answer).message
    assert describe_bag(tmp_path / "bag").is_whole
