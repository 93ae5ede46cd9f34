"""Makes a whole bag from what can be trusted of a damaged one, without ROS."""

import contextlib
import shutil
from dataclasses import dataclass
from pathlib import Path

from walk_optimizer.recording.bag_writer import BagWriter
from walk_optimizer.recording.errors import RecordingError
from walk_optimizer.recording.info import BagInfo, describe_bag, require_ros_topics
from walk_optimizer.recording.records import DamageKind
from walk_optimizer.recording.scan import FileScan
from walk_optimizer.recording.settings import Compression, RecorderSettings

REPAIRED_FROM_KEY = "repaired_from"
"""Key in the custom data of metadata.yaml that names the bag a repaired one was made from."""


@dataclass(frozen=True)
class RepairReport:
    """What a repair has saved.

    Attributes:
        source: The bag that was repaired; it is as it was.
        destination: The whole bag made from it.
        recovered_messages: Messages in the new bag.
        lost_messages: Messages known to be lost: of damaged chunks whose index is still there.
            What was never written to the disk is not in it.
        damaged_chunks: Chunks that were left out because their checksum is wrong or because they
            do not decompress.
        damaged_records: Places where records made no sense, and reading went on at the next chunk.
        cut_off: Whether the recording was broken off.
        foreign_records: Attachments and metadata of other programs; they are not in the new bag.
    """

    source: Path
    destination: Path
    recovered_messages: int
    lost_messages: int
    damaged_chunks: int
    damaged_records: int
    cut_off: bool
    foreign_records: int

    def __str__(self) -> str:
        """Return the report as a sentence for people."""
        end = "cut off" if self.cut_off else "not cut off"
        foreign = f"; {self.foreign_records} attachments and metadata of other programs left out"
        return (
            f"{self.recovered_messages} messages recovered from {self.source} to {self.destination};"
            f" {self.damaged_chunks} damaged chunks and {self.damaged_records} damaged records left"
            f" out, at least {self.lost_messages} messages lost with them; the bag was {end}"
            f"{foreign * bool(self.foreign_records)}"
        )


def repair_bag(path: Path, destination: Path | None = None) -> RepairReport:
    """Write a whole bag next to a damaged one, which is not touched.

    Args:
        path: A bag directory, or a single .mcap file.
        destination: Bag to create; by default `<name>_repaired` beside the source, a file without its suffix.

    Returns:
        What was saved.

    Raises:
        NotABagError: If the path is no bag that can be read.
        ForeignTopicError: If a topic is none of ROS 2.
        BagExistsError: If the destination is already there.
        RecordingError: If the destination cannot be written; nothing is left of it then.
    """
    info = describe_bag(path)
    require_ros_topics(info, info.types)
    # Without `..`, whose neighbours are inside of the folder that it leads out of.
    source = path.resolve()
    target = destination or _beside(source)
    custom_data = {**dict(info.custom_data), REPAIRED_FROM_KEY: source.name}
    writer = BagWriter(target, _settings(info), custom_data, info.topics, info.ros_distro)
    try:
        _copy(info, writer)
        writer.close()
    except BaseException:
        # Half a repaired bag would be one more damaged bag.
        with contextlib.suppress(RecordingError):
            writer.close()
        shutil.rmtree(target, ignore_errors=True)
        raise
    return RepairReport(
        source=path,
        destination=target,
        recovered_messages=writer.messages,
        lost_messages=info.lost_messages,
        damaged_chunks=info.count_damage(DamageKind.CHUNK),
        damaged_records=info.count_damage(DamageKind.RECORD),
        cut_off=info.is_cut_off,
        foreign_records=info.foreign_records,
    )


def _beside(path: Path) -> Path:
    """Return where the repaired copy of a bag goes."""
    return path.with_name(f"{path.stem if path.is_file() else path.name}_repaired")


def _settings(info: BagInfo) -> RecorderSettings:
    """Keep the compression of the source; its files are kept one by one, not split anew."""
    compression = info.compressions[0] if info.compressions else ""
    return RecorderSettings(compression=Compression(compression or "none"))


def _copy(info: BagInfo, writer: BagWriter) -> None:
    for number, file in enumerate(info.files):
        if number:
            writer.split()
        for message in FileScan(file.path).messages():
            name = message.topic.name
            writer.write(name, message.data, message.log_time_ns, message.publish_time_ns)
