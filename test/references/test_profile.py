import math
import timeit

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from library.made_up_gait import made_up_gait, with_refinement

from walk_optimizer.model.kinematics import HIP_Y
from walk_optimizer.model.mechanics import foot_arm
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.references.profile import EulerProfile, RefinedProfile, join_error, profile_of, relabelled
from walk_optimizer.transcription.tableau import NODES

GAIT = made_up_gait(points=20)
PROFILE = EulerProfile.of(GAIT)
STEP = GAIT.request.step_time
patient = settings(deadline=None)
TIMES = st.floats(0, STEP)


def test_grid_points_are_those_of_the_gait():
    for index, time in enumerate(GAIT.trajectory.time):
        sample = PROFILE.sample(min(time, STEP))
        np.testing.assert_allclose(sample.q, GAIT.trajectory.q[:, index], atol=1e-12)


def test_the_step_begins_where_the_one_before_ended():
    last = GAIT.trajectory.q[:, -1]
    hip_x, hip_y, upper_1, knee_1, upper_2, knee_2 = last
    expected = [hip_x - GAIT.step_length, hip_y, upper_2, knee_2, upper_1, knee_1]
    np.testing.assert_array_equal(PROFILE.sample(0.0).q, expected)
    np.testing.assert_allclose(relabelled(relabelled(last, 0.3, 0.1), -0.3, -0.1), last, atol=1e-15)


def test_velocity_and_torque_hold_over_the_interval_that_ends_at_the_point():
    interval = GAIT.request.interval
    for index in range(20):
        inside = PROFILE.sample((index + 0.5) * interval)
        np.testing.assert_array_equal(inside.u, GAIT.trajectory.u[:, index])
        before = PROFILE.sample(0.0).q if index == 0 else GAIT.trajectory.q[:, index - 1]
        expected = (GAIT.trajectory.q[:, index] - before) / interval
        np.testing.assert_allclose(inside.qdot, expected, atol=1e-12)
        at_the_end = PROFILE.sample(GAIT.trajectory.time[index] - 1e-12)
        np.testing.assert_array_equal(at_the_end.u, GAIT.trajectory.u[:, index])


@patient
@given(TIMES)
def test_velocity_is_the_derivative_of_position(time):
    interval = GAIT.request.interval
    start = math.floor(time / interval) * interval
    a, b = start + 0.2 * interval, start + 0.8 * interval
    if b <= STEP:
        slope = (PROFILE.sample(b).q - PROFILE.sample(a).q) / (b - a)
        np.testing.assert_allclose(slope, PROFILE.sample((a + b) / 2).qdot, atol=1e-9)


@patient
@given(TIMES, st.floats(0, 1e-3))
def test_position_is_continuous(time, ahead):
    fastest = max(np.abs(PROFILE.sample((i + 0.5) * GAIT.request.interval).qdot).max() for i in range(20))
    later = min(time + ahead, STEP)
    change = np.abs(PROFILE.sample(later).q - PROFILE.sample(time).q).max()
    assert change <= fastest * (later - time) + 1e-12


def test_samples_cannot_be_written_to():
    sample = PROFILE.sample(0.1)
    for array in (sample.q, sample.qdot, sample.u):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_sample_is_cheap():
    # The aim is well below 100 microseconds; a slow machine gets ten times as long.
    assert min(timeit.repeat(lambda: PROFILE.sample(0.3), number=100, repeat=5)) / 100 < 1e-3


# ---------------------------------------------------------------- the refined solution

REFINED_GAIT = with_refinement(GAIT, intervals=20)
TRAJECTORY = REFINED_GAIT.refined.trajectory
REFINED = profile_of(REFINED_GAIT)


def test_the_refined_solution_is_walked_where_it_is_certified():
    doubtful = with_refinement(GAIT, certified=False)
    assert [profile_of(gait).method for gait in (GAIT, doubtful, REFINED_GAIT)] == [
        "implicit_euler",
        "implicit_euler",
        "radau",
    ]
    longer = RefinedProfile(TRAJECTORY, 0.3, 0.1)
    assert (longer.step_length, longer.rise, longer.step_time) == (0.3, 0.1, STEP)


def test_refined_samples_at_the_nodes_are_the_solution():
    for index, start in enumerate(TRAJECTORY.breaks[:-1]):
        for node in range(3):
            sample = REFINED.sample(start + NODES[node] * TRAJECTORY.lengths[index])
            np.testing.assert_allclose(sample.q, TRAJECTORY.states[index, node + 1, :6], atol=1e-12)
            np.testing.assert_allclose(sample.u, TRAJECTORY.torques[index, node], atol=1e-12)


@patient
@given(TIMES)
def test_refined_velocity_is_the_derivative_of_position(time):
    index, _ = TRAJECTORY.locate(time)
    start, length = TRAJECTORY.breaks[index], TRAJECTORY.lengths[index]
    middle = np.clip(time, start + 1e-5 * length, start + (1 - 1e-5) * length)
    a, b = REFINED.sample(middle - 1e-6 * length).q, REFINED.sample(middle + 1e-6 * length).q
    np.testing.assert_allclose((b - a) / (2e-6 * length), REFINED.sample(middle).qdot, atol=1e-7)


def test_refined_position_is_continuous_and_velocity_but_for_the_impact():
    for end in TRAJECTORY.breaks[1:-1]:
        before, after = REFINED.sample(end), REFINED.sample(end + 1e-12)
        np.testing.assert_allclose(before.q, after.q, atol=1e-10)
        # The made-up motion is smooth; its cubic interpolant is not quite.
        np.testing.assert_allclose(before.qdot, after.qdot, atol=5e-3)
    begin = relabelled(REFINED.sample(STEP).q, REFINED.step_length, 0.0)
    np.testing.assert_allclose(REFINED.sample(0.0).q, begin, atol=1e-12)


def test_a_refined_sample_is_cheap_and_read_only():
    # The aim is well below 50 microseconds; a slow machine gets ten times as long.
    assert min(timeit.repeat(lambda: REFINED.sample(0.3), number=100, repeat=5)) / 100 < 5e-4
    sample = REFINED.sample(0.1)
    assert not any(array.flags.writeable for array in (sample.q, sample.qdot, sample.u))


# ---------------------------------------------------------------- slopes and stairs

TERRAINS = [Terrain(slope=0.0873), Terrain(slope=-0.05), Terrain(step_up=0.04), Terrain(0.05, 0.02)]


@pytest.fixture(params=TERRAINS, ids=str)
def elsewhere(request):
    """A gait on a slope or stairs, on the report's grid and refined, with its profiles."""
    gait = with_refinement(made_up_gait(walker=WalkerParameters(terrain=request.param)), intervals=20)
    return gait, (EulerProfile.of(gait), profile_of(gait))


def test_a_step_rises_to_where_its_foot_lands_and_the_next_one_begins_there(elsewhere):
    gait, profiles = elsewhere
    assert [profile.method for profile in profiles] == ["implicit_euler", "radau"]
    for profile in profiles:
        end = profile.sample(STEP).q
        landing = foot_arm(gait.walker, end[:, None], 1).position[:, 0]
        assert landing == pytest.approx([profile.step_length, profile.rise])
        assert abs(profile.rise) > 0.009
        np.testing.assert_allclose(
            relabelled(end, profile.step_length, profile.rise), profile.sample(0.0).q, atol=1e-12
        )
        assert join_error(profile, profile) < 1e-12


def test_the_hip_does_not_leap_in_the_first_interval_of_a_step_that_rises(elsewhere):
    _, (euler, refined) = elsewhere
    interval = STEP / GAIT.trajectory.points
    for number in range(3):
        moved = refined.sample((number + 1) * interval).q - refined.sample(number * interval).q
        speed = euler.sample((number + 0.5) * interval).qdot[HIP_Y]
        assert speed == pytest.approx(moved[HIP_Y] / interval, abs=1e-3)
