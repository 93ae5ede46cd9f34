"""Reads arrays from a NumPy archive that nobody vouches for.

`numpy.load` trusts sizes that a file declares. Here nothing is unpickled or decompressed, and no
array is larger than the file that it came from.
"""

import io
import math
import zipfile
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from walk_optimizer.errors import GaitFileError

_MOST_ARRAYS = 64
_KINDS = (np.dtype("<f8"), np.dtype("u1"))


def read_archive(data: bytes, largest: int) -> dict[str, NDArray[Any]]:
    """Return the arrays of an uncompressed `.npz` by name; they are read-only.

    Args:
        data: Bytes of the archive.
        largest: Most bytes that an array may have.

    Raises:
        GaitFileError: the archive is truncated or damaged, or holds more than plain numbers.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) > _MOST_ARRAYS:
                raise GaitFileError(f"{len(members)} arrays, allowed are {_MOST_ARRAYS}")
            arrays = {}
            for member in members:
                name = member.filename.removesuffix(".npy")
                if name in arrays:
                    raise GaitFileError(f"array {name} is there twice")
                arrays[name] = _array(archive, member, largest)
            return arrays
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, RuntimeError, SyntaxError) as error:
        raise GaitFileError(f"truncated or damaged: {error or type(error).__name__}") from error


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, largest: int) -> NDArray[Any]:
    """Return one array of the archive."""
    name = member.filename
    if member.compress_type != zipfile.ZIP_STORED:
        raise GaitFileError(f"{name} is compressed, expected a plain array")
    if member.file_size > largest:
        raise GaitFileError(f"{name} has {member.file_size} bytes, allowed are {largest}")
    stream = io.BytesIO(archive.read(member))
    if npy.read_magic(stream) != (1, 0):
        raise GaitFileError(f"{name} is of another version of NumPy's format, expected 1.0")
    shape, fortran_order, kind = npy.read_array_header_1_0(stream)
    if kind not in _KINDS:
        raise GaitFileError(f"{name} holds {kind}, expected float64 or uint8; nothing is unpickled")
    rest = stream.read()
    if len(rest) != math.prod(shape) * kind.itemsize:
        raise GaitFileError(f"{name} has {len(rest)} bytes, expected {math.prod(shape) * kind.itemsize}")
    return np.frombuffer(rest, kind).reshape(shape, order="F" if fortran_order else "C")
