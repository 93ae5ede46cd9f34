"""The disk below a bag: whole writes, syncs, free space."""

import contextlib
import errno
import os
import shutil
from pathlib import Path

from walk_optimizer.errors import shortened
from walk_optimizer.recording.errors import BagNotWritableError, DiskFullError, RecordingError
from walk_optimizer.resources import sync_directory

# Full disk, used-up quota, and the size limit of a file: for a recording all the same.
_FULL_ERRNOS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})


MAKE_SPACE = "free space, or record to another disk"
"""What helps against a full disk."""


class RecordFile:
    """A file that is only appended to, and that holds no half-written record.

    Nothing is buffered: what `write` was given is out of reach of a crash of this process. It has
    the methods that the MCAP library wants of a stream.
    """

    def __init__(self, path: Path) -> None:
        """Create the file.

        Args:
            path: File to create; it must not exist yet.

        Raises:
            OSError: If the file cannot be created.
        """
        self.path = path
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self._size = 0

    def tell(self) -> int:
        """Return the size of the file in [byte]."""
        return self._size

    def write(self, data: bytes) -> int:
        """Append all of the data, or nothing of it.

        Raises:
            OSError: If the data could not be written; the file is as before.
        """
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            # A torn record would hide whatever is appended behind it.
            os.ftruncate(self._descriptor, self._size)
            os.lseek(self._descriptor, self._size, os.SEEK_SET)
            raise
        self._size += len(data)
        return len(data)

    def flush(self) -> None:
        """Do nothing: there is no buffer. The MCAP library calls it."""

    def sync(self) -> None:
        """Wait until the disk has the file, so that it survives a loss of power."""
        os.fsync(self._descriptor)

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)


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
    if error.errno in _FULL_ERRNOS:
        return DiskFullError(f"Cannot write {place}: {reason}; {MAKE_SPACE}")
    return BagNotWritableError(f"Cannot write {place}: {reason}; name a folder that can be written")
