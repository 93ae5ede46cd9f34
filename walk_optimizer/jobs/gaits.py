"""Gaits solved in worker processes: what the optimiser does, made cancellable."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.library.warm_start import optimize_from
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import Outcome
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.status import Progress, ProgressCallback, SolveReport, Status
from walk_optimizer.solve.worker import WorkerPool
from walk_optimizer.solve.worker_task import SolveStoppedError, Ticket


@dataclass(frozen=True)
class GaitJob:
    """A request as it travels to a worker process.

    Attributes:
        request: What is asked for.
        walker: The walker.
        time_limit: In [s].
    """

    request: GaitRequest
    walker: WalkerParameters
    time_limit: float


def solve_job(job: GaitJob, progress: ProgressCallback) -> Outcome:
    """Solve a job, in the worker process."""
    library = GaitLibrary(job.walker)
    return optimize_from(library, job.request, job.walker, time_limit=job.time_limit, progress=progress)


def submit_gait(
    pool: WorkerPool, job: GaitJob, on_progress: Callable[[Progress], None] | None = None
) -> Ticket:
    """Queue a job of a pool of `solve_job`; `outcome_of` reads its future.

    Raises:
        BusyError: the queue is full.
    """
    return pool.submit(job, job.time_limit, on_progress)


def outcome_of(future: "Future[Outcome]") -> Outcome:
    """Return what a finished future says; a solve that was stopped or failed is an outcome as well."""
    try:
        return future.result()
    except SolveStoppedError as error:
        return Outcome(None, error.report)
    except SolveFailedError as error:
        return Outcome(None, SolveReport(Status.SOLVER_ERROR, str(error), back_end=""))
