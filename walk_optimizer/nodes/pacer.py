"""A thread that ticks on an even schedule: no drift, and no burst after a stall."""

import ctypes
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from walk_optimizer.walk.tick_statistics import Punctuality, TickStatistics

# Linux wakes threads up to 50 microseconds late to save power, unless they ask for less, in [ns].
_PR_SET_TIMERSLACK = 29
_TIMER_SLACK = 1
_LIBC = ctypes.CDLL(None)
# A tick that is later than this part of a period is dropped.
_LATEST = 0.5


@dataclass(frozen=True)
class Schedule:
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
    def from_now(cls, period: float) -> "Schedule":
        """Return a schedule that begins now."""
        return cls(time.monotonic(), period, TickStatistics(period))

    def due(self, number: int) -> float:
        """Return when a tick is due."""
        return self.begin + number * self.period

    def next_number(self, number: int, began: float, now: float) -> int:
        """Return the tick that follows one: what is due by now, or the next, but never one that is long past.

        Args:
            number: Of the one before.
            began: When that began, in [s].
            now: When it has ended, in [s].
        """
        first = math.ceil((began - self.begin) / self.period)
        recent = math.ceil((now - self.begin) / self.period - _LATEST)
        return max(number + 1, first, recent)


class Pacer:
    """Calls a function at multiples of a period of the steady clock.

    A tick that comes more than half a period late because the one before took so long is dropped instead of
    made up for, and the ones after it keep to the schedule: there is one between two multiples of the period
    at most. An executor's timer would do much the same, but wait behind the node's other callbacks.

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
        self._schedule = Schedule.from_now(period)
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
        self._schedule = Schedule.from_now(period)

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

    def _follow(self, schedule: Schedule) -> None:
        """Tick on a schedule until there is another one."""
        number = dropped = 0
        while schedule is self._schedule and not self._stopping:
            time.sleep(max(schedule.due(number) - time.monotonic(), 0.0))
            began = time.monotonic()
            schedule.statistics.add(schedule.due(number), began, dropped)
            self._tick()
            following = schedule.next_number(number, began, time.monotonic())
            dropped = following - number - 1
            self.missed += dropped
            number = following
