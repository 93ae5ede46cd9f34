"""Plays bags through rclpy: the very bytes, on their topics, with the quality of service of the recording."""

import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import TIMEOUT_MAX
from typing import TypeVar

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.signals import SignalHandlerOptions

from walk_optimizer.errors import InvalidRequestError, WalkOptimizerError
from walk_optimizer.nodes.parameters import require_name
from walk_optimizer.recording.info import BagInfo
from walk_optimizer.recording.playback import gap_warning, messages_due, topic_names
from walk_optimizer.recording.ros_messages import message_class
from walk_optimizer.recording.topics import INFINITE_NS, QosProfile, TopicInfo

# Longest wait for what is still under way at the end, in [s].
_LAST_WORDS = 1.0
_LONGEST_DELAY = 3600.0
# Time to find out who else publishes, in [s]: each tells of itself every 3 s. Names come after that.
_DISCOVERY, _NAME_DELAY = 4.0, 1.0
# Topics that every node has, and those that several nodes may share, where somebody asks for that.
_EVERYBODYS, _SHARED = ("/rosout", "/parameter_events"), ("diagnostics", "tf", "tf_static")
# What a topic is given whose recording does not tell its history, and the most that a topic is given.
_DEPTH, _LARGEST_DEPTH = 10, 100_000

_Policy = TypeVar("_Policy", ReliabilityPolicy, DurabilityPolicy, LivelinessPolicy)


class PlayerError(WalkOptimizerError):
    """ROS refuses the player: its environment, its keys, or a topic of the bag."""


class TopicInUseError(WalkOptimizerError):
    """Another node publishes what is to be played: its subscribers would get two streams in one."""


@dataclass(frozen=True)
class Playing:
    """What was played.

    Attributes:
        messages: Number of messages.
        topics: Number of topics.
    """

    messages: int
    topics: int


def play_bag(
    path: Path,
    info: BagInfo,
    delay: float,
    tell: Callable[[str], None],
    topics: Collection[str] | None = None,
    rate: float = 1.0,
    loop: bool = False,
    remaps: Collection[str] = (),
) -> Playing:
    """Play a bag, to its end or until Ctrl-C.

    Args:
        path: The bag.
        info: What is in it.
        delay: Time for subscribers to find the player, in [s]; the player looks around for 4 s at the
            least.
        tell: Is given what the user should know meanwhile, a line each.
        topics: Names of the topics wanted; all when None.
        rate: Time of the recording for each time of playing.
        loop: Whether to begin anew at the end.
        remaps: Other names for topics, each as FROM:=TO.

    Raises:
        InvalidRequestError: the bag lacks a topic, a remap is none, or rate or delay is out of range.
        TopicInUseError: somebody else publishes one of the topics.
        ConfigurationError: another name is no name of a topic.
        MessageDefinitionError: a message type is not installed.
        PlayerError: ROS does not let it publish.
    """
    names = topic_names(info, topics, remaps)
    for name in names.values():
        require_name(name)
    if not 0 <= delay <= _LONGEST_DELAY:
        raise InvalidRequestError(f"delay is {delay:g} s, allowed is 0 to {_LONGEST_DELAY:g} s")
    messages = messages_due(path, topics, rate, loop)
    count = 0
    with _player() as node:
        publishers = {
            topic.name: _publisher(node, topic, names[topic.name])
            for topic in info.topics
            if topic.name in names
        }
        time.sleep(max(delay, _DISCOVERY))
        _require_alone(node, publishers.values(), asked_for=topics or ())
        for message, wait in messages:
            _wait(wait, tell)
            publishers[message.topic.name].publish(message.data)
            count += 1
        # What is reliable may still be under way.
        for publisher in publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=_LAST_WORDS))
    return Playing(count, len(publishers))


def _wait(wait: float, tell: Callable[[str], None]) -> None:
    """Wait for the next message, in [s]; a long wait is told first."""
    warning = gap_warning(wait)
    if warning is not None:
        tell(warning)
    time.sleep(min(wait, TIMEOUT_MAX))


@contextmanager
def _player() -> Iterator[Node]:
    """Take part in the ROS graph; Ctrl-C stays Python's.

    Raises:
        PlayerError: ROS does not let it.
    """
    try:
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        node = Node("walk_optimizer_bag_player", start_parameter_services=False)
    except RuntimeError as error:
        rclpy.try_shutdown()
        advice = "see ROS_DOMAIN_ID and the variables ROS_SECURITY_*"
        raise PlayerError(f"can't start: {error}; {advice}") from error
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _publisher(node: Node, topic: TopicInfo, name: str) -> Publisher:
    try:
        return node.create_publisher(message_class(topic.type_name), name, qos_of(topic))
    except RuntimeError as error:
        advice = "play other topics with --topics, or this one under another name with --remap"
        raise PlayerError(f"{name} can't be published as {topic.type_name}: {error}; {advice}") from error


def _require_alone(node: Node, publishers: Iterable[Publisher], asked_for: Collection[str]) -> None:
    """Refuse to play beside others: a walker can't follow two streams of references at once.

    Raises:
        TopicInUseError: names the topics, the nodes, and what to do.
    """
    looked_at = [
        topic
        for topic in (str(publisher.topic_name) for publisher in publishers)
        if topic not in _EVERYBODYS and not (topic in asked_for and topic.rpartition("/")[2] in _SHARED)
    ]
    if not any(_others(node, topic) for topic in looked_at):
        return
    time.sleep(_NAME_DELAY)
    used = [f"{topic} by {', '.join(others)}" for topic in looked_at if (others := _others(node, topic))]
    if used:
        raise TopicInUseError(
            f"published by others already: {'; '.join(used)}. Stop these nodes, play other topics with "
            "--topics, or under other names with --remap FROM:=TO"
        )


def _others(node: Node, topic: str) -> list[str]:
    """Return the names of the nodes that publish a topic beside this one."""
    found = node.get_publishers_info_by_topic(topic)
    names = [f"{one.node_namespace.rstrip('/')}/{one.node_name}" for one in found]
    # Another player has the same name.
    with suppress(ValueError):
        names.remove(node.get_fully_qualified_name())
    return names


def qos_of(topic: TopicInfo) -> QoSProfile:
    """Return what the publisher of a recorded topic offered, as far as that is told and can be offered."""
    recorded = topic.qos[0] if topic.qos else QosProfile()
    keeps_all = recorded.history == "keep_all"
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if keeps_all else HistoryPolicy.KEEP_LAST,
        depth=recorded.depth if 0 < recorded.depth <= _LARGEST_DEPTH else _DEPTH,
        reliability=_policy(ReliabilityPolicy.RELIABLE, recorded.reliability),
        durability=_policy(DurabilityPolicy.VOLATILE, recorded.durability),
        liveliness=_policy(LivelinessPolicy.AUTOMATIC, recorded.liveliness),
        deadline=_duration(recorded.deadline_ns),
        lifespan=_duration(recorded.lifespan_ns),
        liveliness_lease_duration=_duration(recorded.liveliness_lease_duration_ns),
    )


def _policy(default: _Policy, word: str) -> _Policy:
    """Return a recorded policy; the default for words that say nothing, or nothing that rclpy has."""
    found = type(default).__members__.get(word.upper(), default)
    return default if found.name == "UNKNOWN" else found


def _duration(nanoseconds: int) -> Duration:
    """Return a duration; 0, which the middleware takes for infinite, for what is none or infinite."""
    return Duration(nanoseconds=nanoseconds if 0 < nanoseconds < INFINITE_NS else 0)
