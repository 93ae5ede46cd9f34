"""What a bag says about a topic: type, definition, hash, offered quality of service."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from walk_optimizer.recording.errors import MessageError, TopicError

NANOSECONDS_PER_SECOND = 1_000_000_000

SERIALIZATION_FORMAT = "cdr"
"""Encoding of the messages of ROS 2."""

INFINITE_NS = 9_223_372_036_854_775_807
"""The rmw constant for an infinite duration, in [ns]."""

# Bags before version 9 store the numbers of the rmw enumerations instead of words.
_POLICY_WORDS: Mapping[str, tuple[str, ...]] = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": (
        "system_default",
        "automatic",
        "manual_by_node",
        "manual_by_topic",
        "unknown",
        "best_available",
    ),
}


@dataclass(frozen=True)
class QosProfile:
    """Quality of service that a publisher offers, in the words of rosbag2.

    Attributes:
        history: keep_last, keep_all, system_default or unknown.
        depth: Messages kept with keep_last.
        reliability: reliable, best_effort, best_available, system_default or unknown.
        durability: volatile, transient_local, best_available, system_default or unknown.
        deadline_ns: Longest time between two messages, in [ns].
        lifespan_ns: Time after which a message is stale, in [ns].
        liveliness: automatic, manual_by_topic, best_available, system_default or unknown.
        liveliness_lease_duration_ns: Time within which a publisher shows that it lives, in [ns].
        avoid_ros_namespace_conventions: Whether the topic name goes to the middleware as it is.
    """

    history: str = "keep_last"
    depth: int = 10
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline_ns: int = INFINITE_NS
    lifespan_ns: int = INFINITE_NS
    liveliness: str = "automatic"
    liveliness_lease_duration_ns: int = INFINITE_NS
    avoid_ros_namespace_conventions: bool = False

    def to_mapping(self) -> dict[str, Any]:
        """Return the profile as rosbag2 lays it out in YAML."""
        return {
            "history": self.history,
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": _to_time(self.deadline_ns),
            "lifespan": _to_time(self.lifespan_ns),
            "liveliness": self.liveliness,
            "liveliness_lease_duration": _to_time(self.liveliness_lease_duration_ns),
            "avoid_ros_namespace_conventions": self.avoid_ros_namespace_conventions,
        }

    @classmethod
    def from_mapping(cls, profile: Mapping[str, Any]) -> "QosProfile":
        """Read a profile of any bag version, with policies as words or as numbers."""
        return cls(
            history=_policy_word("history", profile["history"]),
            depth=int(profile["depth"]),
            reliability=_policy_word("reliability", profile["reliability"]),
            durability=_policy_word("durability", profile["durability"]),
            deadline_ns=_from_time(profile["deadline"]),
            lifespan_ns=_from_time(profile["lifespan"]),
            liveliness=_policy_word("liveliness", profile["liveliness"]),
            liveliness_lease_duration_ns=_from_time(profile["liveliness_lease_duration"]),
            avoid_ros_namespace_conventions=bool(profile["avoid_ros_namespace_conventions"]),
        )


@dataclass(frozen=True)
class TopicInfo:
    """A topic as a bag describes it.

    Attributes:
        name: Full name of the topic, such as /reference_publisher/joint_reference.
        type_name: Message type, such as sensor_msgs/msg/JointState.
        definition: Definition of the type, followed by those of the types it uses.
        type_hash: RIHS01 hash of the type; empty when unknown.
        qos: Profiles that the publishers of the topic offer.
        definition_encoding: Language of `definition`: ros2msg or ros2idl.
        serialization_format: Encoding of the messages.
    """

    name: str
    type_name: str
    definition: str
    type_hash: str
    qos: tuple[QosProfile, ...] = (QosProfile(),)
    definition_encoding: str = "ros2msg"
    serialization_format: str = SERIALIZATION_FORMAT


def qos_to_yaml(profiles: tuple[QosProfile, ...]) -> str:
    """Return the YAML text that rosbag2 keeps with a channel."""
    return yaml.safe_dump([profile.to_mapping() for profile in profiles], sort_keys=False)


def qos_from_yaml(text: str) -> tuple[QosProfile, ...]:
    """Read the profiles of a channel; a text that holds none gives none.

    A bag is worth reading even if the profile of a topic is not, so nothing is raised for it.
    """
    try:
        return tuple(QosProfile.from_mapping(profile) for profile in yaml.safe_load(text) or ())
    except (yaml.YAMLError, LookupError, TypeError, ValueError, OverflowError, RecursionError):
        return ()


def require_same_type(known: TopicInfo, topic: TopicInfo) -> None:
    """Refuse a topic that is known with another type.

    Raises:
        TopicError: With both types.
    """
    if (known.type_name, known.type_hash) != (topic.type_name, topic.type_hash):
        raise TopicError(
            f"Topic {topic.name} is {known.type_name} ({known.type_hash}) in this bag,"
            f" not {topic.type_name} ({topic.type_hash})"
        )


def require_message(topics: Mapping[str, TopicInfo], topic: str, data: bytes, log_time_ns: int) -> None:
    """Refuse what a bag cannot store.

    Args:
        topics: Announced topics by name.
        topic: Name of the topic.
        data: The serialised message.
        log_time_ns: When it was recorded, in [ns].

    Raises:
        TopicError: If the topic was not announced.
        MessageError: If data or time cannot be stored.
    """
    if topic not in topics:
        known = ", ".join(sorted(topics)) or "none"
        raise TopicError(f"Topic {topic} was not announced to the bag; it knows {known}")
    if not isinstance(data, bytes):
        raise MessageError(f"A message on {topic} is a {type(data).__name__}, must be bytes")
    if not isinstance(log_time_ns, int) or not 0 <= log_time_ns <= INFINITE_NS:
        raise MessageError(f"A log time on {topic} is {log_time_ns!r}, must be in [0, {INFINITE_NS}] ns")


def _to_time(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, NANOSECONDS_PER_SECOND)
    return {"sec": seconds, "nsec": rest}


def _from_time(time: Mapping[str, int]) -> int:
    return min(int(time["sec"]) * NANOSECONDS_PER_SECOND + int(time["nsec"]), INFINITE_NS)


def _policy_word(policy: str, value: str | int) -> str:
    return value if isinstance(value, str) else _POLICY_WORDS[policy][value]
