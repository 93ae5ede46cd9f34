"""When a stream of commands has gone stale."""


class CommandWatch:
    """Notices that a stream of commands has fallen silent.

    Attributes:
        timeout: Longest silence in [s]; 0 for any.
        stale: Whether the last stream fell silent, and no command has come since.
    """

    def __init__(self, timeout: float) -> None:
        """Watch nothing yet.

        Args:
            timeout: Longest silence in [s]; 0 for any.
        """
        self.timeout = timeout
        self.stale = False
        self._last: float | None = None

    def heard(self, now: float) -> None:
        """Take note of a command of a stream, at a time in [s]: others must follow."""
        self._last, self.stale = now, False

    def end(self) -> None:
        """Take note of a command that holds until the next one."""
        self._last, self.stale = None, False

    def fell_silent(self, now: float) -> bool:
        """Return whether the stream has fallen silent by now, in [s]; once for each silence."""
        if self._last is None or self.timeout == 0:
            return False
        # A clock that was set back says nothing about the silence before.
        self._last = min(self._last, now)
        if now - self._last <= self.timeout:
            return False
        self._last, self.stale = None, True
        return True
