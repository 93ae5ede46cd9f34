"""Parameters as symbols, so that one compiled function serves every walker."""

from collections.abc import Sequence

import casadi as ca

from walk_optimizer.model.parameters import DYNAMIC_PARAMETERS, GROUND_PARAMETERS


class SymbolicParameters:
    """Parameters as CasADi symbols, under the names they have as numbers.

    Attributes:
        symbols: All of them in one column, in the order of their names.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Create the symbols."""
        for name in names:
            setattr(self, name, ca.SX.sym(name))
        self.symbols: ca.SX = ca.vertcat(*(getattr(self, name) for name in names))


class SymbolicWalker(SymbolicParameters):
    """The parameters of a walker and of its ground, in the order of `WalkerParameters.vector`."""

    hip_mass: ca.SX
    upper_leg_mass: ca.SX
    lower_leg_mass: ca.SX
    upper_leg_length: ca.SX
    lower_leg_length: ca.SX
    gravity: ca.SX
    friction_coefficient: ca.SX
    slope: ca.SX
    step_up: ca.SX
    tread: ca.SX

    def __init__(self) -> None:
        """Create the symbols."""
        super().__init__(DYNAMIC_PARAMETERS + GROUND_PARAMETERS)

    @property
    def leg_length(self) -> ca.SX:
        """Length of a stretched leg in [m]."""
        return self.upper_leg_length + self.lower_leg_length

    @property
    def total_mass(self) -> ca.SX:
        """Mass of the whole walker in [kg]."""
        return self.hip_mass + 2 * (self.upper_leg_mass + self.lower_leg_mass)

    @property
    def weight(self) -> ca.SX:
        """Weight of the whole walker in [N]."""
        return self.total_mass * self.gravity
