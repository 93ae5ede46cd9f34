"""Topics of a node whose messages also go into a bag while one is being recorded."""

import os
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.nodes.paths import named_path
from walk_optimizer.nodes.qos_warnings import warn_of_subscribers
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.recording import Recorder, RecorderSettings, TopicInfo
from walk_optimizer.recording.errors import (
    AlreadyRecordingError,
    BagNotWritableError,
    NotRecordingError,
    RecordingError,
)
from walk_optimizer.recording.recording_thread import RecorderLog
from walk_optimizer.recording.ros_messages import qos_profile, serialize, topic_info
from walk_optimizer.recording.status import RecorderStatus


def new_bag_folder(folder: str) -> Path:
    """Return the directory of a new bag.

    Args:
        folder: Where bags go; empty for `$ROS_HOME/walk_optimizer`, by default below `~/.ros`.
    """
    home = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")
    base = named_folder(folder) if folder else home / "walk_optimizer"
    return base / f"walk_{datetime.now().astimezone():%Y_%m_%d-%H_%M_%S_%f}"


def named_folder(name: str) -> Path:
    """Return a folder that a user has named; `~` is a home.

    Raises:
        BagNotWritableError: there is no such home.
    """
    try:
        return named_path(name).absolute()
    except ConfigurationError as error:
        raise BagNotWritableError(f"Cannot write {error}") from error


def record(recorder: Recorder, topic: str, data: bytes, time_ns: int) -> None:
    """Have a message recorded, unless no time is known yet.

    Simulated time is 0 until the first message on /clock: a bag from then to now would last for decades.

    Args:
        recorder: That takes it.
        topic: Full name.
        data: The serialised message.
        time_ns: When, by the node's clock, in [ns].
    """
    if time_ns > 0:
        recorder.write(topic, data, time_ns)


class RecordedTopic:
    """A publisher and what a bag says about its topic."""

    def __init__(self, node: SuiteNode, kind: type, name: str, qos: QoSProfile, bag: "StreamBag") -> None:
        """Create the publisher and announce it to the bag."""
        events = warn_of_subscribers(node, name, qos)
        self._publisher: Publisher = node.create_publisher(kind, name, qos, event_callbacks=events)
        self._bag = bag
        self.info: TopicInfo = topic_info(self._publisher.topic_name, kind, qos)
        bag.topics.append(self)

    def publish(self, message: Any, time_ns: int) -> None:
        """Publish a message, and record the very same bytes.

        Args:
            message: Of the topic's type, or serialised.
            time_ns: When, by the node's clock, in [ns].
        """
        recorder = self._bag.recorder
        data = message if isinstance(message, bytes) else serialize(message)
        self._publisher.publish(data)
        if recorder is not None:
            record(recorder, self.info.name, data, time_ns)


class ReceivedTopic:
    """A subscription whose messages also go into the bag: exactly those that the node was given.

    A second subscription would not do: who publishes once may not have found it yet.
    """

    def __init__(self, node: SuiteNode, subscription: Subscription, bag: "StreamBag") -> None:
        """Listen to what the subscription's callback is given."""
        self._node, self._bag = node, bag
        self.info = topic_info(subscription.topic_name, subscription.msg_type, subscription.qos_profile)
        self._announced_to: Recorder | None = None
        self._deliver = subscription.callback
        subscription.callback = self._take
        bag.received.append(self)

    def _take(self, message: Any) -> None:
        self._deliver(message)
        recorder = self._bag.recorder
        if recorder is None:
            return
        if recorder is not self._announced_to:
            recorder.add_topic(self._offered())
            self._announced_to = recorder
        now = self._node.get_clock().now().nanoseconds
        record(recorder, self.info.name, serialize(message), now)

    def _offered(self) -> TopicInfo:
        """Return the topic with what its publishers offer; if they have gone, with what is asked of them."""
        publishers = self._node.get_publishers_info_by_topic(self.info.name)
        offered = tuple(qos_profile(publisher.qos_profile) for publisher in publishers)
        return replace(self.info, qos=offered or self.info.qos)


class StreamBag:
    """At most one recording at a time of a node's topics.

    `start` and `stop` wait for the disk: they are for one thread that has the time (`recording_control`).

    Attributes:
        topics: What the node publishes and is recorded.
        received: What it is sent and is recorded.
        recorder: The recording, also one that has ended by itself; None when there is none.
        error: Why the last bag could not be begun; None when it could.
    """

    def __init__(self) -> None:
        """Record nothing."""
        self.topics: list[RecordedTopic] = []
        self.received: list[ReceivedTopic] = []
        self.recorder: Recorder | None = None
        self.error: RecordingError | None = None

    @property
    def names(self) -> set[str]:
        """Full names of all these topics: nobody else needs to record them."""
        infos = [one.info for one in self.topics] + [one.info for one in self.received]
        return {info.name for info in infos}

    @property
    def recording(self) -> bool:
        """Whether a bag is being recorded."""
        return self.recorder is not None and self.recorder.status().recording

    def start(self, directory: Path, settings: RecorderSettings, log: RecorderLog) -> Recorder:
        """Begin a bag and return its recorder.

        Args:
            directory: The bag.
            settings: How it is written.
            log: Gets what goes wrong later.

        Raises:
            AlreadyRecordingError: one is being recorded.
            RecordingError: the bag can't be created.
        """
        if self.recorder is not None:
            if self.recording:
                raise AlreadyRecordingError(
                    f"already recording to {self.recorder.directory}; stop that first"
                )
            self.stop()
        recorder = Recorder(directory, settings, log=log)
        for topic in self.topics:
            recorder.add_topic(topic.info)
        recorder.start()
        self.recorder, self.error = recorder, None
        return recorder

    def rest(self) -> None:
        """Say that nothing is published for a moment."""
        if self.recorder is not None:
            self.recorder.rest()

    def stop(self) -> RecorderStatus:
        """Close the bag and return what is in it.

        Raises:
            NotRecordingError: nothing is being recorded.
        """
        recorder, self.recorder, self.error = self.recorder, None, None
        if recorder is None:
            raise NotRecordingError("nothing is being recorded")
        return recorder.stop()
