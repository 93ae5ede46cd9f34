"""One request's solves: a common clock, cancelling and progress over all of its stages."""

import os
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from walk_optimizer.solve.back_end import SolveOptions
from walk_optimizer.solve.registry import BACK_ENDS, back_end
from walk_optimizer.solve.settings import SolverSettings
from walk_optimizer.solve.sharing import Shares, processor_count
from walk_optimizer.solve.solution import FloatArray, IterationState, Monitor, Solution
from walk_optimizer.solve.status import Progress, ProgressCallback, Status
from walk_optimizer.transcription.program import Problem

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


class SolveSession:
    """Runs solves until the time limit or a cancel; after that every solve ends at once."""

    def __init__(
        self, settings: SolverSettings, time_limit: float, progress: ProgressCallback | None
    ) -> None:
        """Start the clock.

        Args:
            settings: Of the solver.
            time_limit: Of all solves together in [s].
            progress: Told at each iteration; returning False cancels, returning nothing does not.

        Raises:
            MissingDependencyError: the library of the back end is not installed.
        """
        self._settings, self._time_limit, self._progress = settings, time_limit, progress
        self._back_end = back_end(settings.back_end)
        self._begin = time.monotonic()
        self.verdict: Status | None = None
        self.iterations = 0
        self._last: Progress | None = None

    @property
    def options(self) -> SolveOptions:
        """Options of a solve from a start that may be far from a solution."""
        return SolveOptions(self._settings.tolerance, self._settings.maximum_iterations)

    @property
    def condenses(self) -> bool:
        """Whether near starts in single support are left to the condensed method."""
        return BACK_ENDS[self._settings.back_end].condenses

    @property
    def elapsed(self) -> float:
        """Time since the session began in [s]."""
        return time.monotonic() - self._begin

    @property
    def stopped(self) -> bool:
        """Whether the session was cancelled or is out of time."""
        return self.verdict is not None

    def solve(
        self,
        problem: Problem,
        start: FloatArray,
        stage: str,
        *,
        objective_unit: float,
        options: SolveOptions | None = None,
    ) -> Solution:
        """Solve one program of the session.

        Args:
            problem: The program, scaled.
            start: First iterate.
            stage: Name for the progress.
            objective_unit: What one unit of the scaled objective is, in [(N m)^2].
            options: Of the back end; by default those of the session.
        """
        monitor = self.monitor(stage, objective_unit)
        solution = self._back_end.solve(problem, start, options or self.options, monitor)
        self.iterations += solution.iterations
        return solution

    def monitor(self, stage: str, objective_unit: float) -> Monitor:
        """Return what a solve of the session tells its iterations; arguments as for `solve`."""

        def monitor(state: IterationState) -> Status | None:
            return self._watch(state, stage, objective_unit)

        return monitor

    def map(self, function: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
        """Return what a function of solves gives for each item, all processors working on them.

        Progress is told of this process's share. Once the session is stopped, the rest is left out.

        Args:
            function: May use this session; its results can be pickled.
            items: Independent of each other.
        """
        if self.stopped:
            return []
        iterations = self.iterations
        own = os.getpid()

        def work(number: int) -> tuple[_Result, int]:
            if os.getpid() != own:
                self._progress = None
            before = self.iterations
            result = function(items[number])
            return result, self.iterations - before

        shares = Shares(work, len(items))
        done = shares.done(processor_count(), lambda: self.stopped, lambda: self._asked(self.elapsed))
        for number in range(len(items)):
            if number not in done and not self.stopped:
                done[number] = work(number)  # of a fork that was lost
        self.iterations = iterations + sum(spent for _, spent in done.values())
        return [done[number][0] for number in sorted(done)]

    def _watch(self, state: IterationState, stage: str, objective_unit: float) -> Status | None:
        objective, now = state.objective * objective_unit, self.elapsed
        self._last = Progress(stage, state.iteration, objective, state.infeasibility, now)
        return self._asked(now)

    def _asked(self, now: float) -> Status | None:
        """Return the verdict, after a look at the clock and a question to the caller."""
        if self.verdict is None and now > self._time_limit:
            self.verdict = Status.TIME_LIMIT
        if self.verdict is None and not self._wanted():
            self.verdict = Status.CANCELLED
        return self.verdict

    def _wanted(self) -> bool:
        if self._progress is None or self._last is None:
            return True
        answer = self._progress(self._last)
        return answer is None or bool(answer)
