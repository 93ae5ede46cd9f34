"""When the messages of a bag are due while it is played: as they were recorded, and never in a burst."""

import math
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path

from walk_optimizer.errors import InvalidRequestError, quoted
from walk_optimizer.recording.info import BagInfo, require_ros_topics
from walk_optimizer.recording.reading import BagMessage, read_messages

NANOSECONDS = 1e9
_SLOWEST, _FASTEST = 0.01, 100.0
# A player that is later than this moves its schedule instead of catching up, in [s].
_LONGEST_DELAY = 0.02
# From here on a wait looks like a player that hangs, in [s].
_LONG_WAIT = 10.0
_DAY = 86_400.0


class Schedule:
    """Turns times of recording into times of playing."""

    def __init__(self, rate: float, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin with the first message.

        Args:
            rate: Time of the recording for each time of playing.
            clock: Returns the time in [s].

        Raises:
            InvalidRequestError: the rate is out of range.
        """
        if not _SLOWEST <= rate <= _FASTEST:
            raise InvalidRequestError(f"rate is {rate:g}, allowed is {_SLOWEST:g} to {_FASTEST:g}")
        self._rate, self._clock = rate, clock
        self._begin = math.nan
        self._first_ns = 0
        self.delayed = 0.0

    def wait(self, log_time_ns: int) -> float:
        """Return how long to wait for a message that was recorded at a time in [ns], in [s].

        A message that is overdue by long moves all after it, which then keep their distances.
        """
        now = self._clock()
        if math.isnan(self._begin):
            self._begin, self._first_ns = now, log_time_ns
        due = self._begin + (log_time_ns - self._first_ns) / NANOSECONDS / self._rate
        late = now - due
        if late > _LONGEST_DELAY:
            self._begin += late
            self.delayed += late
        return max(-late, 0.0)


def require_topics(info: BagInfo, topics: Collection[str]) -> None:
    """Refuse topics that a bag has not.

    Raises:
        InvalidRequestError: names them, and those that there are.
    """
    known = list(info.types)
    unknown = sorted(set(topics) - set(known))
    if unknown:
        raise InvalidRequestError(f"the bag has no topic {', '.join(unknown)}; it has {', '.join(known)}")


def topic_names(
    info: BagInfo, topics: Collection[str] | None, remaps: Collection[str] = ()
) -> dict[str, str]:
    """Return the topics that are played, each with the name that it is played under.

    Args:
        info: What is in the bag.
        topics: Names of the topics wanted; all when None.
        remaps: Other names for some of them, each as FROM:=TO.

    Raises:
        InvalidRequestError: the bag lacks a topic, has no message to play, a remap is none, or two topics
            would get one name.
        ForeignTopicError: a topic is none of ROS 2.
    """
    require_topics(info, topics or ())
    wanted = [name for name in info.types if topics is None or name in topics]
    _require_messages(info, wanted)
    require_ros_topics(info, wanted)
    names = {name: name for name in wanted}
    for remap in remaps:
        name, mark, other = remap.partition(":=")
        if not (mark and name and other):
            raise InvalidRequestError(
                f"{quoted(remap)} is no remap: give FROM:=TO, such as /tf:=/recorded/tf"
            )
        if name not in names:
            raise InvalidRequestError(f"{quoted(name)} is not played; played are {', '.join(wanted)}")
        names[name] = other
    _require_apart(names)
    return names


def _require_messages(info: BagInfo, wanted: Sequence[str]) -> None:
    """Refuse topics without a message.

    Raises:
        InvalidRequestError: says what there is not.
    """
    counts = info.counts
    if not any(counts[name] for name in wanted):
        lacking = (
            f"no message on {', '.join(wanted)} is left in the bag" if wanted else "the bag has no topic"
        )
        raise InvalidRequestError(f"nothing to play: {lacking}; `walk-optimizer bag info` tells more")


def _require_apart(names: Mapping[str, str]) -> None:
    """Refuse to play two topics as one: their subscribers could not tell them apart.

    Raises:
        InvalidRequestError: names both, and what to do.
    """
    played: dict[str, str] = {}
    for name, given in names.items():
        # The player is in no namespace.
        other = given if given[0] in "/~" else f"/{given}"
        if other in played:
            raise InvalidRequestError(
                f"{played[other]} and {name} would both be played on {other}; "
                "give one of them another name with --remap, or leave it out with --topics"
            )
        played[other] = name


def gap_warning(wait: float) -> str | None:
    """Return what to tell before a message is waited for, in [s]; None for waits that nobody minds."""
    if wait < _LONG_WAIT:
        return None
    days = f" ({wait / _DAY:.0f} days)" if wait >= _DAY else ""
    return (
        f"nothing was recorded for a while: waiting {wait:.0f} s{days} for the next message; "
        "Ctrl-C ends it, --rate plays faster"
    )


def messages_due(
    path: Path, topics: Collection[str] | None, rate: float, loop: bool
) -> Iterator[tuple[BagMessage, float]]:
    """Iterate over the messages of a bag with the wait in [s] before each is to be published.

    Args:
        path: The bag.
        topics: Names of the topics wanted; all when None.
        rate: Time of the recording for each time of playing.
        loop: Whether to begin anew at the end, without end.

    Returns:
        The messages; the wait is counted from when one is asked for.

    Raises:
        InvalidRequestError: the rate is out of range.
    """
    Schedule(rate)
    return _messages_due(path, topics, rate, loop)


def _messages_due(
    path: Path, topics: Collection[str] | None, rate: float, loop: bool
) -> Iterator[tuple[BagMessage, float]]:
    while True:
        schedule, played = Schedule(rate), 0
        for message in read_messages(path, topics):
            yield message, schedule.wait(message.log_time_ns)
            played += 1
        if not loop or not played:
            return
