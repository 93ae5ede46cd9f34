"""Compiles CasADi functions to machine code once, and keeps the result for the next process."""

import hashlib
import logging
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import casadi as ca

_LOGGER = logging.getLogger(__name__)
# -O2 takes half as long again to compile and runs no faster on this straight-line code.
_COMPILER_FLAGS = ("-O1", "-fPIC", "-shared")
COMPILER_VARIABLE = "WALK_OPTIMIZER_CC"
# Functions whose names end so are only asked for their sparsity, and need no machine code.
PATTERN = "_pattern"


def cache_folder() -> Path:
    """Return the folder of compiled code: `$XDG_CACHE_HOME/walk_optimizer`, by default below `~/.cache`."""
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "walk_optimizer"


@cache
def compiled(build: Callable[[], list[ca.Function]]) -> dict[str, ca.Function]:
    """Return the functions that `build` makes, by name, compiled where a C compiler is found.

    Without a compiler (or with `WALK_OPTIMIZER_CC` set to an empty text) they run in CasADi's
    interpreter: slower, with the same results.
    """
    functions = {function.name(): function for function in build()}
    evaluated = {name: function for name, function in functions.items() if not name.endswith(PATTERN)}
    compiler = _compiler()
    if compiler is None:
        return functions
    try:
        return functions | _machine_code(evaluated, compiler)
    except (OSError, RuntimeError, subprocess.CalledProcessError) as error:
        _LOGGER.warning("C code can't be compiled (%s); CasADi's slower interpreter is used", error)
        return functions


def _compiler() -> str | None:
    """Return the path of the C compiler; None without one, with a warning if one was named."""
    named = os.environ.get(COMPILER_VARIABLE)
    if named == "":
        return None
    compiler = shutil.which(named or "cc")
    if named and compiler is None:
        _LOGGER.warning(
            "%s is %r, which is no program; CasADi's slower interpreter is used", COMPILER_VARIABLE, named
        )
    return compiler


def _machine_code(functions: dict[str, ca.Function], compiler: str) -> dict[str, ca.Function]:
    """Return the functions from their shared library, compiling it if the cache has none that loads.

    Raises:
        OSError: the cache can't be written, or the compiler made nothing.
        RuntimeError: what was compiled can't be loaded.
        CalledProcessError: the compiler failed.
    """
    library = _library_path(functions, compiler)
    if library.is_file():
        try:
            return _loaded(functions, library)
        except RuntimeError:
            _LOGGER.warning("%s is damaged and is compiled again", library)
            library.unlink(missing_ok=True)
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        _compile(functions, compiler, Path(folder), library)
    return _loaded(functions, library)


def _loaded(functions: Iterable[str], library: Path) -> dict[str, ca.Function]:
    return {name: ca.external(name, str(library)) for name in functions}


def _library_path(functions: dict[str, ca.Function], compiler: str) -> Path:
    """Return the path in the cache that stands for these functions and this compiler."""
    key = hashlib.sha256(" ".join([ca.__version__, platform.machine(), compiler, *_COMPILER_FLAGS]).encode())
    for function in functions.values():
        key.update(function.serialize().encode())
    return cache_folder() / f"{next(iter(functions))}-{key.hexdigest()[:24]}.so"


def _compile(functions: dict[str, ca.Function], compiler: str, folder: Path, library: Path) -> None:
    """Generate C into a scratch folder, compile it, and move the result to its place in one step."""
    generator = ca.CodeGenerator("stage.c")
    for function in functions.values():
        generator.add(function)
    generator.generate(f"{folder}{os.sep}")
    scratch = folder / "stage.so"
    command = [compiler, *_COMPILER_FLAGS, str(folder / "stage.c"), "-o", str(scratch), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    scratch.replace(library)
