"""Topics, messages and bags that several tests need. No ROS: rosbags serialises."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_typestore

from walk_optimizer.recording import BagWriter, QosProfile, RecorderSettings, TopicInfo

STORE = get_typestore(Stores.ROS2_JAZZY)
START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 1_000_000


def topic(name: str, type_name: str, qos: QosProfile | None = None) -> TopicInfo:
    definition, _ = STORE.generate_msgdef(type_name, ros_version=2)
    return TopicInfo(name, type_name, definition, STORE.hash_rihs01(type_name), (qos or QosProfile(),))


JOINTS = topic("/walker/joint_reference", "sensor_msgs/msg/JointState")
TORQUES = topic("/walker/feedforward_torques", "std_msgs/msg/Float64MultiArray")
GAIT = topic("/walker/gait", "std_msgs/msg/String", QosProfile(depth=1, durability="transient_local"))


def joint_state(number: int) -> bytes:
    """A message that tells its number in every field."""
    types = STORE.types
    nanoseconds = START_NS + number * PERIOD_NS
    stamp = types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)
    header = types["std_msgs/msg/Header"](stamp, f"frame {number}")
    values = [np.arange(4.0) + number + offset for offset in (0.0, 0.25, 0.5)]
    message = types["sensor_msgs/msg/JointState"](header, ["a", "b", "c", "d"], *values)
    return bytes(STORE.serialize_cdr(message, "sensor_msgs/msg/JointState"))


def string(text: str) -> bytes:
    return bytes(STORE.serialize_cdr(STORE.types["std_msgs/msg/String"](text), "std_msgs/msg/String"))


def number_of(data: bytes) -> int:
    """The number that `joint_state` was given."""
    return int(STORE.deserialize_cdr(data, "sensor_msgs/msg/JointState").position[0])


def write_bag(directory: Path, numbers: Iterable[int], settings: RecorderSettings | None = None) -> Path:
    """Write numbered joint states, and one latched text before them."""
    with BagWriter(directory, settings or RecorderSettings(min_free_bytes=0)) as writer:
        writer.add_topic(JOINTS)
        writer.add_topic(GAIT)
        writer.write(GAIT.name, string("gait"), START_NS)
        for number in numbers:
            writer.write(JOINTS.name, joint_state(number), START_NS + number * PERIOD_NS)
    return directory
