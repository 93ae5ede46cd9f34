"""Entries of the gait library and the rows of its table, as values."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from walk_optimizer.gait import Gait
from walk_optimizer.model.parameters import SpringMode


class Source(StrEnum):
    """Where a gait of the library comes from: a file of two places, or blended from two of them."""

    TABLE = "table"
    CACHE = "cache"
    INTERPOLATED = "interpolated"


@dataclass(frozen=True, eq=False)
class LibraryEntry:
    """A gait with the file that holds it.

    Attributes:
        gait: The gait.
        source: The packaged table or the user's cache.
        path: Its file.
    """

    gait: Gait
    source: Source
    path: Path


@dataclass(frozen=True)
class GaitSummary:
    """One row of the gait table.

    Attributes:
        speed: Requested speed in [m/s].
        step_length: In [m].
        step_time: In [s].
        spring_mode: What was free about the springs.
        stiffness: K in [N m/rad].
        equilibrium: q_eq in [rad].
        objective: F in [(N m)^2].
        relative_objective: F% = 100 F / F of mode `none` at the same speed and N; NaN when the
            library has no such gait.
        points: N.
        certified: Whether the stored certificate holds.
        source: Where it comes from.
    """

    speed: float
    step_length: float
    step_time: float
    spring_mode: SpringMode
    stiffness: float
    equilibrium: float
    objective: float
    relative_objective: float
    points: int
    certified: bool
    source: Source


def summarize(entries: Sequence[LibraryEntry]) -> list[GaitSummary]:
    """Return one row a gait, in the order given, F% taken against mode `none` among them."""
    nominal = {
        _step_key(entry.gait): entry.gait.objective
        for entry in entries
        if entry.gait.request.spring_mode is SpringMode.NONE
    }
    return [_summary(entry, nominal.get(_step_key(entry.gait), math.nan)) for entry in entries]


def table_order(entry: LibraryEntry) -> tuple[int, float, int, float]:
    """Return the key that sorts gaits as a table: by mode, speed and number of points."""
    request = entry.gait.request
    return list(SpringMode).index(request.spring_mode), request.speed, request.points, request.step_length


def _step_key(gait: Gait) -> tuple[float, float, int]:
    """Return what gaits of different modes have in common when their F may be compared."""
    request = gait.request
    return round(request.step_length, 6), round(request.step_time, 6), request.points


def _summary(entry: LibraryEntry, nominal: float) -> GaitSummary:
    """Return the row of a gait, F of mode `none` at the same speed being `nominal`."""
    gait = entry.gait
    return GaitSummary(
        speed=gait.request.speed,
        step_length=gait.step_length,
        step_time=gait.request.step_time,
        spring_mode=gait.request.spring_mode,
        stiffness=gait.spring.stiffness,
        equilibrium=gait.spring.equilibrium,
        objective=gait.objective,
        relative_objective=100 * gait.objective / nominal if nominal > 0 else math.nan,
        points=gait.request.points,
        certified=gait.certificate.certified,
        source=entry.source,
    )
