"""Solves a problem with complementarity from far away: relaxed at first, then tighter and tighter.

[Scholtes2001]: with each product a b bounded by a large number, contact forces act across gaps, so that
the solver learns where a contact helps; the bound then falls to nothing, and so do such forces.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.solution import FloatArray
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.program import Problem

# Bounds on the scaled products, one solve each.
RELAXATIONS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
# The same for a start whose contacts are about right.
LAST_RELAXATIONS = RELAXATIONS[3:]
# Each solve after the first begins with a barrier parameter of this part of its predecessor's bound.
_BARRIER_PART = 0.1
_LARGEST_BARRIER = 1e-3


@dataclass(frozen=True)
class RelaxedSolve:
    """One of the solves.

    Attributes:
        relaxation: Bound on the scaled products.
        status: How it ended.
        iterations: Its number of iterations.
        objective: Scaled objective where it ended.
    """

    relaxation: float
    status: Status
    iterations: int
    objective: float


def follow_relaxation(
    problem_at: Callable[[float], Problem],
    start: FloatArray,
    session: SolveSession,
    objective_unit: float,
    relaxations: Sequence[float] = RELAXATIONS,
) -> tuple[FloatArray, tuple[RelaxedSolve, ...]]:
    """Return the last iterate, and what each solve did. One that fails still starts the next.

    Args:
        problem_at: The problem for a bound on the scaled products; all have the same program.
        start: First iterate, scaled.
        session: Clock, cancelling and progress.
        objective_unit: What one unit of the scaled objective is.
        relaxations: Bounds on the scaled products, one solve each.
    """
    x, solves, barrier = start, [], None
    for relaxation in relaxations:
        problem = problem_at(relaxation)
        stage = f"products below {relaxation:.0e}"
        options = replace(session.options, barrier=barrier)
        solution = session.solve(problem, x, stage, objective_unit=objective_unit, options=options)
        solves.append(RelaxedSolve(relaxation, solution.status, solution.iterations, solution.objective))
        x, barrier = solution.x, min(_BARRIER_PART * relaxation, _LARGEST_BARRIER)
    return x, tuple(solves)
