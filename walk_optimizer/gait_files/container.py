"""What all files of this program have in common: a checked JSON header beside plain arrays in one archive."""

import hashlib
import io
import json
from collections.abc import Mapping, Set
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walk_optimizer import __version__
from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait_files.archive import read_archive
from walk_optimizer.gait_files.checks import check_finite

# 2000 points take 0.4 MB; a file above this is none of ours, whatever its header says.
LARGEST_FILE = 16 * 1024 * 1024
_HEADER = "header"
_COMMON_ENTRIES = frozenset({"format", "version", "software", "checksum"})


@dataclass(frozen=True)
class FileFormat:
    """One format of files.

    Attributes:
        name: As the header gives it.
        version: That this program reads and writes.
        noun: What people call such a file.
        entries: Of the header, besides those of every file.
    """

    name: str
    version: int
    noun: str
    entries: Set[str]


def packed(
    file_format: FileFormat, entries: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]
) -> bytes:
    """Return the bytes of a file; equal contents give equal bytes.

    Raises:
        GaitFileError: a number is not finite.
    """
    for name, values in arrays.items():
        check_finite(name, values)
    header = {"format": file_format.name, "version": file_format.version, "software": __version__, **entries}
    header["checksum"] = _checksum(header, arrays)
    text = json.dumps(header, indent=1, sort_keys=True, allow_nan=False)
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **{_HEADER: np.frombuffer(text.encode(), np.uint8)}, **arrays)
    return buffer.getvalue()


def unpacked(file_format: FileFormat, data: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the header and the arrays of a file.

    Raises:
        GaitFileError: the bytes are no whole file of this format and version.
    """
    arrays = read_archive(data, LARGEST_FILE)
    header = _header(file_format, arrays.pop(_HEADER, None))
    if header["checksum"] != _checksum(header, arrays):
        raise GaitFileError("damaged: the checksum does not fit the content")
    for name, values in arrays.items():
        check_finite(name, values)
    return header, arrays


def _checksum(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> str:
    """Return the SHA-256 of the header without its checksum and of all arrays."""
    rest = {key: value for key, value in header.items() if key != "checksum"}
    digest = hashlib.sha256(json.dumps(rest, sort_keys=True).encode())
    for name in sorted(arrays):
        digest.update(f"{name}{arrays[name].shape}".encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


def _header(file_format: FileFormat, values: NDArray[Any] | None) -> dict[str, Any]:
    """Return the checked header of this version."""
    if values is None or values.dtype != np.uint8:
        raise GaitFileError(f"not a {file_format.noun}: it has no header")
    try:
        header = json.loads(values.tobytes().decode())
    except (ValueError, RecursionError) as error:
        raise GaitFileError(f"damaged: the header is no JSON ({error})") from error
    if not isinstance(header, dict) or header.get("format") != file_format.name:
        raise GaitFileError(
            f"not a {file_format.noun}: the header does not name the format {file_format.name}"
        )
    if header.get("version") != file_format.version:
        version = header.get("version")
        raise GaitFileError(f"format version is {version!r}, this program reads {file_format.version}")
    wrong = sorted(set(header) ^ (_COMMON_ENTRIES | file_format.entries))
    if wrong:
        raise GaitFileError(f"header has missing or unknown entries: {', '.join(wrong)}")
    return header
