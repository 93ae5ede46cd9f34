"""A planar finger beside a disc that lies on a table: the model, seen from the side.

Two links hang from a base above the table, driven at both joints, with point masses at the elbow and
at the tip. The disc rolls and slides on the table. Tip and disc, disc and table may touch; the links
pass beside the disc.
"""

from dataclasses import astuple, dataclass, fields

import casadi as ca

from walk_optimizer.contact.complementarity import ContactPoint
from walk_optimizer.model.symbolic import SymbolicParameters

# Coordinates: both joint angles from the downward vertical and from the upper link, then the disc's
# place and angle, anticlockwise positive. Contacts: the tip on the disc, the disc on the table.
COORDINATES, TORQUES, CONTACTS = 5, 2, 2
SHOULDER, ELBOW, DISC_X, DISC_Y, DISC_ANGLE = range(COORDINATES)


@dataclass(frozen=True)
class Finger:
    """Numbers of finger and disc.

    Attributes:
        base_x: Place of the base in [m], the disc lying at 0 at first.
        base_y: Height of the base above the table in [m].
        link: Length of each link in [m].
        elbow_mass: In [kg].
        tip_mass: In [kg].
        disc_mass: In [kg], spread evenly.
        disc_radius: In [m].
        friction: Coulomb coefficient of both contacts [-].
        gravity: In [m/s^2].
    """

    base_x: float = -0.12
    base_y: float = 0.34
    link: float = 0.16
    elbow_mass: float = 0.05
    tip_mass: float = 0.03
    disc_mass: float = 0.2
    disc_radius: float = 0.05
    friction: float = 0.6
    gravity: float = 9.81

    def vector(self) -> list[float]:
        """Return all numbers, in the order of `SymbolicFinger.symbols`."""
        return list(astuple(self))


class SymbolicFinger(SymbolicParameters):
    """The numbers of a finger as CasADi symbols, in the order of `Finger.vector`."""

    base_x: ca.SX
    base_y: ca.SX
    link: ca.SX
    elbow_mass: ca.SX
    tip_mass: ca.SX
    disc_mass: ca.SX
    disc_radius: ca.SX
    friction: ca.SX
    gravity: ca.SX

    def __init__(self) -> None:
        """Create the symbols."""
        super().__init__([field.name for field in fields(Finger)])

    def elbow(self, q: ca.SX) -> ca.SX:
        """Return the place of the elbow in [m], (2,)."""
        angle = q[SHOULDER]
        return ca.vertcat(self.base_x, self.base_y) + self.link * ca.vertcat(ca.sin(angle), -ca.cos(angle))

    def tip(self, q: ca.SX) -> ca.SX:
        """Return the place of the tip in [m], (2,)."""
        angle = q[SHOULDER] + q[ELBOW]
        return self.elbow(q) + self.link * ca.vertcat(ca.sin(angle), -ca.cos(angle))

    def co_energy(self, q: ca.SX, qdot: ca.SX) -> ca.SX:
        """Return the kinetic co-energy in [J]."""
        masses = ((self.elbow_mass, self.elbow(q)), (self.tip_mass, self.tip(q)))
        disc = ca.sumsqr(qdot[[DISC_X, DISC_Y]]) + self.disc_radius**2 / 2 * qdot[DISC_ANGLE] ** 2
        moving = sum(mass * ca.sumsqr(ca.jtimes(place, q, qdot)) for mass, place in masses)
        return (moving + self.disc_mass * disc) / 2

    def potential(self, q: ca.SX) -> ca.SX:
        """Return the potential energy in [J]."""
        weighted = self.elbow_mass * self.elbow(q)[1] + self.tip_mass * self.tip(q)[1]
        return self.gravity * (weighted + self.disc_mass * q[DISC_Y])

    def contacts(self, q: ca.SX, qdot: ca.SX, forces: ca.SX, slip: ca.SX) -> list[ContactPoint]:
        """Return the tip on the disc and the disc on the table.

        Args:
            q: Coordinates, (5,).
            qdot: Velocities, (5,).
            forces: Forward, backward and normal of each contact in [N], (6,).
            slip: gamma of each in [m/s], (2,).
        """
        from_disc = self.tip(q) - q[[DISC_X, DISC_Y]]
        distance = ca.norm_2(from_disc)
        tangent = ca.vertcat(-from_disc[1], from_disc[0]) / distance
        passing = ca.dot(tangent, ca.jtimes(self.tip(q), q, qdot) - qdot[[DISC_X, DISC_Y]])
        around = self.disc_radius * qdot[DISC_ANGLE]
        gaps = (distance - self.disc_radius, q[DISC_Y] - self.disc_radius)
        speeds = (passing - around, qdot[DISC_X] + around)
        return [
            ContactPoint(
                gap=gaps[k],
                tangential_velocity=speeds[k],
                forward=forces[3 * k],
                backward=forces[3 * k + 1],
                normal=forces[3 * k + 2],
                slip_speed=slip[k],
                friction=self.friction,
            )
            for k in range(CONTACTS)
        ]
