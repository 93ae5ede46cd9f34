"""Size, rows and bounds of the report's programs."""

import math

import numpy as np
import pytest

from walk_optimizer.contact.schedule import FootMode, single_impact
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription.problems import (
    complementarity_problem,
    fixed_schedule_problem,
    from_scaled,
    to_scaled,
)

WALKER = WalkerParameters(hip_angle_limit=1.2, stiffness_limit=300.0)


def asked(mode=SpringMode.NONE, points=4):
    return GaitRequest(0.3, 0.75, mode, points)


def physical_bounds(problem):
    """Lower and upper bounds of the points, (23, N) each, and of the spring, in SI units."""
    with np.errstate(invalid="ignore"):
        (lower, least), (upper, most) = (from_scaled(WALKER, x) for x in (problem.lower_x, problem.upper_x))
    return lower, upper, least, most


@pytest.mark.parametrize("points", [3, 4, 11])
def test_sizes_of_the_report(points):
    problem = complementarity_problem(asked(points=points), WALKER, 1e-8)
    assert problem.lower_x.size == problem.upper_x.size == 23 * points + 2
    equalities = problem.lower_g == problem.upper_g
    assert np.count_nonzero(equalities) == 12 * points
    # Each of the 8 N pairs has a side a that is no variable, and a product.
    sides = (problem.lower_g == 0) & (problem.upper_g == np.inf)
    products = (problem.lower_g == -np.inf) & (problem.upper_g == 1e-8)
    assert np.count_nonzero(sides) == np.count_nonzero(products) == 8 * points
    assert problem.lower_g.size == (12 + 8 + 8) * points + 1


@pytest.mark.parametrize("problem", ["complementarity", "fixed schedule"])
def test_the_step_length_is_the_last_row_and_bounded_from_below_alone(problem):
    walker = WalkerParameters(upper_leg_length=0.4, lower_leg_length=0.4)
    if problem == "complementarity":
        built = complementarity_problem(asked(), walker, 1e-8)
    else:
        built = fixed_schedule_problem(asked(), walker, single_impact(4))
    assert built.lower_g[-1] == pytest.approx(0.3 / 0.8)
    assert built.upper_g[-1] == np.inf


def test_bounds_of_the_report():
    lower, upper, _, _ = physical_bounds(complementarity_problem(asked(), WALKER, 1e-8))
    for row, (low, high) in {2: (-1.2, 1.2), 4: (-1.2, 1.2), 3: (0, math.pi), 5: (0, math.pi)}.items():
        np.testing.assert_allclose(lower[row], low)
        np.testing.assert_allclose(upper[row], high)
    assert (lower[6] == 0).all()
    assert (lower[15:23] == 0).all()
    free = [0, 1, *range(7, 15)]
    assert (lower[free] == -np.inf).all()
    assert (upper[[*free, 6, *range(15, 23)]] == np.inf).all()


@pytest.mark.parametrize(
    ("mode", "least", "most"),
    [
        (SpringMode.NONE, KneeSpring(0.0, math.pi), KneeSpring(0.0, math.pi)),
        (SpringMode.STIFFNESS, KneeSpring(0.0, math.pi), KneeSpring(300.0, math.pi)),
        (SpringMode.STIFFNESS_AND_EQUILIBRIUM, KneeSpring(0.0, 0.0), KneeSpring(300.0, math.pi)),
    ],
)
def test_what_each_spring_mode_may_choose(mode, least, most):
    _, _, low, high = physical_bounds(complementarity_problem(asked(mode), WALKER, 1e-8))
    for bound, expected in ((low, least), (high, most)):
        assert bound.stiffness == pytest.approx(expected.stiffness)
        assert bound.equilibrium == pytest.approx(expected.equilibrium)


def test_a_schedule_fixes_what_each_mode_excludes():
    schedule = np.array([list(FootMode), [FootMode.FREE] * 4], dtype=np.int8)
    problem = fixed_schedule_problem(asked(), WALKER, schedule)
    lower, upper, _, _ = physical_bounds(problem)
    fixed = (lower == 0) & (upper == 0)
    x_plus, x_minus, normal, gamma = 15, 16, 17, 21
    expected = {
        FootMode.FREE: {x_plus, x_minus, normal, gamma},
        FootMode.STICK: {gamma, x_minus},
        FootMode.SLIP_FORWARD: {x_plus},
        FootMode.SLIP_BACKWARD: {x_minus},
    }
    for point, mode in enumerate(FootMode):
        of_foot_1 = {row for row in (x_plus, x_minus, normal, gamma) if fixed[row, point]}
        assert of_foot_1 == expected[mode]
    assert fixed[[18, 19, 20, 22]].all(), "foot 2 is free throughout"
    assert lower[x_plus, list(FootMode).index(FootMode.STICK)] == -np.inf, "the net force"
    # 12 dynamics and the gap of foot 2 a point; of foot 1: gap, and for a loaded foot cone, of which one that
    # sticks has two sides, and slip.
    assert problem.lower_g.size == 4 * 13 + (1 + 4 + 3 + 3) + 1


def test_scaling_there_and_back():
    generator = np.random.default_rng(2)
    points, spring = generator.normal(size=(23, 5)), KneeSpring(120.0, 2.9)
    scaled = to_scaled(WALKER, points, spring)
    assert scaled.shape == (23 * 5 + 2,)
    again, same_spring = from_scaled(WALKER, scaled)
    np.testing.assert_allclose(again, points, rtol=1e-14)
    assert same_spring.stiffness == pytest.approx(120.0)
    assert same_spring.equilibrium == pytest.approx(2.9)


def test_infeasibility_is_the_largest_violation_of_any_bound():
    problem = complementarity_problem(asked(), WALKER, 1e-8)
    x = np.clip(np.zeros(problem.lower_x.size), problem.lower_x, problem.upper_x)
    g = np.clip(np.zeros(problem.lower_g.size), problem.lower_g, problem.upper_g)
    assert problem.infeasibility(x, g) == 0.0
    for index, value in ((3, -0.25), (3, math.pi + 0.25), (17, -0.25)):
        worse = x.copy()
        worse[index] = value
        assert problem.infeasibility(worse, g) == pytest.approx(0.25)
    for index, value in ((0, 0.5), (0, -0.5), (12, -0.5), (20, 0.5), (-1, 0.3 - 0.5)):
        worse = g.copy()
        worse[index] = value
        assert problem.infeasibility(x, worse) == pytest.approx(0.5)


def test_infeasibility_of_what_is_not_a_number_is_not_zero():
    problem = complementarity_problem(asked(), WALKER, 1e-8)
    x, g = np.full(problem.lower_x.size, np.nan), np.full(problem.lower_g.size, np.nan)
    assert problem.infeasibility(x, g) != 0.0
