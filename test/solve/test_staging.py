"""The staged program is the program: same values, same derivatives, and the structure that was promised."""

import casadi as ca
import numpy as np
import pytest

from walk_optimizer.contact.schedule import double_impact
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.oracle import Oracle, extended_parameters, free_variables
from walk_optimizer.solve.staging import Staging, staged_oracle
from walk_optimizer.transcription.problems import fixed_schedule_problem
from walk_optimizer.transcription.program import StageOrder

POINTS = 4
REQUEST = GaitRequest(0.3, 0.75, SpringMode.STIFFNESS, POINTS)


@pytest.fixture(scope="module")
def problem():
    return fixed_schedule_problem(REQUEST, WalkerParameters(), double_impact(POINTS))


@pytest.fixture(scope="module")
def oracle(problem):
    return Oracle.of(problem.nlp, free_variables(problem))


@pytest.fixture(scope="module")
def staging(problem, oracle):
    stages = problem.nlp.stages
    return Staging(oracle, StageOrder(stages.variables[free_variables(problem)], stages.rows))


@pytest.fixture(scope="module")
def point(problem):
    return 1 + 0.1 * np.random.default_rng(3).normal(size=free_variables(problem).size)


def evaluated(oracle, x, p, lam, *outputs):
    function = oracle.function("f", *outputs, multipliers=True)
    return [np.asarray(ca.DM(one)) for one in function.call([x, p, 0.7, lam])]


def test_the_order_of_stages_says_what_rows_depend_on(problem):
    order = problem.nlp.stages
    rows, columns = (np.array(one) for one in problem.nlp.jacobian.sparsity_out(1).get_triplet())
    seen, own = order.variables[columns], order.rows[rows]
    assert set(order.rows) == set(range(POINTS))
    assert ((seen == -1) | (seen == own) | ((seen + 1) % POINTS == own)).all()


def test_rows_and_cost_are_those_of_the_program(problem, oracle, staging, point):
    staged, p = staged_oracle(oracle, staging), extended_parameters(problem)
    lam = np.zeros(staging.height)
    f, g = evaluated(oracle, point, p, lam[: oracle.lam.numel()], oracle.f, oracle.g)
    staged_f, staged_g = evaluated(staged, staging.spread(point), p, lam, staged.f, staged.g)
    assert staged_f == pytest.approx(f)
    np.testing.assert_allclose(staged_g[staging.row_places], g, atol=1e-12)
    # The gaps, and what closes the ring, hold wherever copies agree; closing makes nothing new.
    others = np.delete(staged_g, staging.row_places)
    np.testing.assert_allclose(others, 0, atol=1e-12)


def test_derivatives_along_agreeing_copies_are_those_of_the_program(problem, oracle, staging, point):
    staged, p = staged_oracle(oracle, staging), extended_parameters(problem)
    generator = np.random.default_rng(4)
    along, lam = generator.normal(size=point.size), generator.normal(size=staging.height)
    own_lam = lam[staging.row_places]
    expressions = (oracle.gradient, oracle.jacobian, ca.triu2symm(oracle.hessian))
    gradient, jacobian, hessian = evaluated(oracle, point, p, own_lam, *expressions)
    expressions = (staged.gradient, staged.jacobian, staged.hessian)
    staged_gradient, staged_jacobian, staged_hessian = evaluated(
        staged, staging.spread(point), p, lam, *expressions
    )
    direction = staging.spread(along)
    assert staged_gradient.ravel() @ direction == pytest.approx(gradient.ravel() @ along)
    rows = (staged_jacobian @ direction)[staging.row_places]
    np.testing.assert_allclose(rows, jacobian @ along, atol=1e-9)
    np.testing.assert_array_equal(staged_hessian, staged_hessian.T)
    assert direction @ staged_hessian @ direction == pytest.approx(along @ hessian @ along)


def test_every_entry_lies_within_its_stage(oracle, staging):
    staged, structure = staged_oracle(oracle, staging), staging.structure
    widths = np.array(structure["nx"]) + np.array(structure["nu"])
    stage_of = np.repeat(np.arange(POINTS + 1), widths)
    first, second = (np.array(one) for one in staged.hessian.sparsity().get_triplet())
    assert (stage_of[first] == stage_of[second]).all()
    gaps = np.concatenate(staging.gaps)
    rows, columns = (np.array(one) for one in staged.jacobian.sparsity().get_triplet())
    for k, places in enumerate(staging.gaps):
        assert set(stage_of[columns[np.isin(rows, places)]]) == {k, k + 1}
    path = ~np.isin(rows, gaps)
    heights = [*(one.size for one in staging.rows_of), staging.closing.size]
    order = np.concatenate([np.repeat(np.arange(POINTS + 1), heights)])
    places = np.concatenate([*(staging.row_places[one] for one in staging.rows_of), staging.closing])
    row_stage = dict(zip(places.tolist(), order.tolist(), strict=True))
    assert all(
        row_stage[row] == stage_of[column] for row, column in zip(rows[path], columns[path], strict=True)
    )
