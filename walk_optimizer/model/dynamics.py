"""Hamiltonian dynamics of the walker as CasADi expressions (report eqs. 1 to 4)."""

import casadi as ca
import numpy as np

from walk_optimizer.model.kinematics import KNEE_1, KNEE_2, LEGS, foot_position, mass_positions
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
    """Return T_co(q, qdot) in [J], the sum over the masses of 1/2 m |J_S qdot|^2 (report eq. 2)."""
    return sum(
        mass / 2 * ca.sumsqr(ca.jtimes(position, q, velocity)) for mass, position in mass_positions(walker, q)
    )


def velocity(walker: SymbolicWalker, q: ca.SX, p: ca.SX) -> ca.SX:
    """Return qdot = dH/dp = M(q)^-1 p.

    The legs couple only through the hip, M = [A B_1 B_2; B_1' C_1 0; B_2' 0 C_2] in blocks of two, so
    the legs are eliminated first: the code and its derivatives are a fraction of a dense solve's.
    """
    matrix = mass_matrix(walker, q)
    hip = slice(0, 2)
    legs = [slice(leg[0], leg[1] + 1) for leg in LEGS]
    # B_j C_j^-1 of each leg.
    coupled = [ca.mtimes(matrix[hip, leg], _inverse_2x2(matrix[leg, leg])) for leg in legs]
    reduced, load = matrix[hip, hip], p[hip]
    for leg, one in zip(legs, coupled, strict=True):
        reduced -= ca.mtimes(one, matrix[hip, leg].T)
        load -= ca.mtimes(one, p[leg])
    hip_velocity = ca.mtimes(_inverse_2x2(reduced), load)
    loads = [p[leg] - ca.mtimes(matrix[hip, leg].T, hip_velocity) for leg in legs]
    velocities = [
        ca.mtimes(_inverse_2x2(matrix[leg, leg]), one) for leg, one in zip(legs, loads, strict=True)
    ]
    return ca.vertcat(hip_velocity, *velocities)


def _inverse_2x2(matrix: ca.SX) -> ca.SX:
    """Return the inverse of a symmetric 2 by 2 matrix."""
    a, b, d = matrix[0, 0], matrix[0, 1], matrix[1, 1]
    determinant = a * d - b * b
    return ca.blockcat([[d, -b], [-b, a]]) / determinant


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
