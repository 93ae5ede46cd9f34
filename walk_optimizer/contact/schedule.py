"""Contact schedules: what each foot does at each grid point."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class FootMode(IntEnum):
    """The behaviours that the complementarity pairs of a foot allow (report section II-A)."""

    FREE = 0
    STICK = 1
    SLIP_FORWARD = 2
    SLIP_BACKWARD = 3

    @property
    def slips(self) -> bool:
        """Whether the foot slides under load."""
        return self in (FootMode.SLIP_FORWARD, FootMode.SLIP_BACKWARD)


Schedule = NDArray[np.int8]
FloatArray = NDArray[np.float64]

# A foot slower than this sticks, whatever relaxation leaves of its friction cone, in [m/s].
LEAST_SLIP_SPEED = 1e-4
# A foot with less load than this part of the weight grazes the ground and is free.
LEAST_LOAD = 1e-7


def single_impact(points: int) -> Schedule:
    """Return the schedule of plain walking, (2, points): foot 1 sticks, foot 2 swings."""
    schedule = np.full((2, points), FootMode.FREE, dtype=np.int8)
    schedule[0] = FootMode.STICK
    return schedule


def double_impact(points: int) -> Schedule:
    """Return plain walking in which the foot behind still stands while the one ahead lands.

    Both feet take an impulse at point 1: the one behind pushes off as the other strikes.
    """
    schedule = single_impact(points)
    schedule[1, 0] = FootMode.STICK
    return schedule


# The contact families that a search starts from, for any number of points.
CONTACT_FAMILIES = {"single-impact": single_impact, "double-impact": double_impact}


def observed_schedule(
    gap: FloatArray, normal_force: FloatArray, cone_slack: FloatArray, slip: FloatArray
) -> Schedule:
    """Return what each foot does at each point of a solution, (2, N).

    Of the two sides of a relaxed pair, the larger one in natural units is taken for the one that is
    not zero: a foot is loaded where its force outweighs its gap, it slips where its speed outweighs
    what is left of the friction cone.

    Args:
        gap: Height of both feet in leg lengths, (2, N).
        normal_force: lambda_y of both feet in units of weight, (2, N).
        cone_slack: mu lambda_y - lambda_x+ - lambda_x- in units of weight, (2, N).
        slip: Tangential velocity of both feet in [m/s], (2, N).
    """
    loaded = normal_force > np.maximum(gap, LEAST_LOAD)
    slipping = loaded & (np.abs(slip) > np.maximum(cone_slack, LEAST_SLIP_SPEED))
    schedule = np.where(loaded, FootMode.STICK, FootMode.FREE).astype(np.int8)
    schedule[slipping & (slip > 0)] = FootMode.SLIP_FORWARD
    schedule[slipping & (slip <= 0)] = FootMode.SLIP_BACKWARD
    return schedule
