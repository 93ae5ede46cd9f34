"""How a recording is going, as a value."""

from dataclasses import dataclass
from pathlib import Path

from walk_optimizer.recording.errors import RecordingError


@dataclass(frozen=True)
class RecorderStatus:
    """How a recording is going.

    Attributes:
        directory: The bag.
        recording: Whether further messages are taken.
        messages: Messages in the bag, those in the open chunk included.
        stored_messages: Messages that a crash of this process cannot take away.
        queued: Messages that wait for the disk.
        dropped: Messages that were offered while it was recording, but are not in the bag and will not be.
        size_bytes: Size of the files on the disk in [byte].
        free_bytes: Free space of the disk in [byte], as last measured; 0 before the start.
        error: Why the recording ended on its own; None if it did not.
    """

    directory: Path
    recording: bool
    messages: int
    stored_messages: int
    queued: int
    dropped: int
    size_bytes: int
    free_bytes: int
    error: RecordingError | None
