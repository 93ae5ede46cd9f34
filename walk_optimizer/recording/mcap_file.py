"""One .mcap file of a bag, while it is written."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, Writer

from walk_optimizer.recording.disk import write_error
from walk_optimizer.recording.errors import RecordingError
from walk_optimizer.recording.framing import MAGIC
from walk_optimizer.recording.metadata import FileEntry
from walk_optimizer.recording.record_file import RecordFile
from walk_optimizer.recording.reserve import Reserve
from walk_optimizer.recording.scan import METADATA_KEY, METADATA_RECORD
from walk_optimizer.recording.settings import Compression, RecorderSettings
from walk_optimizer.recording.topics import TopicInfo, qos_to_yaml
from walk_optimizer.resources import sync_directory

PROFILE = "ros2"
LIBRARY = f"walk_optimizer, {LIBRARY_IDENTIFIER}"

_COMPRESSIONS = {
    Compression.NONE: CompressionType.NONE,
    Compression.ZSTD: CompressionType.ZSTD,
    Compression.LZ4: CompressionType.LZ4,
}

# Upper bounds in [byte] of what the end of a file says of each chunk, of each topic in a chunk, of each topic
# beside its definition and quality of service, and of the rest; and a chunk of the usual size.
_PER_CHUNK, _PER_CHANNEL, _PER_TOPIC, _ENDING = 96, 10, 512, 1024
_CHUNK = 64 * 1024


class McapFile:
    """Writes one file such that it ends with a whole record at any time.

    Owns the file and its counts. Does not own when to begin another one, or metadata.yaml.
    """

    def __init__(self, path: Path, settings: RecorderSettings, reserve: Reserve) -> None:
        """Create the file.

        Args:
            path: File to create; it must not exist yet.
            settings: Size and compression of the chunks.
            reserve: Space for what is written when the disk is full.

        Raises:
            BagNotWritableError: If the file cannot be created.
            DiskFullError: If there is no space for it.
        """
        self.path = path
        self.broken = False
        self.stored = FileEntry(path.name)
        self._counts: Counter[str] = Counter()
        self._span: tuple[int, int] | None = None
        self._channels: dict[str, int] = {}
        self._schemas: dict[tuple[str, str], int] = {}
        self._chunks = 0
        self._largest_chunk = _CHUNK
        self._topic_bytes = 0
        try:
            self._file = RecordFile(path, reserve)
        except OSError as error:
            raise write_error(path, error) from error
        # Typed Any because some methods of the MCAP writer have no annotations at all.
        self._writer: Any = Writer(
            self._file,
            chunk_size=settings.chunk_bytes,
            compression=_COMPRESSIONS[settings.compression],
            enable_data_crcs=True,
        )
        self._start()

    def _start(self) -> None:
        try:
            with self._writing():
                self._writer.start(PROFILE, LIBRARY)
                sync_directory(self.path.parent)
        except RecordingError:
            self.discard()
            raise

    @property
    def size(self) -> int:
        """Size on the disk in [byte]; the open chunk is not in it."""
        return self._file.tell()

    @property
    def in_place(self) -> bool:
        """Whether the open file still lies where it was begun."""
        with self._writing():
            return self._file.lies_at(self.path)

    @property
    def entry(self) -> FileEntry:
        """What was written; the open chunk is in it, unless a failed write has lost that."""
        return self.stored if self.broken else self._written()

    @property
    def messages(self) -> int:
        """Messages of `entry`."""
        return self.stored.message_count if self.broken else self._counts.total()

    @property
    def start_time_ns(self) -> int | None:
        """Earliest log time that was written, in [ns]; None without messages."""
        return self._span[0] if self._span else None

    @property
    def end_bytes(self) -> int:
        """Space in [byte] that suffices to end the file: for the open chunk and the index."""
        # The open chunk may hold the topics too; it has an index of its own, of less than its size.
        index = self._chunks * (_PER_CHUNK + _PER_CHANNEL * len(self._channels))
        return 2 * self._largest_chunk + 2 * self._topic_bytes + index + _ENDING

    def add_topic(self, topic: TopicInfo) -> None:
        """Announce a topic; its messages may follow."""
        qos = qos_to_yaml(topic.qos)
        self._topic_bytes += len(topic.definition) + len(qos) + _PER_TOPIC
        with self._writing():
            schema = self._schemas.get((topic.type_name, topic.definition))
            if schema is None:
                schema = self._writer.register_schema(
                    topic.type_name, topic.definition_encoding, topic.definition.encode()
                )
                self._schemas[topic.type_name, topic.definition] = schema
            self._channels[topic.name] = self._writer.register_channel(
                topic.name,
                topic.serialization_format,
                schema,
                {
                    "offered_qos_profiles": qos,
                    "topic_type_hash": topic.type_hash,
                },
            )

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> bool:
        """Append a message of an announced topic, and return whether that has ended a chunk."""
        start, end = self._span or (log_time_ns, log_time_ns)
        self._span = min(start, log_time_ns), max(end, log_time_ns)
        self._counts[topic] += 1
        size = self._file.tell()
        # Not by a context manager: three of a message's seven microseconds.
        try:
            self._writer.add_message(self._channels[topic], log_time_ns, data, publish_time_ns)
        except OSError as error:
            raise self._failed(error) from error
        finally:
            grown = self._note_growth(size)
        return grown

    def add_metadata(self, text: str) -> None:
        """Append a description of the bag."""
        with self._writing():
            self._writer.add_metadata(METADATA_RECORD, {METADATA_KEY: text})

    def sync(self, close_chunk: bool) -> None:
        """Bring what was written to the disk.

        Args:
            close_chunk: Whether the open chunk goes along.
        """
        if close_chunk:
            with self._maybe_ending_chunk():
                self._writer.flush()
        with self._writing():
            self._file.sync()

    def finish(self, description: str) -> None:
        """Write the end of the file and close it; a broken one gets an end without an index.

        Args:
            description: The description of the bag that goes into the file.
        """
        try:
            if not self.broken:
                self.add_metadata(description)
                with self._maybe_ending_chunk():
                    self._writer.finish()
        finally:
            self._close()

    def discard(self) -> None:
        """Remove a file that could not be begun: it would make a damaged bag of a good one."""
        self._file.close()
        self.path.unlink()

    def _close(self) -> None:
        try:
            with self._writing():
                if self.broken:
                    self._write_bare_end()
                self._file.sync()
        finally:
            self._file.close()

    def _written(self) -> FileEntry:
        start, end = self._span or (None, None)
        return FileEntry(self.path.name, dict(self._counts), start, end)

    def _write_bare_end(self) -> None:
        """End a file whose writer has lost its thread; without an index, not every reader takes it."""
        end = RecordBuilder()
        DataEnd(0).write(end)
        Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(end)
        self._file.write(end.end() + MAGIC)

    @contextmanager
    def _maybe_ending_chunk(self) -> Iterator[None]:
        size = self.size
        try:
            with self._writing():
                yield
        finally:
            self._note_growth(size)

    def _note_growth(self, size: int) -> bool:
        """Take note when the file has grown, which here only the end of a chunk makes it do."""
        growth = self._file.tell() - size
        if growth:
            self.stored = self._written()
            self._chunks += 1
            self._largest_chunk = max(self._largest_chunk, growth)
        return growth != 0

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> RecordingError:
        """Take note that the disk has refused, and return the error that says so."""
        self.broken = True
        return write_error(self.path, error)
