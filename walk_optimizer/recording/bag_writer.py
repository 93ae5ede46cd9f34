"""A bag directory, while it is written: files, splits, metadata.yaml. One thread, no queue."""

import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType

from walk_optimizer.recording.disk import replace_text, write_error
from walk_optimizer.recording.errors import (
    BagExistsError,
    BagNotWritableError,
    RecordingError,
)
from walk_optimizer.recording.mcap_file import McapFile
from walk_optimizer.recording.metadata import METADATA_FILE, BagMetadata, FileEntry, file_name
from walk_optimizer.recording.reserve import Reserve
from walk_optimizer.recording.settings import RecorderSettings
from walk_optimizer.recording.topics import (
    NANOSECONDS_PER_SECOND,
    TopicInfo,
    require_message,
    require_same_type,
)

DEFAULT_ROS_DISTRO = "jazzy"
"""Distribution named in bags where the environment does not say another one."""


class BagWriter:
    """Writes a rosbag2 directory with MCAP storage.

    Every call may take as long as the disk does; `Recorder` is for those who cannot wait.
    """

    def __init__(
        self,
        directory: Path,
        settings: RecorderSettings | None = None,
        custom_data: Mapping[str, str] | None = None,
        topics: Iterable[TopicInfo] = (),
        ros_distro: str = "",
    ) -> None:
        """Create the directory, its first file, and its metadata.yaml.

        Args:
            directory: Bag to create; missing parents are created too.
            settings: How to write it.
            custom_data: Free texts for metadata.yaml.
            topics: Topics to announce from the start; others may follow.
            ros_distro: ROS distribution that recorded the messages; that of the environment when empty.

        Raises:
            BagExistsError: If the directory is already there.
            BagNotWritableError: If it cannot be created.
            DiskFullError: If there is no space for it.
        """
        self.directory = directory
        self.settings = settings or RecorderSettings()
        self.custom_data = dict(custom_data or {})
        self._ros_distro = ros_distro or os.environ.get("ROS_DISTRO") or DEFAULT_ROS_DISTRO
        self._topics = {topic.name: topic for topic in topics}
        self._finished: list[FileEntry] = []
        self._finished_bytes = 0
        self._finished_messages = 0
        self._file: McapFile | None = None
        self._closed = False
        self._reserve = Reserve(directory)
        self._description_bytes = 0
        _create_directory(directory)
        try:
            self._file = self._begin_file()
            self._write_metadata()
            self._keep_reserve(self._file)
        except RecordingError:
            self._reserve.release()
            if self._file is not None:
                self._file.discard()
            # It was made just now, and a bag without files is none.
            shutil.rmtree(directory, ignore_errors=True)
            raise

    def __enter__(self) -> "BagWriter":
        """Return the writer."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the bag."""
        self.close()

    @property
    def messages(self) -> int:
        """Messages in the bag; the open chunk is in it, unless a failed write has lost that."""
        return self._count(self._file.messages if self._file else 0)

    @property
    def stored_messages(self) -> int:
        """Messages that a crash of this process cannot take away."""
        return self._count(self._file.stored.message_count if self._file else 0)

    @property
    def size(self) -> int:
        """Size of the files on the disk in [byte]; the open chunk is not in it."""
        return self._finished_bytes + (self._file.size if self._file else 0)

    @property
    def topics(self) -> tuple[TopicInfo, ...]:
        """Topics announced so far."""
        return tuple(self._topics.values())

    def add_topic(self, topic: TopicInfo) -> None:
        """Announce a topic; announcing it again changes nothing.

        Raises:
            TopicError: If the topic is known with another type.
            RecordingError: If the disk refuses.
        """
        known = self._topics.get(topic.name)
        if known is not None:
            require_same_type(known, topic)
            return
        self._open_file().add_topic(topic)
        self._topics[topic.name] = topic
        self._write_metadata()

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int | None = None) -> bool:
        """Append a message.

        Args:
            topic: Name of an announced topic.
            data: The serialised message.
            log_time_ns: When it was recorded, in [ns].
            publish_time_ns: When it was published, in [ns]; `log_time_ns` when None.

        Returns:
            Whether that has brought a chunk to the disk.

        Raises:
            TopicError: If the topic was not announced.
            MessageError: If data or time cannot be stored.
            RecordingError: If the disk refuses; if it is just full, what was given so far is in the bag.
        """
        require_message(self._topics, topic, data, log_time_ns)
        if self._is_full(self._open_file(), log_time_ns):
            self.split()
        published_ns = log_time_ns if publish_time_ns is None else publish_time_ns
        file = self._open_file()
        stored = file.write(topic, data, log_time_ns, published_ns)
        if stored:
            self._keep_reserve(file)
        return stored

    def flush(self) -> None:
        """Bring what was written to the disk, the open chunk too if the settings say so.

        Raises:
            RecordingError: If the disk refuses, or the bag lies somewhere else by now, or nowhere.
        """
        file = self._open_file()
        self.require_in_place()
        file.sync(self.settings.close_chunk_on_flush)
        self._keep_reserve(file)

    def require_in_place(self) -> None:
        """Refuse to go on with a bag that others have taken away; for a bag that is not closed.

        Raises:
            BagNotWritableError: If it was moved or deleted.
        """
        if not (self._file.in_place if self._file is not None else self.directory.is_dir()):
            raise BagNotWritableError(
                f"The bag {self.directory} was moved or deleted while it was recorded; what was moved can be "
                "saved by `walk-optimizer bag repair`"
            )

    def split(self) -> None:
        """End the current file and begin the next one."""
        self._end_file(self._open_file())
        self._file = self._begin_file()
        self._write_metadata()

    def close(self) -> None:
        """End the bag; closing it again changes nothing.

        On a full disk the reserve has the space for that. After another failed write the file gets an end
        without an index, and without the open chunk.

        Raises:
            RecordingError: If the disk refuses; what could be ended is ended nevertheless.
        """
        if self._closed:
            return
        self._closed = True
        self._reserve.release()
        try:
            # There is none if a further one could not be begun.
            if self._file is not None:
                self._end_file(self._file)
        finally:
            self._write_metadata()

    def _open_file(self) -> McapFile:
        if self._file is None:
            raise BagNotWritableError(f"The bag {self.directory} is closed")
        return self._file

    def _begin_file(self) -> McapFile:
        # Where the disk is full already, no further file is begun.
        self._reserve.hold(self._description_bytes)
        name = file_name(self.directory.name, len(self._finished))
        file = McapFile(self.directory / name, self.settings, self._reserve)
        try:
            # It stands again at the end, with the counts; a killed recording has only this one. Of the other
            # files it says nothing: the more there are, the longer each would be.
            file.add_metadata(self._metadata([file.entry]).to_record())
            for topic in self.topics:
                file.add_topic(topic)
        except RecordingError:
            file.discard()
            raise
        return file

    def _end_file(self, file: McapFile) -> None:
        self._file = None
        try:
            file.finish(self._metadata([file.entry]).to_record())
        finally:
            self._finished.append(file.entry)
            self._finished_bytes += file.size
            self._finished_messages += file.messages

    def _is_full(self, file: McapFile, log_time_ns: int) -> bool:
        """Whether the next message belongs into a new file, by the rules of rosbag2."""
        settings = self.settings
        # A file holds a chunk at the least, however small the limit is.
        if settings.max_file_bytes and file.size >= settings.max_file_bytes:
            return file.stored.message_count > 0
        if settings.max_file_duration and file.start_time_ns is not None:
            span = settings.max_file_duration * NANOSECONDS_PER_SECOND
            return log_time_ns - file.start_time_ns > span
        return False

    def _metadata(self, entries: Sequence[FileEntry]) -> BagMetadata:
        return BagMetadata(self.topics, entries, self._ros_distro, self.custom_data)

    def _keep_reserve(self, file: McapFile) -> None:
        """Keep the space for the end of the bag: of its open file, and of its description.

        Raises:
            RecordingError: If the disk is full.
        """
        self._reserve.hold(file.end_bytes + self._description_bytes)

    def _write_metadata(self) -> None:
        path = self.directory / METADATA_FILE
        entries = [*self._finished, *([self._file.entry] if self._file else [])]
        text = self._metadata(entries).to_file()
        # It is written to the file and beside it, and its numbers grow longer.
        self._description_bytes = 3 * len(text)
        try:
            replace_text(path, text)
        except OSError as error:
            raise write_error(path, error) from error

    def _count(self, in_open_file: int) -> int:
        return self._finished_messages + in_open_file


def _create_directory(directory: Path) -> None:
    try:
        directory.mkdir(parents=True)
    except FileExistsError as error:
        raise BagExistsError(f"{directory} exists already; a bag is never overwritten") from error
    except OSError as error:
        raise write_error(directory, error) from error
