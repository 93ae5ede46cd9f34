"""Refines a gait of the report's grid: Radau collocation on a mesh adapted to an error estimate."""

from walk_optimizer.certificate.shadowing import with_replayable_start
from walk_optimizer.gait import Gait, RefinedGait
from walk_optimizer.refinement.first_guess import FEWEST_INTERVALS, FirstGuess
from walk_optimizer.refinement.solves import MOST_ITERATIONS, RefinedSolution, RefinedSolves
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.mesh import Mesh, even_mesh, without_vanished
from walk_optimizer.transcription.phases import is_single_support

# Contact phases that the continuous problem does not have never converge, and take three times as long an
# iteration as single support.
_MOST_ITERATIONS_OF_OTHER_PHASES = 120


def refined_gait(gait: Gait, session: SolveSession) -> RefinedGait | None:
    """Return the certified refinement of a gait; None where there is none.

    Args:
        gait: The gait on the report's grid.
        session: Clock, cancelling and progress.
    """
    refined = RefinedSolves(gait.request, gait.walker, session).certified(refine(gait, session))
    return None if refined is None else with_replayable_start(gait.walker, gait.request, refined)


def refine(gait: Gait, session: SolveSession) -> RefinedSolution:
    """Return the accurate solution with the contact phases of a gait.

    Args:
        gait: The gait on the report's grid: it gives phases and first guess.
        session: Clock, cancelling and progress.
    """
    solves = RefinedSolves(gait.request, gait.walker, session)
    first = FirstGuess(gait)
    meshes = first.meshes()
    solutions = session.map(lambda mesh: _begun(solves, first, mesh), meshes)
    if not solutions:
        return RefinedSolution(session.verdict or Status.TIME_LIMIT, meshes[0], None, gait.spring)
    best, *others = sorted(solutions, key=lambda one: one.effort)
    adapted = solves.adapted(best)
    while not adapted.met and others and not session.stopped:
        adapted = solves.adapted(others.pop(0))
    return adapted


def _begun(solves: RefinedSolves, first: FirstGuess, mesh: Mesh) -> RefinedSolution:
    """Return the solution on an initial mesh, solved again without phases that shrink to nothing."""
    limit = MOST_ITERATIONS if is_single_support(mesh.phases) else _MOST_ITERATIONS_OF_OTHER_PHASES
    solution = solves.solved(mesh, first.points(mesh), limit)
    if solution.trajectory is None:
        return solution
    lasting = without_vanished(mesh, solution.trajectory.breaks)
    if lasting == mesh.phases:
        return solution
    mesh = even_mesh([lasting], FEWEST_INTERVALS)
    return solves.solved(mesh, first.points(mesh))
