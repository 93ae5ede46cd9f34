"""The thread that writes a bag: the only one that ever waits for the disk."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from walk_optimizer.recording.bag_writer import BagWriter
from walk_optimizer.recording.errors import RecordingError
from walk_optimizer.recording.inbox import Inbox
from walk_optimizer.recording.topics import TopicInfo

DROPPED_KEY = "dropped_messages"
"""Key in the custom data of metadata.yaml under which a bag owns up to its gaps."""

# So many messages gather for a rest: a thread that woke up for each would hold up those who write, one that
# stored many at once those who read, on a machine with few processors. Readers have just been woken up when
# a rest begins: they have the pause to themselves. No message waits longer than the patience. In [s].
BATCH = 9
_PAUSE, _PATIENCE = 0.0002, 0.05


class RecorderLog(Protocol):
    """Takes what an operator has to know, from any thread; Python's loggers do."""

    def warning(self, message: str, /) -> object:
        """Tell of messages that the bag lacks."""

    def error(self, message: str, /) -> object:
        """Tell why the recording has ended by itself."""


class Entry(NamedTuple):
    """A message on its way to the bag; times in [ns]."""

    topic: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int | None


@dataclass(frozen=True)
class Progress:
    """What the thread last said; replaced as a whole, so that readers need no lock.

    Attributes:
        messages: Messages in the bag, those in the open chunk included.
        stored_messages: Messages that a crash of this process cannot take away.
        size_bytes: Size of the files on the disk in [byte].
        free_bytes: Free space of the disk in [byte], as last measured.
        lost: Messages that were taken from the queue, but are not in the bag and will not be.
    """

    messages: int = 0
    stored_messages: int = 0
    size_bytes: int = 0
    free_bytes: int = 0
    lost: int = 0


class RecordingThread:
    """Takes messages from a queue to a bag until the queue is closed or the disk refuses.

    Does not own the layout of the bag (`BagWriter`), nor who may write when (`Recorder`).

    Attributes:
        progress: How far it is.
        error: Why it has ended by itself; None if it has not.
    """

    def __init__(
        self,
        writer: BagWriter,
        inbox: Inbox[Entry | TopicInfo],
        require_space: Callable[[], int],
        free: int,
        log: RecorderLog | None,
    ) -> None:
        """Start.

        Args:
            writer: The bag, just begun.
            inbox: The queue.
            require_space: Returns the free space of the disk in [byte], or raises a RecordingError if that is
                too little.
            free: That space at the start in [byte].
            log: Gets what goes wrong; Python's logging when None.
        """
        self._writer, self._inbox, self._require_space = writer, inbox, require_space
        self._log: RecorderLog = log or logging.getLogger(__name__)
        self.progress = Progress(free_bytes=free)
        self.error: RecordingError | None = None
        self._free_bytes = free
        self._taken = 0
        self._reported = 0
        # A daemon, so that a program that forgets to stop can end; the exit hook closes its bag.
        self._thread = threading.Thread(target=self._run, name="bag_recorder", daemon=True)
        self._thread.start()

    def join(self) -> None:
        """Wait until the bag is closed."""
        self._thread.join()

    def _run(self) -> None:
        try:
            self._record()
        except RecordingError as error:
            self.error = error
        except Exception as error:  # noqa: BLE001  # a thread that dies in silence loses the bag
            self.error = RecordingError(f"The recorder failed unexpectedly: {error!r}")
        self._end()

    def _record(self) -> None:
        period = self._writer.settings.flush_period
        next_flush = time.monotonic() + period
        closed = False
        while not closed:
            items, closed = self._take(_PATIENCE, _PAUSE)
            for item in items:
                self._store(item)
            if time.monotonic() >= next_flush:
                self._writer.flush()
                self._report_dropped()
                self._measure_space()
                next_flush = time.monotonic() + period
            self._note_progress()

    def _take(self, patience: float = 0.0, pause: float = 0.0) -> tuple[list[Entry | TopicInfo], bool]:
        """Take what waits in the queue, and count the messages that are from now on ours to store."""
        items, closed = self._inbox.take(patience, pause)
        self._taken += sum(isinstance(item, Entry) for item in items)
        return items, closed

    def _store(self, item: Entry | TopicInfo) -> None:
        if isinstance(item, TopicInfo):
            self._writer.add_topic(item)
            return
        if self._writer.write(item.topic, item.data, item.log_time_ns, item.publish_time_ns):
            self._measure_space()

    def _measure_space(self) -> None:
        self._free_bytes = self._require_space()

    def _report_dropped(self) -> None:
        dropped = self._inbox.rejected - self._reported
        if dropped:
            limit = self._writer.settings.queue_messages
            self._log.warning(
                f"{self._writer.directory}: {dropped} messages dropped, the queue of {limit} was full: the "
                "disk is too slow; record fewer topics, or to a faster disk"
            )
        self._reported += dropped

    def _end(self) -> None:
        """Close the bag, whatever happened to it, and count what is not in it."""
        self._report_dropped()
        self._inbox.close()
        self._take()
        lost = self._taken - self._writer.messages
        self._writer.custom_data[DROPPED_KEY] = str(self._inbox.rejected + lost)
        in_place = self._is_in_place()
        try:
            self._writer.close()
        except RecordingError as error:
            self.error = self.error or error
        if in_place:
            self._note_progress(lost=self._taken - self._writer.messages)
        else:
            self.progress = Progress(free_bytes=self._free_bytes, lost=self._taken)
        if self.error is not None:
            self._log.error(f"the recording has ended: {self.error}")

    def _is_in_place(self) -> bool:
        """Return whether the bag, still open, lies where it was begun; if not, that is what went wrong."""
        try:
            self._writer.require_in_place()
        except RecordingError as error:
            self.error = error
            return False
        return True

    def _note_progress(self, lost: int = 0) -> None:
        writer = self._writer
        self.progress = Progress(writer.messages, writer.stored_messages, writer.size, self._free_bytes, lost)
