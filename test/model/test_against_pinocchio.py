"""The walker's mechanics against an independent rigid-body library, to 1e-10 on random walkers and states."""

import casadi as ca
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from model.pinocchio_walker import PinocchioWalker
from model.states import COORDINATES, SPRINGS, VELOCITIES, WALKERS, patient, relative_error

from walk_optimizer.contact.feet import net_force
from walk_optimizer.model import dynamics
from walk_optimizer.model.functions import evaluate, mass_matrices
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker

TOLERANCE = 1e-10
FORCES = st.lists(st.floats(0.0, 2000.0), min_size=6, max_size=6).map(np.array)
TORQUES = st.lists(st.floats(-200.0, 200.0), min_size=3, max_size=3).map(np.array)


def momentum_rate():
    """(q, qdot, u, reaction, spring, walker) -> pdot of report eq. (4)."""
    walker = SymbolicWalker()
    q, qdot, u = ca.SX.sym("q", 6), ca.SX.sym("qdot", 6), ca.SX.sym("u", 3)
    reaction, spring = ca.SX.sym("reaction", 6), ca.SX.sym("spring", 2)
    rate = dynamics.momentum_rate(walker, q, qdot, u, net_force(walker, reaction), spring)
    return ca.Function("momentum_rate", [q, qdot, u, reaction, spring, walker.symbols], [rate])


def mass_matrix_rate():
    """(q, qdot, walker) -> dM/dt along qdot, from the symbolic model."""
    walker, q, qdot = SymbolicWalker(), ca.SX.sym("q", 6), ca.SX.sym("qdot", 6)
    rate = ca.jtimes(dynamics.mass_matrix(walker, q), q, qdot)
    return ca.Function("rate", [q, qdot, walker.symbols], [rate])


MOMENTUM_RATE = momentum_rate()
MASS_MATRIX_RATE = mass_matrix_rate()


def at(name, walker, q, p=None, spring=(0.0, 0.0)):
    """One quantity of the model at one state."""
    return evaluate(name, walker, q[:, None], (np.zeros(6) if p is None else p)[:, None], spring)[0]


@patient
@given(WALKERS, COORDINATES)
def test_mass_matrix(walker, q):
    expected = PinocchioWalker(walker).mass_matrix(q)
    assert relative_error(mass_matrices(walker, q[:, None])[0], expected) < TOLERANCE


@patient
@given(WALKERS, COORDINATES, VELOCITIES)
def test_velocities_are_those_of_the_momenta(walker, q, qdot):
    p = PinocchioWalker(walker).mass_matrix(q) @ qdot
    assert np.abs(at("velocity", walker, q, p) - qdot).max() < TOLERANCE * np.abs(qdot).max(initial=1.0)


def test_velocities_are_as_accurate_as_those_of_a_stable_solver():
    # Short heavy shanks: the mass matrix has a condition of 10^4.
    walker = WalkerParameters(lower_leg_length=0.125, lower_leg_mass=7.5)
    generator = np.random.default_rng(0)
    ours, stable = 0.0, 0.0
    for q, qdot in generator.uniform(-3.0, 3.0, (50, 2, 6)):
        matrix = PinocchioWalker(walker).mass_matrix(q)
        ours = max(ours, np.abs(at("velocity", walker, q, matrix @ qdot) - qdot).max())
        stable = max(stable, np.abs(np.linalg.solve(matrix, matrix @ qdot) - qdot).max())
    assert ours < 100 * stable


@patient
@given(WALKERS, COORDINATES)
def test_gravity_vector_is_the_force_at_rest(walker, q):
    assert relative_error(-at("force", walker, q), PinocchioWalker(walker).gravity(q)) < TOLERANCE


@patient
@given(WALKERS, COORDINATES, VELOCITIES, SPRINGS)
def test_force_holds_coriolis_gravity_and_spring_terms(walker, q, qdot, spring):
    other = PinocchioWalker(walker, KneeSpring(*spring))
    force = at("force", walker, q, other.mass_matrix(q) @ qdot, spring)
    assert relative_error(force, other.force(q, qdot)) < TOLERANCE


@patient
@given(WALKERS, COORDINATES, VELOCITIES)
def test_bias_is_the_rate_of_the_mass_matrix_less_the_force(walker, q, qdot):
    other = PinocchioWalker(walker)
    rate = np.asarray(MASS_MATRIX_RATE(q, qdot, walker.vector()))
    bias = rate @ qdot - at("force", walker, q, other.mass_matrix(q) @ qdot)
    assert relative_error(bias, other.bias(q, qdot)) < TOLERANCE


@patient
@given(WALKERS, COORDINATES, VELOCITIES)
def test_feet_and_their_velocities(walker, q, qdot):
    other = PinocchioWalker(walker)
    assert relative_error(at("feet", walker, q), other.feet(q)) < TOLERANCE
    velocities = at("foot_velocities", walker, q, other.mass_matrix(q) @ qdot)
    expected = (other.foot_jacobians(q) @ qdot).T
    assert np.abs(velocities - expected).max() < TOLERANCE * np.abs(expected).max(initial=1.0)


@patient
@given(WALKERS, COORDINATES, VELOCITIES, SPRINGS)
def test_total_energy(walker, q, qdot, spring):
    other = PinocchioWalker(walker, KneeSpring(*spring))
    energy = at("energy", walker, q, other.mass_matrix(q) @ qdot, spring)
    scale = max(abs(other.energy(q, qdot)), walker.weight * walker.leg_length)
    assert abs(energy[0] - other.energy(q, qdot)) < TOLERANCE * scale


@patient
@given(WALKERS, COORDINATES, VELOCITIES, TORQUES, FORCES)
def test_momentum_rate_with_torques_and_ground_reactions(walker, q, qdot, u, reaction):
    other = PinocchioWalker(walker)
    joint_torques = np.array([0.0, 0.0, u[0], u[1], -u[0], u[2]])
    feet = reaction.reshape(2, 3)
    net = np.column_stack([feet[:, 0] - feet[:, 1], feet[:, 2]])
    expected = other.force(q, qdot) + joint_torques
    expected += np.einsum("fai,fa->i", other.foot_jacobians(q), net)
    rate = np.array(MOMENTUM_RATE(q, qdot, u, reaction, [0.0, 0.0], walker.vector())).ravel()
    scale = max(np.abs(expected).max(), walker.weight)
    assert np.abs(rate - expected).max() < TOLERANCE * scale
