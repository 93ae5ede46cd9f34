"""The JSON header of a gait file: frozen dataclasses to plain values, and strictly back."""

import math
from dataclasses import MISSING, asdict, fields, is_dataclass
from enum import Enum
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from walk_optimizer.errors import GaitFileError, WalkOptimizerError
from walk_optimizer.resources import as_float

Value = TypeVar("Value")


def to_plain(value: Any) -> Any:
    """Return a dataclass as nested dictionaries, lists, texts and numbers; NaN becomes None.

    Raises:
        GaitFileError: a number is infinite.
    """
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, dict):
        return {key: to_plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(entry) for entry in value]
    if isinstance(value, float):
        if math.isinf(value):
            raise GaitFileError(f"{value} can't be stored: a gait file holds finite numbers")
        return None if math.isnan(value) else value
    return value.value if isinstance(value, Enum) else value


def from_plain(kind: type[Value], plain: Any, where: str) -> Value:
    """Return the dataclass that `to_plain` was given.

    An entry that is missing takes its default where it has one, so that a file outlives a new
    entry. An entry that is unknown is an error: it may change the meaning of the others.

    Args:
        kind: The dataclass.
        plain: What the header holds.
        where: Name of the value in the header, for messages.

    Raises:
        GaitFileError: an entry is missing, unknown, of another type or not finite.
    """
    if not isinstance(plain, dict):
        raise GaitFileError(f"{where} is {plain!r}, expected a mapping")
    known = {field.name: field for field in fields(kind)}  # type: ignore[arg-type]
    unknown = sorted(set(plain) - set(known))
    if unknown:
        raise GaitFileError(f"{where} has unknown entries: {', '.join(unknown)}")
    hints = get_type_hints(kind)
    values = {}
    for name, field in known.items():
        if name in plain:
            values[name] = _value(hints[name], plain[name], f"{where}.{name}", field.default)
        elif field.default is MISSING and field.default_factory is MISSING:
            raise GaitFileError(f"{where} has no entry {name}")
    try:
        return kind(**values)
    except WalkOptimizerError as error:
        raise GaitFileError(f"{where}: {error}") from error


def _value(hint: Any, plain: Any, where: str, default: Any = MISSING) -> Any:
    """Return one entry as its type hint wants it."""
    if get_origin(hint) is tuple:
        if not isinstance(plain, list):
            raise GaitFileError(f"{where} is {plain!r}, expected a list")
        return tuple(_value(get_args(hint)[0], entry, f"{where}[{i}]") for i, entry in enumerate(plain))
    if is_dataclass(hint):
        return from_plain(hint, plain, where)  # type: ignore[arg-type]
    if hint is float:
        return _number(plain, where, may_be_nan=isinstance(default, float) and math.isnan(default))
    if issubclass(hint, Enum):
        return _member(hint, plain, where)
    if not isinstance(plain, hint) or (isinstance(plain, bool) and hint is not bool):
        raise GaitFileError(f"{where} is {plain!r}, expected {hint.__name__}")
    return plain


def _number(plain: Any, where: str, may_be_nan: bool) -> float:
    """Return a finite number; None stands for NaN in the entries that are NaN by default."""
    if plain is None and may_be_nan:
        return math.nan
    if isinstance(plain, bool) or not isinstance(plain, int | float):
        raise GaitFileError(f"{where} is {plain!r}, expected a finite number")
    number = as_float(plain)
    if not math.isfinite(number):
        raise GaitFileError(f"{where} is {number}, expected a finite number")
    return number


def _member(hint: type[Enum], plain: Any, where: str) -> Enum:
    """Return the member of an enumeration."""
    try:
        return hint(plain)
    except ValueError:
        allowed = ", ".join(member.value for member in hint)
        raise GaitFileError(f"{where} is {plain!r}, allowed are {allowed}") from None
