"""When a stream of commands has gone stale."""

from dataclasses import dataclass


@dataclass(frozen=True)
class _Heard:
    """What is known of a stream.

    Attributes:
        last: When its last command came in [s]; None where nothing is watched.
        stale: Whether it fell silent.
    """

    last: float | None = None
    stale: bool = False


class CommandWatch:
    """Notices that a stream of commands has fallen silent.

    A command counts from when it comes, for it may have to be worked on for long. If it is refused in the
    end, all is as if nothing had come since the last one that was followed.

    Attributes:
        timeout: Longest silence in [s]; 0 for any.
    """

    def __init__(self, timeout: float) -> None:
        """Watch nothing yet.

        Args:
            timeout: Longest silence in [s]; 0 for any.
        """
        self.timeout = timeout
        self._heard = self._followed = _Heard()

    @property
    def stale(self) -> bool:
        """Whether the last stream fell silent, and no command has come since."""
        return self._heard.stale

    @property
    def active(self) -> bool:
        """Whether a stream is watched, or would be if what came last were refused."""
        return self._heard.last is not None or self._followed.last is not None

    def heard(self, now: float) -> None:
        """Take note of a command of a stream, at a time in [s]: others must follow."""
        self._heard = _Heard(now)

    def suspend(self) -> None:
        """Take note of a command that holds until the next one."""
        self._heard = _Heard()

    def followed(self) -> None:
        """Take note that what came last is carried out."""
        self._followed = self._heard

    def refused(self) -> None:
        """Take note that what came last is not carried out."""
        self._heard = self._followed

    def end(self) -> None:
        """Watch nothing any more."""
        self._heard = self._followed = _Heard()

    def fell_silent(self, now: float) -> bool:
        """Return whether the stream has fallen silent by now, in [s]; once for each silence."""
        if self._heard.last is None or self.timeout == 0:
            return False
        # A clock that was set back says nothing about the silence before.
        last = min(self._heard.last, now)
        self._heard = _Heard(last)
        if now - last <= self.timeout:
            return False
        self._heard = self._followed = _Heard(stale=True)
        return True
