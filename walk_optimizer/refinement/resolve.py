"""Solves for a new speed from refined gaits of neighbouring speeds, without the report's grid.

The neighbours are interpolated on the finer one's mesh, which is close enough to the new optimum for a
few iterations, and mostly for the mesh to be fine enough: it is divided only if the certificate fails, or
if prices are known and tell that much torque is saved where bounds are left between the nodes.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import Gait, RefinedGait
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.refinement.mesh_adaptation import resampled, torque_saved
from walk_optimizer.refinement.solves import RefinedSolution, RefinedSolves, certified_refinement
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.transcription.layout import P
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints
from walk_optimizer.transcription.phases import phases_of

FloatArray = NDArray[np.float64]

# Part of the objective that a solution may save by leaving its bounds between the nodes.
_MOST_SAVED = 1e-3


def resolve(request: GaitRequest, neighbours: Sequence[Gait], session: SolveSession) -> RefinedGait | None:
    """Return the certified gait of a new speed; None where the neighbours do not lead to one.

    Each of its intervals is replayed; that its torques alone lead through the whole of an unstable step
    is not seen to (`shadowing`): it would take as long again.

    Args:
        request: Speed, step and spring mode.
        neighbours: Refined gaits of the same walker in single support: one, or two with speeds on
            either side.
        session: Clock, cancelling and progress.

    Raises:
        InvalidRequestError: there are not one or two neighbours, or they are not refined, or use
            other contacts than single support.
    """
    if not 1 <= len(neighbours) <= 2:
        raise InvalidRequestError(f"{len(neighbours)} neighbours given, expected one or two")
    refined = [_refined_of(gait) for gait in neighbours]
    meshes = [mesh_of(gait, one) for gait, one in zip(neighbours, refined, strict=True)]
    mesh = max(meshes, key=lambda one: one.intervals)
    guesses = [
        resampled(one.trajectory, one.spring, old, mesh) for one, old in zip(refined, meshes, strict=True)
    ]
    guess = _at_pace(_between(guesses[0], guesses[-1], _share(request, neighbours)), request.step_time)
    walker = neighbours[0].walker
    solves = RefinedSolves(request, walker, session)
    solution = solves.solved_nearby(mesh, guess)
    gait = certified_refinement(walker, request, solution)
    if gait is not None and not _saves_too_much(walker, request, solution):
        return gait
    return solves.certified(solves.adapted(solution)) or gait


def _saves_too_much(walker: WalkerParameters, request: GaitRequest, solution: RefinedSolution) -> bool:
    """Return whether a solution on a neighbour's mesh is known to leave its bounds at a profit."""
    if solution.trajectory is None or solution.prices is None:
        return False
    saved = torque_saved(walker, request.step_length, solution.trajectory, solution.prices)
    return saved > _MOST_SAVED


def continued(request: GaitRequest, neighbours: Sequence[Gait], session: SolveSession) -> RefinedGait | None:
    """Return the best certified gait that single neighbours lead to; None where none does.

    Args:
        request: Speed, step and spring mode.
        neighbours: Gaits of the same walker; those that are not refined, or use other contacts than
            single support, are left out.
        session: Clock, cancelling and progress.
    """
    fit = [one for one in neighbours if one.refined is not None and _is_single_support(one.refined)]
    found = session.map(lambda one: resolve(request, [one], session), fit)
    certified = (one for one in found if one is not None)
    return min(certified, key=lambda one: one.trajectory.torque_effort, default=None)


def _is_single_support(refined: RefinedGait) -> bool:
    trajectory = refined.trajectory
    return not (trajectory.impulses[1:].any() or trajectory.forces[:, :, 2:].any())


def _refined_of(gait: Gait) -> RefinedGait:
    """Return the accurate solution of a gait.

    Raises:
        InvalidRequestError: it has none.
    """
    if gait.refined is None:
        raise InvalidRequestError(f"the gait at {gait.speed:.4f} m/s is not refined; solve it again")
    return gait.refined


def mesh_of(gait: Gait, refined: RefinedGait) -> Mesh:
    """Return the mesh of a gait in single support.

    Raises:
        InvalidRequestError: it has other contacts.
    """
    if not _is_single_support(refined):
        raise InvalidRequestError(f"the gait at {gait.speed:.4f} m/s is not one of single support")
    trajectory = refined.trajectory
    return Mesh(
        phases_of(single_impact(gait.trajectory.points)), (trajectory.lengths / trajectory.step_time,)
    )


def _share(request: GaitRequest, neighbours: Sequence[Gait]) -> float:
    """Return where the new speed lies between two: 0 at the first, 1 at the second."""
    first, last = neighbours[0].request.speed, neighbours[-1].request.speed
    return 0.0 if first == last else float(np.clip((request.speed - first) / (last - first), 0.0, 1.0))


def _at_pace(points: RefinedPoints, step_time: float) -> RefinedPoints:
    """Return the same path walked in another time in [s]: momenta belong to the new velocities."""
    quicker = float(points.durations.sum()) / step_time
    states = points.states.copy()
    states[:, :, P] *= quicker
    return replace(
        points, states=states, durations=points.durations / quicker, impulses=points.impulses * quicker
    )


def _between(first: RefinedPoints, second: RefinedPoints, share: float) -> RefinedPoints:
    """Interpolate linearly between the values of two gaits on one mesh."""

    def mixed(one: FloatArray, other: FloatArray) -> FloatArray:
        return (1 - share) * one + share * other

    springs = [np.array([one.spring.stiffness, one.spring.equilibrium]) for one in (first, second)]
    stiffness, equilibrium = mixed(*springs)
    return RefinedPoints(
        states=mixed(first.states, second.states),
        torques=mixed(first.torques, second.torques),
        forces=mixed(first.forces, second.forces),
        durations=mixed(first.durations, second.durations),
        impulses=mixed(first.impulses, second.impulses),
        spring=KneeSpring(float(stiffness), float(equilibrium)),
    )
