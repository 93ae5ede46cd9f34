"""Where the files that ship beside the code are found, how YAML is read, and when a disk has a file."""

import math
import os
import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import yaml

from walk_optimizer.errors import ConfigurationError, quoted

Settings = TypeVar("Settings")
_PACKAGE = Path(__file__).resolve().parent


def _share_folders() -> list[Path]:
    """Return the folders that may hold `config/`: a checkout, then ament's and pip's share folders."""
    checkout = _PACKAGE.parent
    folders = [checkout] if (checkout / "package.xml").is_file() else []
    prefixes = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    return folders + [Path(prefix) / "share" / "walk_optimizer" for prefix in prefixes if prefix]


def config_file(name: str) -> Path:
    """Return the path of a file of the packaged `config/` folder.

    Raises:
        ConfigurationError: it is in none of the places where installers put it.
    """
    candidates = [folder / "config" / name for folder in _share_folders()]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise ConfigurationError(f"config file {name} not found; looked at {', '.join(map(str, candidates))}")


def data_folder() -> Path:
    """Return the folder of the solved data that ships inside the package."""
    return _PACKAGE / "data"


def read_yaml(path: Path) -> dict[str, Any]:
    """Return the mapping that a YAML file holds.

    Raises:
        ConfigurationError: the file is missing, no YAML, or no mapping.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError(f"{path}: can't be read: {error.strerror}") from error
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{path}: not valid YAML: {error}") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path}: not valid YAML: no UTF-8 text, {error.reason}") from error
    except ValueError as error:
        # A date that there is not, or a whole number of thousands of digits.
        raise ConfigurationError(f"{path}: not valid YAML: {error}") from error
    if not isinstance(content, dict):
        raise ConfigurationError(f"{path}: expected `name: value` entries")
    return {str(name): value for name, value in content.items()}


def settings_from_entries(
    kind: Callable[..., Settings], entries: dict[str, Any], where: Path | str
) -> Settings:
    """Return what `kind` makes of entries; its own refusals then name the file, or the part of a file.

    Raises:
        ConfigurationError: it refuses an entry.
    """
    try:
        return kind(**entries)
    except ConfigurationError as error:
        raise ConfigurationError(f"{where}: {error}") from error


def settings_from_yaml(kind: type[Settings], source: Path) -> Settings:
    """Return the dataclass of settings that a YAML file holds in full.

    A field that is a dataclass itself is a mapping in the file.

    Raises:
        ConfigurationError: the file can't be read, or an entry is missing, unknown or impossible.
    """
    return _complete(kind, read_yaml(source), str(source))


def _complete(kind: type[Settings], entries: Any, where: str) -> Settings:
    """Return the dataclass that a mapping holds in full, and so those within it.

    Args:
        kind: The dataclass.
        entries: What the file holds there.
        where: The file, and the part of it, for messages.

    Raises:
        ConfigurationError: it is no mapping, or an entry is missing, unknown or impossible.
    """
    names = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    if not isinstance(entries, dict):
        raise ConfigurationError(f"{where} is {entries!r}, expected entries {', '.join(names)}")
    wrong = sorted({str(name) for name in entries} ^ set(names))
    if wrong:
        raise ConfigurationError(f"{where}: missing or unknown entries: {', '.join(wrong)}")
    hints = get_type_hints(kind)
    values = {
        name: _complete(hints[name], value, f"{where}: {name}") if is_dataclass(hints[name]) else value
        for name, value in entries.items()
    }
    return settings_from_entries(kind, values, where)


def require_positive(settings: Any, label: str = "") -> None:
    """Refuse the numbers of a dataclass that are not finite and above 0; those declared int must be whole.

    Args:
        settings: The dataclass.
        label: Stands before the name of a refused entry.

    Raises:
        ConfigurationError: names the first such entry and its value.
    """
    for field in fields(settings):
        value, whole = getattr(settings, field.name), field.type is int
        if field.type not in (int, float):
            continue
        number = isinstance(value, int if whole else int | float) and not isinstance(value, bool)
        if not (number and 0 < as_float(value) < math.inf):
            expected = "a positive whole number" if whole else "a positive number"
            raise ConfigurationError(
                f"{label}{field.name} is {quoted(value)}, expected {expected}{text_hint(value)}"
            )


def as_float(number: float) -> float:
    """Return a number as a float; infinite where it is a whole number beyond all floats."""
    try:
        return float(number)
    except OverflowError:
        return math.inf if number > 0 else -math.inf


def text_hint(value: Any) -> str:
    """Return how to write a number that YAML took for a text; empty for everything else."""
    try:
        number = float(value) if isinstance(value, str) else math.nan
    except ValueError:
        number = math.nan
    if math.isnan(number):
        return ""
    return "; YAML takes it for a text: write numbers without quotes, and 1e-8 as 1.0e-8"


def sync_directory(directory: Path) -> None:
    """Wait until the disk knows the names in a directory."""
    descriptor = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
