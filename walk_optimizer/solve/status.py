"""How a solve ended, as values."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum


class Status(StrEnum):
    """How a solve ended. Only `SOLVED` is a success."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    ITERATION_LIMIT = "iteration_limit"
    TIME_LIMIT = "time_limit"
    CANCELLED = "cancelled"
    ACCEPTABLE_ONLY = "acceptable_only"
    EVALUATION_ERROR = "evaluation_error"
    SOLVER_ERROR = "solver_error"
    NOT_CERTIFIED = "not_certified"
    WORKER_LOST = "worker_lost"

    @property
    def sentence(self) -> str:
        """What the status means, for people."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.SOLVED: "converged to an optimum",
    Status.INFEASIBLE: "no gait meets all constraints near the starts that were tried",
    Status.ITERATION_LIMIT: "stopped at the iteration limit before it converged",
    Status.TIME_LIMIT: "stopped at the time limit before it converged",
    Status.CANCELLED: "cancelled by the caller",
    Status.ACCEPTABLE_ONLY: "met only loose tolerances; that is not counted as solved",
    Status.EVALUATION_ERROR: "the model gave values that are not finite",
    Status.SOLVER_ERROR: "the solver gave up for a reason of its own",
    Status.NOT_CERTIFIED: "converged, but the independent certificate found a violation",
    Status.WORKER_LOST: "the worker process ended before it answered; ask again",
}


@dataclass(frozen=True)
class FamilyViolation:
    """Largest violation of a constraint family.

    Attributes:
        family: Name of the family, e.g. `dynamics`.
        violation: Largest violation in `unit`.
        unit: Physical unit.
    """

    family: str
    violation: float
    unit: str

    @property
    def amount(self) -> str:
        """The violation with its unit for a sentence: `79.7 N or N m`, where a family has rows of both."""
        return f"{self.violation:.3g} {self.unit.replace(', ', ' or ')}"


@dataclass(frozen=True)
class SolveReport:
    """What a solve did, good or bad.

    Attributes:
        status: How it ended.
        message: The same for people.
        back_end: Solver that was used.
        start: First guess whose solution was kept.
        starts: Number of first guesses tried.
        iterations: Over all stages.
        solve_time: Wall time in [s].
        objective: F in [(N m)^2].
        violations: Largest violation of each constraint family.
    """

    status: Status
    message: str
    back_end: str
    start: str = ""
    starts: int = 0
    iterations: int = 0
    solve_time: float = 0.0
    objective: float = float("nan")
    violations: tuple[FamilyViolation, ...] = field(default=())


@dataclass(frozen=True)
class Progress:
    """Where a running solve stands.

    Attributes:
        stage: Name of the stage, e.g. `fixed_schedule`.
        iteration: Iteration of the stage.
        objective: F in [(N m)^2].
        infeasibility: Largest constraint violation, scaled.
        elapsed: Time since the solve began in [s].
    """

    stage: str
    iteration: int
    objective: float
    infeasibility: float
    elapsed: float


# Called at every iteration; False asks the solve to stop, None does not.
ProgressCallback = Callable[[Progress], bool | None]
