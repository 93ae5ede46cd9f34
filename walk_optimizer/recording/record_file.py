"""A file of whole records, on a disk that may get full."""

import os
from pathlib import Path

from walk_optimizer.recording.disk import FULL_ERRNOS
from walk_optimizer.recording.reserve import Reserve


class RecordFile:
    """A file that is only appended to, and that holds no half-written record.

    Nothing is buffered: what `write` was given is out of reach of a crash of this process. It has
    the methods that the MCAP library wants of a stream.
    """

    def __init__(self, path: Path, reserve: Reserve) -> None:
        """Create the file.

        Args:
            path: File to create; it must not exist yet.
            reserve: Released when the disk is full, for the write that finds it so.

        Raises:
            OSError: If the file cannot be created.
        """
        self._reserve = reserve
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self._size = 0

    def tell(self) -> int:
        """Return the size of the file in [byte]."""
        return self._size

    def write(self, data: bytes) -> int:
        """Append all of the data, or nothing of it.

        Raises:
            OSError: If the data could not be written, even to the reserve; the file is as before.
        """
        try:
            self._append(data)
        except OSError as error:
            # The MCAP library loses its thread when a write is refused: no index could follow.
            if error.errno not in FULL_ERRNOS or not self._reserve.release(error):
                raise
            self._append(data)
        self._size += len(data)
        return len(data)

    def flush(self) -> None:
        """Do nothing: there is no buffer. The MCAP library calls it."""

    def sync(self) -> None:
        """Wait until the disk has the file, so that it survives a loss of power."""
        os.fsync(self._descriptor)

    def lies_at(self, path: Path) -> bool:
        """Return whether that is this file, and not another one or none."""
        try:
            return os.path.samestat(os.fstat(self._descriptor), path.stat())
        except FileNotFoundError:
            return False

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)

    def _append(self, data: bytes) -> None:
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            # A torn record would hide whatever is appended behind it.
            os.ftruncate(self._descriptor, self._size)
            os.lseek(self._descriptor, self._size, os.SEEK_SET)
            raise
