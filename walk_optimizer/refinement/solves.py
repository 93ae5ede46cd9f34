"""Solves of the refined problem of a request: on one mesh, on adapted ones, with a certificate."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.condensed.solve import solve_condensed
from walk_optimizer.gait import Certificate, RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.mechanics import foot_2_ahead
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.refinement.mesh_adaptation import MeshErrors, resampled, trajectory_on
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints
from walk_optimizer.transcription.phases import is_single_support
from walk_optimizer.transcription.refined import RefinedProblem
from walk_optimizer.transcription.scaling import torque_unit

FloatArray = NDArray[np.float64]

_STAGE = "refinement"
_ROUNDS = 10
# Further halvings where each interval is accurate enough, but not all of them together.
_FINER_ROUNDS = 2
# Single support needs up to 70 iterations from the report's grid.
MOST_ITERATIONS = 200
# Barrier parameter for a start from the report's grid, or from another refined solution.
BARRIER = 1e-5


@dataclass(frozen=True, eq=False)
class RefinedSolution:
    """What a refinement led to.

    Attributes:
        status: How its last solve ended.
        mesh: Phases and intervals.
        trajectory: The step; None unless it was solved.
        spring: K and q_eq.
        local_error: Largest error of an interval in [rad] or [m]; infinite before it is estimated.
        met: Whether the mesh is fine enough for the error.
        prices: What it would save to leave bounds, see `torque_saved`; None where that is not known.
    """

    status: Status
    mesh: Mesh
    trajectory: RefinedTrajectory | None
    spring: KneeSpring
    local_error: float = np.inf
    met: bool = False
    prices: FloatArray | None = None

    @property
    def effort(self) -> float:
        """Integral of 1/2 |u|^2 dt in [(N m)^2 s]; infinite without a solution."""
        return np.inf if self.trajectory is None else self.trajectory.torque_effort


def certified_refinement(
    walker: WalkerParameters, request: GaitRequest, solution: RefinedSolution
) -> RefinedGait | None:
    """Return a solution with its certificate; None where there is none or it fails."""
    if solution.trajectory is None:
        return None
    step_length = foot_2_ahead(walker, solution.trajectory.states[-1, -1])
    bare = RefinedGait(solution.trajectory, solution.spring, step_length, Certificate(()))
    certificate = certify_refined(walker, request, bare)
    return replace(bare, certificate=certificate) if certificate.certified else None


class RefinedSolves:
    """The solves of the refined problem of a request."""

    def __init__(self, request: GaitRequest, walker: WalkerParameters, session: SolveSession) -> None:
        """Prepare.

        Args:
            request: Speed, step and spring mode.
            walker: The walker.
            session: Clock, cancelling and progress.
        """
        self.request, self.walker, self.session = request, walker, session
        self._condenses = session.condenses

    def adapted(self, solution: RefinedSolution) -> RefinedSolution:
        """Return a solution on a mesh that is divided until its error is small, or whatever fails there."""
        best = solution
        for _ in range(_ROUNDS):
            mesh, trajectory = best.mesh, best.trajectory
            if trajectory is None:
                return best
            errors = MeshErrors.of(self.walker, self.request.step_length, best.spring, trajectory)
            best = replace(best, local_error=float(errors.local.max()))
            if errors.met:
                return replace(best, met=True)
            finer = errors.divided(mesh)
            best = self.solved_nearby(finer, resampled(trajectory, best.spring, mesh, finer))
        return best

    def certified(self, solution: RefinedSolution) -> RefinedGait | None:
        """Return an adapted solution with its certificate; None where there is none, also on finer meshes."""
        gait = certified_refinement(self.walker, self.request, solution)
        for _ in range(_FINER_ROUNDS):
            if gait is not None or solution.trajectory is None or not solution.met:
                break
            solution = self.adapted(self._on_halves(solution.mesh, solution.trajectory, solution.spring))
            gait = certified_refinement(self.walker, self.request, solution)
        return gait

    def _on_halves(self, mesh: Mesh, trajectory: RefinedTrajectory, spring: KneeSpring) -> RefinedSolution:
        """Return the solution on a mesh whose less accurate intervals are halved."""
        finer = MeshErrors.of(self.walker, self.request.step_length, spring, trajectory).halved(mesh)
        return self.solved_nearby(finer, resampled(trajectory, spring, mesh, finer))

    def solved_nearby(self, mesh: Mesh, points: RefinedPoints) -> RefinedSolution:
        """Return the solution on one mesh from a start that is near it, condensed where that can be done.

        Args:
            mesh: Phases and intervals.
            points: First guess.
        """
        if self._condenses and is_single_support(mesh.phases):
            monitor = self.session.monitor(_STAGE, self._objective_unit)
            lengths = mesh.lengths(points.durations)
            tolerance = self.session.options.tolerance
            found = solve_condensed(self.request, self.walker, lengths, points, tolerance, monitor)
            self.session.iterations += found.iterations
            if found.points is not None:
                trajectory, spring = trajectory_on(mesh, found.points), found.points.spring
                return RefinedSolution(found.status, mesh, trajectory, spring, prices=found.prices)
            if self.session.stopped:
                return RefinedSolution(found.status, mesh, None, points.spring)
            self._condenses = False  # nor would it come to an end on finer meshes
        return self.solved(mesh, points)

    @property
    def _objective_unit(self) -> float:
        return float(torque_unit(self.walker)) ** 2 / self.request.interval

    def solved(
        self, mesh: Mesh, points: RefinedPoints, most_iterations: int = MOST_ITERATIONS
    ) -> RefinedSolution:
        """Return the solution on one mesh.

        Args:
            mesh: Phases and intervals.
            points: First guess.
            most_iterations: Iteration limit.
        """
        refined = RefinedProblem(self.request, self.walker, mesh)
        options = replace(self.session.options, barrier=BARRIER, maximum_iterations=most_iterations)
        solution = self.session.solve(
            refined.problem(),
            refined.pack(points),
            _STAGE,
            objective_unit=self._objective_unit,
            options=options,
        )
        if not solution.solved:
            return RefinedSolution(solution.status, mesh, None, points.spring)
        found = refined.unpack(solution.x)
        return RefinedSolution(Status.SOLVED, mesh, trajectory_on(mesh, found), found.spring)
