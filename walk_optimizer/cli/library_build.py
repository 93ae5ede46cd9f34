"""`library build`: solve the table of seven speeds and three spring modes."""

import argparse
import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from walk_optimizer.cli.arguments import (
    Subparsers,
    add_verb,
    add_walker,
    parse_count,
    parse_points,
    walker_from,
)
from walk_optimizer.cli.terminal import StatusLine
from walk_optimizer.request import KMH_PER_MS, gait_table_settings

if TYPE_CHECKING:
    from walk_optimizer.gait import Gait
    from walk_optimizer.model.parameters import WalkerParameters
    from walk_optimizer.optimizer.table_builder import TableProgress

_TEXT = """\
solve the table that ships with the package

Every speed and spring mode is searched for from scratch, then continued from its
neighbours until none improves, and refined. A gait is written as soon as it is
certified and better than the one in the folder: an interrupted build keeps what it has
found. A further build begins with the gaits that are there too, and never makes the
table worse, on either grid. Begin with an empty folder to start over."""

_EPILOG = """\
examples:
  walk-optimizer library build
  walk-optimizer library build --output my_table --walker my_walker.yaml"""

_BAR = 30
# Each is a process of its own, and all are started.
_MOST_JOBS = 256


def add_parser(actions: Subparsers) -> None:
    """Add the action."""
    parser = add_verb(actions, "build", _TEXT, _EPILOG)
    parser.add_argument(
        "--output", type=Path, metavar="FOLDER", help="default: the package's own data folder"
    )
    parser.add_argument("--jobs", metavar="N", help="solves at a time (default: one a core)")
    parser.add_argument("--points", metavar="N", help="grid points of a step (default: 200)")
    add_walker(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Build the table; 1 when entries are missing."""
    jobs = (os.cpu_count() or 1) if args.jobs is None else parse_count(args.jobs, "jobs", _MOST_JOBS)
    walker = walker_from(args)
    points = None if args.points is None else parse_points(args.points)

    from walk_optimizer.gait_files.access import writable_folder
    from walk_optimizer.library import table_folder
    from walk_optimizer.model.parameters import SpringMode
    from walk_optimizer.optimizer.table_builder import build_table

    folder = args.output or table_folder()
    writable_folder(folder, create=args.output is None)
    known = former_gaits(folder, walker)
    display = BuildDisplay(folder)
    with _children_end_on_interrupt():
        gaits = build_table(walker, processes=jobs, points=points, known=known, on_progress=display)
    expected = gait_table_settings().gaits * len(SpringMode)
    print(f"{len(gaits)} of {expected} gaits solved in {minutes(display.elapsed)}; files in {folder}")
    return 0 if len(gaits) == expected else 1


def former_gaits(folder: Path, walker: "WalkerParameters") -> list["Gait"]:
    """Return the gaits of a folder whose certificates hold."""
    from walk_optimizer.gait_files import SUFFIX
    from walk_optimizer.gait_files.access import files_in
    from walk_optimizer.library.verification import verify_file

    verified = (verify_file(path, walker) for path in files_in(folder, SUFFIX))
    return [one.gait for one in verified if one.passed and one.gait is not None]


class BuildDisplay:
    """Stores what a build finds, and shows how far it is."""

    def __init__(self, folder: Path) -> None:
        """Start the clock."""
        self._folder, self._line = folder, StatusLine()
        self._begin = self._stage_begin = self._last_end = time.monotonic()

    @property
    def elapsed(self) -> float:
        """Time since the build began in [s]."""
        return time.monotonic() - self._begin

    def __call__(self, progress: "TableProgress") -> None:
        """Store the gait of a solve that has ended, print it, and move the bar."""
        if progress.done == 1:
            # A stage has begun when the last solve of the former one ended.
            self._stage_begin = self._last_end
        gait = progress.outcome.gait if progress.kept else None
        stored = gait is not None and store_better(gait, self._folder)
        self._line.lasting(solve_text(progress, stored))
        elapsed = time.monotonic() - self._stage_begin
        self._line.update(bar_text(progress.stage, progress.done, progress.total, elapsed))
        self._last_end = time.monotonic()


def store_better(gait: "Gait", folder: Path) -> bool:
    """Write a gait, as far as the folder holds no certified one of the same request that is as good.

    Both grids count for themselves: a better refinement is written beside the better gait on the grid.

    Returns:
        Whether anything was written.
    """
    from walk_optimizer.gait_files import gait_file_name, write_gait_file
    from walk_optimizer.library.verification import verify_file
    from walk_optimizer.optimizer.comparison import best_of_both

    path = folder / gait_file_name(gait)
    former = verify_file(path, gait.walker)
    if former.passed and former.gait is not None:
        best = best_of_both(former.gait, gait)
        if best is former.gait:
            return False
        gait = best
    write_gait_file(gait, path)
    return True


def solve_text(progress: "TableProgress", stored: bool) -> str:
    """Return the line of a solve that has ended."""
    request, report = progress.request, progress.outcome.report
    result = f"F {report.objective:.5g}" if progress.outcome.gait else report.message
    note = "stored" if stored else "no better" if progress.outcome.gait else "FAILED"
    return (
        f"{progress.stage} {progress.done}/{progress.total}  {request.speed * KMH_PER_MS:.2f} km/h "
        f"{request.spring_mode.value}: {result}, {report.solve_time:.1f} s, {note}"
    )


def bar_text(stage: str, done: int, total: int, elapsed: float) -> str:
    """Return a progress bar with the time that the stage still takes, judged by the solves so far."""
    filled = _BAR * done // total
    left = elapsed / done * (total - done)
    bar = "#" * filled + "." * (_BAR - filled)
    return f"[{bar}] {done}/{total} {stage}, {minutes(elapsed)}, about {minutes(left)} left of this stage"


def minutes(seconds: float) -> str:
    """Return a duration in [s] as minutes and seconds."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d} min"


@contextmanager
def _children_end_on_interrupt() -> Iterator[None]:
    """Kill the worker processes on Ctrl-C: a pool would first finish all that is in its queue."""
    from concurrent.futures.process import BrokenProcessPool

    interrupted = False

    def handle(number: int, frame: FrameType | None) -> None:
        del number, frame
        nonlocal interrupted
        interrupted = True
        for child in multiprocessing.active_children():
            child.kill()

    former = signal.signal(signal.SIGINT, handle)
    try:
        yield
    except BrokenProcessPool:
        if not interrupted:
            raise
    finally:
        signal.signal(signal.SIGINT, former)
    if interrupted:
        raise KeyboardInterrupt
