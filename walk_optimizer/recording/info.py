"""What is in a bag, and whether it is whole, without ROS."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from walk_optimizer.errors import quoted
from walk_optimizer.recording.bag_directory import (
    Description,
    bag_files,
    metadata_faults,
    parse_description,
    read_description,
    require_readable,
)
from walk_optimizer.recording.errors import ForeignTopicError
from walk_optimizer.recording.metadata import FileEntry
from walk_optimizer.recording.records import LOSING_MESSAGES, Damage, DamageKind
from walk_optimizer.recording.scan import FileScan
from walk_optimizer.recording.topics import SERIALIZATION_FORMAT, TopicInfo

_OTHER_TOOLS = "the program that wrote the file, or the `mcap` command line tool, handles it"


@dataclass(frozen=True)
class FileInfo:
    """One file of a bag.

    Attributes:
        path: The file.
        size_bytes: Its size in [byte].
        entry: Messages per topic, and their span in time.
        topics: Topics of the file.
        chunks: Chunks that were read whole.
        compressions: Compressions of the chunks; empty text for none.
        damage: What cannot be trusted, in the order of the file.
        lost_messages: Messages known to be lost to the damage; there may be more.
        foreign_records: Attachments and metadata of other programs.
    """

    path: Path
    size_bytes: int
    entry: FileEntry
    topics: tuple[TopicInfo, ...]
    chunks: int
    compressions: tuple[str, ...]
    damage: tuple[Damage, ...]
    lost_messages: int
    foreign_records: int

    @property
    def is_whole(self) -> bool:
        """Whether the file was ended properly and every checksum is right."""
        return not self.damage


@dataclass(frozen=True)
class BagInfo:
    """A bag as its files say it is; metadata.yaml is compared with them, not believed.

    Attributes:
        path: The bag.
        files: Its files, in the order of recording.
        ros_distro: ROS distribution that the bag names; empty when unknown.
        has_metadata: Whether there is a metadata.yaml that can be read.
        metadata_faults: How metadata.yaml differs from the files, a sentence each.
        custom_data: Free texts of the bag.
    """

    path: Path
    files: tuple[FileInfo, ...]
    ros_distro: str
    has_metadata: bool
    metadata_faults: tuple[str, ...]
    custom_data: tuple[tuple[str, str], ...]

    @property
    def is_whole(self) -> bool:
        """Whether all files were ended properly, every checksum is right, and metadata.yaml too."""
        return all(file.is_whole for file in self.files) and not self.metadata_faults

    @property
    def is_cut_off(self) -> bool:
        """Whether the recording of a file was broken off."""
        return self.count_damage(DamageKind.CUT_OFF) > 0

    @property
    def topics(self) -> tuple[TopicInfo, ...]:
        """Topics of all files, in the order met; more than once only where types differ."""
        topics = (topic for file in self.files for topic in file.topics)
        return tuple({(topic.name, topic.type_name, topic.type_hash): topic for topic in topics}.values())

    @property
    def types(self) -> dict[str, tuple[str, ...]]:
        """Message types by topic; a topic of ROS has one."""
        names = dict.fromkeys(topic.name for topic in self.topics)
        return {name: tuple(topic.type_name for topic in self.topics if topic.name == name) for name in names}

    @property
    def counts(self) -> Counter[str]:
        """Messages per topic."""
        return sum((Counter(file.entry.counts) for file in self.files), Counter())

    @property
    def message_count(self) -> int:
        """Messages that can be read."""
        return sum(file.entry.message_count for file in self.files)

    @property
    def lost_messages(self) -> int:
        """Messages known to be lost to damage; there may be more."""
        return sum(file.lost_messages for file in self.files)

    @property
    def foreign_records(self) -> int:
        """Attachments and metadata of other programs."""
        return sum(file.foreign_records for file in self.files)

    @property
    def size_bytes(self) -> int:
        """Size of all files in [byte]."""
        return sum(file.size_bytes for file in self.files)

    @property
    def compressions(self) -> tuple[str, ...]:
        """Compressions of the chunks, in the order met; empty text for none."""
        return tuple(dict.fromkeys(name for file in self.files for name in file.compressions))

    @property
    def start_time_ns(self) -> int | None:
        """Earliest log time in [ns]; None without messages."""
        starts = (file.entry.start_time_ns for file in self.files)
        return min((start for start in starts if start is not None), default=None)

    @property
    def duration_ns(self) -> int:
        """Time from the earliest to the latest message in [ns]."""
        ends = (file.entry.end_time_ns for file in self.files)
        end = max((end for end in ends if end is not None), default=0)
        return end - (self.start_time_ns or 0) if end else 0

    def count_damage(self, kind: DamageKind) -> int:
        """Return how often a kind of damage was met."""
        return sum(damage.kind is kind for file in self.files for damage in file.damage)


def describe_bag(path: Path) -> BagInfo:
    """Read a whole bag and say what is in it.

    Args:
        path: A bag directory, or a single .mcap file.

    Raises:
        NotABagError: If the path is no bag that can be read.
        CompressedBagError: If rosbag2 has compressed its files or messages.
    """
    scans = [FileScan(file) for file in bag_files(path)]
    files = tuple(_describe_file(scan) for scan in scans)
    metadata = read_description(path)
    # A single file, or a bag without metadata.yaml, still describes itself at its end.
    description = metadata or parse_description(scans[-1].bag_metadata or "") or Description()
    require_readable(path, description)
    return BagInfo(
        path=path,
        files=files,
        ros_distro=description.ros_distro,
        has_metadata=metadata is not None,
        metadata_faults=_metadata_faults(metadata, files) if path.is_dir() else (),
        custom_data=description.custom_data,
    )


def _metadata_faults(metadata: Description | None, files: Sequence[FileInfo]) -> tuple[str, ...]:
    kinds = {damage.kind for file in files for damage in file.damage}
    messages = None if kinds & LOSING_MESSAGES else sum(file.entry.message_count for file in files)
    return metadata_faults(metadata, [file.path for file in files], messages)


def _describe_file(scan: FileScan) -> FileInfo:
    path = scan.path
    counts: Counter[str] = Counter()
    start: int | None = None
    end: int | None = None
    for message in scan.messages():
        counts[message.topic.name] += 1
        time_ns = message.log_time_ns
        start = time_ns if start is None else min(start, time_ns)
        end = time_ns if end is None else max(end, time_ns)
    return FileInfo(
        path=path,
        size_bytes=path.stat().st_size,
        entry=FileEntry(path.name, counts, start, end),
        topics=tuple(scan.topics.values()),
        chunks=scan.chunks,
        compressions=tuple(scan.compressions),
        damage=tuple(scan.damage),
        lost_messages=scan.lost_messages,
        foreign_records=scan.foreign_records,
    )


def require_ros_topics(info: BagInfo, names: Collection[str]) -> None:
    """Refuse topics that only other programs than ROS 2 write.

    Raises:
        ForeignTopicError: says what is wrong with them.
    """
    for topic in info.topics:
        if topic.name in names and topic.serialization_format != SERIALIZATION_FORMAT:
            raise ForeignTopicError(
                f"topic {quoted(topic.name)} is encoded as {quoted(topic.serialization_format)}, "
                f"allowed is {SERIALIZATION_FORMAT}, as ROS 2 does; {_OTHER_TOOLS}"
            )
    for name, types in info.types.items():
        if name in names and len(types) > 1:
            raise ForeignTopicError(
                f"topic {quoted(name)} has {len(types)} types, {' and '.join(map(quoted, types))}, "
                f"allowed is one, as in ROS 2; {_OTHER_TOOLS}"
            )
