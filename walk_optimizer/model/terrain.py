"""The ground that a walker walks on: level, inclined, or stairs.

NumPy is loaded where it is needed: the command line reads walkers before anything is computed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.resources import as_float, text_hint

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]

STEEPEST_SLOPE = math.pi / 4


@dataclass(frozen=True)
class Terrain:
    """The ground under a walker whose stance foot stands at the origin.

    The ground has the height tan(slope) x + step_up (s - sin(2 pi s) / (2 pi)) with s = x / tread. A
    tread is as long as the step. A foot that lands as the step ends stands in the middle of a tread, where
    the second term has neither slope nor curvature. Forces and slip are along and normal to the slope
    everywhere: on stairs the footing is as on terraces, level wherever a foot stands.

    Attributes:
        slope: Inclination of the surface in [rad]; uphill is positive.
        step_up: Each step lands higher by so much, beside the slope, in [m]; negative goes downstairs.
    """

    slope: float = 0.0
    step_up: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what no walker can stand on."""
        for field in fields(self):
            object.__setattr__(self, field.name, _finite(field.name, getattr(self, field.name)))
        if abs(self.slope) > STEEPEST_SLOPE:
            raise ConfigurationError(f"terrain slope is {self.slope} rad, allowed is -pi/4 to pi/4")

    @classmethod
    def from_entries(cls, entries: Any) -> Terrain:
        """Return the terrain of a mapping with `slope` and `step_up`, either of which may be left out.

        Raises:
            ConfigurationError: it is no mapping, or an entry is unknown or impossible.
        """
        known = [field.name for field in fields(cls)]
        if not isinstance(entries, dict):
            raise ConfigurationError(f"terrain is {entries!r}, expected entries {', '.join(known)}")
        unknown = sorted(str(name) for name in entries if name not in known)
        if unknown:
            raise ConfigurationError(
                f"unknown terrain entry {', '.join(unknown)}; known are {', '.join(known)}"
            )
        return cls(**entries)

    @property
    def is_flat(self) -> bool:
        """Whether the ground is level everywhere."""
        return self.slope == 0.0 and self.step_up == 0.0

    def height(self, x: FloatArray | float, tread: float) -> FloatArray:
        """Return the height of the ground in [m] at places x in [m], treads being `tread` in [m] long."""
        import numpy as np

        part = np.asarray(x) / tread
        stairs = self.step_up * (part - np.sin(2 * np.pi * part) / (2 * np.pi))
        height: FloatArray = math.tan(self.slope) * np.asarray(x) + stairs
        return height

    def gap(self, position: FloatArray, tread: float) -> FloatArray:
        """Return the distance of points (2, ...) from the ground in [m], across the slope."""
        gap: FloatArray = math.cos(self.slope) * (position[1] - self.height(position[0], tread))
        return gap

    def along_and_normal(self, vectors: FloatArray) -> FloatArray:
        """Return the components of vectors (2, ...) along the surface, uphill positive, and normal to it."""
        import numpy as np

        cosine, sine = math.cos(self.slope), math.sin(self.slope)
        return np.array([cosine * vectors[0] + sine * vectors[1], cosine * vectors[1] - sine * vectors[0]])

    def horizontal_and_vertical(self, components: FloatArray) -> FloatArray:
        """Return the vectors (2, ...) of components along the surface and normal to it."""
        return Terrain(-self.slope).along_and_normal(components)


def _finite(name: str, value: Any) -> float:
    """Return the value as a float.

    Raises:
        ConfigurationError: it is no finite number.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigurationError(f"terrain {name} is {value!r}, expected a number{text_hint(value)}")
    number = as_float(value)
    if not math.isfinite(number):
        raise ConfigurationError(f"terrain {name} is {number}, allowed are finite numbers")
    return number
