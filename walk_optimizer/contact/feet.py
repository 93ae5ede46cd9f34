"""The walker's feet as points of contact."""

import casadi as ca

from walk_optimizer.contact.complementarity import ContactPoint, pairs_of
from walk_optimizer.model import ground
from walk_optimizer.model.dynamics import foot_jacobian
from walk_optimizer.model.kinematics import foot_position
from walk_optimizer.model.symbolic import SymbolicWalker


def net_force(walker: SymbolicWalker, reaction: ca.SX) -> ca.SX:
    """Return the ground reaction (2, 2): rows x and y in [N], one column a foot.

    Args:
        walker: The walker.
        reaction: lambda, (6,): forward, backward and normal of foot 1, then of foot 2.
    """
    feet = (reaction[3 * leg : 3 * leg + 3] for leg in range(2))
    return ca.horzcat(*(ground.horizontal_and_vertical(walker, one[0] - one[1], one[2]) for one in feet))


def cone_sides(walker: SymbolicWalker, tangential: ca.SX, normal: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return how far a force is inside the friction cone of the ground, in [N].

    Args:
        walker: The walker.
        tangential: Its component along the surface in [N].
        normal: Its component normal to it in [N].

    Returns:
        mu times the normal force, less and plus the tangential force.
    """
    limit = walker.friction_coefficient * normal
    return limit - tangential, limit + tangential


def reaction_cones(walker: SymbolicWalker, reaction: ca.SX) -> ca.SX:
    """Return the `cone_sides` of the net force of foot 1, then of foot 2, (4,) in [N].

    Args:
        walker: The walker.
        reaction: lambda, (6,), in [N].
    """
    feet = (reaction[3 * leg : 3 * leg + 3] for leg in range(2))
    return ca.vertcat(*(side for one in feet for side in cone_sides(walker, one[0] - one[1], one[2])))


def foot_contact(
    walker: SymbolicWalker, q: ca.SX, qdot: ca.SX, reaction: ca.SX, slip_speed: ca.SX, leg: int
) -> ContactPoint:
    """Return the foot of leg `leg` + 1 as a point of contact; arguments as for `contact_pairs`."""
    velocity = ca.mtimes(foot_jacobian(walker, q, leg), qdot)
    forward, backward, normal = (reaction[3 * leg + k] for k in range(3))
    return ContactPoint(
        gap=ground.gap(walker, foot_position(walker, q, leg)),
        tangential_velocity=ground.along_and_normal(walker, velocity)[0],
        forward=forward,
        backward=backward,
        normal=normal,
        slip_speed=slip_speed[leg],
        friction=walker.friction_coefficient,
    )


def contact_pairs(
    walker: SymbolicWalker, q: ca.SX, qdot: ca.SX, reaction: ca.SX, slip_speed: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """Return both sides, (8,) each, of the pairs of foot 1, then of foot 2.

    Args:
        walker: The walker.
        q: Coordinates, (6,).
        qdot: Velocities, (6,).
        reaction: lambda, (6,), in [N].
        slip_speed: gamma, (2,), in [m/s].
    """
    return pairs_of([foot_contact(walker, q, qdot, reaction, slip_speed, leg) for leg in range(2)])
