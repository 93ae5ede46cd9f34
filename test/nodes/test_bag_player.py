"""`walk-optimizer bag play`: a process of its own plays a bag to a subscriber."""

import math
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip("rclpy")

from rclpy.qos import QoSProfile
from recording.samples import GAIT, JOINTS, PERIOD_NS, START_NS, number_of, string, topic
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.nodes.bag_player import play_bag, qos_of
from walk_optimizer.nodes.qos import LATCHED, STREAM
from walk_optimizer.recording import BagWriter, QosProfile, RecorderSettings, describe_bag
from walk_optimizer.recording.ros_messages import qos_profile

pytestmark = pytest.mark.ros

COUNT, RATE = 200, 0.5
SLOW_READER = QoSProfile(depth=1000)


@pytest.fixture
def bag(tmp_path):
    from recording.samples import joint_state

    with BagWriter(tmp_path / "walk", RecorderSettings(min_free_bytes=0), topics=[JOINTS, GAIT]) as writer:
        writer.write(GAIT.name, string("a gait"), START_NS)
        for number in range(COUNT):
            writer.write(JOINTS.name, joint_state(number), START_NS + number * PERIOD_NS)
    return tmp_path / "walk"


def play(bag, *arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "walk_optimizer.cli.main", "bag", "play", str(bag), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def test_a_bag_is_played_as_it_was_recorded_and_never_faster(graph, bag):
    raw, times = [], []
    graph.node.create_subscription(
        JointState,
        JOINTS.name,
        lambda data: (raw.append(data), times.append(time.monotonic())),
        SLOW_READER,
        raw=True,
    )
    latched = graph.subscribe(String, GAIT.name, LATCHED)
    # On a busy machine discovery takes long.
    player = play(bag, "--rate", str(RATE), "--delay", "4")
    graph.spin_until(lambda: player.poll() is not None, "the player")
    output = player.communicate()[0]
    graph.spin_for(0.3)
    assert player.returncode == 0, output
    assert f"played {COUNT + 1} messages on 2 topics" in output
    assert [number_of(data) for data in raw] == list(range(COUNT))
    assert [message.data for message in latched] == ["a gait"]
    # The last one was due at the end of the recording's time, however long a message takes.
    assert times[-1] - times[0] > (COUNT - 1) * PERIOD_NS * 1e-9 / RATE - 0.1
    assert np.median(np.diff(times)) > 0.5 * PERIOD_NS * 1e-9 / RATE


def test_a_gap_of_decades_is_told_and_can_be_broken_off(graph, tmp_path):
    with BagWriter(tmp_path / "bag", RecorderSettings(min_free_bytes=0), topics=[GAIT]) as writer:
        for time_ns in (0, START_NS):
            writer.write(GAIT.name, string("a gait"), time_ns)
    player = play(tmp_path / "bag", "--rate", "0.01")
    line = player.stdout.readline()
    assert "waiting 170000000000 s (1967593 days) for the next message; Ctrl-C ends it" in line
    assert player.poll() is None
    player.send_signal(signal.SIGINT)
    assert (player.wait(60), "interrupted" in player.communicate()[0]) == (130, True)


def test_what_cannot_be_played_is_refused_before_any_work(bag, monkeypatch):
    monkeypatch.setattr("walk_optimizer.nodes.bag_player._player", lambda: pytest.fail("it took part"))
    info = describe_bag(bag)
    for arguments in (
        {"rate": 0.0},
        {"rate": math.nan},
        {"delay": -1.0},
        {"topics": ["/nothing"]},
        {"remaps": [f"{JOINTS.name}:={GAIT.name}"]},
    ):
        with pytest.raises(InvalidRequestError):
            play_bag(bag, info, **{"delay": 0.0, "tell": print} | arguments)


def test_topics_are_picked_and_wrong_ones_refused(graph, bag):
    player = play(bag, "--topics", "/nothing")
    assert player.wait(60) == 2
    assert "the bag has no topic /nothing; it has" in player.communicate()[0]
    player = play(bag, "--delay", "0.1", "--topics", GAIT.name)
    assert "played 1 messages on 1 topics" in player.communicate(timeout=60)[0]


def test_a_topic_that_another_node_publishes_is_refused_unless_it_gets_another_name(graph, bag):
    graph.node.create_publisher(JointState, JOINTS.name, 1)
    player = play(bag, "--topics", JOINTS.name)
    graph.spin_until(lambda: player.poll() is not None, "the refusal")
    output = player.communicate()[0]
    assert player.returncode == 2
    assert f"published by others already: {JOINTS.name} by /test_client. Stop" in output
    assert "Traceback" not in output
    elsewhere = graph.subscribe(JointState, "/recorded/joints")
    player = play(bag, "--remap", f"{JOINTS.name}:=/recorded/joints", "--delay", "5")
    graph.spin_until(lambda: player.poll() is not None, "the player")
    assert player.returncode == 0, player.communicate()[0]
    assert len(elsewhere) == COUNT
    for remap, words in (
        ("/joints", "is no remap: give FROM:=TO"),
        ("/joints:=/other", "'/joints' is not played; played are"),
        (f"{JOINTS.name}:=no name", "'no name' is no name of a topic"),
    ):
        player = play(bag, "--remap", remap)
        assert player.wait(60) == 2
        assert words in player.communicate()[0]


def test_diagnostics_beside_those_of_others_are_played_if_asked_for(graph, tmp_path):
    diagnostics = topic("/diagnostics", "std_msgs/msg/String")
    with BagWriter(tmp_path / "bag", RecorderSettings(min_free_bytes=0), topics=[diagnostics]) as writer:
        writer.write(diagnostics.name, string("well"), START_NS)
    graph.node.create_publisher(String, diagnostics.name, 1)
    outcomes = []
    for arguments in ((), ("--topics", diagnostics.name)):
        player = play(tmp_path / "bag", *arguments)
        graph.spin_until(lambda player=player: player.poll() is not None, "the player")
        outcomes.append(player.returncode)
    assert outcomes == [2, 0]


@pytest.mark.parametrize(
    ("variable", "value"), [("ROS_DOMAIN_ID", "abc"), ("ROS_SECURITY_KEYSTORE", "/nowhere")]
)
def test_an_environment_that_ros_refuses_gives_one_line(graph, bag, monkeypatch, variable, value):
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true" if "SECURITY" in variable else "false")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv(variable, value)
    player = play(bag)
    assert player.wait(60) == 2
    output = player.communicate()[0]
    assert "walk-optimizer: can't start: " in output
    assert "see ROS_DOMAIN_ID and the variables ROS_SECURITY_*" in output
    assert "Traceback" not in output


@pytest.mark.parametrize(
    ("told", "offered"),
    [
        ({"reliability": "unknown"}, {}),
        ({"reliability": "sometimes", "durability": "unknown"}, {}),
        (
            {"liveliness": "manual_by_node", "durability": "transient_local"},
            {"durability": "transient_local"},
        ),
        ({"liveliness": "unknown", "reliability": "best_effort"}, {"reliability": "best_effort"}),
        ({"depth": -5}, {}),
        ({"depth": 10**12, "deadline_ns": -5}, {}),
        ({"depth": 100_000}, {"depth": 100_000}),
    ],
)
def test_what_ros_cannot_offer_becomes_the_default(graph, told, offered):
    recorded = topic("/told", "std_msgs/msg/String", QosProfile(**told))
    assert qos_profile(qos_of(recorded)) == QosProfile(**offered)
    graph.node.destroy_publisher(graph.node.create_publisher(String, "/told", qos_of(recorded)))


def test_the_recorded_quality_of_service_is_offered_again():
    for qos in (STREAM, LATCHED):
        recorded = topic("/t", "std_msgs/msg/String", qos_profile(qos))
        assert qos_profile(qos_of(recorded)) == qos_profile(qos)
    discovered = QosProfile(history="unknown", depth=0, reliability="best_effort")
    assert qos_profile(qos_of(topic("/t", "std_msgs/msg/String", discovered))) == QosProfile(
        depth=10, reliability="best_effort"
    )
