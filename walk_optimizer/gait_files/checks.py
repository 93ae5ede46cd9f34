"""Checks of numbers that nobody vouches for; their messages name the number."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import GaitFileError


def check_finite(name: str, values: NDArray[Any]) -> None:
    """Raise GaitFileError unless all values are finite double precision numbers."""
    if values.dtype != np.float64:
        raise GaitFileError(f"array {name} holds {values.dtype}, expected float64")
    if not np.isfinite(values).all():
        count = int(np.sum(~np.isfinite(values)))
        raise GaitFileError(f"array {name} has {count} values that are not finite")


def check_shape(name: str, values: NDArray[Any], shape: tuple[int, ...]) -> None:
    """Raise GaitFileError unless an array has its shape."""
    if values.shape != shape:
        raise GaitFileError(f"array {name} has the shape {values.shape}, expected {shape}")


def positive(value: Any, where: str) -> float:
    """Return a finite number above 0."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < np.inf:
        raise GaitFileError(f"{where} is {value!r}, expected a finite number above 0")
    return float(value)
