"""Records beside a fast loop: a bounded queue, and a thread that writes the bag."""

import atexit
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType

from walk_optimizer.recording.bag_writer import BagWriter
from walk_optimizer.recording.disk import MAKE_SPACE, free_bytes, nearest_directory, write_error
from walk_optimizer.recording.errors import DiskFullError, RecordingError
from walk_optimizer.recording.inbox import Inbox
from walk_optimizer.recording.recording_thread import BATCH, Entry, Progress, RecorderLog, RecordingThread
from walk_optimizer.recording.settings import RecorderSettings
from walk_optimizer.recording.status import RecorderStatus
from walk_optimizer.recording.topics import TopicInfo, require_message, require_same_type


class Recorder:
    """Writes a bag in the background; `write` never waits for the disk.

    Owns the queue and the limit of free space. Does not own what its thread does (`RecordingThread`),
    the layout of the bag (`BagWriter`), nor how messages become bytes (`ros_messages`).

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
        self._log = log
        self._topics: dict[str, TopicInfo] = {}
        self._inbox: Inbox[Entry | TopicInfo] = Inbox(self.settings.queue_messages, BATCH)
        self._thread: RecordingThread | None = None

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
        free = self._require_space()
        topics = tuple(self._topics.values())
        writer = BagWriter(self.directory, self.settings, self._custom_data, topics)
        self._thread = RecordingThread(writer, self._inbox, self._require_space, free, self._log)
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
        return self._inbox.offer(Entry(topic, data, log_time_ns, publish_time_ns))

    def rest(self) -> None:
        """Say that nothing is written for a moment: the thread then has the time to store what waits."""
        self._inbox.rest()

    def status(self) -> RecorderStatus:
        """Return how the recording is going."""
        thread = self._thread
        progress = thread.progress if thread is not None else Progress()
        return RecorderStatus(
            directory=self.directory,
            recording=thread is not None and not self._inbox.closed,
            messages=progress.messages,
            stored_messages=progress.stored_messages,
            queued=len(self._inbox),
            dropped=self._inbox.rejected + progress.lost,
            size_bytes=progress.size_bytes,
            free_bytes=progress.free_bytes,
            error=thread.error if thread is not None else None,
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

    def _require_space(self) -> int:
        """Return the free space of the disk of the bag in [byte].

        Raises:
            DiskFullError: If that is less than the settings want.
            BagNotWritableError: If the disk does not tell.
        """
        try:
            free = self._free_space(nearest_directory(self.directory))
        except OSError as error:
            raise write_error(self.directory, error) from error
        least = self.settings.min_free_bytes
        if free < least:
            raise DiskFullError(
                f"Not recording to {self.directory}: {free / 1e6:.1f} MB are free on the"
                f" disk, and {least / 1e6:.1f} MB must stay free; {MAKE_SPACE}"
            )
        return free
