"""Where the files that ship beside the code are found, and how YAML is read."""

import os
import sys
from pathlib import Path
from typing import Any

import yaml

from walk_optimizer.errors import ConfigurationError

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
    if not isinstance(content, dict):
        raise ConfigurationError(f"{path}: expected `name: value` entries")
    return content
