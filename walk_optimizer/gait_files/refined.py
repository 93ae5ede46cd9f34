"""The refined part of a gait: its arrays by name, with their shapes, and what describes them.

Also the border where such arrays come in from elsewhere, be it a file or a message.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import Certificate, RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.gait_files.checks import check_finite, check_shape, positive
from walk_optimizer.gait_files.header import from_plain, to_plain
from walk_optimizer.model.parameters import KneeSpring

REFINED_PREFIX = "refined_"
# Shape of each array on n intervals, behind the n; beside them are the n + 1 breaks.
ROW_SHAPES: Mapping[str, tuple[int, ...]] = {
    "states": (4, 12),
    "torques": (3, 3),
    "forces": (3, 4),
    "impulses": (4,),
}
_NAMES = ("breaks", *ROW_SHAPES)
# Between the last break and the step time, in [s].
_TIME_TOLERANCE = 1e-9


@dataclass(frozen=True)
class _Description:
    """What the header says about a refined part."""

    spring: KneeSpring
    step_length: float
    certificate: Certificate


def refined_arrays(refined: RefinedGait | None) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a refined gait by their names in a file; none without one."""
    if refined is None:
        return {}
    return {REFINED_PREFIX + name: getattr(refined.trajectory, name) for name in _NAMES}


def refined_header(refined: RefinedGait | None) -> Any:
    """Return what describes the arrays as plain JSON values; None without a refined gait."""
    if refined is None:
        return None
    return to_plain(_Description(refined.spring, refined.step_length, refined.certificate))


def refined_from(plain: Any, arrays: Mapping[str, NDArray[Any]], step_time: float) -> RefinedGait | None:
    """Return the refined part of a file.

    Args:
        plain: The header's entry; None or empty means that there is no refined part.
        arrays: All arrays of the file.
        step_time: Of the gait in [s].

    Raises:
        GaitFileError: the arrays or their description are not those of a refined gait.
    """
    names = set() if plain in (None, {}) else {REFINED_PREFIX + name for name in _NAMES}
    found = {name: values for name, values in arrays.items() if name.startswith(REFINED_PREFIX)}
    wrong = sorted(set(found) ^ names)
    if wrong:
        raise GaitFileError(f"missing or unknown arrays: {', '.join(wrong)}")
    if not names:
        return None
    described = from_plain(_Description, plain, "refined")
    return RefinedGait(
        trajectory=refined_trajectory(found, step_time),
        spring=described.spring,
        step_length=positive(described.step_length, "refined.step_length"),
        certificate=described.certificate,
    )


def refined_trajectory(arrays: Mapping[str, NDArray[Any]], step_time: float) -> RefinedTrajectory:
    """Return the trajectory of arrays that nobody vouches for.

    Args:
        arrays: By their names in a file.
        step_time: Of the gait in [s].

    Raises:
        GaitFileError: an array is not of its shape or not finite, or the breaks don't lead from 0 to
            the step time.
    """
    intervals = max(arrays[f"{REFINED_PREFIX}breaks"].size - 1, 1)
    shapes = {name: (intervals, *rest) for name, rest in ROW_SHAPES.items()}
    for name, shape in {"breaks": (intervals + 1,), **shapes}.items():
        check_shape(REFINED_PREFIX + name, arrays[REFINED_PREFIX + name], shape)
        check_finite(REFINED_PREFIX + name, arrays[REFINED_PREFIX + name])
    _check_breaks(arrays[f"{REFINED_PREFIX}breaks"], step_time)
    return RefinedTrajectory(**{name: arrays[REFINED_PREFIX + name] for name in _NAMES})


def _check_breaks(breaks: NDArray[np.float64], step_time: float) -> None:
    """Raise GaitFileError unless the ends of the intervals increase from 0 to the step time in [s]."""
    if np.any(np.diff(breaks) <= 0):
        raise GaitFileError("array refined_breaks does not increase")
    if breaks[0] != 0 or not abs(breaks[-1] - step_time) <= _TIME_TOLERANCE:
        raise GaitFileError(
            f"array refined_breaks leads from {breaks[0]:g} s to {breaks[-1]:.9g} s, "
            f"expected 0 to {step_time:.9g} s"
        )
