"""The messages of one bag file, each with its topic, and what was wrong with the file."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from mmap import ACCESS_READ, mmap
from pathlib import Path
from stat import S_ISREG

from mcap.records import Channel, McapRecord, Message, Metadata, Schema

from walk_optimizer.recording.errors import NotABagError
from walk_optimizer.recording.framing import MAGIC, find_chunk, read_blocks, read_summary
from walk_optimizer.recording.records import Block, Damage, DamageKind
from walk_optimizer.recording.topics import TopicInfo, qos_from_yaml

METADATA_RECORD = "rosbag2"
METADATA_KEY = "serialized_metadata"


@dataclass(frozen=True)
class BagMessage:
    """A message as it lies in a bag.

    Attributes:
        topic: The topic it was published on.
        data: The serialised message.
        log_time_ns: When it was recorded, in [ns].
        publish_time_ns: When it was published, in [ns].
    """

    topic: TopicInfo
    data: bytes
    log_time_ns: int
    publish_time_ns: int


@dataclass
class FileScan:
    """One walk through a bag file; the findings are whole once `messages` has run to its end.

    Attributes:
        path: The file.
        topics: Topics by channel number.
        damage: What could not be trusted, in the order of the file.
        compressions: Compressions that its chunks use, in the order met; empty text for none.
        chunks: Chunks that were read whole.
        lost_messages: Messages of damaged chunks, as far as an index still counts them, and
            messages whose topic was lost.
        foreign_records: Attachments and metadata of other programs.
        bag_metadata: The latest description of the bag that the file holds, in YAML.
    """

    path: Path
    topics: dict[int, TopicInfo] = field(default_factory=dict)
    damage: list[Damage] = field(default_factory=list)
    compressions: list[str] = field(default_factory=list)
    chunks: int = 0
    lost_messages: int = 0
    foreign_records: int = 0
    bag_metadata: str | None = None
    _schemas: dict[int, Schema] = field(default_factory=dict)

    def messages(self) -> Iterator[BagMessage]:
        """Walk through the file once, in the order of recording.

        Yields:
            The messages of all chunks whose checksum is right.

        Raises:
            NotABagError: If the file is missing or no MCAP file at all.
        """
        try:
            # Looked at first, because to open a named pipe would wait for its writer forever.
            if not S_ISREG(self.path.stat().st_mode):
                raise NotABagError(f"{self.path} is no regular file; name a bag directory or an .mcap file")
            with self.path.open("rb") as stream:
                start = stream.read(len(MAGIC))
                if self._is_empty(start):
                    return
                # Files of /proc have content, but no size, and so no memory map.
                if not self.path.stat().st_size:
                    raise self._no_mcap(start)
                with mmap(stream.fileno(), 0, access=ACCESS_READ) as data:
                    self._require_mcap(data)
                    yield from self._walk(data)
        except OSError as error:
            raise NotABagError(f"Cannot read {self.path}: {error.strerror}") from error

    def _is_empty(self, start: bytes) -> bool:
        """Whether the recording was killed before it had written anything."""
        if len(start) == len(MAGIC) or not MAGIC.startswith(start):
            return False
        reason = f"the file ends after {len(start)} bytes, before its first record"
        self.damage.append(Damage(0, DamageKind.CUT_OFF, reason))
        return True

    def _require_mcap(self, data: mmap) -> None:
        if data[: len(MAGIC)] != MAGIC and find_chunk(data, 0) is None:
            raise self._no_mcap(data[: len(MAGIC)])

    def _no_mcap(self, start: bytes) -> NotABagError:
        return NotABagError(
            f"{self.path} is no MCAP file: it begins with {start!r}, such a file with {MAGIC!r}"
        )

    def _walk(self, data: mmap) -> Iterator[BagMessage]:
        # The end of the file repeats the topics: they are then known even if the chunk that
        # introduces them is the damaged one.
        for record in read_summary(data) or []:
            self._take_description(record)
        index_counts_lost = False
        for item in read_blocks(data):
            if isinstance(item, Damage):
                self.damage.append(item)
                index_counts_lost = item.kind is DamageKind.CHUNK
                continue
            index_counts_lost = index_counts_lost and not item.records
            self.lost_messages += item.indexed_messages if index_counts_lost else 0
            yield from self._take_block(item)

    def _take_block(self, block: Block) -> Iterator[BagMessage]:
        if block.compression is not None:
            self.chunks += 1
            if block.compression not in self.compressions:
                self.compressions.append(block.compression)
        self.foreign_records += block.is_attachment
        for record in block.records:
            if not isinstance(record, Message):
                self._take_description(record)
            elif (topic := self.topics.get(record.channel_id)) is None:
                self.lost_messages += 1
            else:
                yield BagMessage(topic, record.data, record.log_time, record.publish_time)

    def _take_description(self, record: McapRecord) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self.topics[record.id] = self._topic(record)
        elif isinstance(record, Metadata) and record.name != METADATA_RECORD:
            self.foreign_records += 1
        elif isinstance(record, Metadata):
            self.bag_metadata = record.metadata.get(METADATA_KEY, self.bag_metadata)

    def _topic(self, channel: Channel) -> TopicInfo:
        schema = self._schemas.get(channel.schema_id) or Schema(0, b"", "", "")
        return TopicInfo(
            name=channel.topic,
            type_name=schema.name,
            definition=schema.data.decode("utf-8", errors="replace"),
            type_hash=channel.metadata.get("topic_type_hash", ""),
            qos=qos_from_yaml(channel.metadata.get("offered_qos_profiles", "")),
            definition_encoding=schema.encoding,
            serialization_format=channel.message_encoding,
        )
