"""One request's solves: a common clock, cancelling and progress over all of its stages."""

import time

from walk_optimizer.solve.back_end import SolveOptions
from walk_optimizer.solve.registry import back_end
from walk_optimizer.solve.settings import SolverSettings
from walk_optimizer.solve.solution import FloatArray, IterationState, Solution
from walk_optimizer.solve.status import Progress, ProgressCallback, Status
from walk_optimizer.transcription.program import Problem


class SolveSession:
    """Runs solves until the time limit or a cancel; after that every solve ends at once."""

    def __init__(
        self, settings: SolverSettings, time_limit: float, progress: ProgressCallback | None
    ) -> None:
        """Start the clock.

        Args:
            settings: Of the solver.
            time_limit: Of all solves together in [s].
            progress: Told at each iteration; may cancel.

        Raises:
            MissingDependencyError: the library of the back end is not installed.
        """
        self._settings, self._time_limit, self._progress = settings, time_limit, progress
        self._back_end = back_end(settings.back_end)
        self._begin = time.monotonic()
        self.verdict: Status | None = None
        self.iterations = 0

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
        barrier: float | None = None,
        maximum_iterations: int | None = None,
        options: SolveOptions | None = None,
    ) -> Solution:
        """Solve one program of the session.

        Args:
            problem: The program, scaled.
            start: First iterate.
            stage: Name for the progress.
            objective_unit: What one unit of the scaled objective is, in [(N m)^2].
            barrier: First barrier parameter for a start that is close to a solution.
            maximum_iterations: By default the settings'.
            options: Of the back end, in place of the settings, the barrier and the limit.
        """

        def monitor(state: IterationState) -> Status | None:
            return self._watch(state, stage, objective_unit)

        if options is None:
            limit = maximum_iterations or self._settings.maximum_iterations
            options = SolveOptions(self._settings.tolerance, limit, barrier)
        solution = self._back_end.solve(problem, start, options, monitor)
        self.iterations += solution.iterations
        return solution

    def _watch(self, state: IterationState, stage: str, objective_unit: float) -> Status | None:
        if self.verdict is None and self.elapsed > self._time_limit:
            self.verdict = Status.TIME_LIMIT
        if self.verdict is None and self._progress is not None:
            objective = state.objective * objective_unit
            progress = Progress(stage, state.iteration, objective, state.infeasibility, self.elapsed)
            if not self._progress(progress):
                self.verdict = Status.CANCELLED
        return self.verdict
