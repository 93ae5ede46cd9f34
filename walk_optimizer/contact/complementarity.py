"""The complementarity pairs of feet and ground, report eq. (5)."""

import casadi as ca

from walk_optimizer.model.dynamics import foot_jacobian
from walk_optimizer.model.kinematics import foot_position
from walk_optimizer.model.symbolic import SymbolicWalker

PAIRS_PER_FOOT = 4


def net_force(reaction: ca.SX) -> ca.SX:
    """Return the ground reaction (2, 2): rows x and y in [N], one column a foot.

    Args:
        reaction: lambda, (6,): x+, x-, y of foot 1, then of foot 2.
    """
    return ca.horzcat(
        *(ca.vertcat(reaction[3 * j] - reaction[3 * j + 1], reaction[3 * j + 2]) for j in range(2))
    )


def foot_pairs(
    walker: SymbolicWalker, q: ca.SX, qdot: ca.SX, reaction: ca.SX, slip_speed: ca.SX, leg: int
) -> tuple[ca.SX, ca.SX]:
    """Return both sides (4,) and (4,) of 0 <= a, 0 <= b, a b = 0, eqs. (5a) to (5d) of one foot.

    Args:
        walker: The walker.
        q: Coordinates, (6,).
        qdot: Velocities, (6,).
        reaction: lambda, (6,), in [N].
        slip_speed: gamma, (2,), in [m/s].
        leg: 0 or 1.
    """
    forward, backward, normal = (reaction[3 * leg + k] for k in range(3))
    gamma = slip_speed[leg]
    tangential_velocity = ca.mtimes(foot_jacobian(walker, q, leg)[0, :], qdot)
    a = ca.vertcat(
        foot_position(walker, q, leg)[1],
        walker.friction_coefficient * normal - forward - backward,
        gamma + tangential_velocity,
        gamma - tangential_velocity,
    )
    return a, ca.vertcat(normal, gamma, forward, backward)


def contact_pairs(
    walker: SymbolicWalker, q: ca.SX, qdot: ca.SX, reaction: ca.SX, slip_speed: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """Return both sides, (8,) each, of the pairs of foot 1, then of foot 2."""
    feet = [foot_pairs(walker, q, qdot, reaction, slip_speed, leg) for leg in range(2)]
    return ca.vertcat(feet[0][0], feet[1][0]), ca.vertcat(feet[0][1], feet[1][1])
