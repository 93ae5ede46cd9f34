"""The largest torques that steps may take: one number for all, or that of the hips and that of the knees."""

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import RefinedGait
from walk_optimizer.refined_peaks import torque_peaks

FloatArray = NDArray[np.float64]

TorqueLimit: TypeAlias = float | tuple[float, float]


def hip_and_knee(limit: TorqueLimit) -> tuple[float, float]:
    """Return the limit of the hips and that of the knees in [N m]; both may be infinite.

    Raises:
        InvalidRequestError: one of them is not above 0.
    """
    hip, knee = limit if isinstance(limit, tuple) else (limit, limit)
    if not (hip > 0 and knee > 0):
        raise InvalidRequestError(f"torque limit is {limit} N m, allowed is above 0")
    return hip, knee


def each_torque(limit: TorqueLimit) -> FloatArray:
    """Return the limits of u1, which acts at the hips, and of u2 and u3 at the knees, in [N m], (3,)."""
    hip, knee = hip_and_knee(limit)
    return np.array([hip, knee, knee])


def exceeds(steps: Iterable[RefinedGait], limit: TorqueLimit) -> bool:
    """Return whether steps take more torque than is allowed, between their nodes too."""
    allowed = each_torque(limit)
    return any((torque_peaks(step.trajectory) > allowed).any() for step in steps)


def limit_in_words(limit: TorqueLimit) -> str:
    """Return a limit as the end of a sentence; empty for none."""
    hip, knee = hip_and_knee(limit)
    if hip == knee:
        return f" within {hip:g} N m" if np.isfinite(hip) else ""
    return f" within {hip:g} N m at the hips and {knee:g} N m at the knees"
