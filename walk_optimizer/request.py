"""What a user asks for: a speed, a spring mode, a grid. Validated here, before any work."""

import math
import operator
import re
from dataclasses import dataclass
from functools import cache
from numbers import Real
from typing import Any

from walk_optimizer.errors import ConfigurationError, InvalidRequestError, quoted
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.resources import as_float, config_file, require_positive, settings_from_yaml

KMH_PER_MS = 3.6
# The report prints km/h with two decimals: a speed within one unit of the last one names a table gait.
TABLE_SPEED_TOLERANCE = 0.01 / KMH_PER_MS
# Relative; far more than speeds are rounded by, and nothing that could be measured.
_ROUNDING = 1e-12
_BYTES_PER_POINT = 40_000
# The impact of the landing takes the first two points of a step.
_FEWEST_POINTS = 3


@dataclass(frozen=True)
class GaitTableSettings:
    """The gaits of the table and the range of requests (config/gait_table.yaml).

    Attributes:
        slowest_step_length: In [m].
        slowest_step_time: In [s].
        fastest_step_length: In [m].
        fastest_step_time: In [s].
        gaits: Number of speeds in the table.
        minimum_speed: Slowest speed that may be asked for in [m/s].
        maximum_speed: Fastest speed that may be asked for in [m/s].
        points: Default number N of grid points of a step.
        minimum_points: Fewest grid points.
        maximum_points: Most grid points.
    """

    slowest_step_length: float
    slowest_step_time: float
    fastest_step_length: float
    fastest_step_time: float
    gaits: int
    minimum_speed: float
    maximum_speed: float
    points: int
    minimum_points: int
    maximum_points: int

    def __post_init__(self) -> None:
        """Refuse numbers that are impossible by themselves or beside each other.

        Raises:
            ConfigurationError: says which number, and what it may be.
        """
        require_positive(self)
        for name, low, high in (
            ("gaits", 2, math.inf),
            ("minimum_speed", 0.0, self.maximum_speed),
            ("minimum_points", _FEWEST_POINTS, self.maximum_points),
            ("points", self.minimum_points, self.maximum_points),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ConfigurationError(f"{name} is {value}, allowed is {low} to {high}")

    def table_steps(self) -> list[tuple[float, float]]:
        """Return (step length in [m], step time in [s]) of each gait of the table, slowest first."""
        return [self._step(index / (self.gaits - 1)) for index in range(self.gaits)]

    def table_speeds(self) -> list[float]:
        """Return the speeds of the table in [m/s], slowest first."""
        return [length / time for length, time in self.table_steps()]

    def step_for_speed(self, speed: float) -> tuple[float, float]:
        """Return step length in [m] and step time in [s] of a speed, on the line of the table."""
        length_span = self.fastest_step_length - self.slowest_step_length
        time_span = self.fastest_step_time - self.slowest_step_time
        # slowest_length + s length_span = speed (slowest_time + s time_span), solved for s.
        place = (speed * self.slowest_step_time - self.slowest_step_length) / (
            length_span - speed * time_span
        )
        return self._step(place)

    def _step(self, place: float) -> tuple[float, float]:
        length = self.slowest_step_length + place * (self.fastest_step_length - self.slowest_step_length)
        time = self.slowest_step_time + place * (self.fastest_step_time - self.slowest_step_time)
        return length, time


@cache
def gait_table_settings() -> GaitTableSettings:
    """Return the packaged gait table settings, read once."""
    return settings_from_yaml(GaitTableSettings, config_file("gait_table.yaml"))


@dataclass(frozen=True)
class GaitRequest:
    """A gait that is asked for; build it with `for_speed` or `for_step`, which validate.

    Attributes:
        step_length: Shortest step that counts, in [m].
        step_time: Duration of a step in [s].
        spring_mode: What may be chosen about the knee springs.
        points: Number N of grid points of a step.
    """

    step_length: float
    step_time: float
    spring_mode: SpringMode
    points: int

    @property
    def speed(self) -> float:
        """Requested speed in [m/s]."""
        return self.step_length / self.step_time

    @property
    def interval(self) -> float:
        """Time step h in [s]."""
        return self.step_time / self.points

    @classmethod
    def for_speed(
        cls, speed: float, spring_mode: SpringMode | str = SpringMode.NONE, points: int | None = None
    ) -> "GaitRequest":
        """Return the request for a speed, with step length and time on the line of the table.

        Args:
            speed: In [m/s].
            spring_mode: A mode or its name.
            points: N; None means the default of the settings.

        Raises:
            InvalidRequestError: the speed, mode or number of points is impossible; the message says
                what was got and what is allowed.
        """
        settings = gait_table_settings()
        step_length, step_time = settings.step_for_speed(_checked_speed(speed, settings))
        return cls(step_length, step_time, SpringMode.parse(spring_mode), _checked_points(points, settings))

    @classmethod
    def for_step(
        cls,
        step_length: float,
        step_time: float,
        spring_mode: SpringMode | str = SpringMode.NONE,
        points: int | None = None,
    ) -> "GaitRequest":
        """Return the request for a step of given length in [m] and duration in [s].

        Raises:
            InvalidRequestError: as for `for_speed`.
        """
        settings = gait_table_settings()
        for name, value in (("step length", step_length), ("step time", step_time)):
            if not (_is_number(value) and 0 < as_float(value) < math.inf):
                raise InvalidRequestError(f"{name} is {quoted(value)}, allowed are finite numbers above 0")
        _checked_speed(step_length / step_time, settings)
        return cls(step_length, step_time, SpringMode.parse(spring_mode), _checked_points(points, settings))


def _is_number(value: Any) -> bool:
    """Return whether a value is a real number, of Python or NumPy; True and False are not."""
    return isinstance(value, Real) and not isinstance(value, bool)


def speed_number(speed: Any) -> float:
    """Return a speed in [m/s] as a float, whatever its value.

    Raises:
        InvalidRequestError: it is no number.
    """
    if not _is_number(speed):
        raise InvalidRequestError(f"speed is {quoted(speed)}, expected a number, in m/s")
    return as_float(speed)


def _checked_speed(given: float, settings: GaitTableSettings) -> float:
    """Return the speed; raise InvalidRequestError outside the settings' range."""
    speed, low, high = speed_number(given), settings.minimum_speed, settings.maximum_speed
    # A speed at an end is rounded when it has become a step, and is asked for again.
    if not low * (1 - _ROUNDING) <= speed <= high * (1 + _ROUNDING):
        raise InvalidRequestError(
            f"speed is {speed:.8g} m/s, allowed is {low:g} to {high:g} m/s "
            f"({low * KMH_PER_MS:.2f} to {high * KMH_PER_MS:.2f} km/h)"
        )
    return speed


def _checked_points(points: int | None, settings: GaitTableSettings) -> int:
    """Return the number of grid points; raise InvalidRequestError outside the settings' range."""
    if points is None:
        return settings.points
    low, high = settings.minimum_points, settings.maximum_points
    try:
        count = low - 1 if isinstance(points, bool) else operator.index(points)
    except TypeError:
        count = low - 1
    if not low <= count <= high:
        estimate = f" (about {as_float(count) * _BYTES_PER_POINT / 1e9:.4g} GB)" if count > high else ""
        raise InvalidRequestError(f"N is {quoted(points)} grid points{estimate}, allowed is {low} to {high}")
    return count


def parse_speed(text: str) -> float:
    """Return the speed in [m/s] from a text such as `0.3185`, `0.3185m/s` or `1.15km/h`.

    Raises:
        InvalidRequestError: the text is no number, or has another unit.
    """
    match = re.fullmatch(r"\s*(\S+?)\s*(m/s|km/h)?\s*", text)
    try:
        value = float(match[1]) if match else math.nan
    except ValueError:
        match = None
    if match is None:
        raise InvalidRequestError(f"speed {quoted(text)} not understood; write 0.3185, 0.3185m/s or 1.15km/h")
    return value / KMH_PER_MS if match[2] == "km/h" else value
