"""Bags as rosbag2 writes them: record, describe, repair and read them.

Nothing here needs ROS but `walk_optimizer.recording.ros_messages`, which is therefore not imported
from this page.
"""

from walk_optimizer.recording.bag_text import format_bag
from walk_optimizer.recording.bag_writer import BagWriter
from walk_optimizer.recording.info import BagInfo, describe_bag
from walk_optimizer.recording.reading import BagMessage, read_messages
from walk_optimizer.recording.recorder import Recorder
from walk_optimizer.recording.repair import RepairReport, repair_bag
from walk_optimizer.recording.settings import Compression, RecorderSettings
from walk_optimizer.recording.status import RecorderStatus
from walk_optimizer.recording.topics import QosProfile, TopicInfo

__all__ = [
    "BagInfo",
    "BagMessage",
    "BagWriter",
    "Compression",
    "QosProfile",
    "Recorder",
    "RecorderSettings",
    "RecorderStatus",
    "RepairReport",
    "TopicInfo",
    "describe_bag",
    "format_bag",
    "read_messages",
    "repair_bag",
]
