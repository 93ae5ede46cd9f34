"""A thread that ticks on an even schedule: no drift, and no burst after a stall."""

import ctypes
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from walk_optimizer.tick_statistics import Punctuality, TickStatistics

# Linux wakes threads up to 50 microseconds late to save power, unless they ask for less, in [ns].
_PR_SET_TIMERSLACK = 29
_TIMER_SLACK = 1
_LIBC = ctypes.CDLL(None)


@dataclass(frozen=True)
class _Schedule:
    """Ticks at multiples of a period, counted from a begin: nothing adds up, so nothing drifts.

    Attributes:
        begin: Of the steady clock in [s].
        period: In [s].
        statistics: Of its ticks.
    """

    begin: float
    period: float
    statistics: TickStatistics

    @classmethod
    def from_now(cls, period: float) -> "_Schedule":
        return cls(time.monotonic(), period, TickStatistics(period))

    def due(self, number: int) -> float:
        """Return when a tick is due."""
        return self.begin + number * self.period

    def next_number(self, number: int, now: float) -> int:
        """Return the first tick after one that is not past."""
        return max(number + 1, math.ceil((now - self.begin) / self.period))


class Pacer:
    """Calls a function at multiples of a period of the steady clock.

    A tick that comes too late is dropped instead of made up for, and the ones after it keep to the
    schedule. An executor's timer would do the same, but wait behind the node's other callbacks.

    Attributes:
        missed: Ticks that were dropped since the start.
    """

    def __init__(self, period: float, tick: Callable[[], None]) -> None:
        """Start ticking.

        Args:
            period: In [s].
            tick: Must not raise.
        """
        self.missed = 0
        self._schedule = _Schedule.from_now(period)
        self._tick = tick
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="pacer", daemon=True)
        self._thread.start()

    @property
    def period(self) -> float:
        """Time between two ticks in [s]."""
        return self._schedule.period

    @period.setter
    def period(self, period: float) -> None:
        """Begin another schedule; the running tick is the last of the former."""
        self._schedule = _Schedule.from_now(period)

    def punctuality(self) -> Punctuality:
        """Return how punctual the ticks of about the last second were."""
        return self._schedule.statistics.punctuality()

    def stop(self) -> None:
        """End the ticking and wait for the last tick."""
        self._stopping = True
        self._thread.join()

    def _run(self) -> None:
        _LIBC.prctl(_PR_SET_TIMERSLACK, _TIMER_SLACK)
        while not self._stopping:
            self._follow(self._schedule)

    def _follow(self, schedule: _Schedule) -> None:
        """Tick on a schedule until there is another one."""
        number = dropped = 0
        while schedule is self._schedule and not self._stopping:
            time.sleep(max(schedule.due(number) - time.monotonic(), 0.0))
            schedule.statistics.add(schedule.due(number), time.monotonic(), dropped)
            self._tick()
            following = schedule.next_number(number, time.monotonic())
            dropped = following - number - 1
            self.missed += dropped
            number = following
