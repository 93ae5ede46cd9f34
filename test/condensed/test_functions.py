"""The condensed functions against mechanics written a second time, and against finite differences."""

from functools import cache

import numpy as np
import pytest

from walk_optimizer.condensed.functions import end_functions, hip_functions, node_functions
from walk_optimizer.model.mechanics import along_and_normal, foot_arm, mechanics_at
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.transcription.scaling import spring_units, torque_unit

SPRING = KneeSpring(stiffness=60.0, equilibrium=2.7)
STEP = 0.4


@pytest.fixture(autouse=True)
def rng():
    """Numbers that do not depend on which tests ran before."""
    return np.random.default_rng(7)


@pytest.fixture(params=[Terrain(), Terrain(slope=0.08)], ids=["level", "slope"])
def walker(request):
    return WalkerParameters(hip_mass=40.0, lower_leg_length=0.45, terrain=request.param)


@cache
def functions():
    return {one.name(): one for one in [*node_functions(), *end_functions(), *hip_functions()]}


def full_state(walker, theta, omega):
    """Return q, qdot and p (6,) each, from the hip's place and the mechanics' own mass matrix."""
    hip, velocity = functions()["condensed_hip"](theta, omega, walker.vector(STEP))
    q = np.concatenate([np.asarray(hip).ravel(), theta])
    qdot = np.concatenate([np.asarray(velocity).ravel(), omega])
    # The mass matrix's columns are what makes M^-1 p unit velocities.
    unit = mechanics_at(walker, SPRING, np.tile(q[:, None], 6), np.eye(6)).qdot
    return q, qdot, np.linalg.solve(unit, qdot)


def random_motion(rng):
    theta = np.array([0.2, 2.9, -0.3, 2.5]) + 0.1 * rng.standard_normal(4)
    return theta, rng.standard_normal(4)


def test_the_hip_is_where_foot_1_stands_at_the_origin_and_does_not_move(walker, rng):
    theta, omega = random_motion(rng)
    q, qdot, p = full_state(walker, theta, omega)
    state = mechanics_at(walker, SPRING, q[:, None], p[:, None])
    np.testing.assert_allclose(foot_arm(walker, q[:, None], 0).position, 0.0, atol=1e-15)
    np.testing.assert_allclose(state.foot_velocity(0), 0.0, atol=1e-12)
    np.testing.assert_allclose(state.qdot[:, 0], qdot, atol=1e-12)


def test_momenta_are_those_of_the_mechanics(walker, rng):
    theta, omega = random_motion(rng)
    value, _ = functions()["condensed_momentum"](np.concatenate([theta, omega]), walker.vector(STEP))
    np.testing.assert_allclose(np.asarray(value).ravel(), full_state(walker, theta, omega)[2], rtol=1e-10)


def test_rows_of_a_node_are_the_torques_that_the_rate_of_the_momenta_needs(walker, rng):
    theta, omega = random_motion(rng)
    q, _, p = full_state(walker, theta, omega)
    torques, reaction = rng.standard_normal(3) * 20, np.array([30.0, 700.0])
    mechanics = mechanics_at(walker, SPRING, q[:, None], p[:, None])
    forces = np.concatenate([reaction, np.zeros(2)])[:, None]
    rate = mechanics.momentum_rate(torques[:, None], forces)[:, 0]
    springs = np.array([SPRING.stiffness, SPRING.equilibrium]) / np.array(spring_units(walker), dtype=float)
    y = np.concatenate([theta, omega, rate, springs])
    rows = np.asarray(functions()["condensed_point"](y, walker.vector(STEP))[0]).ravel()
    unit = float(torque_unit(walker))
    np.testing.assert_allclose(rows[:3] * unit, torques, atol=1e-9)
    assert abs(rows[3] * unit) < 1e-9, "a motion of the walker needs no torque where none acts"
    gap = walker.terrain.gap(foot_arm(walker, q[:, None], 1).position, STEP)[0]
    assert rows[4] * walker.leg_length == pytest.approx(gap, abs=1e-12)


def test_the_ends_are_zero_for_an_impact_of_the_mechanics(walker, rng):
    theta, omega = random_motion(rng)
    _, _, before = full_state(walker, theta, omega)
    exchanged = theta[[2, 3, 0, 1]]
    # A velocity after the impact, and the impulse that leads there.
    after = np.linalg.lstsq(*impact_equations(walker, exchanged, before), rcond=None)[0]
    e = np.concatenate([theta, omega, after[:4]])
    rows, _ = functions()["condensed_ends"](e, walker.vector(STEP))
    impulse = np.asarray(functions()["condensed_impulse"](e, walker.vector(STEP))).ravel()
    values = np.asarray(rows).ravel()
    np.testing.assert_allclose(values[:4], 0.0, atol=1e-10)
    np.testing.assert_allclose(impulse, after[4:], atol=1e-8)
    q, _, p = full_state(walker, theta, omega)
    foot = foot_arm(walker, q[:, None], 1).position
    velocity = mechanics_at(walker, SPRING, q[:, None], p[:, None]).foot_velocity(1)
    assert values[4] * walker.leg_length == pytest.approx(walker.terrain.gap(foot, STEP)[0], abs=1e-12)
    assert values[5] * walker.leg_length == pytest.approx(foot[0, 0])
    tangential, normal = along_and_normal(walker, np.concatenate([impulse, impulse])[:, None])[:2, 0]
    limit = walker.friction_coefficient * normal
    cone = np.array([limit - tangential, limit + tangential]) / (0.1 * walker.weight)
    np.testing.assert_allclose(values[6:8], cone, atol=1e-9)
    speeds = along_and_normal(walker, np.concatenate([velocity, velocity]))
    assert values[8] == pytest.approx(-speeds[1, 0], abs=1e-12)


def impact_equations(walker, theta, before):
    """Return matrix and right side of P(theta, omega) - J_1' impulse = momenta before, legs exchanged."""
    momenta = np.array([full_state(walker, theta, unit)[2] for unit in np.eye(4)]).T
    q = full_state(walker, theta, np.zeros(4))[0]
    jacobian = foot_arm(walker, q[:, None], 0).jacobian[0]
    return np.hstack([momenta, -jacobian.T]), before[[0, 1, 4, 5, 2, 3]]


@pytest.mark.parametrize("name", ["condensed_point", "condensed_momentum", "condensed_ends"])
def test_first_derivatives_are_those_of_finite_differences(walker, rng, name):
    function, vector = functions()[name], walker.vector(STEP)
    theta, omega = random_motion(rng)
    size = function.size1_in(0)
    x = np.concatenate([theta, omega, rng.standard_normal(8)])[:size]
    derivative = np.asarray(function(x, vector)[1])
    jacobian = derivative if name == "condensed_ends" else derivative.T
    differences = [
        np.asarray(function(x + step, vector)[0] - function(x - step, vector)[0]).ravel() / 2e-6
        for step in 1e-6 * np.eye(size)
    ]
    np.testing.assert_allclose(jacobian, np.array(differences).T, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("name", ["curvature", "ends_curvature"])
def test_second_derivatives_are_those_of_finite_differences(walker, rng, name):
    every, vector = functions(), walker.vector(STEP)
    theta, omega = random_motion(rng)
    if name == "curvature":
        x = np.concatenate([theta, omega, rng.standard_normal(6), [3.0, 2.8]])
        of_rows, of_momenta = rng.standard_normal(5), rng.standard_normal(6)

        def gradient(at):
            rows = np.asarray(every["condensed_point"](at, vector)[1]) @ of_rows
            rows[:8] += np.asarray(every["condensed_momentum"](at[:8], vector)[1]) @ of_momenta
            return rows

        hessian = np.asarray(every["condensed_curvature"](x, of_rows, of_momenta, vector))
    else:
        x, lam = np.concatenate([theta, omega, rng.standard_normal(4)]), rng.standard_normal(9)

        def gradient(at):
            return np.asarray(every["condensed_ends"](at, vector)[1]).T @ lam

        hessian = np.asarray(every["condensed_ends_curvature"](x, lam, vector))
    differences = [(gradient(x + step) - gradient(x - step)) / 2e-6 for step in 1e-6 * np.eye(x.size)]
    np.testing.assert_allclose(hessian, np.array(differences), rtol=1e-5, atol=1e-5)
