"""The real console script in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(sys.executable).with_name("walk-optimizer")


def command(*arguments: str) -> list[str]:
    """Return the command line of the installed script, or of the module where there is none."""
    script = [str(SCRIPT)] if SCRIPT.exists() else [sys.executable, "-m", "walk_optimizer.cli.main"]
    return [*script, *map(str, arguments)]


def environment(home: Path) -> dict[str, str]:
    """Return an environment whose user cache lies below `home`."""
    return {**os.environ, "XDG_CACHE_HOME": str(home)}


def walk_optimizer(*arguments: str, home: Path, timeout: float = 120) -> subprocess.CompletedProcess:
    """Run a command to its end."""
    return subprocess.run(
        command(*arguments),
        capture_output=True,
        text=True,
        timeout=timeout,
        env=environment(home),
        check=False,
    )
