"""Recording beside everything else: the disk may take its time, the node answers meanwhile."""

import errno
import functools
import gc
import os
import shutil
import threading
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist, Vector3
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nodes.graph import SETTLING
from nodes.walking import NODE
from rcl_interfaces.msg import Log
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from walk_optimizer_interfaces.msg import WalkState
from walk_optimizer_interfaces.srv import StartRecording, StopRecording

from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.nodes.reference_publisher import ReferencePublisherNode
from walk_optimizer.recording import describe_bag

pytestmark = pytest.mark.ros

# Of rcl_interfaces/msg/Log.
ERROR = 40
START, STOP = f"{NODE}/start_recording", f"{NODE}/stop_recording"


# What waits for a disk that hangs: some of it writes, some only asks.
DISK_CALLS = (
    *((os, name) for name in ("fsync", "statvfs")),
    (shutil, "disk_usage"),
    *((Path, name) for name in ("absolute", "exists", "expanduser", "is_dir", "is_file", "mkdir")),
)


class SlowDisk:
    """A disk that answers nothing until it is released."""

    def __init__(self, monkeypatch):
        self._free = threading.Event()
        self._free.set()
        self.waited_for = threading.Event()
        for owner, name in DISK_CALLS:
            monkeypatch.setattr(owner, name, self._waiting(getattr(owner, name)))

    def _waiting(self, call):
        @functools.wraps(call)
        def waits(*arguments, **names):
            # The test itself, which releases it, runs on another disk.
            if threading.current_thread() is not threading.main_thread() and not self._free.is_set():
                self.waited_for.set()
                self._free.wait()
            return call(*arguments, **names)

        return waits

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


class FullDisk:
    """A disk that takes nothing while it is full."""

    def __init__(self, monkeypatch):
        self.full = False
        self._write = os.write
        monkeypatch.setattr(os, "write", self._refuse)

    def _refuse(self, descriptor, data):
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return self._write(descriptor, data)


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
        del self.node, self._executor
        gc.collect()  # Or what is left of the node takes the log of the next one of its name with it.


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
    graph.spin_until(lambda: any(tmp_path.glob("*/metadata.yaml")), "the bag")
    (bag,) = tmp_path.iterdir()
    graph.spin_until(lambda: describe_bag(bag).is_whole, "the whole bag")


def test_while_a_bag_is_recorded_nothing_but_its_thread_waits_for_the_disk(graph, disk, publisher, tmp_path):
    """Neither the findings about the recording, nor topics that appear and whose types have to be read."""
    graph.client(Trigger, f"{NODE}/emergency_stop")
    graph.client(Trigger, f"{NODE}/resume")
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    graph.set_parameters(NODE, Parameter("recording_topics", value=["late"]))
    assert graph.call(StartRecording, START, directory=str(tmp_path / "bag")).success
    wait_for(graph, heard, DiagnosticStatus.OK, "recording to")
    disk.hold()
    graph.spin_until(disk.waited_for.is_set, "the disk")
    late = graph.node.create_publisher(Float64, "late", 10)
    graph.spin_until(lambda: finding(heard).level == DiagnosticStatus.WARN, "the long queue", 30.0)
    assert "messages wait for the disk, from 20000 on they are dropped" in finding(heard).message
    emergency_stop_holds(graph)
    assert "free_mb" in {value.key for value in finding(heard).values}
    disk.release()
    graph.spin_until(late.get_subscription_count, "that the topic is recorded")
    late.publish(Float64(data=7.0))
    graph.spin_for(SETTLING)
    assert graph.call(StopRecording, STOP).success
    assert describe_bag(tmp_path / "bag").counts["/late"] == 1


def test_files_of_a_bag_that_would_cost_more_than_they_hold_are_refused(graph, publisher):
    def answer(name, value):
        (answer,) = graph.set_parameters(NODE, Parameter(name, value=value))
        return answer.successful or answer.reason

    size, duration = "recording_file_bytes", "recording_file_duration"
    expected = "0.001 s is too little for a file; give 1.0 s or more, or 0 for one file"
    assert answer(duration, 0.001) == f"{duration}: {expected}"
    expected = "give 1048576 byte or more, or 0 for one file"
    assert answer(size, 1) == f"{size}: 1 byte is too little for a file; {expected}"
    for name, allowed in ((duration, 1.0), (duration, 0.0), (size, 1 << 20), (size, 0)):
        assert answer(name, allowed) is True


def test_a_node_that_ends_while_a_bag_is_being_begun_leaves_a_whole_one(graph, disk, publisher, tmp_path):
    graph.client(StartRecording, START)
    disk.hold()
    answer = graph.send(StartRecording, START, directory=str(tmp_path / "bag"))
    graph.spin_until(disk.waited_for.is_set, "the disk")
    threading.Timer(0.3, disk.release).start()
    publisher.close()
    assert "is shutting down" in graph.result(answer).message
    assert describe_bag(tmp_path / "bag").is_whole


def record(graph, folder):
    """Ask for a bag in a folder, as an operator does."""
    parameters = (Parameter("recording_folder", value=str(folder)), Parameter("record", value=True))
    assert all(answer.successful for answer in graph.set_parameters(NODE, *parameters))


def finding(heard):
    """The newest finding about the recording; None before the first."""
    statuses = [one for array in heard for one in array.status if one.name == f"{NODE}: recording"]
    return statuses[-1] if statuses else None


def wait_for(graph, heard, level, words):
    """Wait until the newest finding about the recording has words, and `record` tells the same."""
    heard.clear()

    def told():
        status = finding(heard)
        return status is not None and words in status.message and status.level == level

    graph.spin_until(told, words, 30.0)
    recording = words.startswith("recording to")
    graph.spin_until(
        lambda: graph.get_parameter(NODE, "record").bool_value == recording, "the parameter `record`", 30.0
    )


def change(graph, *transitions):
    for transition in transitions:
        request = Transition(id=transition)
        assert graph.call(ChangeState, f"{NODE}/change_state", transition=request).success


def recording_wanted(graph):
    return graph.get_parameter(NODE, "record").bool_value


@pytest.mark.parametrize("asked_by", ["service", "parameter", "both"])
def test_only_what_the_parameter_has_asked_for_is_recorded_after_another_activation(
    graph, publisher, tmp_path, asked_by
):
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    default = tmp_path / "default"
    graph.set_parameters(NODE, Parameter("recording_folder", value=str(default)))
    if asked_by in ("service", "both"):
        assert graph.call(StartRecording, START, directory=str(tmp_path / "named")).success
    if asked_by in ("parameter", "both"):
        record(graph, default)
    wait_for(graph, heard, DiagnosticStatus.OK, "recording to")
    change(graph, Transition.TRANSITION_DEACTIVATE)
    kept = asked_by != "service"
    assert recording_wanted(graph) == kept
    before = set(default.glob("*"))
    change(graph, Transition.TRANSITION_ACTIVATE)
    wait_for(graph, heard, DiagnosticStatus.OK, "recording to" if kept else "not recording")
    assert len(set(default.glob("*")) - before) == kept


def test_what_the_parameter_asks_for_while_the_node_is_inactive_outlives_a_cleanup(
    graph, publisher, tmp_path
):
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    assert graph.call(StartRecording, START, directory=str(tmp_path / "named")).success
    change(graph, Transition.TRANSITION_DEACTIVATE)
    record(graph, tmp_path / "default")
    change(graph, Transition.TRANSITION_CLEANUP, Transition.TRANSITION_CONFIGURE)
    assert recording_wanted(graph)
    change(graph, Transition.TRANSITION_ACTIVATE)
    wait_for(graph, heard, DiagnosticStatus.OK, f"recording to {tmp_path / 'default'}")


def test_a_deactivation_while_a_bag_is_being_closed_leaves_nothing_to_record(
    graph, disk, publisher, tmp_path
):
    assert graph.call(StartRecording, START, directory=str(tmp_path / "bag")).success
    graph.client(ChangeState, f"{NODE}/change_state")
    graph.client(StopRecording, STOP)
    assert recording_wanted(graph)
    disk.hold()
    answer = graph.send(StopRecording, STOP)
    graph.spin_until(disk.waited_for.is_set, "the disk")
    threading.Timer(0.3, disk.release).start()
    change(graph, Transition.TRANSITION_DEACTIVATE)
    graph.result(answer)
    assert not recording_wanted(graph)
    assert describe_bag(tmp_path / "bag").is_whole


def test_a_bag_that_can_not_be_begun_is_told_and_not_claimed(graph, publisher, tmp_path):
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    for place in ("/dev/null/bags", "~nobody_of_that_name/bags", "/tmp/" + 300 * "n"):
        record(graph, place)
        wait_for(graph, heard, DiagnosticStatus.ERROR, f"not recording: Cannot write {place[:40]}")
    refused = graph.call(StartRecording, START, directory="/tmp/" + 100_000 * "n")
    assert "Cannot write /tmp/nnn" in refused.message
    assert len(refused.message) < 300
    record(graph, tmp_path)
    wait_for(graph, heard, DiagnosticStatus.OK, f"recording to {tmp_path}")
    assert graph.call(StopRecording, STOP).success
    wait_for(graph, heard, DiagnosticStatus.OK, "not recording")
    record(graph, place)
    wait_for(graph, heard, DiagnosticStatus.ERROR, "not recording: Cannot write")
    graph.set_parameters(NODE, Parameter("record", value=False))
    wait_for(graph, heard, DiagnosticStatus.OK, "not recording")


def test_after_a_full_disk_another_folder_is_recorded_to(graph, publisher, tmp_path, monkeypatch):
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    told = graph.subscribe(Log, "/rosout")
    disk = FullDisk(monkeypatch)
    record(graph, tmp_path / "full")
    wait_for(graph, heard, DiagnosticStatus.OK, "recording to")
    disk.full = True
    wait_for(graph, heard, DiagnosticStatus.ERROR, "recording has ended: Cannot write")
    disk.full = False
    graph.spin_until(lambda: any(one.level == ERROR for one in told), "the log", 30.0)
    (error,) = [one for one in told if one.level == ERROR]
    assert (error.name, "No space left on device; free space" in error.msg) == (NODE, True)
    record(graph, tmp_path / "other")
    wait_for(graph, heard, DiagnosticStatus.OK, f"recording to {tmp_path / 'other'}")
    assert graph.call(StopRecording, STOP).success
    (bag,) = (tmp_path / "other").iterdir()
    assert describe_bag(bag).is_whole


def test_nothing_is_recorded_before_simulated_time_begins_and_nothing_latched_is_missed(
    graph, publisher, tmp_path
):
    """Without a clock all times are 0: a bag from 1970 to now would play for decades."""
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    graph.node.create_publisher(Float64, "latched", latched).publish(Float64(data=7.0))
    parameters = {"use_sim_time": True, "recording_topics": ["latched", "/diagnostics"]}
    graph.set_parameters(NODE, *(Parameter(name, value=value) for name, value in parameters.items()))
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    speeds = graph.publisher(Float64, f"{NODE}/target_speed", latched)
    assert graph.call(StartRecording, START, directory=str(tmp_path / "bag")).success
    wait_for(graph, heard, DiagnosticStatus.OK, "recording to")
    speeds.publish(Float64(data=-1.0))
    graph.spin_for(SETTLING)
    clock, began = graph.publisher(Clock, "/clock"), 1_700_000_000
    for tick in range(250):
        clock.publish(Clock(clock=Time(sec=began + tick // 100, nanosec=tick % 100 * 10_000_000)))
        graph.spin_for(0.01)
    assert graph.call(StopRecording, STOP).success
    info = describe_bag(tmp_path / "bag")
    assert began <= info.start_time_ns * 1e-9 < began + 3
    assert info.duration_ns < 3e9
    recorded = set(+info.counts)
    assert {f"/{NODE}/state", f"/{NODE}/joint_reference", "/latched", "/diagnostics"} <= recorded
    with AnyReader([tmp_path / "bag"]) as reader:
        stamps = [
            reader.deserialize(data, one.msgtype).stamp.sec
            for one, _, data in reader.messages()
            if one.topic == f"/{NODE}/state"
        ]
    assert min(stamps) >= began


def test_commands_are_recorded_as_the_node_got_them_refused_ones_too(graph, publisher, tmp_path):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    speeds = graph.publisher(Float64, f"{NODE}/target_speed", latched)
    velocities = graph.publisher(Twist, f"{NODE}/cmd_vel")
    graph.spin_for(SETTLING)
    speeds.publish(Float64(data=0.0))  # Before the bag.
    graph.spin_for(SETTLING)
    for bag, sent in (("first", [99.0]), ("second", [-3.0, 0.0])):
        assert graph.call(StartRecording, START, directory=str(tmp_path / bag)).success
        for speed in sent:
            speeds.publish(Float64(data=speed))
            velocities.publish(Twist(linear=Vector3(x=speed)))
            graph.spin_for(SETTLING)
        assert graph.call(StopRecording, STOP).success
        with AnyReader([tmp_path / bag]) as reader:
            read = [(one.topic, reader.deserialize(data, one.msgtype)) for one, _, data in reader.messages()]
            profiles = {one.topic: one.ext.offered_qos_profiles[0] for one in reader.connections}
        assert [one.data for topic, one in read if topic == f"/{NODE}/target_speed"] == sent
        assert [one.linear.x for topic, one in read if topic == f"/{NODE}/cmd_vel"] == sent
        assert profiles[f"/{NODE}/target_speed"].durability is QosDurability.TRANSIENT_LOCAL
        assert profiles[f"/{NODE}/cmd_vel"].durability is QosDurability.VOLATILE
