"""Options that several verbs share, and what they mean to the core."""

import argparse
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

from walk_optimizer.errors import InvalidRequestError, quoted
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest, gait_table_settings, parse_speed

# What `add_subparsers` returns; argparse gives the type no public name.
Subparsers: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"  # noqa: SLF001

_SPRING = SpringMode.NONE.value


def add_verb(verbs: Subparsers, name: str, text: str, epilog: str = "") -> argparse.ArgumentParser:
    """Return the parser of a new verb; the first line of the text also describes it in the list."""
    return verbs.add_parser(
        name,
        help=text.splitlines()[0],
        description=text,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )


def add_walker(parser: argparse.ArgumentParser) -> None:
    """Add the choice of a walker."""
    parser.add_argument(
        "--walker",
        type=Path,
        metavar="YAML",
        help="parameters of another walker (default: config/walker.yaml)",
    )


def add_library(parser: argparse.ArgumentParser) -> None:
    """Add the choice of the folder that gaits are stored in."""
    parser.add_argument(
        "--library", type=Path, metavar="FOLDER", help="folder of stored gaits (default: the user's cache)"
    )


def add_request(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """Add speed, spring mode and number of points."""
    # Texts, not numbers: the core reads and refuses them, with the same words for every border.
    parser.add_argument("--speed", required=required, metavar="SPEED", help="0.3185, 0.3185m/s or 1.15km/h")
    parser.add_argument(
        "--spring",
        metavar="MODE",
        help=f"{', '.join(mode.value for mode in SpringMode)} (default: {_SPRING})",
    )
    parser.add_argument("--points", metavar="N", help="grid points of a step (default: 200)")


def add_gait_choice(parser: argparse.ArgumentParser) -> None:
    """Add what says which gait: a request that the library or a solve answers, or a file."""
    add_request(parser, required=False)
    parser.add_argument("--file", type=Path, metavar="GAIT", help="a gait file instead of a request")
    add_walker(parser)
    add_library(parser)


def walker_from(args: argparse.Namespace) -> WalkerParameters:
    """Return the walker that was chosen."""
    return WalkerParameters.from_yaml(args.walker)


def request_from(args: argparse.Namespace) -> GaitRequest:
    """Return the validated request."""
    points = None if args.points is None else parse_points(args.points)
    spring = _SPRING if args.spring is None else args.spring
    return GaitRequest.for_speed(parse_speed(args.speed), spring, points)


def refuse_beside(option: str, args: argparse.Namespace, names: Iterable[str]) -> None:
    """Refuse options that would be ignored because another one is given.

    Args:
        option: The other one.
        args: What was given.
        names: Attributes of the options; those not given are None or False.

    Raises:
        InvalidRequestError: one of them was given.
    """
    given = [f"--{name.replace('_', '-')}" for name in names if getattr(args, name) not in (None, False)]
    if given:
        raise InvalidRequestError(
            f"{option} can't be combined with {', '.join(given)}; leave out the one or the other"
        )


def parse_points(text: str) -> int:
    """Return a number of grid points.

    Raises:
        InvalidRequestError: the text is no whole number.
    """
    points = _whole(text)
    if points is None:
        settings = gait_table_settings()
        allowed = f"{settings.minimum_points} to {settings.maximum_points}"
        raise InvalidRequestError(f"N is {quoted(text)} grid points, allowed is {allowed}")
    return points


def parse_count(text: str, name: str, most: int) -> int:
    """Return a number of things.

    Raises:
        InvalidRequestError: the text is no whole number from 1 to `most`.
    """
    count = _whole(text)
    if count is None or not 1 <= count <= most:
        raise InvalidRequestError(f"{name} is {quoted(text)}, allowed are whole numbers from 1 to {most}")
    return count


def _whole(text: str) -> int | None:
    """Return a whole number; None where the text is none."""
    try:
        return int(text)
    except ValueError:
        return None


def positive_seconds(text: str, name: str) -> float:
    """Return a duration in [s].

    Args:
        text: What was typed.
        name: Of the duration, for messages.

    Raises:
        InvalidRequestError: the text is no finite number above 0.
    """
    return parse_number(text, name, "in s", above=0.0)


def output_folder(folder: Path) -> Path:
    """Return a folder for what a command writes; it is made where it is missing.

    Raises:
        GaitFileError: a file has its name, or it can't be written into.
    """
    from walk_optimizer.gait_files.access import writable_folder
    from walk_optimizer.library import existing_folder

    if folder.exists():
        existing_folder(folder)
    writable_folder(folder, create=True)
    return folder


def parse_number(text: str, name: str, unit: str, above: float = -math.inf, most: float = math.inf) -> float:
    """Return a finite number.

    Args:
        text: What was typed.
        name: Of the quantity, for messages.
        unit: What follows in a message, as "in s".
        above: What it must be larger than.
        most: The largest that is allowed.

    Raises:
        InvalidRequestError: the text is no such number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (above < value <= most and math.isfinite(value)):
        least = f" above {above:g}" if math.isfinite(above) else ""
        largest = f" up to {most:g}" if math.isfinite(most) else ""
        raise InvalidRequestError(
            f"{name} is {quoted(text)}, allowed are finite numbers{least}{largest}, {unit}"
        )
    return value
