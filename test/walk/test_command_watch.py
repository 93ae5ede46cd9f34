"""A stream of commands that falls silent is noticed, whatever is refused meanwhile."""

import pytest

from walk_optimizer.walk.command_watch import CommandWatch

TIMEOUT = 0.5


@pytest.fixture
def watch():
    """A watch of a stream that was followed at 1 s."""
    watch = CommandWatch(TIMEOUT)
    watch.heard(1.0)
    watch.followed()
    return watch


def test_a_silence_is_noticed_once(watch):
    assert [watch.fell_silent(now) for now in (1.0, 1.5, 1.51, 2.0)] == [False, False, True, False]
    assert watch.stale


def test_a_command_that_is_worked_on_keeps_the_stream_alive_until_it_is_refused(watch):
    for now in (1.3, 1.7, 2.1):
        watch.heard(now)
        assert not watch.fell_silent(now + 0.4)
    watch.refused()
    assert watch.fell_silent(2.5)


def test_a_stale_stream_stays_stale_until_it_is_followed(watch):
    assert watch.fell_silent(2.0)
    watch.heard(3.0)
    assert not watch.stale
    watch.refused()
    assert watch.stale
    assert not watch.fell_silent(9.0)
    watch.heard(10.0)
    watch.followed()
    assert not watch.stale
    assert watch.fell_silent(11.0)


def test_a_set_point_ends_the_watch_only_if_it_is_carried_out(watch):
    watch.suspend()
    assert not watch.fell_silent(9.0)
    watch.refused()
    assert watch.fell_silent(9.0)
    watch.heard(10.0)
    watch.followed()
    watch.suspend()
    watch.followed()
    assert (watch.fell_silent(20.0), watch.active) == (False, False)


def test_a_clock_that_was_set_back_says_nothing_about_the_silence_before(watch):
    assert [watch.fell_silent(now) for now in (0.2, 0.6, 0.8)] == [False, False, True]


def test_without_a_timeout_no_silence_is_too_long():
    watch = CommandWatch(0)
    watch.heard(0.0)
    assert not watch.fell_silent(1e9)
