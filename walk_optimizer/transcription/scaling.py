"""Natural units of the walker: every variable and row of the program is of order one in them."""

from typing import Protocol

import casadi as ca

# Passive walking needs torques of about a percent of weight times leg length.
TORQUE_FRACTION = 0.01
# Stiffest springs of interest, in units of weight times leg length per radian.
STIFFNESS_FRACTION = 0.1


class Sized(Protocol):
    """What the units are made from; a walker of numbers and one of symbols both offer it."""

    @property
    def leg_length(self) -> ca.SX:
        """Length of a stretched leg in [m]."""

    @property
    def total_mass(self) -> ca.SX:
        """Mass in [kg]."""

    @property
    def weight(self) -> ca.SX:
        """Weight in [N]."""


def point_units(walker: Sized) -> list[ca.SX]:
    """Return the unit of each row of a grid point's column, 23 values."""
    momentum = walker.total_mass
    lengths = [walker.leg_length] * 2 + [1.0] * 4
    momenta = [momentum] * 2 + [momentum * walker.leg_length / 10] * 4
    return lengths + momenta + [torque_unit(walker)] * 3 + [walker.weight] * 6 + [1.0] * 2


def torque_unit(walker: Sized) -> ca.SX:
    """Return the unit of torques in [N m]."""
    return TORQUE_FRACTION * walker.weight * walker.leg_length


def spring_units(walker: Sized) -> list[ca.SX]:
    """Return the units of K and q_eq."""
    return [STIFFNESS_FRACTION * walker.weight * walker.leg_length, 1.0]


def row_units(walker: Sized) -> list[ca.SX]:
    """Return the unit of each row of a grid point's constraints, 32 values, in the order of the layout."""
    foot = [walker.leg_length, walker.weight, 1.0, 1.0]
    products = [walker.leg_length * walker.weight] + [walker.weight] * 3
    return point_units(walker)[:12] + foot * 2 + products * 2 + [walker.weight] * 4
