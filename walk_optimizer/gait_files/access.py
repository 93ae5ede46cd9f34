"""Careful reading and writing of small files: no links, no devices, no half-written file."""

import contextlib
import errno
import os
import stat
import tempfile
from pathlib import Path

from walk_optimizer.errors import GaitFileError, GaitNotWritableError, shortened
from walk_optimizer.resources import sync_directory


def files_in(folder: Path, suffix: str) -> list[Path]:
    """Return the files of a folder that end in a suffix, by name and without hidden ones.

    Args:
        folder: Where to look; where there is none, there are no files.
        suffix: Of the files.

    Raises:
        GaitFileError: the folder can't be read.
    """
    try:
        paths = sorted(folder.iterdir())
    except FileNotFoundError:
        return []
    except OSError as error:
        raise GaitFileError(f"{folder}: the folder can't be read: {error.strerror}") from error
    return [path for path in paths if path.name.endswith(suffix) and not path.name.startswith(".")]


def read_limited(path: Path, largest: int) -> bytes:
    """Return the content of a regular file.

    Args:
        path: The file; a symbolic link is refused.
        largest: Most bytes that it may have.

    Raises:
        GaitFileError: the file is missing, no regular file, or too large.
    """
    try:
        # Without O_NONBLOCK a named pipe would wait for a writer forever.
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        with os.fdopen(descriptor, "rb") as stream:
            status = os.fstat(stream.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise GaitFileError(f"{path}: no regular file")
            if status.st_size > largest:
                raise GaitFileError(f"{path}: {status.st_size} bytes, a gait file has at most {largest}")
            return stream.read(largest)
    except OSError as error:
        # What O_NOFOLLOW makes of a link; to ask the path needs the right to enter its folder.
        if error.errno == errno.ELOOP:
            raise GaitFileError(f"{path}: a symbolic link, which is not followed") from error
        raise GaitFileError(f"{path}: can't be read: {error.strerror}") from error


def replace_file(path: Path, data: bytes) -> None:
    """Give a file a new content such that a crash leaves either the old or the new one.

    Raises:
        GaitNotWritableError: the file can't be written; a former one is as before.
    """
    draft = None
    try:
        descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".new", dir=path.parent)
        draft = Path(name)
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fchmod(stream.fileno(), 0o644)
            os.fsync(stream.fileno())
        draft.replace(path)
        sync_directory(path.parent)
    except OSError as error:
        raise GaitNotWritableError(f"{path}: can't be written: {error.strerror}") from error
    finally:
        # Also on Ctrl-C: only a killed process leaves its draft, which no reader takes for a gait.
        if draft is not None:
            with contextlib.suppress(OSError):
                draft.unlink(missing_ok=True)


def writable_folder(folder: Path, create: bool) -> None:
    """Make sure that files can be written into a folder.

    Args:
        folder: The folder; a symbolic link is refused, so that no other place is written to.
        create: Whether to create it when it is missing.

    Raises:
        GaitNotWritableError: the folder is missing, a link, no folder, or not writable; the message names it.
    """
    try:
        if folder.is_symlink():
            raise GaitNotWritableError(
                f"{folder}: the folder is a symbolic link, which is not written through"
            )
        if create:
            folder.mkdir(parents=True, exist_ok=True)
        if not folder.is_dir():
            raise GaitNotWritableError(f"{folder}: the folder is missing; create it or name another")
        # Permissions alone do not tell: the file system may be read-only, or full.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise GaitNotWritableError(f"{folder}: the folder is not writable: {error.strerror}") from error


def writable_target(path: Path) -> None:
    """Make sure, before any work, that a file can be put where a user wants it.

    Raises:
        GaitFileError: the folder is missing, not writable or can't be looked into, or the path is a folder.
    """
    folder = path.absolute().parent
    try:
        if path.is_dir():
            raise GaitFileError(f"{path}: a folder, expected a file name")
        if not folder.is_dir():
            raise GaitFileError(f"{path}: the folder {folder} is missing")
        target = path if path.exists() else folder
    except OSError as error:
        place = shortened(str(path))
        raise GaitFileError(f"{place}: can't be written: {error.strerror}; name another file") from error
    if not os.access(target, os.W_OK):
        raise GaitFileError(f"{path}: not writable")


def write_text(path: Path, text: str) -> None:
    """Write a text for a user; not by renaming, so that it may also go to a device or through a link.

    Raises:
        GaitFileError: it can't be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise GaitFileError(f"{path}: can't be written: {error.strerror}") from error
