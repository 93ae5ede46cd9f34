"""The description of a bag that is written: metadata.yaml of version 9, and the names of its files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import yaml

from walk_optimizer.recording.topics import INFINITE_NS, TopicInfo

METADATA_FILE = "metadata.yaml"
METADATA_VERSION = 9
STORAGE_IDENTIFIER = "mcap"
TOP_LEVEL_KEY = "rosbag2_bagfile_information"
# In C where PyYAML has it: the thread that writes bags competes with the stream for Python's lock.
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


@dataclass(frozen=True)
class FileEntry:
    """What the description says about one file of the bag.

    Attributes:
        path: Name of the file within the bag.
        counts: Messages per topic.
        start_time_ns: Earliest log time in [ns]; None without messages.
        end_time_ns: Latest log time in [ns]; None without messages.
    """

    path: str
    counts: Mapping[str, int] = field(default_factory=dict)
    start_time_ns: int | None = None
    end_time_ns: int | None = None

    @cached_property
    def message_count(self) -> int:
        """Messages in the file."""
        return sum(self.counts.values())

    # Made once: with every further file of a bag metadata.yaml is written again.
    @cached_property
    def path_lines(self) -> str:
        """What stands for the file in metadata.yaml below `relative_file_paths`."""
        return _lines({"relative_file_paths": [self.path]}, skip=1)

    @cached_property
    def lines(self) -> str:
        """What stands for the file in metadata.yaml below `files`."""
        return _lines({"files": [_file(self)]}, skip=1)


@dataclass(frozen=True)
class BagMetadata:
    """The description of a whole bag.

    Attributes:
        topics: Topics of the bag.
        files: Files of the bag, one at least, in the order of recording.
        ros_distro: Name of the ROS distribution that recorded it.
        custom_data: Free texts.
    """

    topics: Sequence[TopicInfo]
    files: Sequence[FileEntry]
    ros_distro: str
    custom_data: Mapping[str, str]

    def to_record(self) -> str:
        """Return the text that rosbag2 keeps inside of an MCAP file, as it lays it out in YAML."""
        paths, files = [entry.path for entry in self.files], [_file(entry) for entry in self.files]
        return _dump({**self._head(), "relative_file_paths": paths, "files": files, **self._tail()})

    def to_file(self) -> str:
        """Return the text of metadata.yaml: the same below a key."""
        paths = "".join(entry.path_lines for entry in self.files)
        files = "".join(entry.lines for entry in self.files)
        lists = f"  relative_file_paths:\n{paths}  files:\n{files}"
        return f"{TOP_LEVEL_KEY}:\n{_lines(self._head())}{lists}{_lines(self._tail())}"

    def _head(self) -> dict[str, Any]:
        return {
            "version": METADATA_VERSION,
            "storage_identifier": STORAGE_IDENTIFIER,
            **_span(self.files),
            "message_count": sum(entry.message_count for entry in self.files),
            "topics_with_message_count": [self._topic(topic) for topic in self.topics],
            # These two mean whole files that were compressed; chunks say it of themselves.
            "compression_format": "",
            "compression_mode": "",
        }

    def _tail(self) -> dict[str, Any]:
        return {"custom_data": dict(self.custom_data), "ros_distro": self.ros_distro}

    def _topic(self, topic: TopicInfo) -> dict[str, Any]:
        return {
            "topic_metadata": {
                "name": topic.name,
                "type": topic.type_name,
                "serialization_format": topic.serialization_format,
                "offered_qos_profiles": [profile.to_mapping() for profile in topic.qos],
                "type_description_hash": topic.type_hash,
            },
            "message_count": sum(entry.counts.get(topic.name, 0) for entry in self.files),
        }


def file_name(bag_name: str, number: int) -> str:
    """Return the name of a file of a bag, counted from 0."""
    return f"{bag_name}_{number}.mcap"


def _span(entries: Sequence[FileEntry]) -> dict[str, Any]:
    """Return start and duration of files; without messages rosbag2 writes the largest time."""
    starts = [entry.start_time_ns for entry in entries if entry.start_time_ns is not None]
    ends = [entry.end_time_ns for entry in entries if entry.end_time_ns is not None]
    start = min(starts, default=INFINITE_NS)
    return {
        "duration": {"nanoseconds": max(ends, default=start) - start},
        "starting_time": {"nanoseconds_since_epoch": start},
    }


def _file(entry: FileEntry) -> dict[str, Any]:
    return {"path": entry.path, **_span([entry]), "message_count": entry.message_count}


def _lines(content: Mapping[str, Any], skip: int = 0) -> str:
    """Return what stands for a mapping in metadata.yaml, without its first lines."""
    return _dump({TOP_LEVEL_KEY: content}).split("\n", skip + 1)[-1]


def _dump(content: Mapping[str, Any]) -> str:
    return str(yaml.dump(content, Dumper=_DUMPER, sort_keys=False))
