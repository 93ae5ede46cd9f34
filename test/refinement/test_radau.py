"""The collocation method and the refined program's derivatives."""

import casadi as ca
import numpy as np

from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.gait import Gait
from walk_optimizer.transcription.mesh import Mesh
from walk_optimizer.transcription.phases import phases_of
from walk_optimizer.transcription.refined import RefinedProblem
from walk_optimizer.transcription.tableau import DIFFERENTIATION, NODES, NODES_WITH_START, QUADRATURE


def test_quadrature_is_exact_to_degree_four() -> None:
    for degree in range(5):
        assert np.isclose(QUADRATURE @ NODES**degree, 1 / (degree + 1), rtol=1e-13)
    assert not np.isclose(QUADRATURE @ NODES**5, 1 / 6, rtol=1e-4)


def test_differentiation_is_exact_for_cubics() -> None:
    for degree in range(1, 4):
        assert np.allclose(DIFFERENTIATION @ NODES_WITH_START**degree, degree * NODES ** (degree - 1))


def test_derivatives_of_the_refined_program(gait: Gait) -> None:
    mesh = Mesh(phases_of(single_impact(50)), (np.array([0.4, 0.6]),))
    problem = RefinedProblem(gait.request, gait.walker, mesh).problem()
    random = np.random.default_rng(3)
    x = random.uniform(0.3, 1.2, problem.lower_x.size)
    multipliers = random.normal(size=problem.lower_g.size)
    nlp, p, step = problem.nlp, problem.parameters, 1e-6
    value = ca.Function("value", [nlp.expressions["x"], nlp.expressions["p"]], [nlp.expressions["g"]])

    def lagrangian_gradient(at: np.ndarray) -> np.ndarray:
        objective = np.asarray(nlp.gradient(at, p)[1]).ravel()
        return 0.7 * objective + np.asarray(nlp.jacobian(at, p)[1]).T @ multipliers

    directions = np.eye(x.size)
    rows = [(value(x + step * d, p) - value(x - step * d, p)) / (2 * step) for d in directions]
    assert np.allclose(np.hstack(rows), nlp.jacobian(x, p)[1], atol=1e-6)
    columns = [
        (lagrangian_gradient(x + step * d) - lagrangian_gradient(x - step * d)) / (2 * step)
        for d in directions
    ]
    upper = np.asarray(ca.DM(nlp.hessian(x, p, 0.7, multipliers)))
    assert np.allclose(np.triu(np.column_stack(columns)), upper, atol=1e-5)
