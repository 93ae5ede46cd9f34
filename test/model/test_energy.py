"""Energy of the walker in flight, and derivatives of the Hamiltonian by finite differences."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from walk_optimizer.model import dynamics
from walk_optimizer.model.functions import evaluate, model_function
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker

WALKER = WalkerParameters()
SPRING = (150.0, 2.9)
Q = np.array([0.1, 0.9, 0.3, 2.6, -0.4, 2.9])
P = np.array([50.0, -20.0, 3.0, -1.0, 2.0, 0.7])
ENERGY_UNIT = WALKER.weight * WALKER.leg_length


def motion():
    """(q, p, u, force) -> qdot, pdot, power of torques and ground forces."""
    walker = SymbolicWalker()
    q, p, u, force = ca.SX.sym("q", 6), ca.SX.sym("p", 6), ca.SX.sym("u", 3), ca.SX.sym("force", 2, 2)
    qdot = dynamics.velocity(walker, q, p)
    rate = dynamics.momentum_rate(walker, q, qdot, u, force, ca.DM(SPRING))
    function = ca.Function("motion", [q, p, u, force, walker.symbols], [qdot, rate])
    feet = model_function("foot_velocities")

    def evaluated(q, p, u, force):
        qdot, rate = (np.asarray(value).ravel() for value in function(q, p, u, force, WALKER.vector()))
        foot_velocities = np.asarray(feet(q, p, WALKER.vector(), SPRING))
        # Written out by hand: the hip torque turns leg 1 against leg 2, the others bend the knees.
        joints = u[0] * (qdot[2] - qdot[4]) + u[1] * qdot[3] + u[2] * qdot[5]
        return qdot, rate, joints + float(np.sum(force * foot_velocities))

    return evaluated


MOTION = motion()


def integrate(u, force):
    """State and work done at 21 instants of one second."""

    def rate(time, state):
        qdot, pdot, power = MOTION(state[:6], state[6:12], u(time), force)
        return np.concatenate([qdot, pdot, [power]])

    start = np.concatenate([Q, P, [0.0]])
    instants = np.linspace(0.0, 1.0, 21)
    solution = solve_ivp(rate, (0.0, 1.0), start, "DOP853", instants, rtol=1e-11, atol=1e-11)
    assert solution.success
    return solution.y


def energies(states):
    return evaluate("energy", WALKER, states[:6], states[6:12], SPRING).ravel()


def test_energy_of_the_free_system_with_springs_is_conserved():
    states = integrate(lambda _: np.zeros(3), np.zeros((2, 2)))
    energy = energies(states)
    kinetic = energy - evaluate("energy", WALKER, states[:6], 0 * states[6:12], SPRING).ravel()
    assert np.ptp(kinetic) > 0.1 * ENERGY_UNIT, "kinetic and potential energy must be exchanged"
    assert np.ptp(energy) < 1e-9 * ENERGY_UNIT


def test_horizontal_momentum_and_the_centre_of_mass_in_free_fall():
    states = integrate(lambda _: np.zeros(3), np.zeros((2, 2)))
    np.testing.assert_allclose(states[6], P[0], atol=1e-8)
    fall = P[1] - WALKER.weight * np.linspace(0.0, 1.0, 21)
    np.testing.assert_allclose(states[7], fall, atol=1e-8)


def test_energy_grows_by_the_work_of_torques_and_ground_forces():
    force = np.array([[30.0, -10.0], [400.0, 250.0]])
    states = integrate(lambda time: np.array([8.0 * np.sin(9 * time), 3.0, -5.0 * time]), force)
    work = states[12]
    assert np.ptp(work) > 0.1 * ENERGY_UNIT
    np.testing.assert_allclose(energies(states) - energies(states)[0], work, atol=1e-8 * ENERGY_UNIT)


def differences(of, state):
    """Central differences of an energy along each of six coordinates."""
    steps = 1e-5 * np.eye(6)
    return np.array([(of(state + step) - of(state - step)) / 2e-5 for step in steps])


def energy_at(q, p):
    return float(evaluate("energy", WALKER, q[:, None], p[:, None], SPRING).squeeze())


def test_force_is_minus_the_derivative_of_the_hamiltonian_at_held_momenta():
    force = evaluate("force", WALKER, Q[:, None], P[:, None], SPRING)[0]
    np.testing.assert_allclose(-differences(lambda q: energy_at(q, P), Q), force, rtol=1e-7, atol=1e-5)


def test_velocity_is_the_derivative_of_the_hamiltonian_by_momenta():
    velocity = evaluate("velocity", WALKER, Q[:, None], P[:, None])[0]
    np.testing.assert_allclose(differences(lambda p: energy_at(Q, p), P), velocity, rtol=1e-7, atol=1e-5)


def test_foot_velocities_are_the_derivative_of_the_feet():
    qdot = evaluate("velocity", WALKER, Q[:, None], P[:, None])[0]
    steps = np.column_stack([Q - 1e-5 * qdot, Q + 1e-5 * qdot])
    behind, ahead = evaluate("feet", WALKER, steps, np.zeros((6, 2)))
    velocities = evaluate("foot_velocities", WALKER, Q[:, None], P[:, None])[0]
    np.testing.assert_allclose((ahead - behind) / 2e-5, velocities, atol=1e-8)


@pytest.mark.parametrize("count", [1, 2, 7])
def test_many_states_at_once_give_what_each_gives_alone(count):
    q, p = Q[:, None] + 0.1 * np.arange(count), np.tile(P[:, None], count)
    for name, shape in {"mass_matrix": (6, 6), "velocity": (6,), "feet": (2, 2), "energy": (1,)}.items():
        together = evaluate(name, WALKER, q, p, SPRING)
        assert together.shape == (count, *shape)
        for index in range(count):
            alone = evaluate(name, WALKER, q[:, [index]], p[:, [index]], SPRING)[0]
            np.testing.assert_array_equal(together[index], alone)
