"""Contact schedules: what each foot does at each grid point."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


# Below these a foot that complementarity leaves undecided counts as unloaded, or as sticking.
CONTACT_FORCE = 1e-5  # of the weight
SLIP_SPEED = 1e-3  # [m/s]


class FootMode(IntEnum):
    """The behaviours that the complementarity pairs of a foot allow (report section II-A)."""

    FREE = 0
    STICK = 1
    SLIP_FORWARD = 2
    SLIP_BACKWARD = 3


Schedule = NDArray[np.int8]


def single_support(points: int) -> Schedule:
    """Return the schedule of plain walking, (2, points): foot 1 sticks, foot 2 swings."""
    schedule = np.full((2, points), FootMode.FREE, dtype=np.int8)
    schedule[0] = FootMode.STICK
    return schedule


def observed_schedule(
    normal_force: NDArray[np.float64], slip_speed: NDArray[np.float64], slip: NDArray[np.float64], weight: float
) -> Schedule:
    """Return what each foot does at each point of a solution, (2, N).

    Args:
        normal_force: lambda_y of both feet in [N], (2, N).
        slip_speed: gamma of both feet in [m/s], (2, N).
        slip: Tangential velocity of both feet in [m/s], (2, N).
        weight: Weight of the walker in [N].
    """
    loaded = normal_force > CONTACT_FORCE * weight
    slipping = loaded & (slip_speed > SLIP_SPEED)
    schedule = np.where(loaded, FootMode.STICK, FootMode.FREE).astype(np.int8)
    schedule[slipping & (slip > 0)] = FootMode.SLIP_FORWARD
    schedule[slipping & (slip <= 0)] = FootMode.SLIP_BACKWARD
    return schedule
