"""What a run of a stream shows: its rate, how late and how old its messages are, what it costs."""

from dataclasses import dataclass

import numpy as np

PERCENTILES = (50.0, 99.0, 99.9)
# Of a period, to find where most messages lie.
_BINS = 50
# Messages that are early by less are those of the tick that is about to be due, in periods.
_JITTER = 0.1


@dataclass(frozen=True)
class Figures:
    """What one run has shown; times in [s].

    Attributes:
        rate: Messages per second of stamps, in [Hz].
        lateness: Median, 99th and 99.9th percentile.
        age: The same of the time from a message's stamp to its arrival.
        cpu: Share of a core that the publishing process took.
    """

    rate: float
    lateness: np.ndarray
    age: np.ndarray
    cpu: float

    def compared(self, bare):
        """Return by how much each figure is worse than the bare timer's, by name; 0 is equal."""
        return {
            "rate": bare.rate / self.rate - 1,
            "lateness": self.lateness[1] / bare.lateness[1] - 1,
            "age": self.age[1] / bare.age[1] - 1,
            "CPU": self.cpu / bare.cpu - 1,
        }


@dataclass(frozen=True)
class Runs:
    """The same run several times.

    Attributes:
        typical: The median of each figure.
        oldest: The 99th percentile of the age in the worst run, in [s].
    """

    typical: Figures
    oldest: float

    @classmethod
    def of(cls, runs):
        def median(name):
            return np.median([getattr(one, name) for one in runs], axis=0)

        typical = Figures(*(median(name) for name in ("rate", "lateness", "age", "cpu")))
        return cls(typical, max(one.age[1] for one in runs))


def figures(received, rate, seconds, cpu):
    """Return the figures of stamps and arrivals in [ns], (messages, 2), of the last seconds."""
    stamps, arrivals = (received - received[-1, 0]).T * 1e-9
    kept = stamps > -seconds
    stamps, arrivals = stamps[kept], arrivals[kept]
    return Figures(
        rate=(len(stamps) - 1) / (stamps[-1] - stamps[0]),
        lateness=np.percentile(lateness(stamps * rate) / rate, PERCENTILES),
        age=np.percentile(arrivals - stamps, PERCENTILES),
        cpu=cpu,
    )


def lateness(times):
    """Return how late messages are, all in periods: from when the first tick was due that had no message yet.

    The schedule lies where the most punctual messages are. Ticks that have passed when a late message comes
    are dropped: both publishers do so.
    """
    places = times % 1.0
    counts, edges = np.histogram(places, bins=_BINS, range=(0.0, 1.0))
    crowd = edges[np.argmax(counts)]
    # Around the crowd nothing wraps; its early edge is the schedule.
    around = (places - crowd + 0.5) % 1.0 - 0.5
    times = times - crowd - np.percentile(around[np.abs(around) < 2 / _BINS], 1)
    late, due = [], np.round(times[0])
    for now in times.tolist():
        late.append(max(now - due, 0.0))
        due = max(due, np.floor(now + _JITTER)) + 1
    return np.array(late)
