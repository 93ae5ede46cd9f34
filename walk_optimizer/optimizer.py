"""The pipeline: first guesses, fixed contact schedule, complementarity, certificate.

Kinematic guesses are solved with plain single support on a coarse grid; the best distinct optima go
on to the requested grid. The best of them starts the complementarity problem, which is free to find
other contacts, and the contacts that it found are solved once more as a fixed schedule, so that every
complementarity product of the gait is zero and not merely small.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate import certify, landing_distance
from walk_optimizer.contact.schedule import Schedule, observed_schedule, single_support
from walk_optimizer.gait import Certificate, Gait, Trajectory
from walk_optimizer.guess import Start, kinematic_guess, resampled
from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import SolverSettings, solver_settings
from walk_optimizer.solve.solution import Solution
from walk_optimizer.solve.status import FamilyViolation, ProgressCallback, SolveReport, Status
from walk_optimizer.starts import kinematic_starts
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.problems import (
    complementarity_problem,
    fixed_schedule_problem,
    from_scaled,
    to_scaled,
)
from walk_optimizer.transcription.program import Problem
from walk_optimizer.transcription.scaling import torque_unit

FloatArray = NDArray[np.float64]

# Optima whose objectives agree to this relative difference are taken for one.
SAME_OPTIMUM = 1e-4


@dataclass(frozen=True, eq=False)
class Candidate:
    """An iterate of the search, good or bad.

    Attributes:
        name: Of the start that it came from.
        points: All grid points in SI units, (23, N).
        spring: K and q_eq.
        status: How its last solve ended.
    """

    name: str
    points: FloatArray
    spring: KneeSpring
    status: Status

    @property
    def mean_effort(self) -> float:
        """Mean of 1/2 |u|^2 over the points in [(N m)^2]: comparable between grids."""
        return float(np.sum(self.points[layout.U] ** 2) / 2 / self.points.shape[1])


@dataclass(frozen=True)
class Outcome:
    """What a request led to.

    Attributes:
        gait: The gait; None unless it was solved and certified.
        report: How the search went.
    """

    gait: Gait | None
    report: SolveReport


def optimize(
    request: GaitRequest,
    walker: WalkerParameters,
    *,
    settings: SolverSettings | None = None,
    time_limit: float | None = None,
    progress: ProgressCallback | None = None,
    seeds: Sequence[Gait] = (),
) -> Outcome:
    """Solve for the gait of least torque.

    Args:
        request: Speed, step, spring mode and grid.
        walker: The walker.
        settings: Of the search; the packaged ones by default.
        time_limit: In [s]; the settings' by default.
        progress: Called at every iteration; returning False cancels the solve.
        seeds: Gaits of neighbouring requests to continue from, beside the kinematic starts.

    Returns:
        The gait and the report. A solve that fails gives no gait and raises nothing.
    """
    settings = settings or solver_settings()
    session = SolveSession(settings, time_limit or settings.time_limit, progress)
    return _Search(request, walker, settings, session).run(seeds)


class _Search:
    """One request's search; owns nothing beyond it."""

    def __init__(
        self, request: GaitRequest, walker: WalkerParameters, settings: SolverSettings, session: SolveSession
    ) -> None:
        self.request, self.walker, self.settings, self.session = request, walker, settings, session
        self.starts = 0

    def run(self, seeds: Sequence[Gait]) -> Outcome:
        """Return the best certified gait, or the report of why there is none."""
        fine = [self._fine(candidate) for candidate in self._coarse()]
        fine += [self._continued(seed) for seed in seeds]
        solved = _distinct(fine)
        if not solved:
            return self._failure(fine)
        best = self._with_free_contacts(solved[0])
        return self._certified(best)

    def _coarse(self) -> list[Candidate]:
        """Return the best distinct optima of the kinematic starts on the coarse grid."""
        coarse = replace(self.request, points=min(self.settings.coarse_points, self.request.points))
        starts = kinematic_starts(self.walker, self.request.spring_mode)
        candidates = [self._from_start(coarse, start) for start in starts if not self.session.stopped]
        # Without any coarse optimum the least infeasible attempts still deserve the fine grid.
        return (_distinct(candidates) or candidates)[: self.settings.kept_starts]

    def _from_start(self, request: GaitRequest, start: Start) -> Candidate:
        self.starts += 1
        guess = Candidate(start.name, kinematic_guess(self.walker, request, start.shape), start.spring, Status.SOLVED)
        return self._with_schedule(request, single_support(request.points), guess, "search")

    def _fine(self, candidate: Candidate) -> Candidate:
        """Return the candidate solved on the requested grid."""
        if candidate.points.shape[1] == self.request.points:
            return candidate
        points = resampled(candidate.points, self.request.points)
        schedule = single_support(self.request.points)
        return self._with_schedule(self.request, schedule, replace(candidate, points=points), "fixed_schedule")

    def _continued(self, seed: Gait) -> Candidate:
        """Return the optimum that continues a gait of another request."""
        self.starts += 1
        points = resampled(stacked(seed.trajectory), self.request.points)
        name = f"continuation-{seed.speed:.4f}-{seed.request.spring_mode}"
        guess = Candidate(name, points, seed.spring, Status.SOLVED)
        return self._with_schedule(self.request, single_support(self.request.points), guess, "continuation")

    def _with_schedule(
        self, request: GaitRequest, schedule: Schedule, guess: Candidate, stage: str, *, warm: bool = False
    ) -> Candidate:
        problem = fixed_schedule_problem(request, self.walker, schedule)
        return self._solve(problem, guess, stage, warm=warm)

    def _solve(self, problem: Problem, guess: Candidate, stage: str, *, warm: bool) -> Candidate:
        scale = torque_unit(self.walker) ** 2 * guess.points.shape[1]
        start = to_scaled(self.walker, guess.points, guess.spring)
        solution = self.session.solve(problem, start, stage, objective_unit=scale, warm=warm)
        return self._candidate(guess.name, solution)

    def _candidate(self, name: str, solution: Solution) -> Candidate:
        points, spring = from_scaled(self.walker, solution.x)
        return Candidate(name, points, spring, solution.status)

    def _with_free_contacts(self, best: Candidate) -> Candidate:
        """Return the optimum with contacts found by complementarity; the start itself if that is no better."""
        problem = complementarity_problem(self.request, self.walker, self.settings.relaxation)
        guess = replace(best, points=self._with_slip_speeds(best.points))
        relaxed = self._solve(problem, guess, "complementarity", warm=True)
        if relaxed.status is not Status.SOLVED:
            return guess
        polished = self._with_schedule(self.request, self._schedule(relaxed), relaxed, "polish", warm=True)
        if polished.status is not Status.SOLVED or polished.mean_effort > best.mean_effort:
            return guess
        return replace(polished, points=self._with_slip_speeds(polished.points))

    def _slip(self, points: FloatArray) -> FloatArray:
        """Return the tangential velocity of both feet, (2, N)."""
        return evaluate("foot_velocities", self.walker, points[layout.Q], points[layout.P])[:, 0, :].T

    def _with_slip_speeds(self, points: FloatArray) -> FloatArray:
        """Return the points with gamma = |slip|, the least that eqs. (5c) and (5d) allow."""
        completed = points.copy()
        completed[layout.SLIP] = np.abs(self._slip(points))
        return completed

    def _schedule(self, candidate: Candidate) -> Schedule:
        normal = candidate.points[layout.REACTION][[2, 5]]
        gamma = candidate.points[layout.SLIP]
        return observed_schedule(normal, gamma, self._slip(candidate.points), self.walker.weight)

    def _certified(self, best: Candidate) -> Outcome:
        trajectory = trajectory_of(self.request, best.points)
        certificate = certify(self.walker, self.request, best.spring, trajectory)
        status = Status.SOLVED if certificate.certified else Status.NOT_CERTIFIED
        report = self._report(status, best, certificate)
        if not certificate.certified:
            return Outcome(None, report)
        step_length = landing_distance(self.walker, trajectory)
        return Outcome(
            Gait(self.walker, self.request, best.spring, trajectory, report, certificate, step_length), report
        )

    def _failure(self, candidates: list[Candidate]) -> Outcome:
        """Return the report of a search without any solution, from its last iterate."""
        if self.session.stopped or not candidates:
            status = self.session.verdict or Status.CANCELLED
            if not candidates:
                return Outcome(None, self._empty_report(status))
            candidates = [replace(candidates[-1], status=status)]
        last = candidates[0]
        points = self._with_slip_speeds(last.points)
        certificate = certify(self.walker, self.request, last.spring, trajectory_of(self.request, points))
        return Outcome(None, self._report(last.status, last, certificate))

    def _report(self, status: Status, candidate: Candidate, certificate: Certificate) -> SolveReport:
        worst = max(certificate.entries, key=lambda entry: entry.violation / entry.tolerance)
        message = status.sentence
        if not worst.met:
            message += f"; worst is {worst.family}: {worst.violation:.3g} {worst.unit}, allowed {worst.tolerance:.3g}"
        families = (FamilyViolation(entry.family, entry.violation, entry.unit) for entry in certificate.entries)
        return replace(
            self._empty_report(status),
            message=message,
            start=candidate.name,
            objective=candidate.mean_effort * candidate.points.shape[1],
            violations=tuple(families),
        )

    def _empty_report(self, status: Status) -> SolveReport:
        return SolveReport(
            status,
            status.sentence,
            self.settings.back_end,
            starts=self.starts,
            iterations=self.session.iterations,
            solve_time=self.session.elapsed,
        )


def _distinct(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the solved candidates, best first, each optimum once."""
    distinct: list[Candidate] = []
    for candidate in sorted(
        (one for one in candidates if one.status is Status.SOLVED), key=lambda one: one.mean_effort
    ):
        if not distinct or candidate.mean_effort > distinct[-1].mean_effort * (1 + SAME_OPTIMUM):
            distinct.append(candidate)
    return distinct


def stacked(trajectory: Trajectory) -> FloatArray:
    """Return all quantities of a trajectory as points, (23, N)."""
    parts = (trajectory.q, trajectory.p, trajectory.u, trajectory.reaction, trajectory.slip_speed)
    return np.vstack(parts)


def trajectory_of(request: GaitRequest, points: FloatArray) -> Trajectory:
    """Return the trajectory of points (23, N) on the request's grid."""
    time = request.step_time * np.arange(1, points.shape[1] + 1) / points.shape[1]
    parts = (points[rows] for rows in (layout.Q, layout.P, layout.U, layout.REACTION, layout.SLIP))
    return Trajectory(time, *parts)
