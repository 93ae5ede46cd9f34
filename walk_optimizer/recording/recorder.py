"""Records beside a fast loop: a bounded queue, and a thread that writes the bag."""

import atexit
import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Protocol

from walk_optimizer.recording.bag_writer import BagWriter
from walk_optimizer.recording.disk import MAKE_SPACE, free_bytes, nearest_directory, write_error
from walk_optimizer.recording.errors import DiskFullError, RecordingError
from walk_optimizer.recording.inbox import Inbox
from walk_optimizer.recording.settings import RecorderSettings
from walk_optimizer.recording.status import RecorderStatus
from walk_optimizer.recording.topics import TopicInfo, require_message, require_same_type

DROPPED_KEY = "dropped_messages"
"""Key in the custom data of metadata.yaml under which a bag owns up to its gaps."""

# So many messages gather for a rest: a thread that woke up for each would hold up those who write, one that
# stored many at once those who read, on a machine with few processors. Readers have just been woken up when
# a rest begins: they have the pause to themselves. No message waits longer than the patience. In [s].
_BATCH, _PAUSE, _PATIENCE = 9, 0.0002, 0.05


class RecorderLog(Protocol):
    """Takes what an operator has to know, from any thread; Python's loggers do."""

    def warning(self, message: str, /) -> object:
        """Tell of messages that the bag lacks."""

    def error(self, message: str, /) -> object:
        """Tell why the recording has ended by itself."""


class _Entry(NamedTuple):
    """A message on its way to the bag; times in [ns]."""

    topic: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int | None


@dataclass(frozen=True)
class _Progress:
    """What the thread last said; replaced as a whole, so that readers need no lock."""

    messages: int = 0
    stored_messages: int = 0
    size_bytes: int = 0
    lost: int = 0


class Recorder:
    """Writes a bag in the background; `write` never waits for the disk.

    Owns the thread, the queue and the limit of free space. Does not own the layout of the bag
    (`BagWriter`), nor how messages become bytes (`ros_messages`).

    A full disk or any other failure ends the recording, not the program: `write` then returns
    False, and `status` says why.
    """

    def __init__(
        self,
        directory: Path,
        settings: RecorderSettings | None = None,
        custom_data: Mapping[str, str] | None = None,
        free_space: Callable[[Path], int] = free_bytes,
        log: RecorderLog | None = None,
    ) -> None:
        """Prepare a recording; nothing is written before `start`.

        Args:
            directory: Bag to create.
            settings: How to write it.
            custom_data: Free texts for metadata.yaml.
            free_space: Returns the free space at a place in [byte].
            log: Gets what goes wrong; Python's logging when None.
        """
        self.directory = directory
        self.settings = settings or RecorderSettings()
        self._custom_data = dict(custom_data or {})
        self._free_space = free_space
        self._log: RecorderLog = log or logging.getLogger(__name__)
        self._topics: dict[str, TopicInfo] = {}
        self._inbox: Inbox[_Entry | TopicInfo] = Inbox(self.settings.queue_messages, _BATCH)
        self._thread: threading.Thread | None = None
        self._error: RecordingError | None = None
        self._progress = _Progress()
        self._taken = 0
        self._reported = 0

    def __enter__(self) -> "Recorder":
        """Start the recording."""
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the recording."""
        self.stop()

    def add_topic(self, topic: TopicInfo) -> None:
        """Announce a topic, before or after the start; announcing it again changes nothing.

        Raises:
            TopicError: If the topic is known with another type.
        """
        known = self._topics.get(topic.name)
        if known is not None:
            require_same_type(known, topic)
            return
        self._topics[topic.name] = topic
        if self._thread is not None:
            self._inbox.push(topic)

    def start(self) -> None:
        """Create the bag and begin to take messages.

        Raises:
            BagExistsError: If the directory is already there.
            BagNotWritableError: If it cannot be created.
            DiskFullError: If there is less free space than the settings want.
            RecordingError: If the recorder was started before; each one makes one bag.
        """
        if self._thread is not None:
            raise RecordingError(f"The recorder of {self.directory} was started before")
        try:
            self._require_space(nearest_directory(self.directory))
        except OSError as error:
            raise write_error(self.directory, error) from error
        topics = tuple(self._topics.values())
        writer = BagWriter(self.directory, self.settings, self._custom_data, topics)
        # A daemon, so that a program that forgets to stop can end; the exit hook closes its bag.
        self._thread = threading.Thread(target=self._run, args=(writer,), name="bag_recorder", daemon=True)
        self._thread.start()
        atexit.register(self.stop)

    def write(self, topic: str, data: bytes, log_time_ns: int, publish_time_ns: int | None = None) -> bool:
        """Hand over a message without waiting for anything.

        Args:
            topic: Name of an announced topic.
            data: The serialised message.
            log_time_ns: When it was recorded, in [ns].
            publish_time_ns: When it was published, in [ns]; `log_time_ns` when None.

        Returns:
            Whether the message was taken; one that was not is counted as dropped, unless the recording has
            ended.

        Raises:
            TopicError: If the topic was not announced.
            MessageError: If data or time cannot be stored.
            RecordingError: If the recorder was not started.
        """
        if self._thread is None:
            raise RecordingError(f"The recorder of {self.directory} was not started")
        require_message(self._topics, topic, data, log_time_ns)
        return self._inbox.offer(_Entry(topic, data, log_time_ns, publish_time_ns))

    def rest(self) -> None:
        """Say that nothing is written for a moment: the thread then has the time to store what waits."""
        self._inbox.rest()

    def status(self) -> RecorderStatus:
        """Return how the recording is going."""
        progress = self._progress
        return RecorderStatus(
            directory=self.directory,
            recording=self._thread is not None and not self._inbox.closed,
            messages=progress.messages,
            stored_messages=progress.stored_messages,
            queued=len(self._inbox),
            dropped=self._inbox.rejected + progress.lost,
            size_bytes=progress.size_bytes,
            error=self._error,
        )

    def stop(self) -> RecorderStatus:
        """Write what waits, close the bag, and return the final status; again is harmless.

        Not for signal handlers: it waits for the thread, which may wait for whatever the handler
        has interrupted. Let the handler end the main loop, and stop after it.
        """
        if self._thread is not None:
            self._inbox.close()
            self._thread.join()
            atexit.unregister(self.stop)
        return self.status()

    def _run(self, writer: BagWriter) -> None:
        """Body of the thread."""
        try:
            self._record(writer)
        except RecordingError as error:
            self._error = error
        except Exception as error:  # noqa: BLE001  # a thread that dies in silence loses the bag
            self._error = RecordingError(f"The recorder failed unexpectedly: {error!r}")
        self._end(writer)

    def _record(self, writer: BagWriter) -> None:
        next_flush = time.monotonic() + self.settings.flush_period
        closed = False
        while not closed:
            items, closed = self._take(_PATIENCE, _PAUSE)
            for item in items:
                self._store(writer, item)
            if time.monotonic() >= next_flush:
                writer.flush()
                self._report_dropped()
                next_flush = time.monotonic() + self.settings.flush_period
            self._note_progress(writer)

    def _take(self, patience: float = 0.0, pause: float = 0.0) -> tuple[list[_Entry | TopicInfo], bool]:
        """Take what waits in the queue, and count the messages that are from now on ours to store."""
        items, closed = self._inbox.take(patience, pause)
        self._taken += sum(isinstance(item, _Entry) for item in items)
        return items, closed

    def _store(self, writer: BagWriter, item: _Entry | TopicInfo) -> None:
        if isinstance(item, TopicInfo):
            writer.add_topic(item)
            return
        size = writer.size
        writer.write(item.topic, item.data, item.log_time_ns, item.publish_time_ns)
        if writer.size != size:
            self._require_space(self.directory)

    def _require_space(self, directory: Path) -> None:
        free, least = self._free_space(directory), self.settings.min_free_bytes
        if free < least:
            raise DiskFullError(
                f"Not recording to {self.directory}: {free / 1e6:.1f} MB are free on the"
                f" disk, and {least / 1e6:.1f} MB must stay free; {MAKE_SPACE}"
            )

    def _report_dropped(self) -> None:
        dropped = self._inbox.rejected - self._reported
        if dropped:
            limit = self.settings.queue_messages
            self._log.warning(
                f"{self.directory}: {dropped} messages dropped, the queue of {limit} was full: the disk is "
                "too slow; record fewer topics, or to a faster disk"
            )
        self._reported += dropped

    def _end(self, writer: BagWriter) -> None:
        """Close the bag, whatever happened to it, and count what is not in it."""
        self._report_dropped()
        self._inbox.close()
        self._take()
        lost = self._taken - writer.messages
        writer.custom_data[DROPPED_KEY] = str(self._inbox.rejected + lost)
        try:
            writer.close()
        except RecordingError as error:
            self._error = self._error or error
        self._note_progress(writer, lost=self._taken - writer.messages)
        if self._error is not None:
            self._log.error(f"the recording has ended: {self._error}")

    def _note_progress(self, writer: BagWriter, lost: int = 0) -> None:
        self._progress = _Progress(writer.messages, writer.stored_messages, writer.size, lost)
