"""Messages of a bag, in the order of recording, without ROS."""

from collections.abc import Collection, Iterator
from pathlib import Path

from walk_optimizer.recording.bag_directory import bag_files
from walk_optimizer.recording.scan import BagMessage, FileScan

__all__ = ["BagMessage", "read_messages"]


def read_messages(path: Path, topics: Collection[str] | None = None) -> Iterator[BagMessage]:
    """Iterate over the messages of a bag in the order of recording.

    A bag that was cut off or damaged gives the messages that can be trusted: `describe_bag` tells
    whether it is whole.

    Args:
        path: A bag directory, or a single .mcap file.
        topics: Names of the topics wanted; all when None.

    Yields:
        The messages of all files.

    Raises:
        NotABagError: If the path is no bag that can be read.
    """
    for file in bag_files(path):
        for message in FileScan(file).messages():
            if topics is None or message.topic.name in topics:
                yield message
