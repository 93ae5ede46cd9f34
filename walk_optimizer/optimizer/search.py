"""The solves that a search for gaits is made of: from one candidate to a better one."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.observation import schedule_of, slip_velocities
from walk_optimizer.contact.schedule import CONTACT_FAMILIES, FootMode, Schedule
from walk_optimizer.gait import Gait
from walk_optimizer.guess.kinematic import Start, kinematic_guess, resampled
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.back_end import SolveOptions
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.status import Status
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
# Barrier parameters for starts that meet the optimality conditions but for their contacts, and for optima
# of another grid, of a neighbouring request, or whose contacts have just moved.
_NEAR = 1e-9
_RESAMPLED = 1e-4
# Rows of lambda_x+ and lambda_x- of each foot.
_TANGENTIAL = tuple((layout.REACTION.start + k, layout.REACTION.start + k + 1) for k in (0, 3))
# What contacts of no family are called.
OWN_CONTACTS = "found"


@dataclass(frozen=True, eq=False)
class Candidate:
    """An iterate of the search, good or bad.

    Attributes:
        name: Of the start that it came from.
        contacts: Its contact family, or `found` where complementarity changed it.
        points: All grid points in SI units, (23, N).
        spring: K and q_eq.
        status: How its last solve ended.
        detail: The same in the solver's own words.
    """

    name: str
    contacts: str
    points: FloatArray
    spring: KneeSpring
    status: Status
    detail: str = ""

    @property
    def solved(self) -> bool:
        """Whether its last solve converged."""
        return self.status is Status.SOLVED

    @property
    def mean_effort(self) -> float:
        """Mean of 1/2 |u|^2 over the points in [(N m)^2]: comparable between grids."""
        return self.objective / float(self.points.shape[1])

    @property
    def objective(self) -> float:
        """F, the sum over the points of 1/2 |u|^2 in [(N m)^2]."""
        return float(np.sum(self.points[layout.U] ** 2) / 2)


def distinct(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return the solved candidates, best first, each optimum once."""
    kept: list[Candidate] = []
    for candidate in sorted((one for one in candidates if one.solved), key=lambda one: one.mean_effort):
        if not kept or candidate.mean_effort > kept[-1].mean_effort * (1 + SAME_OPTIMUM):
            kept.append(candidate)
    return kept


def completed(walker: WalkerParameters, points: FloatArray) -> FloatArray:
    """Return the solution of a fixed schedule as one of eq. (5), (23, N).

    Its net tangential forces are split into the least lambda_x+ and lambda_x-, and gamma is |slip|,
    the least that eqs. (5c) and (5d) allow.
    """
    complete = points.copy()
    for forward, backward in _TANGENTIAL:
        net = points[forward] - points[backward]
        complete[forward], complete[backward] = np.maximum(net, 0.0), np.maximum(-net, 0.0)
    complete[layout.SLIP] = np.abs(slip_velocities(walker, points[layout.Q], points[layout.P]))
    return complete


def _with_net_forces(points: FloatArray, schedule: Schedule) -> FloatArray:
    """Return the points (23, N) with the net tangential forces of feet that stick as lambda_x+."""
    net = points.copy()
    for (forward, backward), modes in zip(_TANGENTIAL, schedule, strict=True):
        sticks = modes == FootMode.STICK
        net[forward, sticks] -= net[backward, sticks]
        net[backward, sticks] = 0.0
    return net


class Search:
    """The solves of one request, all within one session."""

    def __init__(
        self, request: GaitRequest, walker: WalkerParameters, session: SolveSession, relaxation: float
    ) -> None:
        """Prepare a search.

        Args:
            request: Speed, step, spring mode and grid.
            walker: The walker.
            session: Clock, cancelling and progress of all solves.
            relaxation: Bound on each complementarity product, in units of weight times 1 m or 1 m/s.
        """
        self.request, self.walker, self.session, self.relaxation = request, walker, session, relaxation

    def from_start(self, start: Start, points: int) -> Candidate:
        """Return the optimum of single support that a kinematic guess on `points` grid points leads to."""
        request = replace(self.request, points=points)
        guess = kinematic_guess(self.walker, request, start.shape)
        candidate = Candidate(start.name, "single-impact", guess, start.spring, Status.SOLVED)
        return self.with_family(candidate, "single-impact", points, "search", self.session.options)

    def from_gait(self, gait: Gait) -> list[Candidate]:
        """Return the optima that continue a gait of another request, also with its own contacts."""
        name = f"continued-{gait.speed:.4f}-{gait.request.spring_mode.value}"
        seed = Candidate(name, OWN_CONTACTS, gait.trajectory.stacked(), gait.spring, Status.SOLVED)
        seed = replace(seed, points=resampled(seed.points, self.request.points))
        schedules = {name: family(self.request.points) for name, family in CONTACT_FAMILIES.items()}
        own = self._schedule(seed)
        if not any(np.array_equal(own, one) for one in schedules.values()):
            schedules[OWN_CONTACTS] = own
        guesses = ((replace(seed, contacts=contacts), one) for contacts, one in schedules.items())
        return [
            self._with_schedule(*guess, "continuation", self._from_barrier(_RESAMPLED))
            for guess in guesses
            if not self.session.stopped
        ]

    def with_family(
        self,
        candidate: Candidate,
        contacts: str,
        points: int,
        stage: str,
        options: SolveOptions | None = None,
    ) -> Candidate:
        """Return the candidate solved on `points` grid points with a contact family.

        Args:
            candidate: Where to start.
            contacts: Name of the contact family.
            points: Number of grid points.
            stage: Name for the progress.
            options: By default those for an optimum of another grid.
        """
        guess = replace(candidate, contacts=contacts, points=resampled(candidate.points, points))
        options = options or self._from_barrier(_RESAMPLED)
        return self._with_schedule(guess, CONTACT_FAMILIES[contacts](points), stage, options)

    def _from_barrier(self, barrier: float) -> SolveOptions:
        return replace(self.session.options, barrier=barrier)

    def with_free_contacts(self, best: Candidate, rounds: int, iterations: int) -> Candidate:
        """Return the optimum with the contacts that complementarity finds; `best` if those are no better.

        In each round the relaxed problem takes some iterations from the best solution, and the contacts
        that it moves to are solved as a fixed schedule: then every product of the result is zero and
        not merely small, and it is plain whether they are worth having. So the relaxed problem itself
        need not converge, and where `best` is stationary a round costs little. Once the session is
        stopped nothing more is tried.

        Args:
            best: A solved candidate on the requested grid.
            rounds: Largest number of rounds.
            iterations: Of the relaxed problem in a round.
        """
        for _ in range(rounds):
            found = self._with_other_contacts(best, iterations)
            if found is None or found.mean_effort >= best.mean_effort * (1 - SAME_OPTIMUM):
                break
            best = found
        return best

    def _with_other_contacts(self, best: Candidate, iterations: int) -> Candidate | None:
        """Return the optimum of the contacts that the relaxed problem moves to; None if it stays."""
        problem = complementarity_problem(self.request, self.walker, self.relaxation)
        options = replace(self._from_barrier(_NEAR), maximum_iterations=iterations)
        relaxed = self._solve(problem, best, "complementarity", options)
        schedule = self._schedule(relaxed)
        if self.session.stopped or np.array_equal(schedule, self._schedule(best)):
            return None
        guess = replace(relaxed, contacts=OWN_CONTACTS)
        found = self._with_schedule(guess, schedule, "polish", self._from_barrier(_RESAMPLED))
        return found if found.solved else None

    def _schedule(self, candidate: Candidate) -> Schedule:
        """Return the contacts that a candidate uses, (2, N)."""
        parts = (candidate.points[rows] for rows in (layout.Q, layout.P, layout.REACTION))
        return schedule_of(self.walker, self.request.step_length, *parts)

    def _with_schedule(
        self, guess: Candidate, schedule: Schedule, stage: str, options: SolveOptions
    ) -> Candidate:
        request = replace(self.request, points=schedule.shape[1])
        problem = fixed_schedule_problem(request, self.walker, schedule)
        guess = replace(guess, points=_with_net_forces(guess.points, schedule))
        solved = self._solve(problem, guess, stage, options)
        return replace(solved, points=completed(self.walker, solved.points))

    def _solve(self, problem: Problem, guess: Candidate, stage: str, options: SolveOptions) -> Candidate:
        # The scaled objective is the integral of 1/2 |u|^2, F its sum over the grid points.
        unit = torque_unit(self.walker) ** 2 * guess.points.shape[1] / self.request.step_time
        start = to_scaled(self.walker, guess.points, guess.spring)
        solution = self.session.solve(problem, start, stage, objective_unit=unit, options=options)
        points, spring = from_scaled(self.walker, solution.x)
        return replace(guess, points=points, spring=spring, status=solution.status, detail=solution.detail)
