"""The pipeline: first guesses, fixed contact schedule, complementarity, certificate.

Kinematic guesses are solved with plain single support on a coarse grid; the best distinct optima go
on to the requested grid with each contact family. The best of all starts the complementarity
problem, which is free to find other contacts. Its contact phases are then solved once more on an
accurate grid, where the refinements of neighbouring gaits are continued too.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

from walk_optimizer.certificate.grid import certify, landing_distance
from walk_optimizer.certificate.shadowing import with_replayable_start
from walk_optimizer.contact.schedule import CONTACT_FAMILIES
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import Certificate, CertificateEntry, Gait, Trajectory
from walk_optimizer.guess.kinematic import Start
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer.search import Candidate, Search, distinct
from walk_optimizer.refinement.refine import refined_gait
from walk_optimizer.refinement.resolve import continued
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import SolverSettings, solver_settings
from walk_optimizer.solve.status import FamilyViolation, ProgressCallback, SolveReport, Status

# A residual of more than so many tolerances is not merely short of convergence.
_FAR = 1000.0
# Refinements whose efforts agree to this relative difference are taken for one: so much is due to meshes.
_SAME_EFFORT = 1e-3


@dataclass(frozen=True)
class Outcome:
    """What a request led to.

    Attributes:
        gait: The gait; None unless it was solved and certified.
        report: How the search went.
        others: Certified gaits of other optima that were met, best first, without the accurate solution; none
            unless they were asked for.
    """

    gait: Gait | None
    report: SolveReport
    others: tuple[Gait, ...] = ()


def optimize(
    request: GaitRequest,
    walker: WalkerParameters,
    *,
    settings: SolverSettings | None = None,
    time_limit: float | None = None,
    progress: ProgressCallback | None = None,
    seeds: Sequence[Gait] = (),
    from_scratch: bool = True,
    refine: bool = True,
    others: bool = False,
) -> Outcome:
    """Solve for the gait of least torque.

    Args:
        request: Speed, step, spring mode and grid.
        walker: The walker.
        settings: Of the search; the packaged ones by default.
        time_limit: In [s], above 0; the settings' by default.
        progress: Called at every iteration; returning False cancels the solve.
        seeds: Gaits of neighbouring requests to continue from.
        from_scratch: Whether to search from kinematic guesses too.
        refine: Whether to add the accurate solution on a collocation grid.
        others: Whether to certify the other optima that are met, too.

    Returns:
        The gait and the report. A solve that fails gives no gait and raises nothing. A time limit that
        interrupts the search for other contacts, or the refinement, gives the gait found before.

    Raises:
        InvalidRequestError: the time limit is not above 0, or there is nothing to start from.
    """
    settings = settings or solver_settings()
    limit = settings.time_limit if time_limit is None else time_limit
    if not limit > 0:
        raise InvalidRequestError(f"time limit is {limit} s, allowed is above 0")
    if not (from_scratch or seeds):
        raise InvalidRequestError("nothing to start from: give seeds, or search from scratch")
    session = SolveSession(settings, limit, progress)
    outcome = _Pipeline(request, walker, settings, session).run(seeds, from_scratch, others)
    if outcome.gait is None or session.stopped or not refine:
        return outcome
    return replace(with_refinement(outcome.gait, session, seeds), others=outcome.others)


def with_refinement(gait: Gait, session: SolveSession, seeds: Sequence[Gait] = ()) -> Outcome:
    """Return the outcome of a solved gait with its refinement, which the time limit may prevent.

    Args:
        gait: The gait on the report's grid.
        session: Clock, cancelling and progress.
        seeds: Gaits of neighbouring requests, whose refinements may lead to a better one.
    """
    refined = refined_gait(gait, session)
    refined = with_continuation(replace(gait, refined=refined), seeds, session).refined
    report = replace(gait.report, iterations=session.iterations, solve_time=session.elapsed)
    if session.verdict is Status.CANCELLED:
        return Outcome(None, replace(report, status=session.verdict, message=session.verdict.sentence))
    if session.stopped:
        report = replace(report, message=f"{report.message}; the time limit cut the refinement short")
    return Outcome(replace(gait, refined=refined, report=report), report)


def with_continuation(gait: Gait, seeds: Sequence[Gait], session: SolveSession) -> Gait:
    """Return a gait with the refinement that seeds lead to, where that is better than its own.

    The best optimum of the report's grid need not lead to the best one of the accurate grid.

    Args:
        gait: The gait, refined or not.
        seeds: Refined gaits of neighbouring requests.
        session: Clock, cancelling and progress.
    """
    found = continued(gait.request, [replace(seed, walker=gait.walker) for seed in seeds], session)
    own = math.inf if gait.refined is None else gait.refined.trajectory.torque_effort
    if found is None or found.trajectory.torque_effort >= own * (1 - _SAME_EFFORT):
        return gait
    return replace(gait, refined=with_replayable_start(gait.walker, gait.request, found))


class _Pipeline:
    """One request, from starts to outcome."""

    def __init__(
        self, request: GaitRequest, walker: WalkerParameters, settings: SolverSettings, session: SolveSession
    ) -> None:
        self.request, self.walker, self.settings, self.session = request, walker, settings, session
        self.search = Search(request, walker, session, settings.relaxation)
        self.starts = 0

    def run(self, seeds: Sequence[Gait], from_scratch: bool, with_others: bool) -> Outcome:
        """Return the best certified gait, or the report of why there is none."""
        if self.request.step_length > self.walker.longest_step:
            return self._out_of_reach()
        candidates = self._from_kinematics() if from_scratch else []
        candidates += self._from_seeds(seeds)
        optima = distinct(candidates)
        if self.session.stopped or not optima:
            return self._failure(candidates)
        freed = self.session.map(self._freed, optima[: self.settings.freed_optima])
        if self.session.verdict is Status.CANCELLED:
            return self._failure(candidates)
        best, *others = distinct([*freed, *optima])
        outcome = self._certified(best)
        gaits = (self._certified(one).gait for one in others) if with_others else ()
        return replace(outcome, others=tuple(gait for gait in gaits if gait is not None))

    def _freed(self, candidate: Candidate) -> Candidate:
        rounds, iterations = self.settings.contact_rounds, self.settings.contact_iterations
        return self.search.with_free_contacts(candidate, rounds, iterations)

    def _from_kinematics(self) -> list[Candidate]:
        """Return the optima on the requested grid that the kinematic starts lead to."""
        coarse_points = min(self.settings.coarse_points, self.request.points)

        def from_start(start: Start) -> Candidate:
            return self.search.from_start(start, coarse_points)

        def with_contacts(pair: tuple[Candidate, str]) -> Candidate:
            return self.search.with_family(*pair, coarse_points, "search")

        def on_grid(one: Candidate) -> Candidate:
            return self.search.with_family(one, one.contacts, self.request.points, "fixed_schedule")

        coarse = self.session.map(from_start, kinematic_starts(self.walker, self.request.spring_mode))
        self.starts += len(coarse)
        kept = self.settings.kept_starts
        families = self.session.map(with_contacts, [*product(distinct(coarse)[:kept], CONTACT_FAMILIES)])
        # Where nothing was solved, what was tried last says why.
        return self.session.map(on_grid, distinct(families)[:kept]) or families or coarse

    def _from_seeds(self, seeds: Sequence[Gait]) -> list[Candidate]:
        """Return the optima that continue the seeds."""
        self.starts += len(seeds)
        return [candidate for found in self.session.map(self.search.from_gait, seeds) for candidate in found]

    def _certified(self, best: Candidate) -> Outcome:
        """Return the gait of a solved candidate, unless its certificate fails."""
        trajectory = Trajectory.from_stacked(best.points, self.request.step_time)
        certificate = certify(self.walker, self.request, best.spring, trajectory)
        status = Status.SOLVED if certificate.certified else Status.NOT_CERTIFIED
        report = self._report(status, best, certificate)
        if not certificate.certified:
            return Outcome(None, report)
        length = landing_distance(self.walker, trajectory)
        gait = Gait(self.walker, self.request, best.spring, trajectory, report, certificate, length)
        return Outcome(gait, report)

    def _out_of_reach(self) -> Outcome:
        """Return the report of a step that no pose of the legs is long enough for."""
        report = self._bare_report(Status.INFEASIBLE)
        reason = (
            f"the step is {self.request.step_length:.4g} m long, "
            f"the legs reach {self.walker.longest_step:.4g} m at most"
        )
        return Outcome(None, replace(report, message=f"{report.message}; {reason}"))

    def _failure(self, candidates: list[Candidate]) -> Outcome:
        """Return the report of a search without any solution, with the violations of its best attempt."""
        status = self.session.verdict
        if not candidates:
            return Outcome(None, self._bare_report(status or Status.INFEASIBLE))
        attempts = [(self._attempted(one), one) for one in candidates]
        certificate, best = min(attempts, key=lambda pair: pair[0].worst.relative)
        return Outcome(None, self._report(status or best.status, best, certificate))

    def _attempted(self, candidate: Candidate) -> Certificate:
        request = replace(self.request, points=candidate.points.shape[1])
        trajectory = Trajectory.from_stacked(candidate.points, request.step_time)
        return certify(self.walker, request, candidate.spring, trajectory)

    def _report(self, status: Status, candidate: Candidate, certificate: Certificate) -> SolveReport:
        return replace(
            self._bare_report(status),
            message="; ".join([status.sentence, *self._remarks(status, candidate, certificate.worst)]),
            start=f"{candidate.name}, {candidate.contacts}",
            objective=candidate.objective,
            violations=tuple(
                FamilyViolation(one.family, one.violation, one.unit) for one in certificate.entries
            ),
        )

    def _remarks(self, status: Status, candidate: Candidate, worst: CertificateEntry) -> list[str]:
        """Return what there is to say beside the status."""
        remarks = []
        if status is Status.SOLVED and self.session.stopped:
            remarks.append("the time limit cut the search for other contacts short")
        if status is Status.SOLVER_ERROR:
            remarks.append(f"it says {candidate.detail}")
        if status is Status.ITERATION_LIMIT and worst.relative > _FAR:
            remarks.append("no start came near a gait that meets all constraints")
        return remarks if worst.met else [*remarks, str(worst)]

    def _bare_report(self, status: Status) -> SolveReport:
        return SolveReport(
            status,
            status.sentence,
            self.settings.back_end,
            starts=self.starts,
            iterations=self.session.iterations,
            solve_time=self.session.elapsed,
        )
