"""Which of a library's gaits answers a request for a speed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from walk_optimizer.errors import GaitNotFoundError, InvalidRequestError, quoted
from walk_optimizer.gait import Gait
from walk_optimizer.library.entries import LibraryEntry, Source
from walk_optimizer.library.interpolation import interpolated
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import (
    KMH_PER_MS,
    TABLE_SPEED_TOLERANCE,
    GaitRequest,
    gait_table_settings,
    speed_number,
)

# Speeds that differ by less are the same to a walker, in [m/s].
EXACT_SPEED_TOLERANCE = 1e-4


class Selection(StrEnum):
    """Which gait answers a request for a speed.

    `exact` takes a gait within a tolerance, `nearest` the closest. `interpolated` takes a gait within
    the tolerance too, otherwise it blends the neighbours, which takes about a second.
    """

    EXACT = "exact"
    INTERPOLATED = "interpolated"
    NEAREST = "nearest"


@dataclass(frozen=True)
class Query:
    """What is looked for.

    Attributes:
        speed: In [m/s].
        mode: The spring mode.
        selection: How the gait is chosen.
        points: Only gaits with this N; None takes any.
        tolerance: Largest difference of an exact speed in [m/s].
    """

    speed: float
    mode: SpringMode
    selection: Selection
    points: int | None
    tolerance: float

    def __post_init__(self) -> None:
        """Refuse a speed that is none.

        Raises:
            InvalidRequestError: the speed is no number, or not finite.
        """
        speed = speed_number(self.speed)
        if not math.isfinite(speed):
            raise InvalidRequestError(f"speed is {speed} m/s, expected a finite number")

    def fits(self, entry: LibraryEntry) -> bool:
        """Return whether a gait is of the mode and, where one is asked for, of the number of points."""
        request = entry.gait.request
        return request.spring_mode is self.mode and self.points in (None, request.points)

    def distance(self, entry: LibraryEntry) -> float:
        """Return how far the requested speed of a gait is from the speed, in [m/s]."""
        return abs(entry.gait.request.speed - self.speed)

    def preference(self, entry: LibraryEntry) -> tuple[bool, float, float]:
        """Return the key by which the smallest is the best answer.

        Gaits with the default number of points go first, then the one closest in speed, then the one
        of least F: one on a coarse grid that lies closer by less than the tolerance is no better.
        """
        other_grid = entry.gait.request.points != gait_table_settings().points
        return other_grid, round(self.distance(entry), 6), entry.gait.objective


def parse_selection(name: Selection | str) -> Selection:
    """Return the selection of that name.

    Raises:
        InvalidRequestError: there is none of that name.
    """
    try:
        return Selection(name)
    except ValueError:
        allowed = ", ".join(entry.value for entry in Selection)
        raise InvalidRequestError(f"unknown selection {quoted(name)}; allowed are {allowed}") from None


def select(entries: Sequence[LibraryEntry], query: Query) -> tuple[Gait, Source]:
    """Return the gait that answers a query, and where it comes from.

    Raises:
        GaitNotFoundError: there is none; the message lists the speeds that there are.
    """
    fitting = [entry for entry in entries if query.fits(entry)]
    least = min(map(query.distance, fitting), default=math.inf)
    if query.selection is Selection.NEAREST and fitting:
        reach = least + TABLE_SPEED_TOLERANCE
    elif least <= query.tolerance:
        reach = query.tolerance
    elif query.selection is Selection.INTERPOLATED:
        return _blended(fitting, query), Source.INTERPOLATED
    else:
        raise GaitNotFoundError(_not_found(fitting, query))
    within = [entry for entry in fitting if query.distance(entry) <= reach]
    best = min(within, key=query.preference)
    return best.gait, best.source


def _blended(entries: list[LibraryEntry], query: Query) -> Gait:
    """Return the blend of the gaits next to a speed; raise GaitNotFoundError where there is none."""
    usable = [entry for entry in entries if entry.gait.refined is not None and is_on_line(entry.gait.request)]
    below = [entry.gait for entry in usable if entry.gait.request.speed < query.speed]
    above = [entry.gait for entry in usable if entry.gait.request.speed > query.speed]
    try:
        if not (below and above):
            raise GaitNotFoundError("not interpolated: there are no refined gaits on both sides")
        lower = max(below, key=lambda gait: gait.request.speed)
        upper = min(above, key=lambda gait: gait.request.speed)
        return interpolated(lower, upper, GaitRequest.for_speed(query.speed, query.mode, query.points))
    except GaitNotFoundError as error:
        raise GaitNotFoundError(f"{_not_found(entries, query)}; {error}") from error


def is_on_line(request: GaitRequest) -> bool:
    """Return whether a request has the step that one for its speed alone would have."""
    return math.isclose(request.step_length, GaitRequest.for_speed(request.speed).step_length, rel_tol=1e-6)


def _not_found(entries: list[LibraryEntry], query: Query) -> str:
    speeds = sorted({entry.gait.request.speed for entry in entries})
    listed = ", ".join(f"{one:.4f} ({one * KMH_PER_MS:.2f} km/h)" for one in speeds) or "none"
    return (
        f"no gait of {query.speed:.4f} m/s ({query.speed * KMH_PER_MS:.2f} km/h) with springs "
        f"{query.mode.value}; speeds in [m/s] of that mode in the library: {listed}"
    )
