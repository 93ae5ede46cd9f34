"""Compiles CasADi functions to machine code once, and keeps the result for the next process."""

import logging
import os
import subprocess
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import casadi as ca

from walk_optimizer.compiler import compile_library, find_compiler, library_path

_LOGGER = logging.getLogger(__name__)
# -O2 takes half as long again to compile and runs no faster on this straight-line code.
_FLAGS = ("-O1",)
_INTERPRETER = "CasADi's slower interpreter"
# Functions whose names end so are only asked for their sparsity, and need no machine code.
PATTERN = "_pattern"


@cache
def compiled(build: Callable[[], list[ca.Function]]) -> dict[str, ca.Function]:
    """Return the functions that `build` makes, by name, compiled where a C compiler is found.

    Without a compiler (or with `WALK_OPTIMIZER_CC` set to an empty text) they run in CasADi's
    interpreter: slower, with the same results.
    """
    functions = {function.name(): function for function in build()}
    evaluated = {name: function for name, function in functions.items() if not name.endswith(PATTERN)}
    compiler = find_compiler(_INTERPRETER)
    if compiler is None:
        return functions
    try:
        return functions | _machine_code(evaluated, compiler)
    except (OSError, RuntimeError, subprocess.CalledProcessError) as error:
        _LOGGER.warning("C code can't be compiled (%s); %s is used", error, _INTERPRETER)
        return functions


def _machine_code(functions: dict[str, ca.Function], compiler: str) -> dict[str, ca.Function]:
    """Return the functions from their shared library, compiling it if the cache has none that loads.

    Raises:
        OSError: the cache can't be written, or the compiler made nothing.
        RuntimeError: what was compiled can't be loaded.
        CalledProcessError: the compiler failed.
    """
    contents = [ca.__version__, *(function.serialize() for function in functions.values())]
    name, parts = next(iter(functions)), (part.encode() for part in contents)
    library = library_path(name, compiler, _FLAGS, parts)
    if library.is_file():
        try:
            return _loaded(functions, library)
        except RuntimeError:
            _LOGGER.warning("%s is damaged and is compiled again", library)
            library.unlink(missing_ok=True)
    compile_library(library, compiler, _FLAGS, lambda folder: [_generated(functions, folder)])
    return _loaded(functions, library)


def _loaded(functions: Iterable[str], library: Path) -> dict[str, ca.Function]:
    return {name: ca.external(name, str(library)) for name in functions}


def _generated(functions: dict[str, ca.Function], folder: Path) -> Path:
    """Write the functions as C into a folder."""
    generator = ca.CodeGenerator("stage.c")
    for function in functions.values():
        generator.add(function)
    generator.generate(f"{folder}{os.sep}")
    return folder / "stage.c"
