"""The schedule of playing a bag: recorded distances, whatever holds the player up."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording.samples import JOINTS, PERIOD_NS, write_bag

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.recording import describe_bag
from walk_optimizer.recording.playback import Schedule, messages_due, require_topics


class Clock:
    """A clock that a test moves."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@settings(deadline=None)
@given(
    st.floats(0.1, 10),
    st.lists(st.tuples(st.integers(0, 50_000_000), st.floats(0, 0.3)), min_size=1, max_size=50),
)
def test_messages_are_never_closer_than_they_were_but_by_the_slack(rate, events):
    """Whatever publishing takes, the time between two messages is that of the recording, or more."""
    clock, time_ns, times = Clock(), 0, []
    schedule = Schedule(rate, clock)
    for gap_ns, held_up in events:
        time_ns += gap_ns
        clock.now += schedule.wait(time_ns)
        times.append((time_ns * 1e-9 / rate, clock.now))
        clock.now += held_up
    begin = times[0]
    for recorded, played in times:
        assert played - begin[1] >= recorded - begin[0] - 1e-9
    for (recorded, played), (later, later_played) in pairwise(times):
        assert later_played - played >= later - recorded - 0.02 - 1e-9


def test_a_player_that_keeps_up_plays_as_recorded():
    clock = Clock()
    schedule = Schedule(2.0, clock)
    played = []
    for time_ns in (0, 10_000_000, 10_000_000, 500_000_000):
        clock.now += schedule.wait(time_ns)
        played.append(clock.now - 100.0)
    assert played == pytest.approx([0.0, 0.005, 0.005, 0.25])
    assert schedule.delayed == 0


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e9])
def test_an_impossible_rate_is_refused(rate):
    with pytest.raises(InvalidRequestError, match=r"rate is .*, allowed is 0.01 to 100"):
        Schedule(rate)


def test_a_loop_begins_anew_and_topics_can_be_picked(tmp_path):
    bag = write_bag(tmp_path / "walk", range(1, 4))
    messages = messages_due(bag, {JOINTS.name}, 1.0, loop=True)
    times = [next(messages)[0].log_time_ns for _ in range(7)]
    assert times[:3] == times[3:6]
    assert times[1] - times[0] == PERIOD_NS
    assert [message.topic for message, _ in messages_due(bag, {JOINTS.name}, 1.0, False)] == [JOINTS] * 3
    assert not list(messages_due(bag, set(), 1.0, loop=True))
    with pytest.raises(InvalidRequestError, match=r"no topic /none; it has /walker/joint_reference"):
        require_topics(describe_bag(bag), ["/none"])
