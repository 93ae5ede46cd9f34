"""Transitions as jobs of a worker process: the solved ones of the table, or solved now and put there."""

import os
from dataclasses import dataclass
from pathlib import Path

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import RefinedGait
from walk_optimizer.solve.status import ProgressCallback
from walk_optimizer.transition.paces import Pace
from walk_optimizer.transition.solve import plan_transition
from walk_optimizer.transition.table import TransitionTable
from walk_optimizer.transition.torque_limit import TorqueLimit, exceeds, hip_and_knee

# Of the worker: what runs beside it, above all a stream of references, goes first.
_NICENESS = 10
# Torques below this part of a limit are not held back by it.
_FREE = 0.95


@dataclass(frozen=True, eq=False)
class TransitionJob:
    """A request as it travels to a worker process.

    Attributes:
        source: What is left.
        target: What is reached.
        torque_limit: Largest torque in [N m], or that of the hips and that of the knees; may be infinite.
        time_limit: In [s].
        folder: Where transitions that are solved are kept; None for the user's cache.
    """

    source: Pace
    target: Pace
    torque_limit: TorqueLimit
    time_limit: float
    folder: Path | None


@dataclass(frozen=True, eq=False)
class TransitionAnswer:
    """What a job led to.

    Attributes:
        steps: The certified steps; empty where there are none.
        message: How the solve went.
        problem: Why solved steps could not be kept or used; empty if they could.
    """

    steps: tuple[RefinedGait, ...]
    message: str
    problem: str = ""


def transition_job(job: TransitionJob, progress: ProgressCallback) -> TransitionAnswer:
    """Do a job in the worker process."""
    os.setpriority(os.PRIO_PROCESS, 0, _NICENESS)
    return planned(job, progress)


def planned(job: TransitionJob, progress: ProgressCallback | None = None) -> TransitionAnswer:
    """Return solved steps of the table, or solve and keep them."""
    table, missing = _table(job)
    known = table.find(job.source, job.target, job.torque_limit)
    if known is not None:
        return TransitionAnswer(known.steps, "from the table", missing)
    outcome = plan_transition(
        job.source.walker,
        job.source,
        job.target,
        torque_limit=job.torque_limit,
        time_limit=job.time_limit,
        progress=progress,
    )
    problems = [*filter(None, [missing]), *table.problems()]
    if outcome.transition is None:
        return TransitionAnswer((), outcome.report.message, "; ".join(problems))
    # A file is named by its paces alone, so only steps that are an optimum without the limit too are kept.
    hip, knee = hip_and_knee(job.torque_limit)
    if not missing and not exceeds(outcome.transition.steps, (_FREE * hip, _FREE * knee)):
        try:
            table.store(outcome.transition)
        except GaitFileError as error:
            problems.append(str(error))
    return TransitionAnswer(outcome.transition.steps, outcome.report.message, "; ".join(problems))


def _table(job: TransitionJob) -> tuple[TransitionTable, str]:
    """Return the table of a job, and why it lacks the job's folder; empty if it does not.

    A folder that is removed while something walks must not end that: what ships still serves.
    """
    try:
        return TransitionTable(job.source.walker, job.folder), ""
    except GaitFileError as error:
        return TransitionTable(job.source.walker), str(error)
