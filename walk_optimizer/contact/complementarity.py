"""The complementarity pairs of any point that may touch a surface with friction, report eq. (5)."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

PAIRS_PER_POINT = 4


@dataclass(frozen=True)
class ContactPoint:
    """A point that may touch a surface, as expressions of a model's variables.

    Attributes:
        gap: Its distance from the surface in [m].
        tangential_velocity: Its velocity along the surface, relative to it, in [m/s].
        forward: Friction force on it along the positive tangent in [N], at least 0.
        backward: Friction force on it along the negative tangent in [N], at least 0.
        normal: Force on it away from the surface in [N], at least 0.
        slip_speed: The slack gamma of its slip speed in [m/s], at least 0.
        friction: Coulomb coefficient mu [-].
    """

    gap: ca.SX
    tangential_velocity: ca.SX
    forward: ca.SX
    backward: ca.SX
    normal: ca.SX
    slip_speed: ca.SX
    friction: ca.SX

    def pairs(self) -> tuple[ca.SX, ca.SX]:
        """Return both sides (4,) and (4,) of 0 <= a, 0 <= b, a b = 0, eqs. (5a) to (5d)."""
        a = ca.vertcat(
            self.gap,
            self.friction * self.normal - self.forward - self.backward,
            self.slip_speed + self.tangential_velocity,
            self.slip_speed - self.tangential_velocity,
        )
        return a, ca.vertcat(self.normal, self.slip_speed, self.forward, self.backward)

    def generalized_force(self, q: ca.SX, qdot: ca.SX) -> ca.SX:
        """Return the contact force on the coordinates q, by the power that it does.

        The normal force works at the rate of the gap, which must be a true distance, and friction at
        the tangential velocity: Q = (d gap / dq)' f_n + (d v_t / d qdot)' f_t.
        """
        friction = ca.jacobian(self.tangential_velocity, qdot).T * (self.forward - self.backward)
        return ca.jacobian(self.gap, q).T * self.normal + friction


def pairs_of(points: Sequence[ContactPoint]) -> tuple[ca.SX, ca.SX]:
    """Return both sides of the pairs of all points, (4,) of each, one point after the other."""
    a, b = zip(*(point.pairs() for point in points), strict=True)
    return ca.vertcat(*a), ca.vertcat(*b)
