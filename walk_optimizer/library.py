"""The gait library: the packaged table and a user's cache, in memory and on disk.

Owns which file answers a request and what happens to files that can't be used. Does not own the
bytes of a file (`gait_files`) and solves nothing.
"""

import math
import os
from enum import StrEnum
from pathlib import Path

from walk_optimizer.errors import GaitFileError, GaitNotFoundError, InvalidRequestError
from walk_optimizer.gait import Gait
from walk_optimizer.gait_files import SUFFIX, gait_file_name, read_gait_file, write_gait_file
from walk_optimizer.gait_files.access import writable_folder
from walk_optimizer.library_entries import GaitSummary, LibraryEntry, Source, summarize, table_order
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.request import KMH_PER_MS, TABLE_SPEED_TOLERANCE, GaitRequest, gait_table_settings
from walk_optimizer.resources import data_folder

__all__ = [
    "GaitLibrary",
    "GaitSummary",
    "LibraryEntry",
    "Selection",
    "Source",
    "cache_folder",
    "table_folder",
]


class Selection(StrEnum):
    """Which gait answers a request for a speed."""

    EXACT = "exact"
    NEAREST = "nearest"


def table_folder() -> Path:
    """Return the folder of the packaged table, which is only read."""
    return data_folder() / "gaits"


def cache_folder(walker: WalkerParameters) -> Path:
    """Return the user's cache folder of a walker: one for each, so that walkers do not meet."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    # The XDG specification: a relative path is to be ignored.
    root = Path(base) if os.path.isabs(base) else Path.home() / ".cache"  # noqa: PTH117
    return root / "walk_optimizer" / "gaits" / walker.fingerprint()


class GaitLibrary:
    """Solved gaits of one walker: the packaged table, and a folder that new gaits are stored in.

    A file that can't be used is set aside: it is left as it is, named by `problems`, and the rest
    is served.
    """

    def __init__(self, walker: WalkerParameters, folder: Path | None = None, writable: bool = False) -> None:
        """Load what there is.

        Args:
            walker: The walker of all gaits.
            folder: Folder of this walker's stored gaits; None means the user's cache, which is
                created when something is written. A folder that is named has to exist.
            writable: Whether to make sure now that gaits can be stored.

        Raises:
            GaitFileError: `writable`, and the folder is missing, a symbolic link or not writable.
        """
        self.walker = walker
        self.folder = folder if folder is not None else cache_folder(walker)
        self._create = folder is None
        if writable:
            writable_folder(self.folder, self._create)
        self.reload()

    def reload(self) -> None:
        """Read both folders again."""
        entries: dict[str, LibraryEntry] = {}
        problems: list[str] = []
        for path, source in _gait_files(self.walker, self.folder):
            try:
                _keep_better(entries, _read_entry(path, source, self.walker))
            except GaitFileError as error:
                problems.append(str(error))
        # Replaced as a whole, never changed: another thread that looks a gait up sees the old or the new.
        self._entries = tuple(sorted(entries.values(), key=table_order))
        self._problems = tuple(problems)

    def entries(self) -> tuple[LibraryEntry, ...]:
        """Return all gaits with their files, by mode, speed and number of points."""
        return self._entries

    def gaits(self) -> list[Gait]:
        """Return all gaits, by mode, speed and number of points."""
        return [entry.gait for entry in self._entries]

    def problems(self) -> list[str]:
        """Return a sentence for each file that was set aside; it begins with the path."""
        return list(self._problems)

    def summaries(self) -> list[GaitSummary]:
        """Return one row a gait, in the order of `gaits`."""
        return summarize(self._entries)

    def find(
        self,
        speed: float,
        mode: SpringMode | str,
        selection: Selection | str = Selection.EXACT,
        points: int | None = None,
    ) -> tuple[Gait, Source]:
        """Return the gait for a speed and where it comes from.

        Of several gaits within `TABLE_SPEED_TOLERANCE` of each other, those with the default number
        of points go first, then the one closest in speed, then the one of least F.

        Args:
            speed: In [m/s].
            mode: A spring mode or its name.
            selection: `exact` takes a gait within `TABLE_SPEED_TOLERANCE`, `nearest` the closest.
            points: Only gaits with this N; None takes any.

        Raises:
            InvalidRequestError: the speed is not finite, or the mode or selection unknown.
            GaitNotFoundError: there is no such gait; the message lists the speeds that there are.
        """
        mode, choice = SpringMode.parse(mode), _parse_selection(selection)
        if not math.isfinite(speed):
            raise InvalidRequestError(f"speed is {speed} m/s, expected a finite number")
        entries = [entry for entry in self._entries if _fits(entry.gait.request, mode, points)]
        least = min((_distance(entry, speed) for entry in entries), default=math.inf)
        if not entries or (choice is Selection.EXACT and least > TABLE_SPEED_TOLERANCE):
            raise GaitNotFoundError(self._not_found(speed, mode, entries))
        reach = TABLE_SPEED_TOLERANCE if choice is Selection.EXACT else least + TABLE_SPEED_TOLERANCE
        within = [entry for entry in entries if _distance(entry, speed) <= reach]
        best = min(within, key=lambda entry: _preference(entry, speed))
        return best.gait, best.source

    def store(self, gait: Gait) -> Path:
        """Write a gait into the folder and serve it from now on.

        Returns:
            Its file; a former one of the same request is replaced. The packaged table's gait is
            still served when its F is smaller.

        Raises:
            GaitFileError: the gait is not certified or for another walker, or can't be written.
        """
        if not gait.certificate.certified:
            failed = ", ".join(entry.family for entry in gait.certificate.failures()) or "no certificate"
            raise GaitFileError(f"only certified gaits are stored; this one fails: {failed}")
        if gait.walker != self.walker:
            raise GaitFileError("the gait is for another walker than the library")
        writable_folder(self.folder, self._create)
        path = self.folder / gait_file_name(gait)
        write_gait_file(gait, path)
        entries = {e.path.name: e for e in self._entries if e.path != path}
        _keep_better(entries, LibraryEntry(gait, Source.CACHE, path))
        self._entries = tuple(sorted(entries.values(), key=table_order))
        self._problems = tuple(text for text in self._problems if not text.startswith(f"{path}:"))
        return path

    def _not_found(self, speed: float, mode: SpringMode, entries: list[LibraryEntry]) -> str:
        speeds = sorted({entry.gait.request.speed for entry in entries})
        listed = ", ".join(f"{one:.4f} ({one * KMH_PER_MS:.2f} km/h)" for one in speeds) or "none"
        set_aside = f"; files set aside: {'; '.join(self._problems)}" if self._problems else ""
        return (
            f"no gait of {speed:.4f} m/s ({speed * KMH_PER_MS:.2f} km/h) with springs {mode.value}; "
            f"speeds in [m/s] of that mode in the library: {listed}{set_aside}"
        )


def _gait_files(walker: WalkerParameters, folder: Path) -> list[tuple[Path, Source]]:
    """Return the files to look at: the packaged table's for the packaged walker, and the folder's."""
    places = [(folder, Source.CACHE)]
    if walker == WalkerParameters.from_yaml():
        places.insert(0, (table_folder(), Source.TABLE))
    return [
        (path, source)
        for place, source in places
        for path in sorted(place.glob(f"*{SUFFIX}"))
        if not path.name.startswith(".")
    ]


def _read_entry(path: Path, source: Source, walker: WalkerParameters) -> LibraryEntry:
    """Return the gait of a file; raise GaitFileError when it can't be served."""
    gait = read_gait_file(path, walker)
    if not gait.certificate.certified:
        raise GaitFileError(f"{path}: the gait is not certified")
    return LibraryEntry(gait, source, path)


def _keep_better(entries: dict[str, LibraryEntry], entry: LibraryEntry) -> None:
    """Add an entry by its file name, unless there is one of the same request with a smaller F."""
    other = entries.get(entry.path.name)
    if other is None or entry.gait.objective <= other.gait.objective:
        entries[entry.path.name] = entry


def _parse_selection(name: Selection | str) -> Selection:
    """Return the selection of that name; an empty one means exact."""
    try:
        return Selection(name or Selection.EXACT)
    except ValueError:
        allowed = ", ".join(entry.value for entry in Selection)
        raise InvalidRequestError(f"unknown selection {name!r}; allowed are {allowed}") from None


def _distance(entry: LibraryEntry, speed: float) -> float:
    """Return how far the requested speed of a gait is from a speed, in [m/s]."""
    return abs(entry.gait.request.speed - speed)


def _fits(request: GaitRequest, mode: SpringMode, points: int | None) -> bool:
    """Return whether a gait is of the mode and, where one is asked for, of the number of points."""
    return request.spring_mode is mode and points in (None, request.points)


def _preference(entry: LibraryEntry, speed: float) -> tuple[bool, float, float]:
    """Return the key by which the smallest is the best answer to a request for a speed."""
    request = entry.gait.request
    # A gait on a coarse grid that lies closer by less than the tolerance is no better answer.
    other_grid = request.points != gait_table_settings().points
    return other_grid, round(_distance(entry, speed), 6), entry.gait.objective
