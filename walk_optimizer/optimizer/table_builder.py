"""Builds the whole table of gaits: every speed and spring mode, then continuation between them.

Each entry is first searched for from scratch, the entries in parallel. Then every entry is continued
from its neighbours in speed and from the mode with less freedom, until no entry improves: none is
left that its neighbour leads to a better optimum of. At last each is refined, from all good optima that
were met on the way, and the refinements are continued from their neighbours in the same way.
"""

import math
import signal
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from itertools import product
from multiprocessing import get_context

from walk_optimizer.gait import Gait
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.optimizer.comparison import refines_better
from walk_optimizer.optimizer.pipeline import Outcome, optimize, with_continuation, with_refinement
from walk_optimizer.optimizer.search import SAME_OPTIMUM
from walk_optimizer.request import GaitRequest, gait_table_settings
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import table_solver_settings

# A key of the table: index of the speed, spring mode.
Key = tuple[int, SpringMode]
_MODES = tuple(SpringMode)
_MAXIMUM_SWEEPS = 6
# Optima of an entry that are worse by no more than this part are refined too.
_GOOD = 0.05


@dataclass(frozen=True)
class TableProgress:
    """One solve of the table has ended.

    Attributes:
        stage: `search`, `continuation`, `refinement` or `refined continuation`.
        done: Solves that have ended in this stage.
        total: Solves of this stage.
        request: What was solved for.
        outcome: What came of it.
        kept: Whether its gait is now the table's entry.
    """

    stage: str
    done: int
    total: int
    request: GaitRequest
    outcome: Outcome
    kept: bool


@dataclass(frozen=True)
class _RefinedJob:
    gait: Gait
    seeds: tuple[Gait, ...]


@dataclass(frozen=True)
class _Job:
    key: Key
    request: GaitRequest
    walker: WalkerParameters
    seeds: tuple[Gait, ...]
    from_scratch: bool


def _run(job: _Job) -> Outcome:
    """Solve one entry, in a process of the pool."""
    settings = table_solver_settings()
    return optimize(
        job.request,
        job.walker,
        settings=settings,
        seeds=job.seeds,
        from_scratch=job.from_scratch,
        refine=False,
        others=True,
    )


def _refine(gait: Gait) -> Outcome:
    """Refine one entry, in a process of the pool."""
    return with_refinement(gait, _session())


def _continue_refined(job: _RefinedJob) -> Outcome:
    """Continue the refinements of neighbours, in a process of the pool."""
    return Outcome(with_continuation(job.gait, job.seeds, _session()), job.gait.report)


def _session() -> SolveSession:
    settings = table_solver_settings()
    return SolveSession(settings, settings.time_limit, None)


def build_table(
    walker: WalkerParameters,
    *,
    processes: int = 2,
    points: int | None = None,
    modes: Iterable[SpringMode] = _MODES,
    known: Sequence[Gait] = (),
    on_progress: Callable[[TableProgress], None] | None = None,
) -> dict[Key, Gait]:
    """Solve for all gaits of the table.

    Args:
        walker: The walker.
        processes: Solves that run at a time.
        points: Grid points of a step; the settings' by default.
        modes: Spring modes.
        known: Gaits of a former table, which the new one is to be no worse than.
        on_progress: Told after each solve; what it raises ends the build, after the solves that run.

    Returns:
        The gaits by speed index and mode; entries without a certified gait are missing.
    """
    steps = gait_table_settings().table_steps()
    requests = {
        (index, mode): GaitRequest.for_step(length, time, mode, points)
        for (index, (length, time)), mode in product(enumerate(steps), modes)
    }
    # Ctrl-C in a terminal reaches the processes of the pool too: it is for this one to end them.
    pool = ProcessPoolExecutor(
        processes, get_context("spawn"), initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)
    )
    try:
        return _Builder(walker, requests, known, pool, on_progress).build()
    finally:
        pool.shutdown(cancel_futures=True)


class _Builder:
    """The table while it grows."""

    def __init__(
        self,
        walker: WalkerParameters,
        requests: dict[Key, GaitRequest],
        known: Sequence[Gait],
        pool: ProcessPoolExecutor,
        on_progress: Callable[[TableProgress], None] | None,
    ) -> None:
        self.walker, self.requests, self.pool, self.on_progress = walker, requests, pool, on_progress
        self.known = {gait.request: gait for gait in known}
        self.table: dict[Key, Gait] = {}
        # All distinct optima of each entry, the table's among them.
        self.found: dict[Key, list[Gait]] = {key: [] for key in requests}

    def build(self) -> dict[Key, Gait]:
        improved = self._solve([self._search(key) for key in self.requests], "search")
        for _ in range(_MAXIMUM_SWEEPS):
            jobs = [self._continuation(key, improved) for key in self.requests]
            improved = self._solve([job for job in jobs if job.seeds], "continuation")
            if not improved:
                break
        self._recall_refinements()
        self._refine()
        self._continue_refinements()
        return self.table

    def _recall_refinements(self) -> None:
        """Begin with the refinements of the former table: others have to be better."""
        for key, gait in self.table.items():
            former = self.known.get(self.requests[key])
            if former is not None:
                self.table[key] = replace(gait, refined=former.refined)

    def _continue_refinements(self) -> None:
        """Continue the refinements of all entries until none improves."""
        improved = set(self.table)
        for _ in range(_MAXIMUM_SWEEPS):
            improved = self._continue_refined(improved)
            if not improved:
                break

    def _continue_refined(self, improved: set[Key]) -> set[Key]:
        """Continue refinements that improved to the entries next to them; return what improves in turn."""
        seeds = {key: self._seeds(key, improved) for key in self.table}
        jobs = {key: _RefinedJob(self.table[key], found) for key, found in seeds.items() if found}
        futures = {self.pool.submit(_continue_refined, job): key for key, job in jobs.items()}
        better = set()
        for done, future in enumerate(as_completed(futures), start=1):
            key, outcome = futures[future], future.result()
            kept = outcome.gait is not None and refines_better(outcome.gait.refined, self.table[key].refined)
            if kept and outcome.gait is not None:
                self.table[key] = outcome.gait
                better.add(key)
            stage = "refined continuation"
            self._tell(TableProgress(stage, done, len(futures), self.requests[key], outcome, kept))
        return better

    def _refine(self) -> None:
        """Add the accurate solution to every entry: the best that any of its good optima leads to.

        The grid's error is larger than the distance between them, so the best on the grid need not be the
        best in truth.
        """
        futures = {self.pool.submit(_refine, gait): key for key in self.table for gait in self._good(key)}
        for done, future in enumerate(as_completed(futures), start=1):
            key, outcome = futures[future], future.result()
            kept = outcome.gait is not None and refines_better(outcome.gait.refined, self.table[key].refined)
            if kept and outcome.gait is not None:
                self.table[key] = replace(self.table[key], refined=outcome.gait.refined)
                outcome = replace(outcome, gait=self.table[key])
            self._tell(TableProgress("refinement", done, len(futures), self.requests[key], outcome, kept))

    def _good(self, key: Key) -> list[Gait]:
        """Return the entry's optima that are not much worse than the best."""
        largest = self.table[key].objective * (1 + _GOOD)
        return [gait for gait in self.found[key] if gait.objective <= largest]

    def _tell(self, progress: TableProgress) -> None:
        if self.on_progress is not None:
            self.on_progress(progress)

    def _job(self, key: Key, seeds: tuple[Gait, ...], *, from_scratch: bool) -> _Job:
        return _Job(key, self.requests[key], self.walker, seeds, from_scratch)

    def _search(self, key: Key) -> _Job:
        """Return the job that searches for an entry from scratch, and from the gait of a former table."""
        former = self.known.get(self.requests[key])
        return self._job(key, () if former is None else (former,), from_scratch=True)

    def _continuation(self, key: Key, improved: set[Key]) -> _Job:
        """Return the job that continues an entry from those of its neighbours that have changed."""
        seeds = (loosened(seed, key[1]) for seed in self._seeds(key, improved))
        return self._job(key, tuple(seeds), from_scratch=False)

    def _seeds(self, key: Key, improved: set[Key]) -> tuple[Gait, ...]:
        """Return those of the entries that may lead to a better one of this key that have changed."""
        index, mode = key
        neighbours = [(index - 1, mode), (index + 1, mode)]
        neighbours += [(index, lesser) for lesser in _MODES[: _MODES.index(mode)]]
        return tuple(self.table[one] for one in neighbours if one in improved)

    def _solve(self, jobs: list[_Job], stage: str) -> set[Key]:
        """Run the jobs, keep what is better, and return the keys of the entries that improved."""
        improved = set()
        futures = {self.pool.submit(_run, job): job for job in jobs}
        for done, future in enumerate(as_completed(futures), start=1):
            job, outcome = futures[future], future.result()
            kept = outcome.gait is not None and self._is_better(job.key, outcome.gait)
            for gait in (outcome.gait, *outcome.others):
                if gait is not None:
                    self._note(job.key, gait)
            if kept and outcome.gait is not None:
                self.table[job.key] = outcome.gait
                improved.add(job.key)
            self._tell(TableProgress(stage, done, len(jobs), job.request, outcome, kept))
        return improved

    def _note(self, key: Key, gait: Gait) -> None:
        """Add an optimum to those of its entry, unless it is one of them."""
        known = (one.objective for one in self.found[key])
        if not any(math.isclose(gait.objective, one, rel_tol=SAME_OPTIMUM) for one in known):
            self.found[key].append(gait)

    def _is_better(self, key: Key, gait: Gait) -> bool:
        known = self.table.get(key)
        return known is None or gait.objective < known.objective * (1 - SAME_OPTIMUM)


def loosened(seed: Gait, mode: SpringMode) -> Gait:
    """Return the seed with a spring inside its bounds where a mode with more freedom continues it."""
    if mode is SpringMode.NONE or seed.spring.stiffness > 0:
        return seed
    return replace(seed, spring=KneeSpring(1.0, seed.spring.equilibrium))
