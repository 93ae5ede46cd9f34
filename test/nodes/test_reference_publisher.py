import itertools
import math
import signal
from functools import partial

import numpy as np
import pytest

pytest.importorskip("rclpy")

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped, Twist, Vector3
from nodes.conftest import FAST, HIP_MASS, SLOW
from nodes.graph import SETTLING, assert_left_cleanly
from rclpy.parameter import Parameter
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from rosbags.typesys import Stores, get_typestore
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger
from walk_optimizer_interfaces.msg import Gait, WalkState
from walk_optimizer_interfaces.srv import GetJointTrajectory, SetGait, StartRecording, StopRecording

from walk_optimizer.cli.processes import NodeProcess
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.nodes.streamed_gait import ReceivedGait
from walk_optimizer.recording import describe_bag
from walk_optimizer.references import JOINTS
from walk_optimizer.references.check import CycleMatcher
from walk_optimizer.request import GaitRequest

pytestmark = pytest.mark.ros

MODE = "stiffness_and_equilibrium"
NODE = "reference_publisher"
# A test machine may stall for long; the phase shall then go on with the clock. Nobody can solve for steps
# between gaits that are made up.
PATIENT = {"longest_gap": 10.0, "rate": 100.0, "transitions": "blended"}


@pytest.fixture
def publisher(start, stocked):
    start("gait_library", **stocked)
    return start("reference_publisher", walker_file=stocked["walker_file"], **PATIENT)


def walk(graph, speed=SLOW):
    """Have a gait walked, and wait until the steps that lead to it are over."""
    states = graph.subscribe(WalkState, f"{NODE}/state", LATCHED)
    answer = graph.call(SetGait, f"{NODE}/set_gait", speed=speed, spring_mode=MODE)
    assert answer.success, answer.message
    assert ("(radau)" if speed == FAST else "(implicit_euler)") in answer.message
    wait_for_state(graph, states, "walking", speed)


def wait_for_state(graph, states, name, speed=0.0):
    def there():
        return states and states[-1].state == name and abs(states[-1].speed - speed) < 1e-6

    graph.spin_until(there, f"{name} at {speed} m/s")


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def matcher_of(gait):
    return CycleMatcher(ReceivedGait.from_message(gait, WalkerParameters(hip_mass=HIP_MASS)).profile)


def match(matcher, message):
    values = (np.array(getattr(message, name)) for name in ("position", "velocity", "effort"))
    return matcher.match(*values)


def assert_is_gait(matcher, message):
    found = match(matcher, message)
    assert max(found.position, found.velocity, found.effort) < 1e-6
    return found.time


def test_the_stream_is_the_gait_and_velocity_its_derivative_across_the_exchange(graph, publisher):
    gaits = graph.subscribe(Gait, f"{NODE}/gait", LATCHED)
    walk(graph)
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    # More than a cycle, so both exchanges of the legs are among them.
    graph.spin_until(lambda: joints and stamp_ns(joints[-1]) - stamp_ns(joints[0]) > 2.5e9, "a cycle")
    matcher = matcher_of(gaits[0])
    times = [assert_is_gait(matcher, message) for message in joints]
    assert all(list(message.name) == list(JOINTS) for message in joints)
    for (before, t0), (after, t1) in itertools.pairwise(zip(joints, times, strict=True)):
        elapsed = (stamp_ns(after) - stamp_ns(before)) * 1e-9
        assert elapsed > 0
        # The gait moves on with the stamps, so what the gait's own derivative is, the stream's is.
        difference = (t1 - t0 - elapsed) % matcher.period
        assert min(difference, matcher.period - difference) < 1e-6
        limit = np.abs([before.velocity, after.velocity]).max() + 20.0
        assert np.abs(np.subtract(after.position, before.position)).max() <= limit * elapsed


def test_torques_are_those_of_the_joints_in_the_order_that_the_label_tells(graph, publisher):
    torques = graph.subscribe(Float64MultiArray, f"{NODE}/feedforward_torques")
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    walk(graph)
    graph.spin_until(lambda: len(torques) > 20, "torques")
    dimension = torques[0].layout.dim[0]
    assert (dimension.label, dimension.size, dimension.stride) == ("u1,u2,u3", 3, 3)
    streamed = {tuple(np.array(joint.effort)[[0, 1, 3]]) for joint in joints}
    assert sum(tuple(torque.data) in streamed for torque in torques) >= len(torques) - 2
    assert all(joint.effort[0] == -joint.effort[2] for joint in joints)
    (answer,) = graph.set_parameters(NODE, Parameter("torque_order", value=["u3", "u1", "u2"]))
    assert answer.successful
    torques.clear()
    graph.spin_until(lambda: torques and torques[-1].layout.dim[0].label == "u3,u1,u2", "another order")


def test_another_gait_begins_at_a_step_without_a_jump(graph, publisher):
    gaits = graph.subscribe(Gait, f"{NODE}/gait", LATCHED)
    walk(graph)
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    graph.spin_until(lambda: len(joints) > 10, "references")
    walk(graph, FAST)
    graph.spin_until(lambda: len(gaits) == 2, "the other gait")
    mark = len(joints)
    step = gaits[1].step_time
    graph.spin_until(lambda: stamp_ns(joints[-1]) - stamp_ns(joints[mark - 1]) > 2 * step * 1e9, "two steps")
    assert_is_gait(matcher_of(gaits[0]), joints[0])
    assert_is_gait(matcher_of(gaits[1]), joints[-1])
    for before, after in itertools.pairwise(joints):
        elapsed = (stamp_ns(after) - stamp_ns(before)) * 1e-9
        fastest = np.abs([before.velocity, after.velocity]).max() + 20.0
        assert np.abs(np.subtract(after.position, before.position)).max() <= fastest * elapsed


def test_bad_target_speeds_are_logged_and_the_walk_goes_on(graph, publisher):
    gaits = graph.subscribe(Gait, f"{NODE}/gait", LATCHED)
    walk(graph)
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    target = graph.publisher(Float64, f"{NODE}/target_speed")
    graph.spin_for(SETTLING)
    for speed in (math.nan, math.inf, -math.inf, -0.5, 99.0):
        joints.clear()
        target.publish(Float64(data=speed))
        graph.spin_until(lambda: len(joints) > 5, "the walk going on")
    graph.spin_until(lambda: "target speed refused: speed is nan m/s" in publisher.output(), "the log")
    assert len(gaits) == 1
    assert_is_gait(matcher_of(gaits[0]), joints[-1])
    target.publish(Float64(data=FAST))
    graph.spin_until(lambda: len(gaits) == 2, "the new speed")
    assert gaits[1].speed == pytest.approx(FAST)
    assert publisher.exit_code is None


def test_refusals_say_what_the_core_says(graph, publisher):
    early = graph.call(GetJointTrajectory, f"{NODE}/joint_trajectory")
    assert (early.success, early.message) == (False, "no gait is walked now; call ~/set_gait first")
    with pytest.raises(InvalidRequestError) as refusal:
        GaitRequest.for_speed(-1.0, MODE)
    answer = graph.call(SetGait, f"{NODE}/set_gait", speed=-1.0, spring_mode=MODE)
    assert (answer.success, answer.message) == (False, str(refusal.value))
    answer = graph.call(SetGait, f"{NODE}/set_gait", speed=SLOW, spring_mode="none")
    assert (answer.success, "gait_optimizer/optimize_gait is not there" in answer.message) == (False, True)
    answer = graph.call(StopRecording, f"{NODE}/stop_recording")
    assert (answer.success, answer.message) == (False, "nothing is being recorded")
    walk(graph)
    for rate in (-5.0, 1001.0):
        answer = graph.call(GetJointTrajectory, f"{NODE}/joint_trajectory", rate=rate)
        assert (answer.success, answer.message) == (False, f"rate is {rate:g} Hz, allowed is 1 to 1000 Hz")


def test_cycles_are_made_while_others_are_answered(graph, publisher):
    walk(graph, FAST)
    graph.client(Trigger, f"{NODE}/emergency_stop")
    several = [graph.send(GetJointTrajectory, f"{NODE}/joint_trajectory", rate=1000.0) for _ in range(8)]
    calls = 6
    for _ in range(calls):
        assert graph.call(Trigger, f"{NODE}/emergency_stop").success
    # Otherwise each call would have waited for a cycle at least.
    assert sum(answer.done() for answer in several) < calls - 2
    answers = [graph.result(answer) for answer in several]
    assert all(len(answer.trajectory.points) > 1000 for answer in answers)


def test_the_cycle_is_what_a_trajectory_controller_takes(graph, publisher):
    gaits = graph.subscribe(Gait, f"{NODE}/gait", LATCHED)
    walk(graph)
    graph.spin_until(lambda: gaits, "the gait")
    trajectory = graph.call(GetJointTrajectory, f"{NODE}/joint_trajectory", rate=50.0).trajectory
    assert list(trajectory.joint_names) == list(JOINTS)
    assert (trajectory.header.stamp.sec, trajectory.header.stamp.nanosec) == (0, 0)
    times = [point.time_from_start.sec + point.time_from_start.nanosec * 1e-9 for point in trajectory.points]
    assert np.all(np.diff(times) > 0)
    assert times[-1] == pytest.approx(2 * gaits[0].step_time)
    assert list(trajectory.points[-1].velocities) == [0.0] * 4
    np.testing.assert_allclose(trajectory.points[0].positions, trajectory.points[-1].positions, atol=1e-9)
    matcher = matcher_of(gaits[0])
    for point in trajectory.points[1:-1]:
        values = (np.array(values) for values in (point.positions, point.velocities, point.effort))
        found = matcher.match(*values)
        assert max(found.position, found.velocity, found.effort) < 1e-6


def read_bag(directory):
    """Return the messages of each topic with an independent reader."""
    messages = {}
    with AnyReader([directory], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            messages.setdefault(connection.topic, []).append(message)
    return messages


def values(message):
    return [list(getattr(message, name)) for name in ("name", "position", "velocity", "effort")]


def test_the_bag_holds_what_the_other_nodes_publish(graph, publisher, start, tmp_path):
    """Those of the default `recording_topics`, each with what it says and its quality of service."""
    messages = pytest.importorskip("tf2_msgs.msg")
    start("walker_visualizer")
    fixed = graph.node.create_publisher(messages.TFMessage, "/tf_static", LATCHED)
    fixed.publish(messages.TFMessage(transforms=[TransformStamped(child_frame_id="camera")]))
    assert graph.call(StartRecording, f"{NODE}/start_recording", directory=str(tmp_path / "bag")).success
    latched = {"/robot_description", "/tf_static", "/gait_library/table"}
    others = latched | {"/tf", "/walker_visualizer/markers", "/diagnostics"}
    # What is flushed can be read while the bag is being recorded.
    graph.spin_until(lambda: others <= describe_bag(tmp_path / "bag").counts.keys(), f"all of {others}")
    assert graph.call(StopRecording, f"{NODE}/stop_recording").success
    bag = read_bag(tmp_path / "bag")
    (description,) = bag["/robot_description"]
    assert "<robot" in description.data
    assert "base_link" in {one.child_frame_id for message in bag["/tf"] for one in message.transforms}
    assert [one.child_frame_id for message in bag["/tf_static"] for one in message.transforms] == ["camera"]
    assert any(message.markers for message in bag["/walker_visualizer/markers"])
    (table, *_) = bag["/gait_library/table"]
    assert len(table.gaits) == 2
    with AnyReader([tmp_path / "bag"]) as reader:
        offered = {one.topic: one.ext.offered_qos_profiles[0].durability for one in reader.connections}
    kept = {name for name in others if offered[name] is QosDurability.TRANSIENT_LOCAL}
    assert kept == latched


def test_the_bag_holds_what_was_streamed(graph, publisher, tmp_path):
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    torques = graph.subscribe(Float64MultiArray, f"{NODE}/feedforward_torques")
    walk(graph, FAST)
    started = graph.call(StartRecording, f"{NODE}/start_recording", directory=str(tmp_path / "bag"))
    assert (started.success, started.directory) == (True, str(tmp_path / "bag"))
    again = graph.call(StartRecording, f"{NODE}/start_recording")
    assert (again.success, "already recording" in again.message) == (False, True)
    assert graph.get_parameter(NODE, "record").bool_value
    begin = len(joints)
    graph.spin_until(lambda: len(joints) > begin + 200, "references")
    stopped = graph.call(StopRecording, f"{NODE}/stop_recording")
    assert stopped.success, stopped.message
    graph.spin_for(0.2)

    bag = read_bag(tmp_path / "bag")
    own = {"joint_reference", "feedforward_torques", "commands", "gait", "knee_spring", "state"}
    assert set(bag) == {f"/{NODE}/{name}" for name in own} | {"/gait_library/table", "/diagnostics"}
    recorded = bag[f"/{NODE}/joint_reference"]
    assert sum(map(len, bag.values())) == stopped.messages
    (gait,) = bag[f"/{NODE}/gait"]
    assert [step.intervals for step in gait.refined] == [5]
    by_stamp = {stamp_ns(message): message for message in recorded}
    first, last = min(by_stamp), max(by_stamp)
    within = [message for message in joints if first <= stamp_ns(message) <= last]
    assert len(within) > 100
    assert len(within) == len(recorded) == len(by_stamp)
    for message in within:
        assert values(message) == values(by_stamp[stamp_ns(message)])
    kept = [list(message.data) for message in bag[f"/{NODE}/feedforward_torques"]]
    streamed = [list(message.data) for message in torques]
    offsets = range(len(streamed) - len(kept) + 1)
    assert any(streamed[offset : offset + len(kept)] == kept for offset in offsets)


def test_what_the_node_records_itself_is_in_the_bag_once_though_it_is_asked_for_again(graph, start, tmp_path):
    named = ["~/target_speed", "/robot/velocity", "reference_publisher/joint_reference", "nobody/there"]
    start(NODE, remaps={"~/cmd_vel": "/robot/velocity"}, recording_topics=named, **PATIENT)
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    speeds, velocities = (
        graph.publisher(kind, name)
        for kind, name in ((Float64, f"{NODE}/target_speed"), (Twist, "/robot/velocity"))
    )
    graph.spin_until(lambda: joints, "references")
    assert graph.call(StartRecording, f"{NODE}/start_recording", directory=str(tmp_path / "bag")).success
    graph.spin_for(2.0)  # Topics are looked for every second.
    for speed in (0.0, 99.0):
        speeds.publish(Float64(data=speed))
        velocities.publish(Twist(linear=Vector3(x=speed)))
        graph.spin_for(SETTLING)
    stopped = graph.call(StopRecording, f"{NODE}/stop_recording")
    assert stopped.message == f"{stopped.messages} messages, 0 dropped; nobody published /nobody/there"
    bag = read_bag(tmp_path / "bag")
    assert [message.data for message in bag[f"/{NODE}/target_speed"]] == [0.0, 99.0]
    assert [message.linear.x for message in bag["/robot/velocity"]] == [0.0, 99.0]
    stamps = [stamp_ns(message) for message in bag[f"/{NODE}/joint_reference"]]
    assert len(stamps) == len(set(stamps)) > 100


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_closes_the_bag_and_leaves_cleanly(graph, publisher, tmp_path, number):
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    walk(graph)
    bag = tmp_path / "bags"
    answers = graph.set_parameters(
        NODE, Parameter("recording_folder", value=str(bag)), Parameter("record", value=True)
    )
    assert all(answer.successful for answer in answers)
    graph.spin_until(lambda: "recording to" in publisher.output(), "the recording")
    joints.clear()
    graph.spin_until(lambda: len(joints) > 50, "references")
    assert_left_cleanly(publisher, publisher.stop(number))
    (directory,) = bag.iterdir()
    assert (directory / "metadata.yaml").is_file()
    # Everything that a subscriber got since the recording began is in the closed bag.
    recorded = {stamp_ns(message) for message in read_bag(directory)[f"/{NODE}/joint_reference"]}
    graph.spin_for(0.2)
    assert all(stamp_ns(message) in recorded for message in joints if stamp_ns(message) >= min(recorded))


def test_parameters_are_validated_and_applied_while_running(graph, publisher):
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    walk(graph)
    for name, value in (
        ("rate", 0.0),
        ("rate", 1e6),
        ("rate", math.nan),
        ("longest_gap", 0.01),  # A period of the rate: the walk would hold at every other reference.
        ("rate", "fast"),
        ("torque_order", ["u1", "u1", "u2"]),
        ("spring_mode", "rubber"),
        ("recording_compression", "zip"),
        ("library_service", "elsewhere"),
    ):
        (answer,) = graph.set_parameters(NODE, Parameter(name, value=value))
        assert not answer.successful, name
        assert any(words in answer.reason for words in (name, "read-only", "Wrong parameter type"))
    assert graph.get_parameter(NODE, "rate").double_value == 100.0
    graph.set_parameters(NODE, Parameter("frame_id", value="hip"), Parameter("rate", value=200.0))
    graph.spin_until(lambda: joints and joints[-1].header.frame_id == "hip", "the new frame")
    graph.set_parameters(NODE, Parameter("streaming", value=False))
    graph.spin_for(0.5)
    joints.clear()
    graph.spin_for(0.5)
    assert not joints
    graph.set_parameters(NODE, Parameter("streaming", value=True))
    graph.spin_until(lambda: joints, "the stream going on")


def test_a_bad_parameter_stops_the_start(start):
    for name, value in (
        ("rate", 5000.0),
        ("initial_speed", 40.0),
        ("spring_mode", "rubber"),
        ("library_service", "no name"),
        ("cache_folder", "/proc/nowhere"),
        ("joint_torque_limits", [0.5]),  # Less than a stand needs.
        ("longest_gap", 0.003),  # Less than two periods.
    ):
        node = start("reference_publisher", **{name: value})
        assert node.process.wait(60) == 1
        assert name in node.output() or str(value) in node.output()
        assert "Traceback" not in node.output()


def test_operators_are_told_why_nothing_is_streamed(graph, start):
    start("reference_publisher", use_sim_time=True)
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")

    def told(words):
        return any(words in one.message for array in heard for one in array.status)

    graph.spin_until(lambda: told("the clock stands still, start what publishes /clock"), "the clock")
    states = graph.subscribe(WalkState, f"{NODE}/state", LATCHED)
    assert graph.call(Trigger, f"{NODE}/emergency_stop").success
    wait_for_state(graph, states, "emergency_stop")
    graph.spin_until(lambda: told("emergency stop, holds its pose without torques"), "the emergency stop")
    clock, steps = graph.publisher(Clock, "/clock"), itertools.count(1)

    def told_while_it_leaps():
        clock.publish(Clock(clock=Time(sec=next(steps))))
        return told("further than `longest_gap` (0.1 s) between two references")

    graph.spin_until(told_while_it_leaps, "a clock that leaps")
    graph.set_parameters(NODE, Parameter("streaming", value=False))
    graph.spin_until(lambda: told("nothing is streamed: the parameter `streaming` is false"), "the parameter")


def test_operators_are_told_that_no_speed_can_be_walked(graph, start, stocked):
    nowhere_known = 0.5
    own = {"initial_speed": nowhere_known, "walker_file": stocked["walker_file"]}
    start(NODE, remaps={"~/cmd_vel": "/robot/velocity"}, **own, **PATIENT)
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")

    def told(check, words):
        found = [one for array in heard for one in array.status if one.name == f"{NODE}: {check}"]
        return bool(found) and words in found[-1].message

    graph.spin_until(lambda: told("library", "the library is not there"), "that the library is missing")
    start("gait_library", **stocked)
    graph.spin_until(lambda: told("library", "the library is there"), "that the library is there")
    refused = "the last speed was refused: initial_speed: "
    graph.spin_until(lambda: told("commands", refused), "the refusal")
    velocity = graph.publisher(Twist, "/robot/velocity")
    send = partial(velocity.publish, Twist(linear=Vector3(x=SLOW)))
    graph.spin_until(lambda: send() or told("walk", "walks at 0.3185 m/s"), "the walk")
    assert told("commands", "no speed is refused")
    graph.spin_until(lambda: told("walk", "no speed on /robot/velocity for 0.5 s, send"), "the silence")


def test_a_misspelt_parameter_is_told(graph, start):
    node = start("reference_publisher", raet=100.0)
    graph.spin_until(
        lambda: "unknown parameter raet is ignored; did you mean rate?" in node.output(), "the warning"
    )
    assert_left_cleanly(node, node.stop())


def test_arguments_that_ros_ignores_are_refused(tmp_path):
    node = NodeProcess("reference_publisher", tmp_path / "log", ["--", "--rate", "500"])
    assert node.process.wait(60) == 1
    assert "can't start: unknown arguments --rate 500; parameters are given as --ros-args" in node.output()


def test_a_simulated_clock_that_jumps_moves_no_reference(graph, start, stocked):
    """Time stands still, runs, is reset, leaps and runs again: the walk holds, or goes on from there."""
    start("gait_library", **stocked)
    own = {"walker_file": stocked["walker_file"], "transitions": "blended"}
    start(NODE, use_sim_time=True, longest_gap=0.2, rate=500.0, **own)
    joints = graph.subscribe(JointState, f"{NODE}/joint_reference")
    gaits = graph.subscribe(Gait, f"{NODE}/gait", LATCHED)
    clock = graph.publisher(Clock, "/clock")

    def run_from(milliseconds):
        """Let the clock run until the stream has told of it, and return the last stamp in [ms]."""
        mark = len(joints)
        for _ in range(2000):
            milliseconds += 20
            seconds, rest = divmod(milliseconds, 1000)
            clock.publish(Clock(clock=Time(sec=seconds, nanosec=rest * 1_000_000)))
            graph.spin_for(0.005)
            if len(joints) >= mark + 30:
                return milliseconds
        raise AssertionError("no references came with the simulated clock")

    states = graph.subscribe(WalkState, f"{NODE}/state", LATCHED)
    clock.publish(Clock(clock=Time(sec=1000)))
    assert graph.call(SetGait, f"{NODE}/set_gait", speed=SLOW, spring_mode=MODE).success
    last = 1_000_000
    while not states or states[-1].state != "walking":
        last = run_from(last)
    joints.clear()
    last = run_from(last)
    graph.spin_for(0.5)
    held = len(joints)
    graph.spin_for(0.5)
    assert len(joints) == held  # Time stands still.
    run_from(2_000)
    run_from(last + 3_600_000)
    stamps = [stamp_ns(message) for message in joints]
    assert min(stamps) < 3e9 < 4e12 < max(stamps)
    times = [assert_is_gait(matcher_of(gaits[0]), message) for message in joints]
    passed = np.diff(times) % (2 * gaits[0].step_time)
    # Never backwards, and never further than the longest gap, which several lost messages may add up.
    assert all(step < 1.0 or step > 2 * gaits[0].step_time - 1e-6 for step in passed)


def test_it_waits_for_a_library_that_comes_late_also_in_a_namespace(graph, start, stocked):
    own = {"initial_speed": SLOW, "walker_file": stocked["walker_file"]}
    start("reference_publisher", namespace="walker_7", **own, **PATIENT)
    graph.client(SetGait, f"walker_7/{NODE}/set_gait")
    joints = graph.subscribe(JointState, f"walker_7/{NODE}/joint_reference")
    start("gait_library", namespace="walker_7", **stocked)
    graph.spin_until(lambda: len(joints) > 3, "the walk")
