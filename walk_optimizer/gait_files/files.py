"""Gait files on disk: their names, atomic writing, reading for one walker."""

from dataclasses import fields
from pathlib import Path

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import Gait
from walk_optimizer.gait_files.access import read_limited, replace_file
from walk_optimizer.gait_files.codec import decode, encode
from walk_optimizer.gait_files.container import LARGEST_FILE
from walk_optimizer.model.parameters import WalkerParameters

SUFFIX = ".npz"


def gait_file_name(gait: Gait) -> str:
    """Return the file name of a gait: the same request for the same walker has the same name."""
    request = gait.request
    return (
        f"{request.spring_mode.value}_{request.step_length:.4f}m_{request.step_time:.4f}s"
        f"_n{request.points}_{gait.walker.fingerprint()[:8]}{SUFFIX}"
    )


def transition_file_name(source: str, target: str, steps: int, walker: str) -> str:
    """Return the name of a transition's file, which may be kept among gaits.

    Args:
        source: Name of the pace that is left.
        target: Name of the pace that is reached.
        steps: Number of steps.
        walker: Beginning of the walker's fingerprint.
    """
    return f"{source}__{target}__{steps}steps__{walker}{SUFFIX}"


def transition_name_parts(name: str) -> tuple[str, str, int, str] | None:
    """Return what `transition_file_name` was given; None for the name of any other file."""
    parts = name.removesuffix(SUFFIX).split("__")
    if not name.endswith(SUFFIX) or len(parts) != 4 or not parts[2].endswith("steps"):
        return None
    source, target, steps, walker = parts
    number = steps.removesuffix("steps")
    return (source, target, int(number), walker) if number.isdecimal() else None


def write_gait_file(gait: Gait, path: Path) -> None:
    """Write a gait file; a crash leaves either the former file or the whole new one.

    Raises:
        GaitFileError: the file can't be written, or a number is not finite.
    """
    try:
        data = encode(gait)
    except GaitFileError as error:
        raise GaitFileError(f"{path}: {error}") from error
    replace_file(path, data)


def read_gait_file(path: Path, walker: WalkerParameters | None = None) -> Gait:
    """Read a gait file and check all of it.

    Args:
        path: The file.
        walker: The walker that it must be for; None takes any.

    Raises:
        GaitFileError: the file is missing, damaged, of another version or for another walker; the
            message begins with the path.
    """
    data = read_limited(path, LARGEST_FILE)
    try:
        gait = decode(data)
        check_walker(gait.walker, walker)
    except GaitFileError as error:
        raise GaitFileError(f"{path}: {error}") from error
    return gait


def check_walker(found: WalkerParameters, expected: WalkerParameters | None) -> None:
    """Raise GaitFileError that names the parameters in which two walkers differ."""
    if expected is None or found == expected:
        return
    differences = [
        f"{entry.name} is {getattr(found, entry.name)}, expected {getattr(expected, entry.name)}"
        for entry in fields(WalkerParameters)
        if getattr(found, entry.name) != getattr(expected, entry.name)
    ]
    raise GaitFileError(f"for another walker: {'; '.join(differences)}")
