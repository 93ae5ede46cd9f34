"""Margins of a walker: the row of its landing speed, and the load on the foot that stands, on both grids."""

import math
from dataclasses import replace

import numpy as np
import pytest
from transcription.plain_program import dense, random_scaled_point

from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.model.parameters import KneeSpring
from walk_optimizer.transcription.mesh import even_mesh
from walk_optimizer.transcription.phases import phases_of
from walk_optimizer.transcription.problems import complementarity_problem, fixed_schedule_problem, from_scaled
from walk_optimizer.transcription.refined import RefinedProblem

LEAST = 0.15


@pytest.fixture(scope="module")
def landing_walker(walker):
    return replace(walker, landing_speed=LEAST)


@pytest.fixture(scope="module")
def bounded(request_of_three_points, landing_walker):
    return fixed_schedule_problem(request_of_three_points, landing_walker, single_impact(3))


def normal_speed(walker, q, p):
    """Speed of foot 2 off the ground at a state, in [m/s]."""
    mechanics = mechanics_at(walker, KneeSpring(), q[:, None], p[:, None])
    return float(walker.terrain.along_and_normal(mechanics.foot_velocity(1)[:, 0])[1])


def test_only_walkers_that_bound_it_have_the_row(
    request_of_three_points, walker, landing_walker, bounded, complementarity
):
    asked, free = (
        request_of_three_points,
        fixed_schedule_problem(request_of_three_points, walker, single_impact(3)),
    )
    for without, within in (
        (free, bounded),
        (complementarity, complementarity_problem(asked, landing_walker, 1e-8)),
    ):
        assert without.lower_g[-1] == pytest.approx(asked.step_length / walker.leg_length)
        np.testing.assert_array_equal(within.lower_g, [*without.lower_g, LEAST])
        np.testing.assert_array_equal(within.upper_g, [*without.upper_g, np.inf])


def test_the_row_is_the_speed_towards_the_ground_at_the_last_point(
    bounded, request_of_three_points, landing_walker
):
    x = random_scaled_point(request_of_three_points, np.random.default_rng(5))
    row = dense(bounded.nlp.jacobian(x, bounded.parameters)[0]).ravel()[-1]
    points, _ = from_scaled(landing_walker, x)
    assert row == pytest.approx(-normal_speed(landing_walker, points[:6, -1], points[6:12, -1]), rel=1e-9)


def test_its_derivatives_are_those_of_differences(bounded, request_of_three_points):
    x = random_scaled_point(request_of_three_points, np.random.default_rng(6))
    only = np.zeros(bounded.lower_g.size)
    only[-1] = 1.0

    def row(where):
        return float(bounded.nlp.jacobian(where, bounded.parameters)[0][-1])

    def slope(where):
        return dense(bounded.nlp.jacobian(where, bounded.parameters)[1])[-1]

    upper = dense(bounded.nlp.hessian(x, bounded.parameters, 0.0, only))
    curvature = upper + np.triu(upper, 1).T
    assert np.abs(curvature).max() > 0.01
    for direction in np.random.default_rng(7).normal(size=(3, x.size)):
        ends = x + 1e-6 * direction, x - 1e-6 * direction
        np.testing.assert_allclose(slope(x) @ direction, (row(ends[0]) - row(ends[1])) / 2e-6, rtol=1e-6)
        difference = (slope(ends[0]) - slope(ends[1])) / 2e-6
        np.testing.assert_allclose(curvature @ direction, difference, atol=1e-6 * np.abs(difference).max())


def test_the_refined_grid_has_the_same_row_before_the_duration(request_of_three_points, landing_walker):
    mesh = even_mesh([phases_of(single_impact(10))], 2)
    refined = RefinedProblem(request_of_three_points, landing_walker, mesh)
    problem = refined.problem()
    assert problem.lower_g[-2] == LEAST
    assert problem.upper_g[-2] == np.inf
    x = np.random.default_rng(8).normal(0.0, 0.5, problem.lower_x.size)
    row = dense(problem.nlp.jacobian(x, problem.parameters)[0]).ravel()[-2]
    last = x[refined.variables.last_state_columns()] * refined.variables.state_unit
    assert row == pytest.approx(-normal_speed(landing_walker, last[:6], last[6:]), rel=1e-9)


def test_the_stance_foot_carries_its_load_after_the_impact(request_of_three_points, walker):
    loaded = replace(walker, stance_load=0.2)
    asked = replace(request_of_three_points, points=5)
    for problem in (
        fixed_schedule_problem(asked, loaded, single_impact(5)),
        complementarity_problem(asked, loaded, 1e-8),
    ):
        lower, _ = from_scaled(loaded, problem.lower_x)
        least = 0.2 * loaded.weight
        np.testing.assert_allclose(lower[17], [0.0, 0.0, least, least, least])
        np.testing.assert_array_equal(lower[20], 0.0)


def test_on_a_slope_any_allowed_vertical_force_loads_the_foot_enough(request_of_three_points, walker):
    loaded = replace(walker, stance_load=0.2)
    refined = RefinedProblem(request_of_three_points, loaded, even_mesh([phases_of(single_impact(10))], 2))
    with np.errstate(invalid="ignore"):
        forces = refined.unpack(refined.problem().lower_x).forces
    vertical = forces[0, 0, 1]
    np.testing.assert_allclose(forces[:, :, 1], vertical)
    np.testing.assert_array_equal(forces[:, :, 3], 0.0)
    # The least normal force that a force within the cone may have there: it leans uphill the most.
    slope, cone = loaded.terrain.slope, math.atan(loaded.friction_coefficient)
    length = vertical / math.cos(slope - cone)
    assert length * math.cos(cone) == pytest.approx(0.2 * loaded.weight, rel=1e-12)
