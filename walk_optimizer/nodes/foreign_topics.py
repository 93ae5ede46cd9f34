"""Topics of other nodes that go into the bag: found in the graph while a recording runs."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, TypeAlias

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.type_support import check_for_type_support

from walk_optimizer.nodes.bag import record
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.recording import Recorder, TopicInfo
from walk_optimizer.recording.definitions import message_definition, type_hash
from walk_optimizer.recording.errors import MessageDefinitionError
from walk_optimizer.recording.ros_messages import message_class, qos_profile

# How often new topics are looked for, in [s].
_LOOK_PERIOD = 1.0
# Messages that may wait while the executor does something else.
_DEPTH = 100
# What a bag says of a topic, and the class of its messages.
_Description: TypeAlias = tuple[TopicInfo, type]


class ForeignTopics:
    """Subscribes to topics as they appear, and records the very bytes that arrive.

    They are recorded with the quality of service that their publishers offer. Owns the thread that reads
    what their types look like: the executor does not wait for the disk.

    Attributes:
        recorder: That gets them.
        missing: Names of those that nobody has published.
    """

    def __init__(self, node: SuiteNode, names: Iterable[str], recorder: Recorder) -> None:
        """Look for topics now, and again every second.

        Args:
            node: That subscribes.
            names: Full names of topics.
            recorder: That was started.
        """
        self._node, self.recorder = node, recorder
        self.missing = set(names)
        self._subscriptions: list[Subscription] = []
        self._closed = False
        self._reader = ThreadPoolExecutor(1, "message_types")
        self._timer = node.repeat(_LOOK_PERIOD, self._look)
        self._look()

    def close(self) -> None:
        """Unsubscribe."""
        self._node.destroy_timer(self._timer)
        self._reader.shutdown(wait=False, cancel_futures=True)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._closed = True

    def _look(self) -> None:
        if self._node.get_clock().now().nanoseconds <= 0:
            return  # What is latched arrives with the subscription, and could not be recorded yet.
        for name in sorted(self.missing):
            publishers = self._node.get_publishers_info_by_topic(name)
            if publishers:
                self.missing.discard(name)
                description = self._reader.submit(_describe, name, publishers)
                description.add_done_callback(partial(self._node.later, self._record, name, publishers))

    def _record(
        self, name: str, publishers: Sequence[TopicEndpointInfo], description: "Future[_Description]"
    ) -> None:
        """Record a topic from now on."""
        if self._closed:
            return
        try:
            info, message_type = description.result()
            subscription = self._node.create_subscription(
                message_type,
                name,
                self._taker(name),
                _offered_by_all(publishers),
                callback_group=self._node.group,
                raw=True,
            )
        except (MessageDefinitionError, RuntimeError) as error:  # also what SROS2 denies
            self._node.get_logger().warning(f"{name} is not recorded: {error}")
            return
        self.recorder.add_topic(info)
        self._subscriptions.append(subscription)

    def _taker(self, name: str) -> Callable[[bytes], None]:
        def take(data: bytes) -> None:
            record(self.recorder, name, data, self._node.get_clock().now().nanoseconds)

        return take


def _describe(name: str, publishers: Sequence[TopicEndpointInfo]) -> _Description:
    """Read what a bag says of a topic, and load its type.

    Raises:
        MessageDefinitionError: its type is not installed here.
    """
    kind = publishers[0].topic_type
    info = TopicInfo(
        name=name,
        type_name=kind,
        definition=message_definition(kind),
        type_hash=type_hash(kind),
        qos=tuple(qos_profile(publisher.qos_profile) for publisher in publishers),
    )
    message_type = message_class(kind)
    check_for_type_support(message_type)
    return info, message_type


def _offered_by_all(publishers: Sequence[Any]) -> QoSProfile:
    """Return the strictest quality of service that each of the publishers offers."""
    profiles = [publisher.qos_profile for publisher in publishers]
    reliable = all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in profiles)
    latched = all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles)
    return QoSProfile(
        depth=_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
