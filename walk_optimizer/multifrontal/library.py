"""The shared library of the factorisation, built once per machine."""

import ctypes
from functools import cache
from pathlib import Path

from walk_optimizer.compiler import native_library


@cache
def factorization_library() -> Path | None:
    """Return the shared library; where it can't be had, IPOPT's own MUMPS does the same in more time."""
    return native_library(Path(__file__).parent, "IPOPT's slower MUMPS")


def use_threads(count: int) -> None:
    """Let factorisations make use of so many processors, where there is the library.

    Args:
        count: At least 1; more than 2 are not used.
    """
    library = factorization_library()
    if library is not None:
        ctypes.CDLL(str(library)).use_threads(count)
