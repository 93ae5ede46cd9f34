"""A command to walk, from when it is taken until it is carried out, refused or of no interest any more."""

import time

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.request import GaitRequest


class SupersededError(WalkOptimizerError):
    """A later command, or an emergency stop, came before this one could begin."""


class WalkOrder:
    """A command for as long as it is carried out."""

    def __init__(self, request: GaitRequest) -> None:
        """Count, until `end`."""
        self._speed, self._began, self._end = request.speed, time.monotonic(), ""

    def __str__(self) -> str:
        """Return what is being done, if it is; empty otherwise."""
        if self._end:
            return ""
        return f"working on {self._speed:.4f} m/s for {time.monotonic() - self._began:.0f} s"

    def end(self, reason: str) -> None:
        """Count no more, for the first of the reasons that are given."""
        self._end = self._end or reason

    def require_valid(self) -> None:
        """Refuse to go on with what does not count any more.

        Raises:
            SupersededError: says why.
        """
        if self._end:
            raise SupersededError(self._end)
