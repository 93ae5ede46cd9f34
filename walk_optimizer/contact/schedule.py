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


Schedule = NDArray[np.int8]


def single_support(points: int) -> Schedule:
    """Return the schedule of plain walking, (2, points): foot 1 sticks, foot 2 swings."""
    schedule = np.full((2, points), FootMode.FREE, dtype=np.int8)
    schedule[0] = FootMode.STICK
    return schedule
