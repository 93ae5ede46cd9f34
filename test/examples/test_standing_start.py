"""Setting off from standing feet: contacts are found, and the residuals are our own."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.examples.standing_start import StandingStart, certify_standing, set_off, still_guess
from walk_optimizer.gait import Trajectory
from walk_optimizer.model.mechanics import foot_arm
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.transcription import layout

WALKER = WalkerParameters()
TASK = StandingStart(distance=0.5, points=16, coarse_points=16)


@pytest.fixture(scope="module")
def motion():
    return set_off(WALKER, TASK, SolveSession(solver_settings(), 300.0, None))


def test_both_feet_stand_in_the_guess():
    points = still_guess(WALKER, TASK)
    assert np.ptp(points[layout.STATE], axis=1).max() == 0.0
    assert (points[layout.P] == 0.0).all()
    feet = [foot_arm(WALKER, points[layout.Q], leg).position for leg in range(2)]
    np.testing.assert_allclose([foot[1] for foot in feet], 0.0, atol=1e-9)
    np.testing.assert_allclose([foot[0, 0] for foot in feet], [0.1, -0.1], atol=1e-9)


def test_it_lifts_a_foot_and_walks(motion):
    schedule = motion.finding.schedule
    assert all((feet == FootMode.FREE).any() and (feet != FootMode.FREE).any() for feet in schedule)
    ends = [foot_arm(WALKER, motion.trajectory.q[:, -1:], leg).position[0, 0] for leg in range(2)]
    assert max(ends) > 0.2, "upright at 0.5 m, a foot must have stepped ahead of where both stood"


def test_it_is_certified(motion):
    assert motion.finding.certificate.certified
    assert motion.trajectory.q[0, -1] >= TASK.distance - 1e-6
    assert motion.trajectory.q[1].min() >= TASK.lowest_hip - 1e-6


@pytest.mark.parametrize(
    ("task", "family"),
    [
        ({"distance": 0.51}, "hip_distance"),
        ({"lowest_hip": 0.999}, "hip_height"),
        ({"speed": 2.0}, "speed"),
        ({"spread": 0.21}, "kinematics"),
    ],
)
def test_it_is_not_certified_for_another_task(motion, task, family):
    failures = certify_standing(WALKER, replace(TASK, **task), motion.trajectory).failures()
    assert family in {entry.family for entry in failures}


def test_a_changed_motion_is_not_certified(motion):
    points = motion.trajectory.stacked()
    points[layout.REACTION] *= 1.01
    broken = Trajectory.from_stacked(points, TASK.duration)
    families = {entry.family for entry in certify_standing(WALKER, TASK, broken).failures()}
    assert "dynamics" in families
