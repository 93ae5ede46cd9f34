"""One of the solves that lead from a relaxed problem to the tight one."""

from dataclasses import dataclass

from walk_optimizer.solve.status import Status


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
