"""Solves for the steps from one pace to another: first guess, adapted mesh, certificate."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import Certificate
from walk_optimizer.gait.refined_peaks import torque_peaks
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.refinement.mesh_adaptation import MeshErrors, resampled, trajectory_on
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import SolverSettings, solver_settings
from walk_optimizer.solve.status import FamilyViolation, ProgressCallback, SolveReport, Status
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints, even_mesh
from walk_optimizer.transcription.scaling import torque_unit
from walk_optimizer.transcription.transition import TransitionLimits, TransitionProblem
from walk_optimizer.transition.certificate import certify_steps
from walk_optimizer.transition.chain import end_in, steps_of
from walk_optimizer.transition.guess import faded_points
from walk_optimizer.transition.paces import (
    Pace,
    border_state,
    spring_of,
)
from walk_optimizer.transition.plan import contact_plan
from walk_optimizer.transition.settings import TransitionSettings, transition_settings
from walk_optimizer.transition.standing import Standing
from walk_optimizer.transition.torque_limit import TorqueLimit, each_torque, hip_and_knee
from walk_optimizer.transition.transition import Transition, TransitionOutcome

FloatArray = NDArray[np.float64]

# Barrier parameters for a start from a faded guess, and from a coarser mesh.
_FIRST_BARRIER, _NEXT_BARRIER = 1e-3, 1e-5
_FEWEST_INTERVALS = 4
_ROUNDS = 5
# A bound at the nodes that is lowered, since torques are higher between them, is lowered so much further.
_TORQUE_MARGIN = 1e-3
# On level ground the length of treads plays no part.
_ANY_TREAD = 1.0


def plan_transition(
    walker: WalkerParameters,
    source: Pace,
    target: Pace,
    *,
    steps: int | None = None,
    torque_limit: TorqueLimit = np.inf,
    settings: TransitionSettings | None = None,
    solver: SolverSettings | None = None,
    time_limit: float | None = None,
    progress: ProgressCallback | None = None,
) -> TransitionOutcome:
    """Solve for the steps of least torque from one pace to another.

    Args:
        walker: The walker.
        source: The gait or stand that is left.
        target: The gait or stand that is reached; one of both is a gait.
        steps: Number of steps; None means that of the settings, and one more where that has no solution.
        torque_limit: Largest magnitude of each torque in [N m], between the nodes of the solve too; or that
            of the hips and that of the knees.
        settings: Of steps; the packaged ones by default.
        solver: Settings of the solver; the packaged ones by default.
        time_limit: In [s], above 0; the solver settings' by default.
        progress: Called at every iteration; returning False cancels the solve.

    Returns:
        The transition and the report. A solve that fails gives none and raises nothing.

    Raises:
        InvalidRequestError: the request makes no sense whatever is computed; says why.
    """
    settings, solver = settings or transition_settings(), solver or solver_settings()
    limit = solver.time_limit if time_limit is None else time_limit
    _check(walker, source, target, steps, torque_limit, limit, settings)
    session = SolveSession(solver, limit, progress)
    request = _Request(walker, source, target, torque_limit, settings, solver.back_end)
    numbers = (steps,) if steps else range(settings.steps, min(settings.steps + 1, settings.most_steps) + 1)
    for number in numbers:
        outcome = _Solve(request, number, session).run()
        if outcome.transition is not None or session.stopped:
            break
    return outcome


@dataclass(frozen=True, eq=False)
class _Request:
    """What was asked for."""

    walker: WalkerParameters
    source: Pace
    target: Pace
    torque_limit: TorqueLimit
    settings: TransitionSettings
    back_end: str

    @property
    def spring(self) -> KneeSpring:
        """The target's spring; on the way to a stand the source's."""
        return spring_of(self.source if isinstance(self.target, Standing) else self.target)


def _check(
    walker: WalkerParameters,
    source: Pace,
    target: Pace,
    steps: int | None,
    torque_limit: TorqueLimit,
    time_limit: float,
    settings: TransitionSettings,
) -> None:
    """Raise InvalidRequestError for a request that makes no sense."""
    if not walker.terrain.is_flat:
        raise InvalidRequestError("transitions are solved on level ground, the walker's terrain is not level")
    if isinstance(source, Standing) and isinstance(target, Standing):
        raise InvalidRequestError("a transition needs a gait at one of its ends, both are stands")
    for pace in (source, target):
        if pace.walker != walker:
            raise InvalidRequestError("source and target must be for the walker of the transition")
        spring_of(pace)
    if steps is not None and not (isinstance(steps, int) and 1 <= steps <= settings.most_steps):
        raise InvalidRequestError(f"steps is {steps!r}, allowed is 1 to {settings.most_steps}")
    hip_and_knee(torque_limit)
    if not time_limit > 0:
        raise InvalidRequestError(f"time limit is {time_limit} s, allowed is above 0")


class _Solve:
    """One number of steps."""

    def __init__(self, request: _Request, steps: int, session: SolveSession) -> None:
        self.request, self.session = request, session
        self.walker, self.spring = request.walker, request.spring
        self.plan = contact_plan(request.source, request.target, steps)
        self.phases = tuple(len(phases) for phases in self.plan.steps)
        settings = request.settings
        self.torque_limit = each_torque(request.torque_limit)
        self.limits = TransitionLimits(self.torque_limit, settings.shortest_step, settings.longest_step)
        self.end = end_in(request.target, self.plan)

    def run(self) -> TransitionOutcome:
        """Return the transition on a mesh fine enough for its error and its certificate."""
        mesh = even_mesh(self.plan.steps, _FEWEST_INTERVALS)
        points = faded_points(self.plan, mesh, self.request.source, self.request.target, self.spring)
        barrier, rounds = _FIRST_BARRIER, 0
        while True:
            status, points = self._solved(mesh, points, barrier)
            trajectory = trajectory_on(mesh, points)
            if status is not Status.SOLVED:
                return self._outcome(status, mesh, trajectory)
            errors = MeshErrors.of(self.walker, _ANY_TREAD, self.spring, trajectory)
            barrier = _NEXT_BARRIER
            if errors.met and self._tightened(trajectory):
                continue
            rounds += 1
            if errors.met or rounds == _ROUNDS:
                outcome = self._outcome(status, mesh, trajectory)
                if outcome.transition is not None or rounds == _ROUNDS:
                    return outcome
            finer = errors.halved(mesh) if errors.met else errors.divided(mesh)
            points = resampled(trajectory, self.spring, mesh, finer)
            mesh = finer

    def _tightened(self, trajectory: RefinedTrajectory) -> bool:
        """Lower the bounds at the nodes of those torques that exceed their limit between these.

        Returns:
            Whether there are any.
        """
        peaks = torque_peaks(trajectory)
        exceeding = peaks > self.torque_limit
        if not exceeding.any():
            return False
        torque = self.limits.torque.copy()
        torque[exceeding] *= (self.torque_limit / peaks * (1 - _TORQUE_MARGIN))[exceeding]
        self.limits = replace(self.limits, torque=torque)
        return True

    def _solved(self, mesh: Mesh, points: RefinedPoints, barrier: float) -> tuple[Status, RefinedPoints]:
        """Solve on a mesh from a start; return how it ended and where."""
        problem = TransitionProblem(
            self.walker,
            mesh,
            self.phases,
            border_state(self.request.source),
            self.end,
            self.spring,
            self.limits,
        )
        unit = torque_unit(self.walker) ** 2
        options = replace(self.session.options, barrier=barrier)
        solution = self.session.solve(
            problem.problem(), problem.pack(points), "transition", objective_unit=unit, options=options
        )
        return solution.status, problem.unpack(solution.x)

    def _outcome(self, status: Status, mesh: Mesh, trajectory: RefinedTrajectory) -> TransitionOutcome:
        """Return the certified steps, or the report of why there are none."""
        request = self.request
        bare = steps_of(self.walker, self.spring, trajectory, mesh, self.phases)
        steps, certificate = certify_steps(
            self.walker,
            request.source,
            request.target,
            bare,
            request.torque_limit,
            replay=status is Status.SOLVED,
        )
        if status is Status.SOLVED and not certificate.certified:
            status = Status.NOT_CERTIFIED
        status = self.session.verdict or status
        report = self._report(status, certificate, trajectory.torque_effort)
        if status is not Status.SOLVED:
            return TransitionOutcome(None, report)
        transition = Transition(
            self.walker, request.source, request.target, steps, request.torque_limit, certificate
        )
        return TransitionOutcome(transition, report)

    def _report(self, status: Status, certificate: Certificate, effort: float) -> SolveReport:
        remarks = [status.sentence.replace("gait", "transition")]
        if status not in (Status.SOLVED, Status.CANCELLED) and not certificate.worst.met:
            remarks.append(str(certificate.worst))
        return SolveReport(
            status,
            "; ".join(remarks),
            self.request.back_end,
            start=f"faded, {len(self.phases)} steps",
            starts=1,
            iterations=self.session.iterations,
            solve_time=self.session.elapsed,
            objective=effort if status is Status.SOLVED else np.nan,
            violations=tuple(
                FamilyViolation(one.family, one.violation, one.unit) for one in certificate.entries
            ),
        )
