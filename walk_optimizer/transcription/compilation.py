"""Compiles CasADi functions to machine code once, and keeps the result for the next process."""

import inspect
import json
import logging
import os
import subprocess
from collections.abc import Callable, Hashable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca

from walk_optimizer.compiler import cache_folder, compile_library, find_compiler, library_path

_LOGGER = logging.getLogger(__name__)
# -O2 takes half as long again to compile and runs no faster on this straight-line code.
_FLAGS = ("-O1",)
_INTERPRETER = "CasADi's slower interpreter"
# Folders of this package that say what functions compute, besides the one of the module that builds them.
_PACKAGE = Path(__file__).parents[1]
_SOURCES = (_PACKAGE / "model", _PACKAGE / "contact", _PACKAGE / "transcription")


@cache
def compiled(build: Callable[..., list[ca.Function]], *arguments: Hashable) -> dict[str, ca.Function]:
    """Return the functions that `build` makes, by name, compiled where a C compiler is found.

    Without a compiler (or with `WALK_OPTIMIZER_CC` set to an empty text) they run in CasADi's
    interpreter: slower, with the same results.

    Args:
        build: Makes the functions; from the same sources and arguments always the same ones.
        arguments: Of `build`.
    """
    compiler = find_compiler(_INTERPRETER)
    if compiler is None:
        return _named(build(*arguments))
    note = _Note(build, arguments, compiler)
    functions = note.functions()
    if functions is not None:
        return functions
    interpreted = _named(build(*arguments))
    try:
        library = _library(interpreted, compiler)
        functions = _loaded(interpreted, library)
        note.write(library, list(functions))
    except (OSError, RuntimeError, subprocess.CalledProcessError) as error:
        _LOGGER.warning("C code can't be compiled (%s); %s is used", error, _INTERPRETER)
        return interpreted
    return functions


def machine_code(build: Callable[..., list[ca.Function]], *arguments: Hashable) -> Path | None:
    """Return the shared library of the functions that `build` makes; None where they are interpreted.

    Args:
        build: As for `compiled`.
        arguments: Of `build`.
    """
    compiler = find_compiler(_INTERPRETER)
    if compiler is None:
        return None
    functions = compiled(build, *arguments).values()
    if not all(function.class_name().endswith("External") for function in functions):
        return None
    return _Note(build, arguments, compiler).library()


def _named(functions: Iterable[ca.Function]) -> dict[str, ca.Function]:
    return {function.name(): function for function in functions}


class _Note:
    """A file that tells which library some sources make, so that nothing has to be built to find it.

    To build the expressions takes longer than all else of a short solve.
    """

    def __init__(self, build: Callable[..., Any], arguments: tuple[Hashable, ...], compiler: str) -> None:
        module = Path(inspect.getfile(build))
        what = f"{module} {build.__qualname__} {arguments!r} {ca.__version__}"
        folders = dict.fromkeys([*_SOURCES, module.parent])
        sources = (source for folder in folders for source in sorted(folder.glob("*.py")))
        contents = [what.encode(), *(source.read_bytes() for source in sources)]
        name = build.__name__.strip("<>")
        self._path = library_path(name, compiler, _FLAGS, contents).with_suffix(".json")

    def functions(self) -> dict[str, ca.Function] | None:
        """Return the functions of the library; None without the note, or where the library does not load."""
        noted = self._read()
        try:
            return None if noted is None else _loaded(noted[1], noted[0])
        except RuntimeError:
            return None

    def library(self) -> Path | None:
        """Return the library; None without the note."""
        noted = self._read()
        return None if noted is None else noted[0]

    def write(self, library: Path, functions: list[str]) -> None:
        """Write the note.

        Raises:
            OSError: the cache can't be written.
        """
        scratch = self._path.with_suffix(f".{os.getpid()}")
        scratch.write_text(json.dumps({"library": library.name, "functions": functions}))
        scratch.replace(self._path)

    def _read(self) -> tuple[Path, list[str]] | None:
        """Return the library and the names of its functions; None without a note that can be read."""
        try:
            note = json.loads(self._path.read_text())
            return cache_folder() / str(note["library"]), [str(name) for name in note["functions"]]
        except (OSError, ValueError, TypeError, KeyError):
            return None


def _library(functions: dict[str, ca.Function], compiler: str) -> Path:
    """Return the shared library of the functions, compiling it if the cache has none that loads.

    Raises:
        OSError: the cache can't be written, or the compiler made nothing.
        CalledProcessError: the compiler failed.
    """
    contents = [ca.__version__, *(function.serialize() for function in functions.values())]
    name, parts = next(iter(functions)), (part.encode() for part in contents)
    library = library_path(name, compiler, _FLAGS, parts)
    if library.is_file():
        try:
            _loaded(functions, library)
        except RuntimeError:
            _LOGGER.warning("%s is damaged and is compiled again", library)
            library.unlink(missing_ok=True)
        else:
            return library
    compile_library(library, compiler, _FLAGS, lambda folder: [_generated(functions, folder)])
    return library


def _loaded(functions: Iterable[str], library: Path) -> dict[str, ca.Function]:
    """Return the functions of a library.

    Raises:
        RuntimeError: it can't be loaded.
    """
    return {name: ca.external(name, str(library)) for name in functions}


def _generated(functions: dict[str, ca.Function], folder: Path) -> Path:
    """Write the functions as C into a folder."""
    generator = ca.CodeGenerator("stage.c")
    for function in functions.values():
        generator.add(function)
    generator.generate(f"{folder}{os.sep}")
    return folder / "stage.c"
