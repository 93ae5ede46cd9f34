"""Compiles C code to shared libraries once, and keeps them for the next process."""

import ctypes
import hashlib
import logging
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

_LOGGER = logging.getLogger(__name__)
COMPILER_VARIABLE = "WALK_OPTIMIZER_CC"
# For this processor and no other: dense kernels run twice as fast with its widest vectors.
_NATIVE_FLAGS = ("-std=gnu11", "-pthread", "-O3", "-march=native", "-fopenmp-simd", "-fvisibility=hidden")


def cache_folder() -> Path:
    """Return the folder of compiled code: `$XDG_CACHE_HOME/walk_optimizer`, by default below `~/.cache`."""
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "walk_optimizer"


def find_compiler(instead: str) -> str | None:
    """Return the path of the C compiler; None without one, or with an empty `WALK_OPTIMIZER_CC`.

    Args:
        instead: What is used without one, for the warning when one was named that isn't there.
    """
    named = os.environ.get(COMPILER_VARIABLE)
    if named == "":
        return None
    compiler = shutil.which(named or "cc")
    if named and compiler is None:
        _LOGGER.warning("%s is %r, which is no program; %s is used", COMPILER_VARIABLE, named, instead)
    return compiler


def library_path(name: str, compiler: str, flags: Iterable[str], contents: Iterable[bytes]) -> Path:
    """Return the path in the cache that stands for some code, its compiler and this kind of machine.

    Args:
        name: First part of the file's name.
        compiler: Path of the compiler.
        flags: Of the compiler.
        contents: What the code is made from.
    """
    key = hashlib.sha256("\n".join([platform.machine(), compiler, *flags]).encode())
    for part in contents:
        key.update(part)
    return cache_folder() / f"{name}-{key.hexdigest()[:24]}.so"


def compile_library(
    library: Path, compiler: str, flags: Iterable[str], sources: Callable[[Path], Iterable[Path]]
) -> None:
    """Compile C files and move the result to its place in one step.

    Args:
        library: The shared library to make.
        compiler: Path of the compiler.
        flags: Of the compiler.
        sources: Returns the C files; may write them to the scratch folder that it is given.

    Raises:
        OSError: the cache can't be written, or the compiler made nothing.
        CalledProcessError: the compiler failed.
    """
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        scratch = Path(folder) / library.name
        files = [str(path) for path in sources(Path(folder))]
        command = [compiler, *flags, "-fPIC", "-shared", *files, "-o", str(scratch), "-lm"]
        subprocess.run(command, check=True, capture_output=True)
        scratch.replace(library)


def native_library(folder: Path, instead: str) -> Path | None:
    """Return the shared library of a folder's C files for this processor; None where it can't be had.

    That is without a C compiler, with an empty `WALK_OPTIMIZER_CC`, or with a cache that can't be
    written. It is compiled where the cache has none that loads.

    Args:
        folder: Of the C files; the library bears its name.
        instead: What is used without the library, for warnings.
    """
    compiler = find_compiler(instead)
    if compiler is None:
        return None
    sources = sorted(folder.glob("*.[ch]"))
    contents = [_processor(), *(path.read_bytes() for path in sources)]
    library = library_path(folder.name, compiler, _NATIVE_FLAGS, contents)
    try:
        if not (library.is_file() and _loads(library)):
            units = [path for path in sources if path.suffix == ".c"]
            compile_library(library, compiler, _NATIVE_FLAGS, lambda _: units)
        ctypes.CDLL(str(library))
    except (OSError, subprocess.CalledProcessError) as error:
        _LOGGER.warning("the C code of %s can't be compiled (%s); %s is used", folder.name, error, instead)
        return None
    return library


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
