"""Files and folders that users name in parameters and requests."""

from pathlib import Path

from walk_optimizer.errors import ConfigurationError, shortened


def named_path(name: str) -> Path:
    """Return the file or folder that a user has named; `~` is a home, which no shell expands behind `:=`.

    Raises:
        ConfigurationError: there is no such home.
    """
    try:
        return Path(name).expanduser()
    except RuntimeError as error:
        raise ConfigurationError(f"{shortened(name)}: no such home; name another place") from error
