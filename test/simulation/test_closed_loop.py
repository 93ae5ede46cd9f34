"""Gaits walk under feedback, and fall without."""

import numpy as np

from walk_optimizer.simulation.ending import Ending


def test_the_gait_walks_at_its_speed_and_effort(loop, gait):
    walk = loop.walk(12)
    assert walk.ending is Ending.LANDED
    assert len(walk.completed) == 12
    np.testing.assert_allclose(walk.mean_speed, gait.speed, rtol=1e-4)
    np.testing.assert_allclose(walk.mean_effort, gait.refined.trajectory.torque_effort, rtol=2e-3)
    assert loop.largest_deviation(walk) < 1e-3


def test_without_feedback_it_drifts_off_and_falls(loop):
    walk = loop.walk_without_feedback(40)
    assert walk.ending.is_fall
    assert loop.largest_deviation(walk) > 0.05


def test_it_recovers_from_a_push(loop):
    walk = loop.walk(10, loop.disturbance(push=5.0))
    assert walk.ending is Ending.LANDED
    back = np.abs([stride.next_state - loop.start for stride in walk.strides]).max(axis=1)
    pushed = loop.settings.disturbed_step - 1
    assert back[pushed] > 0.02
    assert back[-1] < 0.1 * back[pushed]


def test_a_push_too_large_is_a_fall_with_its_reason(loop):
    walk = loop.walk(10, loop.disturbance(push=100.0))
    assert walk.ending.is_fall
    assert len(walk.completed) < 10
    assert walk.ending.sentence
