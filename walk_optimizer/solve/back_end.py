"""What a solver of nonlinear programs is to the rest: options in, a solution out."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from walk_optimizer.solve.solution import FloatArray, Monitor, Solution
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.program import Problem


@dataclass(frozen=True)
class SolveOptions:
    """Options of one solve.

    Attributes:
        tolerance: Scaled optimality error to reach.
        maximum_iterations: Iteration limit.
        barrier: First barrier parameter for a start that is close to a solution, which is then left
            near its bounds; None for a start that may be far from one. Methods without a barrier
            take no notice of it.
    """

    tolerance: float = 1e-9
    maximum_iterations: int = 500
    barrier: float | None = None


class BackEnd(Protocol):
    """A module of a solver family."""

    def solve(
        self, problem: Problem, start: FloatArray, options: SolveOptions, monitor: Monitor | None = None
    ) -> Solution:
        """Solve a program from a start.

        Args:
            problem: The program, scaled.
            start: First iterate, same shape as x.
            options: Of this solve.
            monitor: Told how the solve goes, may stop it; what it raises is raised here.
        """


def refused_start(start: FloatArray) -> Solution | None:
    """Return the end of a solve whose start is not finite; None for every other start."""
    if np.all(np.isfinite(start)):
        return None
    return Solution(Status.EVALUATION_ERROR, start, np.nan, np.inf, 0, "the first guess is not finite")


def ended(problem: Problem, x: FloatArray, status: Status, iterations: int, detail: str) -> Solution:
    """Return the solution at x, whose objective and infeasibility are computed here, not by the solver."""
    g = np.asarray(problem.nlp.jacobian(x, problem.parameters)[0]).ravel()
    objective = float(problem.nlp.gradient(x, problem.parameters)[0])
    return Solution(status, x, objective, problem.infeasibility(x, g), iterations, detail)
