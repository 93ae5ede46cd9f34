"""Space on the disk that is kept for the end of a bag: its index and description come last."""

import contextlib
import errno
import os
from pathlib import Path

from walk_optimizer.recording.disk import write_error

# The reserve grows by so much at once, in [byte].
_STEP = 64 * 1024


class Reserve:
    """A file without a name: nobody meets it, and it is gone with the process, however that ends."""

    def __init__(self, directory: Path) -> None:
        """Hold nothing yet.

        Args:
            directory: The bag.
        """
        self._directory = directory
        self._descriptor: int | None = None
        self._size = 0
        self._refusal: OSError | None = None

    def hold(self, size: int) -> None:
        """Hold that much from now on, in [byte]; never less than before.

        Raises:
            RecordingError: If the disk has not so much, or the space was released because the disk is full.
        """
        try:
            if self._refusal is not None:
                raise self._refusal
            while self._size < size:
                # Random: some disks take no space for zeros.
                self._size += os.write(self._open(), os.urandom(_STEP))
        except OSError as error:
            # Files may not be larger: that is no matter of the disk, and what fits is held.
            if error.errno != errno.EFBIG or self._refusal is not None:
                raise write_error(self._directory, error) from error

    def release(self, refusal: OSError | None = None) -> bool:
        """Give the space back to the disk, for what has to be written now.

        Args:
            refusal: That of the disk to write something else; `hold` raises it from now on.

        Returns:
            Whether there was any.
        """
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is None:
            return False
        self._refusal = refusal
        with contextlib.suppress(OSError):
            os.close(descriptor)
        return True

    def _open(self) -> int:
        if self._descriptor is None:
            path = self._directory / ".reserve"
            self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
            path.unlink()
        return self._descriptor
