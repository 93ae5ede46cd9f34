"""The finger: the package's contact pairs on a model that is no walker, checked by Newton's laws."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.examples.finger import move_disc
from walk_optimizer.examples.finger_check import certify_finger
from walk_optimizer.examples.finger_model import Finger
from walk_optimizer.examples.finger_problem import (
    FORCES,
    SLIP,
    FingerTask,
    P,
    Q,
    finger_problem,
    points_of,
    still_guess,
)
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings

FINGER, TASK = Finger(), FingerTask(points=20)


@pytest.fixture(scope="module")
def motion():
    return move_disc(FINGER, TASK, SolveSession(solver_settings(), 300.0, None))


def test_it_finds_a_contact_that_the_guess_does_not_have_and_lets_go_again(motion):
    tip, disc = motion.finding.schedule
    assert tip[0] == FootMode.FREE
    assert tip[-1] == FootMode.FREE
    assert 0 < np.count_nonzero(tip != FootMode.FREE) < TASK.points / 2
    assert (disc != FootMode.FREE).any()
    assert motion.points[2, -1] == pytest.approx(TASK.distance, abs=1e-9)


def test_its_certificate_is_within_all_tolerances(motion):
    certificate = motion.finding.certificate
    assert certificate.certified
    families = {entry.family for entry in certificate.entries}
    assert {"kinematics", "dynamics", "distance", "tip_complementarity", "disc_penetration"} <= families


@pytest.mark.parametrize(
    ("rows", "family"),
    [(Q, "kinematics"), (P, "dynamics"), (FORCES, "dynamics"), (SLIP, "complementarity")],
)
def test_a_motion_that_is_changed_is_not_certified(motion, rows, family):
    broken = motion.points.copy()
    broken[rows] *= 1.001
    broken[rows] += 1e-5
    failures = certify_finger(FINGER, TASK, broken).failures()
    assert any(entry.family.endswith(family) for entry in failures)


def test_a_disc_that_falls_short_is_not_certified(motion):
    farther = replace(TASK, distance=TASK.distance + 1e-4)
    assert "distance" in {one.family for one in certify_finger(FINGER, farther, motion.points).failures()}


def test_the_check_and_the_program_agree_on_the_dynamics_of_random_points():
    """Rows of the program are those of Newton's laws, for any motion at all."""
    generator = np.random.default_rng(4)
    problem = finger_problem(FINGER, TASK, 1e-2)
    x = still_guess(FINGER, TASK) + generator.normal(0.0, 0.2, problem.lower_x.size)
    rows = np.asarray(problem.nlp.jacobian(x, problem.parameters)[0]).reshape(26, TASK.points, order="F")
    units = np.array([1, 1, 0.1, 0.1, 1, 0.01, 0.01, 0.2, 0.2, 0.01])
    defects = rows[:10] * units[:, None] / TASK.interval
    certificate = {one.family: one for one in certify_finger(FINGER, TASK, points_of(FINGER, x)).entries}
    assert np.abs(defects[:5]).max() == pytest.approx(certificate["kinematics"].violation, rel=1e-9)
    assert np.abs(defects[5:]).max() == pytest.approx(certificate["dynamics"].violation, rel=1e-9)


def test_derivatives_of_the_assembled_program_against_finite_differences():
    task = FingerTask(points=3)
    problem, step = finger_problem(FINGER, task, 1e-2), 1e-6
    x = still_guess(FINGER, task) + np.random.default_rng(6).normal(0.0, 0.1, problem.lower_x.size)

    def rows(at):
        return np.asarray(problem.nlp.jacobian(at, problem.parameters)[0]).ravel()

    columns = [(rows(x + one) - rows(x - one)) / (2 * step) for one in step * np.eye(x.size)]
    found = np.asarray(ca.densify(problem.nlp.jacobian(x, problem.parameters)[1]))
    np.testing.assert_allclose(found, np.transpose(columns), atol=1e-6)
