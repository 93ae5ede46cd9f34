"""Builds the shared library of the factorisation, once per machine."""

import ctypes
import logging
import subprocess
from functools import cache
from pathlib import Path

from walk_optimizer.compiler import compile_library, find_compiler, library_path

_LOGGER = logging.getLogger(__name__)
_FOLDER = Path(__file__).parent
# For this processor and no other: the dense kernels run twice as fast with its widest vectors.
_FLAGS = ("-std=gnu11", "-pthread", "-O3", "-march=native", "-fopenmp-simd", "-fvisibility=hidden")
_MUMPS = "IPOPT's slower MUMPS"


@cache
def factorization_library() -> Path | None:
    """Return the shared library, compiled where the cache has none; None where it can't be had.

    That is without a C compiler, with an empty `WALK_OPTIMIZER_CC`, or with a cache that can't be
    written. IPOPT's own solver MUMPS then does the same in more time.
    """
    compiler = find_compiler(_MUMPS)
    if compiler is None:
        return None
    sources = sorted(_FOLDER.glob("*.[ch]"))
    contents = [_processor(), *(path.read_bytes() for path in sources)]
    library = library_path("multifrontal", compiler, _FLAGS, contents)
    try:
        if not (library.is_file() and _loads(library)):
            compile_library(
                library, compiler, _FLAGS, lambda _: [path for path in sources if path.suffix == ".c"]
            )
        ctypes.CDLL(str(library))
    except (OSError, subprocess.CalledProcessError) as error:
        _LOGGER.warning("the factorisation can't be compiled (%s); %s is used", error, _MUMPS)
        return None
    return library


def use_threads(count: int) -> None:
    """Let factorisations make use of so many processors, where there is the library.

    Args:
        count: At least 1; more than 2 are not used.
    """
    library = factorization_library()
    if library is not None:
        ctypes.CDLL(str(library)).use_threads(count)


def _loads(library: Path) -> bool:
    try:
        ctypes.CDLL(str(library))
    except OSError:
        _LOGGER.warning("%s is damaged and is compiled again", library)
        return False
    return True


def _processor() -> bytes:
    """Return the instruction sets of this processor, which a home folder on a network may not share."""
    try:
        lines = Path("/proc/cpuinfo").read_bytes().splitlines()
    except OSError:
        return b""
    return next((line for line in lines if line.startswith((b"flags", b"Features"))), b"")
