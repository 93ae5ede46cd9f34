"""The clock of a walk never goes back, never jumps, and comes to rest smoothly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walk_optimizer.walk.phase_clock import Motion, PhaseClock, smooth_rate

patient = settings(deadline=None, max_examples=60)
GAP = 0.1
ROUNDING = 1e-6
# Normal ticks, stalls, jumps of the clock in both directions.
TICKS = st.one_of(st.floats(0, 0.02), st.floats(-1e6, 1e6), st.just(0.0))
COMMANDS = st.sampled_from(["pause", "resume", "stop_at_once", None, None, None])


@patient
@given(st.lists(st.tuples(TICKS, COMMANDS), max_size=150))
def test_the_phase_moves_at_most_as_far_as_the_clock_and_never_back(events):
    clock, time = PhaseClock(GAP), 1e9
    clock.advance(time)
    for tick, command in events:
        if command is not None:
            getattr(clock, command)()
        before = time
        time += tick
        moved = clock.advance(time)
        assert 0 <= moved.phase <= max(time - before, 0.0) + 1e-12
        assert moved.phase <= GAP + ROUNDING
        assert 0 <= moved.rate <= 1
        if not 0 <= time - before <= GAP + ROUNDING:
            assert moved.phase == 0


@patient
@given(st.lists(st.tuples(st.floats(1e-4, 0.02), COMMANDS), min_size=2, max_size=150))
def test_the_phase_is_the_integral_of_the_rate_and_the_rate_has_no_jump(events):
    clock, time = PhaseClock(GAP, ramp=0.3), 0.0
    before = clock.advance(time)
    for tick, command in events:
        if command is not None:
            getattr(clock, command)()
        time += tick
        after = clock.advance(time)
        steepest = 1.5 / 0.3
        if command != "stop_at_once":
            assert abs(after.rate - before.rate) <= steepest * tick + 1e-9
            mean = (before.rate + after.rate) / 2
            assert abs(after.phase - mean * tick) <= steepest * tick**2
        before = after


def moved_until_rest(clock, period=0.001):
    """Advance until the walk is held, and return the phases."""
    phases, time = [], 0.0
    clock.advance(0.0)
    while not clock.at_rest:
        time += period
        phases.append(clock.advance(time).phase)
    return phases


def test_a_pause_takes_half_of_the_ramp_to_come_to_rest():
    clock = PhaseClock(ramp=0.4)
    clock.pause()
    phases = moved_until_rest(clock)
    assert sum(phases) == pytest.approx(0.2, abs=1e-9)
    assert len(phases) == pytest.approx(400, abs=1)
    assert np.all(np.diff(phases) < 1e-12)


def test_an_emergency_stop_holds_at_once_and_takes_two_calls_to_go_on():
    clock = PhaseClock()
    clock.advance(0.0)
    clock.stop_at_once()
    held = clock.advance(0.01)
    assert (held.phase, held.rate, clock.at_rest) == (0.0, 0.0, True)
    clock.pause()
    assert clock.motion is Motion.EMERGENCY_STOP
    assert clock.resume() is Motion.PAUSED
    assert clock.advance(0.02).phase == 0
    assert clock.resume() is Motion.RUNNING
    assert clock.advance(0.03).phase > 0


def test_a_new_walk_runs_unless_an_emergency_stop_is_in_force():
    clock = PhaseClock(GAP)
    for motion, phase in ((clock.pause, 0.01), (clock.stop_at_once, 0.0)):
        clock.advance(5.0)
        motion()
        clock.advance(6.0)
        clock.restart()
        assert (clock.holds, clock.advance(1.0).phase) == (0, 0.0)
        assert clock.advance(1.01).phase == pytest.approx(phase)
    assert clock.motion is Motion.EMERGENCY_STOP


def test_a_suspended_walk_comes_to_a_hold_and_goes_on_as_it_was_asked_to():
    clock = PhaseClock(ramp=0.4)
    clock.suspended = True
    assert sum(moved_until_rest(clock)) == pytest.approx(0.2, abs=1e-9)
    clock.pause()
    assert clock.resume() is Motion.RUNNING
    assert clock.advance(1.0).phase == 0
    clock.restart()
    assert (clock.at_rest, clock.advance(0.0).rate) == (True, 0.0)
    clock.suspended = False
    assert clock.advance(0.1).rate == pytest.approx(smooth_rate(0.25))


def test_a_run_is_as_fast_as_the_clock():
    clock = PhaseClock()
    assert [clock.advance(time).phase for time in (5.0, 5.01, 5.03)] == pytest.approx([0.0, 0.01, 0.02])
    assert (smooth_rate(0.0), smooth_rate(0.5), smooth_rate(1.0)) == (0.0, 0.5, 1.0)


def test_a_clock_that_moves_just_as_far_as_the_longest_gap_moves_the_walk():
    clock = PhaseClock(GAP)
    phases = [clock.advance(tick * GAP).phase for tick in range(1000)]
    assert phases[1:] == pytest.approx([GAP] * 999)
    assert clock.holds == 0


def test_one_jump_changes_no_velocity_and_from_the_second_in_a_row_on_the_walk_is_at_rest():
    clock = PhaseClock(GAP, ramp=0.1)
    times = [5.0, 5.2, 5.25, 5.24, 5.25, 5.4, 5.6, 5.8]
    moved = [clock.advance(time) for time in times]
    assert [advance.rate for advance in moved] == [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
    assert clock.holds == 5
    # It does not set off with a jump of the velocity either.
    assert clock.advance(5.85).rate == pytest.approx(smooth_rate(0.5))
    assert clock.advance(5.95).rate == 1
