"""The schedule of playing a bag: recorded distances, whatever holds the player up."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recording.samples import GAIT, JOINTS, PERIOD_NS, topic, write_bag

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.recording import BagWriter, describe_bag
from walk_optimizer.recording.playback import Schedule, gap_warning, messages_due, require_topics, topic_names


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


def test_an_impossible_rate_is_refused_before_the_first_message_is_asked_for(tmp_path):
    with pytest.raises(InvalidRequestError, match="rate is nan"):
        messages_due(tmp_path / "nothing", None, float("nan"), loop=False)


@pytest.mark.parametrize("topics", [None, ["/silent"]])
def test_nothing_to_play_is_refused(tmp_path, topics):
    info = describe_bag(write_bag(tmp_path / "walk", range(3)))
    with BagWriter(tmp_path / "silent", topics=[topic("/silent", "std_msgs/msg/String")]):
        pass
    silent = describe_bag(tmp_path / "silent")
    with pytest.raises(
        InvalidRequestError, match="nothing to play: no message on /silent is left in the bag"
    ):
        topic_names(silent, topics)
    assert len(topic_names(info, None)) == 2
    (tmp_path / "empty.mcap").touch()
    with pytest.raises(InvalidRequestError, match="nothing to play: the bag has no topic"):
        topic_names(describe_bag(tmp_path / "empty.mcap"), None)


@pytest.mark.parametrize("other", [GAIT.name, GAIT.name.lstrip("/")])
def test_two_topics_are_not_played_under_one_name(tmp_path, other):
    info = describe_bag(write_bag(tmp_path / "walk", range(3)))
    with pytest.raises(
        InvalidRequestError, match=f"{JOINTS.name} and {GAIT.name} would both be played on {GAIT.name}"
    ):
        topic_names(info, None, [f"{JOINTS.name}:={other}"])
    assert topic_names(info, [JOINTS.name], [f"{JOINTS.name}:={other}"]) == {JOINTS.name: other}
    swapped = [f"{JOINTS.name}:={GAIT.name}", f"{GAIT.name}:={JOINTS.name}"]
    assert topic_names(info, None, swapped) == {JOINTS.name: GAIT.name, GAIT.name: JOINTS.name}


@pytest.mark.parametrize(
    ("wait", "words"),
    [
        (9.9, None),
        (10.0, "nothing was recorded for a while: waiting 10 s for the next message"),
        (1_700_000_008.0, "waiting 1700000008 s (19676 days) for the next message"),
    ],
)
def test_a_long_gap_is_told_before_it_is_waited_for(wait, words):
    assert (gap_warning(wait) is None) if words is None else (words in gap_warning(wait))


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
