"""The assembled program against the plain one: values, Jacobian, gradient and Hessian, boundary included."""

import casadi as ca
import numpy as np
import pytest
from transcription.plain_program import ROWS, dense, random_scaled_point

from walk_optimizer.contact.schedule import FootMode, double_impact
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.problems import fixed_schedule_problem

TOLERANCE = {"rtol": 1e-10, "atol": 1e-10}


@pytest.fixture(scope="module")
def program(complementarity):
    return complementarity.nlp


@pytest.fixture(scope="module")
def parameters(complementarity):
    return complementarity.parameters


def test_rows(program, parameters, plain):
    g, _ = program.jacobian(plain.x, parameters)
    np.testing.assert_allclose(dense(g).ravel(), plain.g[plain.report], **TOLERANCE)


def test_jacobian(program, parameters, plain):
    _, jacobian = program.jacobian(plain.x, parameters)
    assert jacobian.nnz() < 0.3 * jacobian.numel(), "sparse even for three points"
    np.testing.assert_allclose(dense(jacobian), plain.jacobian[plain.report], **TOLERANCE)


def test_hessian_of_the_lagrangian(program, parameters, plain):
    hessian = program.hessian(plain.x, parameters, plain.sigma, plain.multipliers[plain.report])
    np.testing.assert_allclose(dense(hessian), np.triu(plain.hessian), **TOLERANCE)


def test_each_row_of_the_boundary_enters_the_hessian(program, parameters, plain):
    # Position of the relabelled hip, and the step length: the only ones that are not linear.
    for row in (0, plain.report.size - 1):
        multipliers = np.zeros(plain.report.size)
        multipliers[row] = 1.0
        hessian = dense(program.hessian(plain.x, parameters, 0.0, multipliers))
        last = layout.POINT_WIDTH * 2
        angles = [last + 4, last + 5]
        assert np.abs(hessian[np.ix_(angles, angles)]).max() > 0.01


def test_gradient_of_the_objective(program, parameters, plain):
    _, gradient = program.gradient(plain.x, parameters)
    np.testing.assert_allclose(dense(gradient).ravel(), plain.gradient, **TOLERANCE)


def test_the_objective_is_proportional_to_f(program, parameters, plain, request_of_three_points):
    other = random_scaled_point(request_of_three_points, np.random.default_rng(8))
    value, _ = program.gradient(other, parameters)
    assert float(value) == pytest.approx(plain.unit * float(plain.objective(other)), rel=1e-12)


def test_expressions_and_derivative_functions_agree(program, parameters, plain):
    names = program.expressions
    function = ca.Function("values", [names["x"], names["p"]], [names["f"], names["g"]])
    f, g = function(plain.x, parameters)
    np.testing.assert_allclose(dense(g).ravel(), plain.g[plain.report], **TOLERANCE)
    assert float(f) == pytest.approx(float(program.gradient(plain.x, parameters)[0]), rel=1e-12)


def test_jacobian_is_that_of_finite_differences(program, parameters, plain):
    def rows(x):
        return dense(program.jacobian(x, parameters)[0]).ravel()

    steps = 1e-6 * np.eye(plain.x.size)
    columns = [(rows(plain.x + step) - rows(plain.x - step)) / 2e-6 for step in steps]
    scale = np.abs(plain.jacobian).max()
    jacobian = dense(program.jacobian(plain.x, parameters)[1])
    np.testing.assert_allclose(jacobian, np.array(columns).T, atol=1e-7 * scale)


def test_a_fixed_schedule_is_a_selection_of_the_same_rows(walker, request_of_three_points, plain):
    schedule = double_impact(3)
    schedule[0, 1], schedule[0, 2] = FootMode.SLIP_FORWARD, FootMode.SLIP_BACKWARD
    problem = fixed_schedule_problem(request_of_three_points, walker, schedule)
    gap, cone, plus, minus = range(12, 16)
    sides = [[28, 29], [30, 31]]
    kept = {0: [gap, plus, 16, 18, *sides[0], *sides[1]], 1: [gap, cone, minus, 16], 2: [gap, cone, plus, 16]}
    rows = [ROWS * point + row for point in range(3) for row in [*range(12), *kept[point]]]
    rows.append(plain.g.size - 1)
    g, jacobian = problem.nlp.jacobian(plain.x, problem.parameters)
    np.testing.assert_allclose(dense(g).ravel(), plain.g[rows], **TOLERANCE)
    np.testing.assert_allclose(dense(jacobian), plain.jacobian[rows], **TOLERANCE)
    multipliers = np.zeros(plain.g.size)
    multipliers[rows] = plain.multipliers[rows]
    hessian = problem.nlp.hessian(plain.x, problem.parameters, plain.sigma, multipliers[rows])
    directions = np.random.default_rng(3).normal(size=(plain.x.size, 3))
    full = dense(hessian) + np.triu(dense(hessian), 1).T

    def gradient(x):
        slope = dense(problem.nlp.gradient(x, problem.parameters)[1]).ravel()
        return (
            plain.sigma * slope + dense(problem.nlp.jacobian(x, problem.parameters)[1]).T @ multipliers[rows]
        )

    for direction in directions.T:
        difference = (gradient(plain.x + 1e-6 * direction) - gradient(plain.x - 1e-6 * direction)) / 2e-6
        np.testing.assert_allclose(full @ direction, difference, atol=1e-6 * np.abs(difference).max())
