"""The most that a refined step needs, between its nodes too: the extremes of its polynomials.

A solve bounds torques at its nodes only. In the packaged transitions those of a joint are up to 18 % higher
between them, above all where an interval begins, and so briefly that 400 even samples of a step miss 19 %.
"""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.kinematics import KNEE_1, KNEE_2, UPPER_1, UPPER_2

FloatArray = NDArray[np.float64]

_JOINTS = (UPPER_1, KNEE_1, UPPER_2, KNEE_2)


def torque_peaks(trajectory: RefinedTrajectory) -> FloatArray:
    """Return the largest magnitudes of u over a step in [N m], (3,)."""
    return _peaks(trajectory.motion_polynomials[:, :3, 12:])


def speed_peaks(trajectory: RefinedTrajectory) -> FloatArray:
    """Return the largest speeds of upper leg and knee of leg 1, then of leg 2, in [rad/s], (4,)."""
    return _peaks(trajectory.motion_polynomials[:, :3, 6:12][:, :, _JOINTS])


def _peaks(quadratics: FloatArray) -> FloatArray:
    """Return the largest magnitudes on [0, 1] of c0 + c1 s + c2 s^2, of coefficients (n, 3, m) for each m.

    A quadratic is extreme at an end or where its derivative c1 + 2 c2 s is zero.
    """
    c0, c1, c2 = np.moveaxis(quadratics, 1, 0)
    turning = np.divide(-c1, 2 * c2, out=np.zeros_like(c1), where=c2 != 0).clip(0.0, 1.0)
    places = np.stack([np.zeros_like(c1), turning, np.ones_like(c1)])
    peaks: FloatArray = np.abs(c0 + (c1 + c2 * places) * places).max(axis=(0, 1))
    return peaks
