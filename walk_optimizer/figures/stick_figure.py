"""Points of the legs for pictures: hip, knee and foot of both legs."""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import WalkerParameters

FloatArray = NDArray[np.float64]

_FIRST_ANGLE = (2, 4)


def leg_points(walker: WalkerParameters, q: FloatArray, leg: int) -> FloatArray:
    """Return hip, knee and foot of a leg.

    Args:
        walker: The walker.
        q: Coordinates in [m] and [rad], (6, N).
        leg: 0 or 1.

    Returns:
        Positions (x, y) in [m], (3, 2, N).
    """
    upper = q[_FIRST_ANGLE[leg]]
    lower = upper + q[_FIRST_ANGLE[leg] + 1] - np.pi
    hip = q[:2]
    knee = hip + walker.upper_leg_length * np.array([np.sin(upper), -np.cos(upper)])
    foot = knee + walker.lower_leg_length * np.array([np.sin(lower), -np.cos(lower)])
    return np.stack([hip, knee, foot])
