"""Faults of commands, parameters, clocks, disks and processes that the publisher has to survive."""

import math
import os
import resource
import signal

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nodes.conftest import FAST, SLOW, stock
from nodes.graph import assert_left_cleanly, exists, workers_of
from nodes.walking import BLENDED, MODE, NODE, Walker, assert_continuous, stamp_ns
from rcl_interfaces.srv import DescribeParameters
from rclpy.parameter import Parameter
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from walk_optimizer_interfaces.srv import SetGait, StartRecording, StopRecording

from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.nodes.publisher_settings import SETTINGS
from walk_optimizer.recording import describe_bag, repair_bag
from walk_optimizer.recording.records import DamageKind
from walk_optimizer.request import gait_table_settings

pytestmark = pytest.mark.ros

OWN = "own"
LIMITS = gait_table_settings()
many = settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], database=None
)
impossible_speeds = st.floats(width=64).filter(
    lambda speed: not (speed == 0 or LIMITS.minimum_speed <= speed <= LIMITS.maximum_speed)
)


@pytest.fixture(scope="module")
def process(start_for_module, other_walker, tmp_path_factory):
    start_for_module("gait_library", **stock(tmp_path_factory.mktemp("stock"), other_walker))
    return start_for_module(NODE, walker_file=other_walker, **BLENDED)


@pytest.fixture
def walker(graph, process):
    walker = Walker(graph)
    graph.spin_until(lambda: walker.states, "the state")
    if walker.states[-1].state != "walking":
        walker.walk(SLOW)
    return walker


def go_on(walker):
    """Wait for references of a walk that nothing has disturbed."""
    joints = walker.listen(JointState, "joint_reference")
    walker.graph.spin_until(lambda: len(joints) > 20, "the walk going on")
    assert_continuous(joints)
    assert (walker.states[-1].state, walker.states[-1].speed) == ("walking", pytest.approx(SLOW))


def test_impossible_requests_are_refused_and_the_walk_goes_on(graph, walker, process):
    """Faults 1 to 4: NaN, infinite, negative, zero and too large speeds; unknown spring modes."""

    @many
    @given(impossible_speeds | st.just(0.0), st.sampled_from([*SpringMode, "rubber", ""]))
    def ask(speed, mode):
        answer = walker.set_gait(speed, mode)
        assert not answer.success
        assert "allowed " in answer.message

    ask()
    speeds = walker.talk(Float64, "target_speed")

    @many
    @given(impossible_speeds)
    def send(speed):
        speeds.publish(Float64(data=speed))

    send()
    go_on(walker)
    assert process.exit_code is None


def unfit_values(setting):
    """Values of the right type that a setting does not take, and one of a wrong type."""
    yield "text" if not isinstance(setting.default, str) else 7
    if isinstance(setting.default, float):
        yield math.nan
    if setting.choices is not None:
        yield "rubber" if isinstance(setting.default, str) else [*setting.default[1:], "rubber"]
    if setting.name == "frame_id":
        yield from ("", "/base_link", "base link")
    if setting.low is not None and setting.high is not None:
        kind = type(setting.default)
        yield kind(min(setting.high * 2 + 1, 2**63 - 1) if kind is int else setting.high * 2 + 1)
        yield kind(setting.low - 1)


def test_parameters_out_of_range_or_of_a_wrong_type_are_refused_by_name(graph, walker):
    """Fault 5, for every parameter."""
    for setting in SETTINGS:
        before = graph.get_parameter(NODE, setting.name)
        for value in unfit_values(setting):
            (answer,) = graph.set_parameters(NODE, Parameter(setting.name, value=value))
            assert not answer.successful, (setting.name, value)
            assert any(text in answer.reason for text in (setting.name, "read-only", "Wrong parameter type"))
        assert graph.get_parameter(NODE, setting.name) == before
    (answer,) = graph.set_parameters(NODE, Parameter("frame_id", value=""))
    assert answer.reason == (
        "frame_id: '' is no frame: give a name without spaces or a leading slash, such as odom"
    )
    topics = Parameter("recording_topics", value=["/diagnostics", "no name"])
    (answer,) = graph.set_parameters(NODE, topics)
    assert (answer.successful, "'no name' is no name of a topic" in answer.reason) == (False, True)
    go_on(walker)


def test_parameters_of_choices_tell_them(graph, walker):
    """As `ros2 param describe` asks."""
    settings = [setting for setting in SETTINGS if setting.choices is not None]
    assert {"spring_mode", "selection", "transitions", "joint_names"} <= {one.name for one in settings}
    answer = graph.call(
        DescribeParameters, f"{NODE}/describe_parameters", names=[one.name for one in settings]
    )
    for setting, descriptor in zip(settings, answer.descriptors, strict=True):
        names = ", ".join(setting.choices)
        lists = isinstance(setting.default, list)
        assert descriptor.additional_constraints == (f"each of {names} once" if lists else f"one of {names}")


def test_too_little_free_space_refuses_a_recording_and_nothing_else(graph, walker, tmp_path):
    """Fault 17: the limit of free space."""
    more_than_any_disk = 1 << 60
    graph.set_parameters(NODE, Parameter("recording_free_bytes", value=more_than_any_disk))
    refused = graph.call(StartRecording, f"{NODE}/start_recording", directory=str(tmp_path / "refused"))
    assert not refused.success
    assert "must stay free" in refused.message
    assert not (tmp_path / "refused").exists()
    go_on(walker)


@pytest.fixture
def own(graph, start, stocked):
    """A publisher that a test may kill, with its library, apart from the lasting one."""
    start("gait_library", namespace=OWN, **stocked)
    walker = Walker(graph, OWN)
    walker.process = start(NODE, namespace=OWN, walker_file=stocked["walker_file"], **BLENDED)
    walker.walk(FAST)
    return walker


def record(walker, directory, seconds=1.5):
    """Record for some time and return what a subscriber received meanwhile."""
    joints = walker.listen(JointState, "joint_reference")
    answer = walker.graph.call(StartRecording, walker.topic("start_recording"), directory=str(directory))
    assert answer.success, answer.message
    walker.graph.spin_for(seconds)
    return joints


def recorded_stamps(directory, topic):
    with AnyReader([directory]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == topic]
        return [
            stamp_ns(reader.deserialize(data, connection.msgtype))
            for connection, _, data in reader.messages(connections)
        ]


def test_a_publisher_killed_while_it_records_loses_at_most_a_second(graph, own, tmp_path):
    """Fault 16, SIGKILL: what is older than the flush period is in the repaired bag, without a gap."""
    joints = record(own, tmp_path / "bag", 3.0)
    own.process.process.send_signal(signal.SIGKILL)
    own.process.process.wait()
    graph.spin_for(0.3)
    info = describe_bag(tmp_path / "bag")
    assert info.is_cut_off
    report = repair_bag(tmp_path / "bag")
    stamps = recorded_stamps(report.destination, f"/{OWN}/{NODE}/joint_reference")
    received = [stamp_ns(message) for message in joints]
    assert received[-1] - stamps[-1] < 2.5e9  # The period is 1 s; a busy machine may be late with it.
    expected = [stamp for stamp in received if stamps[0] <= stamp <= stamps[-1]]
    assert expected == stamps


def test_a_restarted_publisher_begins_with_a_stand(graph, own, start, stocked):
    """A publisher that was killed in mid-walk comes back, and its library serves it again."""
    own.process.process.send_signal(signal.SIGKILL)
    own.process.process.wait()
    own.states.clear()
    start(NODE, namespace=OWN, walker_file=stocked["walker_file"], **BLENDED)
    own.wait_for("standing")
    own.walk(SLOW)
    answer = graph.call(StopRecording, own.topic("stop_recording"))
    assert (answer.success, answer.message) == (False, "nothing is being recorded")


def test_the_stream_goes_on_when_the_disk_is_full(graph, own, tmp_path):
    """Fault 17: the operating system lets the publisher write no more into a file than some bytes."""
    largest = 200_000
    resource.prlimit(own.process.process.pid, resource.RLIMIT_FSIZE, (largest, largest))
    diagnostics = graph.subscribe(DiagnosticArray, "/diagnostics")
    graph.set_parameters(own.node, Parameter("recording_free_bytes", value=0), Parameter("rate", value=500.0))
    joints = record(own, tmp_path / "bag", 0.0)

    def told():
        found = [
            status
            for array in diagnostics
            for status in array.status
            if status.name == f"{own.node}: recording"
        ]
        return any(status.level == b"\x02" and "Cannot write" in status.message for status in found)

    graph.spin_until(told, "the diagnostics")
    mark = len(joints)
    graph.spin_until(lambda: len(joints) > mark + 100, "the stream going on")
    assert_continuous(joints)
    info = describe_bag(tmp_path / "bag")
    # There may be no space for the index; every message that was stored is there.
    assert {damage.kind for file in info.files for damage in file.damage} <= {DamageKind.INDEX}
    assert info.message_count > 100


@pytest.fixture
def solving(graph, start, stocked, other_walker, tmp_path):
    """A publisher that may solve for steps, and a gait that no steps lead to: a solve that lasts."""
    start("gait_library", namespace=OWN, **stocked)
    walker = Walker(graph, OWN)
    walker.process = start(NODE, namespace=OWN, walker_file=other_walker, cache_folder=tmp_path)
    walker.wait_for("standing")

    def begin():
        """Ask for the gait, and return the future answer and the worker once that is at work."""
        future = graph.send(SetGait, walker.topic("set_gait"), speed=FAST, spring_mode=MODE)
        graph.spin_until(lambda: workers(walker) or future.done(), "the worker")
        assert not future.done(), future.result().message
        return future, workers(walker)[0]

    walker.begin_solve = begin
    return walker


def workers(walker):
    return workers_of(walker.process.process.pid)


def test_a_solve_for_steps_may_lose_its_process_be_overtaken_and_end_with_the_node(graph, solving):
    future, worker = solving.begin_solve()
    os.kill(worker, signal.SIGKILL)
    answer = graph.result(future)
    assert (answer.success, "the worker process ended" in answer.message) == (False, True)
    future, worker = solving.begin_solve()
    solving.trigger("stop")
    answer = graph.result(future)
    assert (answer.success, answer.message) == (False, "superseded by a newer command")
    joints = solving.listen(JointState, "joint_reference")
    _, worker = solving.begin_solve()
    mark = len(joints)
    graph.spin_until(lambda: len(joints) > mark + 50, "the stand being streamed")
    assert_left_cleanly(solving.process, solving.process.stop(signal.SIGTERM))
    assert not exists(worker)
