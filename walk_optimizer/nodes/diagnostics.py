"""What a node knows about its own health: named checks, each with a sentence for operators.

Owns how findings are collected. Does not own messages (`diagnostics_publisher`), and imports no ROS.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """How bad a finding is; the numbers of diagnostic_msgs/DiagnosticStatus, whose STALE readers conclude."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Finding:
    """What a check has found.

    Attributes:
        level: How bad it is.
        message: For operators: what is wrong and what to do, or that all is well.
        values: Numbers and names behind it.
    """

    level: Level
    message: str
    values: Mapping[str, object] = field(default_factory=dict)


# Returns at once; called once a second by the node's executor.
Check = Callable[[], Finding]


class Diagnostics:
    """The named checks of a node."""

    def __init__(self) -> None:
        """Begin without checks."""
        self._checks: dict[str, Check] = {}

    def add(self, name: str, check: Check) -> None:
        """Add a check; one that had the name is replaced."""
        self._checks[name] = check

    def remove(self, name: str) -> None:
        """Take a check away; one that is not there is no fault."""
        self._checks.pop(name, None)

    def findings(self) -> dict[str, Finding]:
        """Return what each check finds now; a check that fails is a finding too."""
        return {name: _finding(check) for name, check in self._checks.items()}


def _finding(check: Check) -> Finding:
    try:
        return check()
    except Exception as error:  # noqa: BLE001  # a broken check must not hide the others
        return Finding(Level.ERROR, f"this check itself failed: {error!r}")
