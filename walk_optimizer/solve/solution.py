"""What a back end returns, and how it is watched."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.solve.status import Status

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Solution:
    """Where a back end ended.

    Attributes:
        status: How it ended.
        x: Last iterate.
        objective: f at x.
        infeasibility: Largest violation of any bound, scaled.
        iterations: Number of iterations.
        detail: The back end's own words.
    """

    status: Status
    x: FloatArray
    objective: float
    infeasibility: float
    iterations: int
    detail: str

    @property
    def solved(self) -> bool:
        """Whether the program was solved to its tolerance."""
        return self.status is Status.SOLVED


@dataclass(frozen=True)
class IterationState:
    """What a back end tells at each iteration."""

    iteration: int
    objective: float
    infeasibility: float


class Monitor(Protocol):
    """Told at each iteration; answers whether, and why, to stop."""

    def __call__(self, state: IterationState) -> Status | None:
        """Return None to go on, else the status to end with."""
