"""The report's own formulation: its functions are those of the report, and what it ends with is judged."""

import casadi as ca
import numpy as np
import pytest

from walk_optimizer.compiler import COMPILER_VARIABLE
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.optimizer import reference_solve
from walk_optimizer.optimizer.reference_solve import reference_guess, solve_reference
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.solution import Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription import reference_formulation
from walk_optimizer.transcription.problems import to_scaled
from walk_optimizer.transcription.reference_formulation import (
    LEAST_MAXIMUM,
    reference_problem,
    scaling_constants,
    squared_fischer_burmeister,
)

REQUEST = GaitRequest.for_speed(0.42, SpringMode.NONE, 20)


@pytest.fixture(scope="module", autouse=True)
def interpreted():
    """Have the functions of this formulation interpreted: compiling them takes longer than these tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(COMPILER_VARIABLE, "")
        reference_formulation._kind()


@pytest.mark.parametrize(
    ("a", "b", "fulfilled"),
    [(0, 0, True), (3, 0, True), (0, 2, True), (1, 1, False), (-1, 0, False), (0, -2, False), (-1, 3, False)],
)
def test_the_function_vanishes_exactly_where_the_pair_is_complementary(a, b, fulfilled):
    value = float(squared_fischer_burmeister(ca.DM(a), ca.DM(b)))
    assert (value < 1e-12) is fulfilled


def test_its_derivative_is_that_of_the_report():
    a, b, c_a, c_b = ca.SX.sym("a"), ca.SX.sym("b"), 2.0, 3.0
    phi = squared_fischer_burmeister(c_a * a, c_b * b)
    derivative = ca.Function("derivative", [a, b], [ca.jacobian(phi, a)])
    root = np.hypot(2.0 * 0.7, 3.0 * 0.4)
    # Section 3.3.3, eq. (17): phi_FB (c_a^2 a / sqrt((c_a a)^2 + (c_b b)^2) - c_a).
    expected = (root - (2.0 * 0.7 + 3.0 * 0.4)) * (c_a**2 * 0.7 / root - c_a)
    assert float(derivative(0.7, 0.4)) == pytest.approx(expected)


def test_the_constants_are_one_over_the_maxima_of_all_points():
    sides = np.random.default_rng(1).uniform(0.1, 2.0, size=(16, 5))
    sides[3] = 0.0
    symbol = ca.MX.sym("sides", 16, 5)
    constants = ca.Function("constants", [symbol], [scaling_constants(symbol)])(sides)
    expected = 1 / np.maximum(sides.max(axis=1), LEAST_MAXIMUM)
    np.testing.assert_allclose(np.asarray(constants).ravel(), expected)


def test_the_program_has_the_size_of_the_reports():
    problem = reference_problem(REQUEST, WalkerParameters())
    assert problem.lower_x.size == 23 * 20 + 2
    assert problem.lower_g.size == 20 * 20 + 1
    assert (problem.lower_g[:-1] == 0).all()
    assert (problem.upper_g[:-1] == 0).all()


def test_our_gaits_solve_the_reports_program(plain_gait):
    problem = reference_problem(plain_gait.request, plain_gait.walker)
    x = to_scaled(plain_gait.walker, plain_gait.trajectory.stacked(), plain_gait.spring)
    g = np.asarray(problem.nlp.jacobian(x, problem.parameters)[0]).ravel()
    assert problem.infeasibility(x, g) < 1e-6
    perturbed = x.copy()
    perturbed[17] += 0.01  # A vertical force of the foot that stands: no longer in equilibrium.
    g = np.asarray(problem.nlp.jacobian(perturbed, problem.parameters)[0]).ravel()
    assert problem.infeasibility(perturbed, g) > 1e-4


def test_the_first_guess_follows_the_imposed_paths():
    points = reference_guess(WalkerParameters(), REQUEST)
    assert points.shape == (23, 20)
    assert np.diff(points[0]).std() < 1e-9, "the hip moves at constant speed"
    assert not points[12:15].any(), "without torques"


def test_what_is_not_solved_is_told_as_residuals_and_is_no_gait():
    told = []
    outcome = solve_reference(
        REQUEST, WalkerParameters(), progress=lambda progress: told.append(progress) or len(told) < 6
    )
    assert outcome.gait is None
    assert outcome.report.status is Status.CANCELLED
    assert outcome.report.iterations == 5
    assert {progress.stage for progress in told} == {"reference"}
    families = {violation.family for violation in outcome.report.violations}
    assert {"dynamics", "normal_complementarity", "speed"} <= families
    assert not outcome.certificate.certified
    assert str(outcome.certificate.worst) in outcome.report.message


@pytest.mark.parametrize("good", [True, False])
def test_it_becomes_a_gait_only_with_a_certificate(plain_gait, monkeypatch, good):
    points = plain_gait.trajectory.stacked().copy()
    points[12] += 0.0 if good else 0.01

    def solved(session, problem, start, stage, **options):
        x = to_scaled(plain_gait.walker, points, plain_gait.spring)
        return Solution(Status.SOLVED, x, 1.0, 0.0, 9, "Solve_Succeeded")

    monkeypatch.setattr(reference_solve.SolveSession, "solve", solved)
    outcome = solve_reference(plain_gait.request, plain_gait.walker)
    assert (outcome.gait is not None) is good
    assert outcome.report.status is (Status.SOLVED if good else Status.NOT_CERTIFIED)
    assert ("dynamics is off by" in outcome.report.message) is not good


def test_what_it_does_not_know_is_refused():
    with pytest.raises(InvalidRequestError, match="level ground only"):
        solve_reference(REQUEST, WalkerParameters(terrain=Terrain(slope=0.05)))
    with pytest.raises(InvalidRequestError, match="time limit is 0 s, allowed is above 0"):
        solve_reference(REQUEST, WalkerParameters(), time_limit=0)
