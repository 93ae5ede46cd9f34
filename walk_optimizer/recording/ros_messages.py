"""The bridge from rclpy to bags: with `cdr`, what of this package needs ROS."""

from importlib import import_module
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message

from walk_optimizer.recording.cdr import trim
from walk_optimizer.recording.definitions import message_definition, type_hash
from walk_optimizer.recording.errors import MessageDefinitionError
from walk_optimizer.recording.scan import BagMessage
from walk_optimizer.recording.topics import INFINITE_NS, QosProfile, TopicInfo


def topic_info(name: str, message_type: type, qos: QoSProfile) -> TopicInfo:
    """Describe a topic for a bag.

    Args:
        name: Full name of the topic.
        message_type: Generated message class, such as sensor_msgs.msg.JointState.
        qos: Quality of service that its publisher offers.

    Raises:
        MessageDefinitionError: If the definition of the type is not installed.
    """
    full_name = type_name(message_type)
    return TopicInfo(
        name=name,
        type_name=full_name,
        definition=message_definition(full_name),
        type_hash=type_hash(full_name),
        qos=(qos_profile(qos),),
    )


def type_name(message_type: type) -> str:
    """Return the ROS name of a generated message class, such as sensor_msgs/msg/JointState."""
    package, kind = message_type.__module__.split(".")[:2]
    return f"{package}/{kind}/{message_type.__name__}"


def message_class(full_name: str) -> type:
    """Return the generated class of a message type.

    Args:
        full_name: Such as sensor_msgs/msg/JointState.

    Raises:
        MessageDefinitionError: If its package is not installed, or lacks the type.
    """
    try:
        package, kind, name = full_name.split("/")
        found = getattr(import_module(f"{package}.{kind}"), name)
    except (ValueError, ImportError, AttributeError) as error:
        raise MessageDefinitionError(f"Message type {full_name!r} is not installed") from error
    return found  # type: ignore[no-any-return]


def serialize(message: Any) -> bytes:
    """Return a message as the bytes that a bag stores."""
    return trim(message, serialize_message(message))


def deserialize(message: BagMessage) -> Any:
    """Return a message of a bag as an object of its generated class.

    Raises:
        MessageDefinitionError: If its type is not installed.
    """
    return deserialize_message(message.data, message_class(message.topic.type_name))


def qos_profile(qos: QoSProfile) -> QosProfile:
    """Return a profile of rclpy in the words of a bag."""
    return QosProfile(
        history=qos.history.name.lower(),
        depth=qos.depth,
        reliability=qos.reliability.name.lower(),
        durability=qos.durability.name.lower(),
        deadline_ns=_duration_ns(qos.deadline.nanoseconds),
        lifespan_ns=_duration_ns(qos.lifespan.nanoseconds),
        liveliness=qos.liveliness.name.lower(),
        liveliness_lease_duration_ns=_duration_ns(qos.liveliness_lease_duration.nanoseconds),
        avoid_ros_namespace_conventions=qos.avoid_ros_namespace_conventions,
    )


def _duration_ns(nanoseconds: int) -> int:
    # 0 leaves it to the middleware, whose default is infinite: what a discovered publisher shows.
    return nanoseconds or INFINITE_NS
