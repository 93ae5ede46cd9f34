"""The real console script in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(sys.executable).with_name("walk-optimizer")
# Where compiled code is kept; read before a test points the variable elsewhere.
_CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "walk_optimizer"


def command(*arguments: str) -> list[str]:
    """Return the command line of the installed script, or of the module where there is none."""
    script = [str(SCRIPT)] if SCRIPT.exists() else [sys.executable, "-m", "walk_optimizer.cli.main"]
    return [*script, *map(str, arguments)]


def environment(home: Path | None) -> dict[str, str]:
    """Return an environment whose user cache lies below `home`, with the compiled code of the real one."""
    if home is None:
        return dict(os.environ)
    own = home / "walk_optimizer"
    own.mkdir(exist_ok=True)
    for entry in _CACHE.iterdir() if _CACHE.is_dir() else ():
        if entry.name not in {"gaits", "transitions"} and not (own / entry.name).exists():
            (own / entry.name).symlink_to(entry)
    return {**os.environ, "XDG_CACHE_HOME": str(home)}


def walk_optimizer(*arguments: str, home: Path | None, timeout: float = 120) -> subprocess.CompletedProcess:
    """Run a command to its end."""
    return subprocess.run(
        command(*arguments),
        capture_output=True,
        text=True,
        timeout=timeout,
        env=environment(home),
        check=False,
    )
