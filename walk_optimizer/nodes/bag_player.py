"""Plays bags through rclpy: the very bytes, on their topics, with the quality of service of the recording."""

import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

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

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.recording.info import BagInfo
from walk_optimizer.recording.playback import messages_due, require_topics
from walk_optimizer.recording.ros_messages import message_class
from walk_optimizer.recording.topics import INFINITE_NS, QosProfile, TopicInfo

# Longest wait for what is still under way at the end, in [s].
_LAST_WORDS = 1.0
_LONGEST_DELAY = 3600.0
# What a topic is given whose recording does not tell its history.
_DEPTH = 10


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
    topics: Collection[str] | None = None,
    rate: float = 1.0,
    loop: bool = False,
) -> Playing:
    """Play a bag, to its end or until Ctrl-C.

    Args:
        path: The bag.
        info: What is in it.
        delay: Time for subscribers to find the player, in [s].
        topics: Names of the topics wanted; all when None.
        rate: Time of the recording for each time of playing.
        loop: Whether to begin anew at the end.

    Raises:
        InvalidRequestError: the bag lacks a topic, or rate or delay is out of range.
        MessageDefinitionError: a message type is not installed.
    """
    require_topics(info, topics or ())
    if not 0 <= delay <= _LONGEST_DELAY:
        raise InvalidRequestError(f"delay is {delay:g} s, allowed is 0 to {_LONGEST_DELAY:g} s")
    wanted = [topic for topic in info.topics if topics is None or topic.name in topics]
    messages = messages_due(path, topics, rate, loop)
    count = 0
    with _player() as node:
        publishers = {topic.name: _publisher(node, topic) for topic in wanted}
        time.sleep(delay)
        for message, wait in messages:
            time.sleep(wait)
            publishers[message.topic.name].publish(message.data)
            count += 1
        # What is reliable may still be under way.
        for publisher in publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=_LAST_WORDS))
    return Playing(count, len(publishers))


@contextmanager
def _player() -> Iterator[Node]:
    """Take part in the ROS graph; Ctrl-C stays Python's."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = Node("walk_optimizer_bag_player", start_parameter_services=False)
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _publisher(node: Node, topic: TopicInfo) -> Publisher:
    return node.create_publisher(message_class(topic.type_name), topic.name, qos_of(topic))


def qos_of(topic: TopicInfo) -> QoSProfile:
    """Return what the publisher of a recorded topic offered."""
    recorded = topic.qos[0] if topic.qos else QosProfile()
    keeps_all = recorded.history == "keep_all"
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if keeps_all else HistoryPolicy.KEEP_LAST,
        depth=recorded.depth or _DEPTH,
        reliability=ReliabilityPolicy[recorded.reliability.upper()],
        durability=DurabilityPolicy[recorded.durability.upper()],
        liveliness=LivelinessPolicy[recorded.liveliness.upper()],
        deadline=_duration(recorded.deadline_ns),
        lifespan=_duration(recorded.lifespan_ns),
        liveliness_lease_duration=_duration(recorded.liveliness_lease_duration_ns),
    )


def _duration(nanoseconds: int) -> Duration:
    """Return a duration; 0, which the middleware takes for infinite, for an infinite one."""
    return Duration(nanoseconds=0 if nanoseconds >= INFINITE_NS else nanoseconds)
