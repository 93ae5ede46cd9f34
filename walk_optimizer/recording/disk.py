"""The disk below a bag: its free space, its refusals, texts that are replaced as a whole."""

import contextlib
import errno
import os
import shutil
from pathlib import Path

from walk_optimizer.errors import shortened
from walk_optimizer.recording.errors import BagNotWritableError, DiskFullError, RecordingError
from walk_optimizer.resources import sync_directory

# Full disk, used-up quota, and the size limit of a file: for a recording all the same.
FULL_ERRNOS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""What the operating system says of a disk that is full."""

MAKE_SPACE = "free space, or record to another disk"
"""What helps against a full disk."""


def replace_text(path: Path, text: str) -> None:
    """Give a file a new content such that a crash leaves either the old or the new one.

    Args:
        path: File to write; an existing one is replaced.
        text: The new content.

    Raises:
        OSError: If that failed; a former file is as before.
    """
    draft = path.with_name(f".{path.name}.new")
    try:
        with draft.open("w", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        draft.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise
    sync_directory(path.parent)


def free_bytes(directory: Path) -> int:
    """Return the space that an ordinary user may still fill below a directory, in [byte]."""
    return shutil.disk_usage(directory).free


def nearest_directory(path: Path) -> Path:
    """Return the deepest existing directory on the way to a path, which tells its disk."""
    return next((place for place in path.absolute().parents if place.is_dir()), Path("/"))


def write_error(path: Path, error: OSError) -> RecordingError:
    """Return the recording error that says what an operating system error means for a bag."""
    reason = error.strerror or str(error)
    place = shortened(str(path)) if error.errno == errno.ENAMETOOLONG else path
    if error.errno in FULL_ERRNOS:
        return DiskFullError(f"Cannot write {place}: {reason}; {MAKE_SPACE}")
    return BagNotWritableError(f"Cannot write {place}: {reason}; name a folder that can be written")
