import math
import timeit

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from library.made_up_gait import made_up_gait

from walk_optimizer.profile import BlendedProfile, EulerProfile, relabelled

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
    np.testing.assert_array_equal(relabelled(relabelled(last, 0.3), -0.3)[1:], last[1:])


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


@patient
@given(st.lists(st.floats(-0.5, 0.5), min_size=6, max_size=6), TIMES)
def test_a_blend_leads_from_one_gait_to_the_other(offset, time):
    start = PROFILE.sample(0.0).q + np.array(offset)
    blend = BlendedProfile(PROFILE, start)
    np.testing.assert_allclose(blend.sample(0.0).q, start, atol=1e-12)
    np.testing.assert_allclose(blend.sample(STEP).q, PROFILE.sample(STEP).q, atol=1e-12)
    np.testing.assert_allclose(blend.sample(STEP).qdot, PROFILE.sample(STEP).qdot, atol=1e-12)

    def added(at):
        return blend.sample(at).q - PROFILE.sample(at).q

    a, b = max(time - 1e-5, 0.0), min(time + 1e-5, STEP)
    slope = (added(b) - added(a)) / (b - a)
    middle = (a + b) / 2
    np.testing.assert_allclose(slope, blend.sample(middle).qdot - PROFILE.sample(middle).qdot, atol=1e-6)
