import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from library.made_up_gait import made_up_gait

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.profile import EulerProfile
from walk_optimizer.reference_check import CycleMatcher
from walk_optimizer.references import JOINTS, ReferenceGenerator, cycle_reference, sample_cycle

SLOW = EulerProfile.of(made_up_gait(points=20))
FAST = EulerProfile.of(made_up_gait(speed=0.8, points=30, torque=3.0))
# No deadline: how fast the machine is says nothing about the code.
patient = settings(deadline=None, max_examples=60)
# Normal ticks, stalls, jumps of the clock in both directions.
TICKS = st.lists(st.one_of(st.floats(0, 0.02), st.floats(-1e6, 1e6), st.just(0.0)), min_size=1, max_size=150)
PERIODS = st.floats(1e-3, 0.2)


def fastest(*profiles):
    """Largest speed of a joint in [rad/s], with what blending two of the profiles may add."""
    cycles = [sample_cycle(profile, 1000) for profile in profiles]
    own = max(np.abs(cycle.velocity).max() for cycle in cycles)
    return own + 1.875 * 2 * np.pi / min(profile.step_time for profile in profiles)


def test_joints_are_named_in_the_order_of_the_contract():
    assert JOINTS == ("left_hip", "left_knee", "right_hip", "right_knee")


def test_left_is_the_stance_leg_of_the_first_step_and_legs_exchange():
    sample = SLOW.sample(0.3)
    left, right = cycle_reference(SLOW, 0.3), cycle_reference(SLOW, 0.3 + SLOW.step_time)
    u1, u2, u3 = sample.u
    np.testing.assert_array_equal(left.position, sample.q[[2, 3, 4, 5]])
    np.testing.assert_array_equal(left.effort, [u1, u2, -u1, u3])
    np.testing.assert_allclose(right.position, sample.q[[4, 5, 2, 3]], atol=1e-12)
    np.testing.assert_allclose(right.velocity, sample.qdot[[4, 5, 2, 3]], atol=1e-12)
    np.testing.assert_allclose(right.effort, [-u1, u3, u1, u2], atol=1e-12)
    assert right.base[0] == pytest.approx(left.base[0] + SLOW.step_length)


@patient
@given(st.floats(0, 1.5))
def test_efforts_are_the_three_torques(time):
    reference = cycle_reference(SLOW, time)
    u1, u2, u3 = reference.torques
    np.testing.assert_array_equal(reference.effort, [u1, u2, -u1, u3])


def test_hip_and_knee_conventions_are_those_of_the_kinematics():
    # Foot of the leg from the documented angles: upper leg at hip, lower leg at hip + knee - pi.
    walker = WalkerParameters()
    reference = cycle_reference(SLOW, 0.2)
    hip, knee = reference.position[:2]
    lower = hip + knee - np.pi
    foot = reference.base + walker.upper_leg_length * np.array([np.sin(hip), -np.cos(hip)])
    foot += walker.lower_leg_length * np.array([np.sin(lower), -np.cos(lower)])
    q = SLOW.sample(0.2).q[:, None]
    feet = evaluate("feet", walker, q, np.zeros_like(q))[0]  # One column a foot.
    np.testing.assert_allclose(foot, feet[:, 0], atol=1e-12)


@patient
@given(TICKS)
def test_the_phase_never_goes_back_and_never_jumps(ticks):
    generator = ReferenceGenerator(SLOW, longest_gap=0.1)
    clock, before = 1e9, generator.advance(1e9)
    for tick in ticks:
        clock += tick
        after = generator.advance(clock)
        passed = (after.step - before.step) * SLOW.step_time + after.time - before.time
        assert -1e-9 <= passed <= 0.1 + 1e-9
        if tick <= 0:
            assert passed == 0
        before = after


@patient
@given(TICKS, st.lists(st.sampled_from([SLOW, FAST]), max_size=5), st.data())
def test_references_are_continuous_whatever_the_clock_and_the_gaits_do(ticks, gaits, data):
    generator = ReferenceGenerator(SLOW, longest_gap=0.1)
    changes = {data.draw(st.integers(0, 150)): gait for gait in gaits}
    clock, before = 0.0, generator.advance(0.0)
    limit = fastest(SLOW, FAST) * 0.1
    for number, tick in enumerate(ticks):
        if number in changes:
            generator.change(changes[number])
        clock += tick
        after = generator.advance(clock)
        assert np.abs(after.position - before.position).max() <= limit
        assert after.base[0] >= before.base[0] - 0.05
        before = after


@patient
@given(PERIODS, st.integers(2, 12))
def test_velocity_is_the_derivative_of_position_across_the_exchange(period, count):
    """The integral of the velocity over each tick is the change of the position."""
    generator = ReferenceGenerator(SLOW, longest_gap=1.0)
    references = [generator.advance(number * period) for number in range(count)]
    for before, after in itertools.pairwise(references):
        begin = before.step * SLOW.step_time + before.time
        fine = begin + (np.arange(50) + 0.5) / 50 * period
        velocities = [cycle_reference(SLOW, time % (2 * SLOW.step_time)).velocity for time in fine]
        integral = np.mean(velocities, axis=0) * period
        error = np.abs(after.position - before.position - integral).max()
        assert error <= fastest(SLOW) * period / 12


@pytest.mark.parametrize("changed", [False, True])
def test_position_has_no_jump_at_the_end_of_a_step(changed):
    generator = ReferenceGenerator(SLOW)
    if changed:
        generator.change(FAST)
    clock, references = 0.0, []
    while not references or references[-1].step < 2:
        clock += 1e-3
        references.append(generator.advance(clock))
    positions = np.array([reference.position for reference in references])
    bases = np.array([reference.base for reference in references])
    limit = 1e-3 * fastest(SLOW, FAST)
    assert np.abs(np.diff(positions, axis=0)).max() <= limit
    assert np.abs(np.diff(bases, axis=0)).max() <= limit


def test_another_gait_begins_at_the_next_step_and_the_last_request_counts():
    generator = ReferenceGenerator(SLOW)
    generator.advance(0.0)
    generator.change(SLOW)
    generator.change(FAST)
    clock = 0.0
    while (reference := generator.advance(clock)).step == 0:
        assert generator.gait is SLOW
        expected = cycle_reference(SLOW, reference.time)
        np.testing.assert_allclose(reference.position, expected.position, atol=1e-12)
        clock += 0.01
    assert generator.gait is FAST
    while (reference := generator.advance(clock)).step == 1:
        clock += 0.01
    expected = cycle_reference(FAST, reference.time)  # An even step again: left leads.
    np.testing.assert_allclose(reference.position, expected.position, atol=1e-12)


def test_references_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        cycle_reference(SLOW, 0.1).position[0] = 1.0


@patient
@given(st.floats(1, 1000))
def test_a_cycle_is_closed_and_evenly_sampled(rate):
    cycle = sample_cycle(SLOW, rate)
    assert cycle.position.shape == (4, cycle.time.size)
    assert cycle.time[0] == 0
    assert cycle.time[-1] == pytest.approx(2 * SLOW.step_time)
    assert np.diff(cycle.time).max() <= 1 / rate * (1 + 1e-9)
    np.testing.assert_allclose(cycle.position[:, 0], cycle.position[:, -1], atol=1e-12)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf"), 1e7])
def test_a_cycle_of_an_impossible_rate_is_refused(rate):
    with pytest.raises(InvalidRequestError, match=r"rate is .* allowed is 1 to 10000 Hz"):
        sample_cycle(SLOW, rate)


@patient
@given(st.one_of(st.floats(0, 1), st.integers(0, 40).map(lambda point: point / 40 - 2e-6)))
def test_a_received_reference_is_found_in_the_cycle(place):
    matcher = CycleMatcher(SLOW)
    true = cycle_reference(SLOW, place % 1.0 * matcher.period)
    match = matcher.match(true.position, true.velocity, true.effort)
    assert max(match.position, match.velocity, match.effort) < 1e-6
    wrong = matcher.match(true.position + 0.01, true.velocity, true.effort)
    assert wrong.position > 1e-3
