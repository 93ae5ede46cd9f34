"""The ground under each step of a simulated walk."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.terrain import Terrain

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class StepGround:
    """The ground around a stance foot, seen from there.

    Attributes:
        terrain: What the walker's gait was made for.
        tread: Length of the gait's step in [m].
        drop_ahead: The ground ahead lies lower by so much, in [m].
        drop_behind: The ground behind lies lower by so much, in [m].
    """

    terrain: Terrain
    tread: float
    drop_ahead: float = 0.0
    drop_behind: float = 0.0

    def gap(self, foot: FloatArray) -> float:
        """Return the distance of a foot (2,) in [m] from the ground, across its slope."""
        drop = self.drop_ahead if foot[0] > 0 else self.drop_behind
        return float(self.terrain.gap(foot + np.array([0.0, drop]), self.tread))
