"""A thread that ticks on an even schedule: no drift, and no burst after a stall."""

import math
import threading
import time
from collections.abc import Callable


class Pacer:
    """Calls a function at multiples of a period of the steady clock.

    A tick that comes too late is dropped instead of made up for, and the ones after it keep to the
    schedule. An executor's timer would do the same, but wait behind the node's other callbacks.

    Attributes:
        period: Time between two ticks in [s]; may be changed while running.
        missed: Ticks that were dropped.
    """

    def __init__(self, period: float, tick: Callable[[], None]) -> None:
        """Start ticking.

        Args:
            period: In [s].
            tick: Must not raise.
        """
        self.period = period
        self.missed = 0
        self._tick = tick
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="pacer", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the ticking and wait for the last tick."""
        self._stopping = True
        self._thread.join()

    def _run(self) -> None:
        due = time.monotonic()
        while not self._stopping:
            self._tick()
            due = self._next(due)
            time.sleep(max(due - time.monotonic(), 0.0))

    def _next(self, due: float) -> float:
        """Return the next time of the schedule that is not past."""
        due += self.period
        late = time.monotonic() - due
        if late > 0:
            missed = math.ceil(late / self.period)
            self.missed += missed
            due += missed * self.period
        return due
