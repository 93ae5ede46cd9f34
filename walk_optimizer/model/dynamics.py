"""Hamiltonian dynamics of the walker as CasADi expressions (report eqs. 1 to 4)."""

import casadi as ca
import numpy as np

from walk_optimizer.model.kinematics import KNEE_1, KNEE_2, foot_position, mass_positions
from walk_optimizer.model.symbolic import SymbolicWalker

# u1 acts between the upper legs, u2 and u3 on the knees (report eq. 4).
INPUT_MAP = np.array([[0, 0, 1, 0, -1, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 0, 1]], dtype=float).T
INPUT_MAP.setflags(write=False)


def mass_matrix(walker: SymbolicWalker, q: ca.SX) -> ca.SX:
    """Return M(q) = J_S' M_0 J_S, (6, 6), from report eqs. (2) and (3)."""
    matrix = ca.SX.zeros(6, 6)
    for mass, position in mass_positions(walker, q):
        jacobian = ca.jacobian(position, q)
        matrix += mass * jacobian.T @ jacobian
    return ca.simplify(matrix)


def potential_energy(walker: SymbolicWalker, q: ca.SX, spring: ca.SX) -> ca.SX:
    """Return V(q) in [J]: gravity and both knee springs; `spring` is (K, q_eq)."""
    gravity = sum(mass * walker.gravity * position[1] for mass, position in mass_positions(walker, q))
    stiffness, equilibrium = spring[0], spring[1]
    return gravity + stiffness / 2 * ((q[KNEE_1] - equilibrium) ** 2 + (q[KNEE_2] - equilibrium) ** 2)


def kinetic_energy(walker: SymbolicWalker, q: ca.SX, velocity: ca.SX) -> ca.SX:
    """Return T_co(q, qdot) = 1/2 qdot' M(q) qdot in [J]."""
    return ca.bilin(mass_matrix(walker, q), velocity, velocity) / 2


def velocity(walker: SymbolicWalker, q: ca.SX, p: ca.SX) -> ca.SX:
    """Return qdot = dH/dp = M(q)^-1 p."""
    return ca.solve(mass_matrix(walker, q), p)


def generalized_force(walker: SymbolicWalker, q: ca.SX, qdot: ca.SX, spring: ca.SX) -> ca.SX:
    """Return -dH/dq at p = M(q) qdot, (6,).

    With p held, dT/dq of the Hamiltonian is minus that of the co-energy (report eq. 8), so
    -dH/dq = d/dq [T_co(q, qdot) - V(q)] with qdot held. This form needs no derivative of M^-1.
    """
    held = ca.SX.sym("qdot_held", 6)
    lagrangian = kinetic_energy(walker, q, held) - potential_energy(walker, q, spring)
    return ca.substitute(ca.gradient(lagrangian, q), held, qdot)


def foot_jacobian(walker: SymbolicWalker, q: ca.SX, leg: int) -> ca.SX:
    """Return dg_j/dq, (2, 6): rows x and y."""
    return ca.jacobian(foot_position(walker, q, leg), q)


def momentum_rate(
    walker: SymbolicWalker, q: ca.SX, qdot: ca.SX, u: ca.SX, force: ca.SX, spring: ca.SX
) -> ca.SX:
    """Return pdot of report eq. (4), (6,).

    Args:
        walker: The walker.
        q: Coordinates, (6,).
        qdot: Velocities M(q)^-1 p, (6,).
        u: Torques in [N m], (3,).
        force: Ground reaction in [N], (2, 2): rows x and y, one column a foot.
        spring: (K, q_eq) in [N m/rad] and [rad].
    """
    rate = generalized_force(walker, q, qdot, spring) + ca.mtimes(ca.DM(INPUT_MAP), u)
    for leg in range(2):
        rate += foot_jacobian(walker, q, leg).T @ force[:, leg]
    return rate
