"""How punctual a periodic loop is: lateness, jitter and missed ticks of about the last second."""

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

# Median, the worst of a hundred, the worst.
_PERCENTILES = (50.0, 99.0, 100.0)


@dataclass(frozen=True)
class Punctuality:
    """How punctual the ticks of about the last second were; NaN where there were none.

    Attributes:
        rate: Ticks per second that were achieved, in [Hz].
        lateness: Median, 99th percentile and maximum of the time from when a tick was due to when it
            began, in [s].
        jitter: The same of how far the time between two ticks is from the period, in [s].
        missed: Ticks that were dropped because they would have come too late, in the same time.
    """

    rate: float
    lateness: tuple[float, float, float]
    jitter: tuple[float, float, float]
    missed: int


class TickStatistics:
    """Remembers about a second of ticks. One thread adds; any thread may ask."""

    def __init__(self, period: float) -> None:
        """Begin without ticks.

        Args:
            period: Of the ticks in [s].
        """
        self._period = period
        # Due, begun and dropped before it. Bounded: a year of ticks takes no more room than a second.
        self._ticks: deque[tuple[float, float, int]] = deque(maxlen=max(math.ceil(1 / period), 2))

    def add(self, due: float, begun: float, dropped: int) -> None:
        """Remember a tick.

        Args:
            due: When it was to begin, in [s].
            begun: When it began, in [s] of the same clock.
            dropped: Ticks that were dropped before it.
        """
        self._ticks.append((due, begun, dropped))

    def punctuality(self) -> Punctuality:
        """Return how punctual the ticks were."""
        ticks = list(self._ticks)
        lateness = [begun - due for due, begun, _ in ticks]
        # A gap that dropped ticks leave is counted by them.
        jitter = [
            abs(after[1] - before[1] - self._period) for before, after in pairwise(ticks) if after[2] == 0
        ]
        span = ticks[-1][1] - ticks[0][1] if ticks else 0.0
        return Punctuality(
            rate=(len(ticks) - 1) / span if span > 0 else math.nan,
            lateness=_percentiles(lateness),
            jitter=_percentiles(jitter),
            missed=sum(dropped for _, _, dropped in ticks),
        )


def _percentiles(values: list[float]) -> tuple[float, float, float]:
    if not values:
        return (math.nan, math.nan, math.nan)
    median, high, most = np.percentile(values, _PERCENTILES).tolist()
    return median, high, most
