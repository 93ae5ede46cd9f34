"""The gait library: the packaged table and a user's cache, in memory and on disk.

Owns what happens to files that can't be used. Does not own which gait answers a request
(`selection`) nor the bytes of a file (`gait_files`), and solves nothing.
"""

import os
from collections.abc import Sequence
from pathlib import Path

from walk_optimizer.errors import GaitFileError, GaitNotFoundError, GaitNotWritableError
from walk_optimizer.gait import Gait
from walk_optimizer.gait_files import (
    SUFFIX,
    gait_file_name,
    read_gait_file,
    transition_name_parts,
    write_gait_file,
)
from walk_optimizer.gait_files.access import files_in, writable_folder
from walk_optimizer.gait_files.codec import encode
from walk_optimizer.library.entries import GaitSummary, LibraryEntry, Source, summarize, table_order
from walk_optimizer.library.selection import (
    Query,
    Selection,
    parse_selection,
    select,
)
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer.comparison import best_of_both
from walk_optimizer.request import TABLE_SPEED_TOLERANCE, gait_table_settings
from walk_optimizer.resources import data_folder


def table_folder() -> Path:
    """Return the folder of the packaged table, which is only read."""
    return data_folder() / "gaits"


def existing_folder(folder: Path | str) -> Path:
    """Return a folder that was named; a misspelt one must not pass for one that holds nothing.

    Raises:
        GaitFileError: it is missing, no folder, or out of reach.
    """
    folder = Path(folder)
    try:
        if folder.is_dir():
            return folder
        if folder.exists():
            raise GaitFileError(f"{folder}: the folder is a file; name another")
    except OSError as error:
        raise GaitFileError(f"{folder}: the folder can't be read: {error.strerror}") from error
    raise GaitFileError(f"{folder}: the folder is missing; create it or name another")


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

    def __init__(
        self, walker: WalkerParameters, folder: Path | str | None = None, writable: bool = False
    ) -> None:
        """Load what there is.

        Args:
            walker: The walker of all gaits.
            folder: Folder of this walker's stored gaits; None means the user's cache, which is
                created when something is written. A folder that is named has to exist.
            writable: Whether to make sure now that gaits can be stored.

        Raises:
            GaitFileError: a folder that is named is missing, or none; or `writable`, and the folder is a
                symbolic link or not writable.
        """
        self.walker = walker
        self.folder = cache_folder(walker) if folder is None else existing_folder(folder)
        self._create = folder is None
        if writable:
            writable_folder(self.folder, self._create)
        self.reload()

    def reload(self) -> None:
        """Read both folders again."""
        found: list[LibraryEntry] = []
        problems: list[str] = []
        for folder, source in self._places():
            try:
                paths = _gait_files(folder)
            except GaitFileError as error:
                problems.append(str(error))
                continue
            for path in paths:
                try:
                    found.append(_read_entry(path, source, self.walker))
                except GaitFileError as error:
                    problems.append(str(error))
        self._found = found
        self._entries = _best(found)
        self._problems = tuple(problems)
        self._unsaved: dict[Path, str] = {}

    def entries(self) -> tuple[LibraryEntry, ...]:
        """Return all gaits with their files, by mode, speed and number of points."""
        return self._entries

    def gaits(self) -> list[Gait]:
        """Return all gaits, by mode, speed and number of points."""
        return [entry.gait for entry in self._entries]

    def table_gaits(self) -> list[Gait]:
        """Return the gaits of the table's speeds, on its grid.

        Raises:
            GaitNotFoundError: there are none.
        """
        points, speeds = gait_table_settings().points, gait_table_settings().table_speeds()
        found = [
            gait
            for gait in self.gaits()
            if gait.request.points == points
            and any(abs(gait.request.speed - speed) < 1e-9 for speed in speeds)
        ]
        if not found:
            raise GaitNotFoundError(
                f"{self.folder}: no gaits of the table for this walker; solve them with `library build`"
            )
        return found

    def problems(self) -> list[str]:
        """Return a sentence for each file that was set aside; it begins with the path."""
        return list(self._problems)

    def unsaved(self) -> list[str]:
        """Return a sentence for each gait that is in memory only, because its file can't be written."""
        return list(self._unsaved.values())

    def summaries(self) -> list[GaitSummary]:
        """Return one row a gait, in the order of `gaits`."""
        return summarize(self._entries)

    def find(
        self,
        speed: float,
        mode: SpringMode | str,
        selection: Selection | str = Selection.EXACT,
        points: int | None = None,
        tolerance: float = TABLE_SPEED_TOLERANCE,
    ) -> tuple[Gait, Source]:
        """Return the gait for a speed and where it comes from.

        Args:
            speed: In [m/s].
            mode: A spring mode or its name.
            selection: How the gait is chosen, see Selection.
            points: Only gaits with this N; None takes any.
            tolerance: Largest difference of an exact speed in [m/s]; by default speeds in km/h may be
                written with two decimals, as the report does.

        Raises:
            InvalidRequestError: the speed is no finite number, or the mode or selection unknown.
            GaitNotFoundError: there is no such gait; the message lists the speeds that there are, and
                says why there is no blend.
        """
        query = Query(speed, SpringMode.parse(mode), parse_selection(selection), points, tolerance)
        try:
            return select(self._entries, query)
        except GaitNotFoundError as error:
            set_aside = f"; files set aside: {'; '.join(self._problems)}" if self._problems else ""
            raise GaitNotFoundError(f"{error}{set_aside}") from error

    def store(self, gait: Gait) -> Path:
        """Write a gait into the folder and serve it from now on, even if it can't be written.

        Returns:
            Its file; a former one of the same request is replaced, but no refinement is lost: a gait without
            one is stored with the former's, and as far as it is better. The packaged table's gait is
            still served when its F is smaller, or it alone is refined.

        Raises:
            GaitFileError: the gait is not certified, for another walker, or a number is not finite;
                nothing has changed.
            GaitNotWritableError: it can't be written, and is lost when this process ends.
        """
        if not gait.certificate.certified:
            failed = ", ".join(entry.family for entry in gait.certificate.failures()) or "no certificate"
            raise GaitFileError(f"only certified gaits are stored; this one fails: {failed}")
        if gait.walker != self.walker:
            raise GaitFileError("the gait is for another walker than the library")
        path = self.folder / gait_file_name(gait)
        former = next((entry.gait for entry in self._found if entry.path == path), None)
        if former is not None and former.refined is not None and gait.refined is None:
            gait = best_of_both(former, gait)
        try:
            writable_folder(self.folder, self._create)
            write_gait_file(gait, path)
        except GaitNotWritableError as error:
            encode(gait)  # Refuses what no file could hold.
            self._serve(gait, path)
            self._unsaved[path] = str(error)
            raise GaitNotWritableError(
                f"the gait is kept in memory only, and lost when this process ends: {error}"
            ) from error
        self._serve(gait, path)
        self._unsaved.pop(path, None)
        self._problems = tuple(text for text in self._problems if not text.startswith(f"{path}:"))
        return path

    def _places(self) -> list[tuple[Path, Source]]:
        """Return the folders to look at: the packaged table's for the packaged walker, and the own one."""
        own = (self.folder, Source.CACHE)
        return [(table_folder(), Source.TABLE), own] if self.walker == WalkerParameters.from_yaml() else [own]

    def _serve(self, gait: Gait, path: Path) -> None:
        others = [entry for entry in self._found if entry.path != path]
        self._found = [*others, LibraryEntry(gait, Source.CACHE, path)]
        self._entries = _best(self._found)


def _gait_files(folder: Path) -> list[Path]:
    """Return the files of gaits in a folder; raise GaitFileError when it can't be read."""
    return [path for path in files_in(folder, SUFFIX) if transition_name_parts(path.name) is None]


def _read_entry(path: Path, source: Source, walker: WalkerParameters) -> LibraryEntry:
    """Return the gait of a file; raise GaitFileError when it can't be served."""
    gait = read_gait_file(path, walker)
    if not gait.certificate.certified:
        raise GaitFileError(f"{path}: the gait is not certified")
    return LibraryEntry(gait, source, path)


def _best(found: Sequence[LibraryEntry]) -> tuple[LibraryEntry, ...]:
    """Return the gaits to serve, in the order of the table: of files for the same request the least F.

    One that is not refined hides none that is: controllers are fed refined ones. A tuple that is replaced as
    a whole: another thread that looks a gait up sees the old or the new ones.
    """

    def rank(entry: LibraryEntry) -> tuple[bool, float]:
        return entry.gait.refined is None, entry.gait.objective

    best: dict[str, LibraryEntry] = {}
    for entry in found:
        other = best.get(entry.path.name)
        if other is None or rank(entry) <= rank(other):
            best[entry.path.name] = entry
    return tuple(sorted(best.values(), key=table_order))
