"""The largest torques that steps may take: one number for all, or that of the hips and that of the knees."""

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import InvalidRequestError, quoted
from walk_optimizer.gait import RefinedGait
from walk_optimizer.gait.refined_peaks import torque_peaks

FloatArray = NDArray[np.float64]

TorqueLimit: TypeAlias = float | tuple[float, float]


def hip_and_knee(limit: TorqueLimit) -> tuple[float, float]:
    """Return the limit of the hips and that of the knees in [N m]; both may be infinite.

    Raises:
        InvalidRequestError: they are not one or two numbers, or one of them is not above 0.
    """
    both = limit if isinstance(limit, tuple) else (limit, limit)
    if len(both) != 2 or not all(isinstance(one, int | float | np.number) and one > 0 for one in both):
        raise InvalidRequestError(
            f"torque limit is {quoted(limit)} N m, allowed is a number above 0, or that of the hips and that "
            "of the knees"
        )
    return both


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
