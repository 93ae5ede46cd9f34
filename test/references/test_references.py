import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from library.made_up_gait import made_up_gait

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.mechanics import foot_arm
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.references import EXCHANGED_JOINTS, JOINTS, cycle_reference, sample_cycle
from walk_optimizer.references.check import CycleMatcher, CycleSearch
from walk_optimizer.references.profile import EulerProfile, profile_of

SLOW = EulerProfile.of(made_up_gait(points=20))
FAST = EulerProfile.of(made_up_gait(speed=0.8, points=30, torque=3.0))
# No deadline: how fast the machine is says nothing about the code.
patient = settings(deadline=None, max_examples=60)


def test_joints_are_named_in_the_order_of_the_contract():
    assert JOINTS == ("left_hip", "left_knee", "right_hip", "right_knee")
    assert EXCHANGED_JOINTS == ("right_hip", "right_knee", "left_hip", "left_knee")


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


@pytest.mark.parametrize("terrain", [Terrain(slope=0.0873), Terrain(step_up=-0.04)], ids=str)
def test_on_slopes_and_stairs_the_base_is_that_since_the_start_of_the_walk(terrain):
    walker = WalkerParameters(terrain=terrain)
    profile = EulerProfile.of(made_up_gait(walker=walker))
    for time in np.linspace(0.0, 2 * profile.step_time, 30).tolist():
        reference = cycle_reference(profile, time)
        q = np.concatenate([reference.base, reference.position])[:, None]
        standing = foot_arm(walker, q, reference.step).position[:, 0]
        step = reference.step * np.array([profile.step_length, profile.rise])
        # On the grid's chords a foot that stands is a little above the ground.
        np.testing.assert_allclose(standing, step, atol=1e-3)
    before, after = (cycle_reference(profile, profile.step_time + shift) for shift in (0.0, 1e-9))
    assert (before.step, after.step) == (0, 1)
    np.testing.assert_allclose(after.base, before.base, atol=1e-8)


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


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    return GaitLibrary(WalkerParameters.from_yaml(), tmp_path_factory.mktemp("empty")).gaits()


def test_the_exchange_of_the_legs_is_the_middle_entry_of_the_table(shipped):
    # A chord across it would cut the corner where the velocity jumps.
    for profile in (SLOW, FAST, *map(profile_of, shipped)):
        times = CycleSearch(profile)._times
        assert times.size == 1601
        assert times[800] == pytest.approx(profile.step_time, abs=1e-12)


@pytest.mark.parametrize("mode", list(SpringMode))
def test_no_reference_of_a_shipped_gait_is_taken_for_a_mirrored_one(shipped, mode):
    gaits = [gait for gait in shipped if gait.request.spring_mode is mode]
    assert len(gaits) == 7
    for gait in gaits:
        profile = profile_of(gait)
        matcher = CycleMatcher(profile)
        cycle = sample_cycle(profile, 2000.0)
        # Where the legs pass each other, the mirrored posture is nearest: once a step.
        apart = np.abs(cycle.position[:2] - cycle.position[2:]).max(axis=0)
        passing = cycle.time[np.argmin(apart)] % profile.step_time
        close = passing + np.linspace(-0.02, 0.02, 80)
        exchanges = profile.step_time * np.arange(3)
        whole = np.linspace(0.0, matcher.period, 120)
        for time in np.concatenate([whole, exchanges, close, close + profile.step_time]):
            true = cycle_reference(profile, float(time))
            match = matcher.match(true.position, true.velocity, true.effort)
            assert max(match.position, match.velocity, match.effort) < 1e-5, (gait.speed, time)
