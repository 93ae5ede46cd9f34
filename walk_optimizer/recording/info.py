"""What is in a bag, and whether it is whole, without ROS."""

from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from walk_optimizer.recording.bag_directory import (
    Description,
    bag_files,
    parse_description,
    read_description,
    require_readable,
)
from walk_optimizer.recording.metadata import FileEntry
from walk_optimizer.recording.records import Damage, DamageKind
from walk_optimizer.recording.scan import FileScan
from walk_optimizer.recording.topics import NANOSECONDS_PER_SECOND, TopicInfo


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
    """

    path: Path
    size_bytes: int
    entry: FileEntry
    topics: tuple[TopicInfo, ...]
    chunks: int
    compressions: tuple[str, ...]
    damage: tuple[Damage, ...]
    lost_messages: int

    @property
    def is_whole(self) -> bool:
        """Whether the file was ended properly and every checksum is right."""
        return not self.damage


@dataclass(frozen=True)
class BagInfo:
    """A bag as its files say it is; metadata.yaml is not believed.

    Attributes:
        path: The bag.
        files: Its files, in the order of recording.
        ros_distro: ROS distribution that the bag names; empty when unknown.
        has_metadata: Whether there is a metadata.yaml that can be read.
        custom_data: Free texts of the bag.
    """

    path: Path
    files: tuple[FileInfo, ...]
    ros_distro: str
    has_metadata: bool
    custom_data: tuple[tuple[str, str], ...]

    @property
    def is_whole(self) -> bool:
        """Whether all files were ended properly and every checksum is right."""
        return all(file.is_whole for file in self.files)

    @property
    def is_cut_off(self) -> bool:
        """Whether the recording of a file was broken off."""
        return self.count_damage(DamageKind.CUT_OFF) > 0

    @property
    def topics(self) -> tuple[TopicInfo, ...]:
        """Topics of all files, each once, in the order met."""
        return tuple({topic.name: topic for file in self.files for topic in file.topics}.values())

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
        custom_data=description.custom_data,
    )


def format_bag(info: BagInfo) -> str:
    """Return the description of a bag as a text for people."""
    lines = [
        f"Bag:         {info.path}",
        f"State:       {_state(info)}",
        f"Size:        {info.size_bytes / 1e6:.3f} MB in {len(info.files)} file(s)",
        f"Compression: {', '.join(name or 'none' for name in info.compressions) or 'none'}",
        f"Distro:      {info.ros_distro or 'unknown'}",
        f"Start:       {_date(info.start_time_ns)}",
        f"Duration:    {info.duration_ns / NANOSECONDS_PER_SECOND:.6f} s",
        f"Messages:    {info.message_count}",
        "Topics:",
    ]
    counts = info.counts
    lines += [f"  {topic.name}  {topic.type_name}  {counts[topic.name]}" for topic in info.topics]
    lines += [f"{key}: {value}" for key, value in info.custom_data]
    for file in info.files:
        lines += [f"  {file.path.name}, byte {item.offset}: {item.reason}" for item in file.damage]
    return "\n".join(lines)


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
    )


def _state(info: BagInfo) -> str:
    if info.is_whole:
        return "whole, all checksums right"
    found = [f"{info.count_damage(kind)} x {kind.value}" for kind in DamageKind if info.count_damage(kind)]
    saved = "repair writes a whole bag from what is left"
    rest = saved if info.message_count else "nothing was recorded that could be saved"
    return f"damaged ({', '.join(found)}); {rest}"


def _date(time_ns: int | None) -> str:
    if time_ns is None:
        return "no messages"
    seconds = time_ns / NANOSECONDS_PER_SECOND
    date = datetime.fromtimestamp(seconds, tz=UTC).isoformat(sep=" ")
    return f"{date} ({time_ns} ns)"
