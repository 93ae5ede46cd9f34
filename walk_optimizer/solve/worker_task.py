"""A job in the queue of the workers, and its clients' shares of it."""

import math
import time
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.solve.status import Progress, SolveReport, Status
from walk_optimizer.solve.worker_handle import WorkerHandle


class SolveStoppedError(SolveFailedError):
    """The worker process was stopped, or died, before it had an answer.

    Attributes:
        report: Status, and the statistics of the last iterate that was heard of.
    """

    def __init__(self, report: SolveReport) -> None:
        """Take message and status from the report."""
        super().__init__(report.message)
        self.report = report


class Ticket:
    """One client's share of a job.

    Attributes:
        future: Resolves to the function's result, or to SolveStoppedError or SolveFailedError.
    """

    def __init__(
        self,
        task: "Task",
        give_up: Callable[["Ticket"], None],
        on_progress: Callable[[Progress], None] | None,
    ) -> None:
        """Wait for a job; `give_up` ends that."""
        self.future: Future[Any] = Future()
        self.on_progress = on_progress
        self._task, self._give_up = task, give_up

    @property
    def progress(self) -> Progress:
        """Where the job stands now; its stage is `queued`, then `starting`, before the function tells one."""
        return self._task.standing()

    def cancel(self) -> None:
        """Give the job up at once; its process is killed unless another client waits for it too."""
        self._give_up(self)


class Task:
    """A job and everyone who waits for it.

    Attributes:
        job: For the function.
        time_limit: From the start of the job in [s].
        tickets: Those who wait.
        worker: That does it, or is to do it as soon as it is ready; None in the queue.
        handed_over: Whether the worker has got the job.
        begin: When it was queued, or then started.
    """

    def __init__(self, job: Hashable, time_limit: float) -> None:
        self.job, self.time_limit = job, time_limit
        self.tickets: list[Ticket] = []
        self.worker: WorkerHandle | None = None
        self.handed_over = False
        self.begin = self._heard = time.monotonic()
        self._progress = _silent("queued")

    def start(self, worker: WorkerHandle) -> None:
        """Note that a worker does the job from now on."""
        self.worker, self.begin = worker, time.monotonic()
        self._note(_silent("starting"))

    def tell(self, progress: Progress) -> None:
        """Pass progress on to everyone who waits."""
        self._note(progress)
        for ticket in tuple(self.tickets):
            if ticket.on_progress is not None:
                ticket.on_progress(progress)

    def standing(self) -> Progress:
        """Return the last progress, with the time that has passed since; in the queue none passes."""
        since = 0.0 if self.worker is None else time.monotonic() - self._heard
        return replace(self._progress, elapsed=self._progress.elapsed + since)

    def stopped(self, status: Status, message: str = "") -> SolveStoppedError:
        """Return the error that ends the task with a status; the message is the status's own by default."""
        report = SolveReport(
            status,
            message or status.sentence,
            back_end="",
            iterations=self._progress.iteration,
            solve_time=time.monotonic() - self.begin,
            objective=self._progress.objective,
        )
        return SolveStoppedError(report)

    def _note(self, progress: Progress) -> None:
        self._progress, self._heard = progress, time.monotonic()


def _silent(stage: str) -> Progress:
    """Return the progress of a job that has told none itself."""
    return Progress(stage, iteration=0, objective=math.nan, infeasibility=math.nan, elapsed=0.0)
