"""The ground of a walk, whose first standing foot stands at the origin."""

import math

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.scene.gait import ShownGait

FloatArray = NDArray[np.float64]

# The ground is shown so far before and behind the walker, [m].
_REACH = 2.0
# Points for each metre where the ground is not straight.
_DENSITY = 40


def ground_height(walker: WalkerParameters, gait: ShownGait | None, x: FloatArray | float) -> FloatArray:
    """Return the height of the ground in [m] at places along the way in [m]; treads are as long as steps."""
    tread = gait.profile.step_length if gait is not None else walker.leg_length
    return walker.terrain.height(x, tread)


def ground_around(walker: WalkerParameters, gait: ShownGait | None, middle: float) -> FloatArray:
    """Return points of the ground around a place along the way: x, y in [m], (2, G)."""
    count = math.ceil(2 * _REACH * _DENSITY) if walker.terrain.step_up else 2
    x = np.linspace(middle - _REACH, middle + _REACH, count)
    return np.array([x, ground_height(walker, gait, x)])
