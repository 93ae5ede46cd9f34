"""Whatever is commanded and whatever the clock does: no jump, and no more torque than the gaits have."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from library.made_up_gait import made_up_gait, with_refinement
from walk.paces import FAST, SLOW, STAND, STANDING, landing_jump

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.references import cycle_reference
from walk_optimizer.references.profile import profile_of
from walk_optimizer.walk.blending import blended
from walk_optimizer.walk.joint_limits import (
    JointLimitError,
    JointLimits,
    JointNeed,
    JointPeaks,
    peaks_of,
    peaks_of_gait,
)
from walk_optimizer.walk.phase_clock import PhaseClock
from walk_optimizer.walk.walk import DiscontinuousPlanError, StepPlan, Walk

PACES = (STAND, SLOW, FAST)
PLANS = {(a, b): blended(a, b) for a in PACES for b in PACES if a is not b}
STEPS = [*PACES, *(step for plan in PLANS.values() for step in plan.steps)]
PEAKS = peaks_of(STEPS)
FASTEST, STRONGEST = max(PEAKS.speed), max(PEAKS.torque)
LANDING = max(map(landing_jump, (SLOW, FAST)))
RAMP, GAP = 0.3, 0.1
LARGEST = np.finfo(np.float64).max


def steepest():
    """Largest acceleration of a joint within the steps, and while a pause comes or goes, in [rad/s^2]."""
    largest = 0.0
    for step in STEPS:
        times = np.linspace(0, min(step.step_time, 2.0), 2000)
        rates = np.array([step.sample(time).qdot[2:] for time in times])
        largest = max(largest, np.abs(np.diff(rates, axis=0)).max() / (times[1] - times[0]))
    return largest + FASTEST * 1.5 / RAMP


STEEPEST = steepest()

COMMANDS = ["slow", "fast", "stand", "pause", "resume", "resume", "emergency"]
EVENTS = st.lists(
    st.tuples(
        st.one_of(st.floats(1e-4, 0.05), st.sampled_from([0.0, -3.0, 5.0, 1e6])),
        st.one_of(st.none(), st.none(), st.sampled_from(COMMANDS)),
    ),
    min_size=20,
    max_size=120,
)


def go(walk, goal):
    if goal is walk.pace:
        assert walk.stay(goal)
    else:
        assert walk.follow(PLANS[walk.pace, goal])


def command(walk, name):
    if name in ("slow", "fast", "stand"):
        go(walk, {"slow": SLOW, "fast": FAST, "stand": STAND}[name])
    else:
        {"pause": walk.clock.pause, "resume": walk.clock.resume, "emergency": walk.clock.stop_at_once}[name]()


@settings(deadline=None, max_examples=80)
@given(EVENTS)
def test_references_are_continuous_and_bounded_whatever_is_commanded(events):
    walk, clock = Walk(STAND, PhaseClock(GAP, RAMP)), 0.0
    before, jumped = walk.advance(clock), False
    for tick, name in events:
        if name is not None:
            command(walk, name)
        clock += tick
        after = walk.advance(clock)
        passed = tick if 0 < tick <= GAP else 0.0
        jumped, jumped_before = not 0 <= tick <= GAP, jumped
        assert np.abs(after.position - before.position).max() <= FASTEST * passed * 1.01 + 1e-9
        assert np.abs(after.effort).max() <= STRONGEST * (1 + 1e-9)
        assert np.abs(after.velocity).max() <= FASTEST * 1.01
        if name != "emergency" and not (jumped and jumped_before):
            allowed = STEEPEST * passed * 1.1 + 1e-6 + LANDING * (after.step - before.step)
            assert np.abs(after.velocity - before.velocity).max() <= allowed
        else:
            assert not after.velocity.any()
            assert not after.effort.any()
        before = after


@settings(deadline=None, max_examples=30)
@given(EVENTS)
def test_velocity_is_the_derivative_of_position(events):
    walk, clock, period = Walk(STAND, PhaseClock(GAP, RAMP)), 0.0, 5e-3
    before = walk.advance(clock)
    for _, name in events:
        if name is not None:
            command(walk, name)
        halted = name == "emergency"
        for _ in range(10):
            clock += period
            after = walk.advance(clock)
            moved = (before.velocity + after.velocity) / 2 * period
            error = np.abs(after.position - before.position - moved).max()
            jump = LANDING * (after.step - before.step) + (FASTEST if halted else 0.0)
            assert error <= (STEEPEST * period + jump) * period
            before, halted = after, False


def run(walk, begin, seconds, period=1e-3):
    """Return the references of some time."""
    times = begin + np.arange(1, round(seconds / period) + 1) * period
    return [walk.advance(time) for time in times.tolist()]


def test_a_stand_is_left_at_once_and_a_gait_at_the_end_of_its_step():
    walk = Walk(STAND, PhaseClock())
    standing = run(walk, 0.0, 0.5)
    np.testing.assert_array_equal(standing[-1].position, STANDING.q[2:])
    np.testing.assert_array_equal(standing[-1].torques, STANDING.torques)
    assert not np.any([reference.velocity for reference in standing])
    go(walk, SLOW)
    assert walk.goal is SLOW
    (first,) = run(walk, 0.5, 1e-3)
    assert (first.step, walk.pace, walk.is_changing) == (0, SLOW, True)
    run(walk, 0.501, SLOW.step_time)
    assert not walk.is_changing
    go(walk, STAND)
    assert walk.pace is SLOW
    references = run(walk, 0.501 + SLOW.step_time, 2.1 * SLOW.step_time)
    assert (walk.pace, walk.is_changing, walk.former) == (STAND, False, SLOW)
    # Three steps later the right leg is the one ahead.
    assert references[-1].step == 3
    np.testing.assert_allclose(references[-1].position, STANDING.q[[4, 5, 2, 3]], atol=1e-12)
    assert not references[-1].velocity.any()


def test_once_it_is_reached_a_gait_is_streamed_as_it_is():
    walk = Walk(STAND, PhaseClock())
    walk.advance(0.0)
    go(walk, FAST)
    references = run(walk, 0.0, 4 * FAST.step_time)
    for reference in references[-100:]:
        expected = cycle_reference(FAST, reference.time + (reference.step % 2) * FAST.step_time)
        np.testing.assert_allclose(reference.position, expected.position, atol=1e-9)
        np.testing.assert_allclose(reference.velocity, expected.velocity, atol=1e-9)


def test_up_a_slope_and_stairs_every_step_goes_on_where_the_one_before_ended():
    walker = WalkerParameters(terrain=Terrain(slope=0.05, step_up=0.03))
    slow, fast = (
        profile_of(with_refinement(made_up_gait(speed=speed, walker=walker), intervals=20))
        for speed in (0.25 / 0.785, 0.8)
    )
    walk = Walk(slow, PhaseClock())
    walk.advance(0.0)
    walk.follow(blended(slow, fast))
    duration = 1.5 * slow.step_time + 4 * fast.step_time
    base = np.array([reference.base for reference in run(walk, 0.0, duration)])
    assert walk.pace is fast
    assert np.abs(np.diff(base, axis=0)).max() < 2e-3
    period = round(fast.step_time / 1e-3)
    climbed = (base[-1] - base[-1 - period]) / (period * 1e-3)
    assert climbed == pytest.approx(np.array([fast.step_length, fast.rise]) / fast.step_time, rel=0.01)


def test_of_several_plans_the_last_one_counts_and_one_from_elsewhere_is_refused():
    walk = Walk(SLOW, PhaseClock())
    assert walk.follow(PLANS[SLOW, FAST])
    assert walk.follow(PLANS[SLOW, STAND])
    assert not walk.follow(PLANS[FAST, STAND])
    run(walk, 0.0, 2.5 * SLOW.step_time)
    assert walk.pace is STAND
    walk.follow(PLANS[STAND, FAST])
    assert not walk.stay(FAST)
    assert walk.stay(STAND)
    run(walk, 10.0, 0.1)
    assert walk.pace is STAND


def test_a_walk_that_is_held_starts_nothing():
    walk = Walk(STAND, PhaseClock())
    walk.advance(0.0)
    walk.clock.stop_at_once()
    go(walk, SLOW)
    assert {reference.step for reference in run(walk, 0.0, 1.0)} == {0}
    walk.clock.resume()
    walk.clock.resume()
    run(walk, 1.0, 0.2)
    assert walk.pace is SLOW


def test_steps_that_jump_are_no_plan():
    with pytest.raises(DiscontinuousPlanError, match=r"step 0 of 0 .* ends 0\.\d+ m or rad from where"):
        StepPlan(SLOW, (), FAST)


def test_what_no_joint_can_do_is_refused_with_the_joint_and_both_numbers():
    peaks = peaks_of([FAST])
    limits = JointLimits(torque=(100.0, 100.0, 100.0, 1.0), speed=(100.0,) * 4)
    need = JointNeed("to walk", peaks)
    expected = r"to walk, right_knee needs \d+(\.\d+)? N m, its limit is 1 N m"
    with pytest.raises(JointLimitError, match=expected) as error:
        limits.require(need)
    assert "left" not in str(error.value)
    JointLimits().require(need)
    # The legs exchange their roles, so either knee needs what the stance or the swing knee does.
    assert peaks.torque[:2] == peaks.torque[2:]
    assert peaks.speed[1] == pytest.approx(
        max(np.abs([FAST.sample(t).qdot[[3, 5]] for t in np.linspace(0, FAST.step_time, 4000)]).max(axis=0)),
        rel=1e-3,
    )


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_what_is_no_finite_number_is_refused_whatever_the_limits_are(number):
    peaks = peaks_of([FAST])
    broken = JointPeaks((*peaks.torque[:3], number), peaks.speed)
    for need in (broken, broken | peaks, peaks | broken):
        for limits in (JointLimits(), JointLimits(torque=(200.0,) * 4)):
            with pytest.raises(JointLimitError, match=f"to walk, right_knee needs {number} N m"):
                limits.require(JointNeed("to walk", need))


def test_torques_that_overflow_between_the_nodes_are_refused():
    gait = with_refinement(made_up_gait())
    torques = gait.refined.trajectory.torques
    trajectory = replace(gait.refined.trajectory, torques=torques / np.abs(torques).max() * LARGEST)
    gait = replace(gait, refined=replace(gait.refined, trajectory=trajectory))
    with np.errstate(all="ignore"):
        peaks = peaks_of_gait(gait)
    with pytest.raises(JointLimitError, match=r"left_knee needs (inf|nan) N m, its limit is inf N m"):
        JointLimits().require(JointNeed("to walk", peaks))
