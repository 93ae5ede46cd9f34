"""Solves a problem with complementarity from far away: relaxed at first, then tighter and tighter.

[Scholtes2001]: with each product a b bounded by a large number, contact forces act across gaps, so that
the solver learns where a contact helps; the bound then falls to nothing, and so do such forces.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol, TypeVar

from walk_optimizer.examples.finding import Finding
from walk_optimizer.examples.relaxed_solve import RelaxedSolve
from walk_optimizer.solve.back_end import SolveOptions
from walk_optimizer.solve.ipopt import IpoptOptions, far_strategy
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.solution import FloatArray
from walk_optimizer.transcription.program import Problem

# Bounds on the scaled products, one solve each.
_RELAXATIONS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
# Those that a start whose contacts are about right leaves out.
_LOOSE = 3
# First barrier parameters: with a small one the solver stays near the guess, with a large one it forgets it.
_BARRIERS = (1e-3, 1e-1)
# Each solve after the first begins with a barrier parameter of this part of its predecessor's bound.
_BARRIER_PART = 0.1
_LARGEST_BARRIER = 1e-3


@dataclass(frozen=True)
class Way:
    """How the problem is followed from a start.

    Attributes:
        relaxations: Bounds on the scaled products, one solve each.
        barrier: First barrier parameter of the first solve.
    """

    relaxations: tuple[float, ...]
    barrier: float

    @property
    def last(self) -> "Way":
        """The same for a start whose contacts are about right."""
        return replace(self, relaxations=_RELAXATIONS[_LOOSE:])

    def first_options(self, options: SolveOptions) -> SolveOptions:
        """Return the options of the first solve."""
        further = tuple(far_strategy(self.barrier).items())
        return IpoptOptions(options.tolerance, options.maximum_iterations, further=further)


WAYS = tuple(Way(_RELAXATIONS[skipped:], barrier) for skipped, barrier in product((0, 1), _BARRIERS))


class Motion(Protocol):
    """What a way leads to."""

    @property
    def finding(self) -> Finding:
        """Its contacts and residuals."""


_Motion = TypeVar("_Motion", bound=Motion)


def best_of_ways(found: Callable[[Way], _Motion]) -> _Motion:
    """Return the best motion that the ways lead to: complementarity is no global search.

    Args:
        found: What a way leads to.
    """
    return min(map(found, WAYS), key=lambda motion: motion.finding.rank)


def follow_relaxation(
    problem_at: Callable[[float], Problem],
    start: FloatArray,
    session: SolveSession,
    objective_unit: float,
    way: Way,
) -> tuple[FloatArray, tuple[RelaxedSolve, ...]]:
    """Return the last iterate, and what each solve did. One that fails still starts the next.

    Args:
        problem_at: The problem for a bound on the scaled products; all have the same program.
        start: First iterate, scaled.
        session: Clock, cancelling and progress.
        objective_unit: What one unit of the scaled objective is.
        way: How tightly the products are bounded, and how the first solve begins.
    """
    x, solves, options = start, [], way.first_options(session.options)
    for relaxation in way.relaxations:
        problem = problem_at(relaxation)
        stage = f"products below {relaxation:.0e}"
        solution = session.solve(problem, x, stage, objective_unit=objective_unit, options=options)
        solves.append(RelaxedSolve(relaxation, solution.status, solution.iterations, solution.objective))
        x, barrier = solution.x, min(_BARRIER_PART * relaxation, _LARGEST_BARRIER)
        options = replace(session.options, barrier=barrier)
    return x, tuple(solves)
