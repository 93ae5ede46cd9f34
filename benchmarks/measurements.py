"""What is timed, for the package and for the plain transcription; every function runs in a new process."""

import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

# The package imports it when a replay first needs it; times are without imports.
import scipy.integrate  # noqa: F401
from numpy.typing import NDArray
from packaged import packaged_library
from plain_refined import PlainRefined, phases_of
from plain_transcription import FixedSchedule, PlainSolution, kinematic_points, search, with_free_contacts

from walk_optimizer.certificate.grid import certify
from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.gait import Certificate, Gait, RefinedGait, Trajectory
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.guess.starts import kinematic_starts
from walk_optimizer.model.mechanics import foot_2_ahead
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.optimizer.search import Search
from walk_optimizer.refinement.resolve import resolve
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.transcription.tableau import NODES_WITH_START

FloatArray = NDArray[np.float64]

REPEATS = 5  # of solves that take milliseconds


@dataclass(frozen=True)
class Score:
    """One solve, judged by the package's certificate.

    Attributes:
        seconds: Wall time.
        processor: Processor time, that of child processes included.
        objective: F in [(N m)^2], or the integral of 1/2 |u|^2 dt in [(N m)^2 s] of a refined gait.
        status: How it ended, in the solver's words.
        residual: Largest residual in units of its tolerance; certified if at most 1.
        family: The family of constraints that it belongs to.
        iterations: Of all solves together.
        again: Wall time of the same solve in the same process, where nothing is built anew; the median of
            several where it is short.
    """

    seconds: float
    processor: float
    objective: float
    status: str
    residual: float
    family: str
    iterations: int = 0
    again: float = float("nan")

    @property
    def certified(self) -> bool:
        """Whether every residual is within its tolerance."""
        return self.residual <= 1.0


def walker() -> WalkerParameters:
    return WalkerParameters.from_yaml()


def library_gait(request: GaitRequest) -> Gait:
    """Return the gait of the packaged table for a request."""
    return packaged_library().find(request.speed, request.spring_mode)[0]


class Clock:
    """Wall and processor time since it was made."""

    def __init__(self) -> None:
        self._wall, self._processor = time.perf_counter(), sum(os.times()[:4])

    def read(self) -> tuple[float, float]:
        """Return wall time and processor time in [s]."""
        return time.perf_counter() - self._wall, sum(os.times()[:4]) - self._processor


def score_points(
    times: tuple[float, float],
    request: GaitRequest,
    points: FloatArray,
    spring: KneeSpring,
    status: str,
    iterations: int,
) -> Score:
    """Judge points (23, N) in SI units on the report's grid."""
    trajectory = Trajectory.from_stacked(points, request.step_time)
    worst = certify(walker(), request, spring, trajectory).worst
    return Score(*times, trajectory.torque_cost, status, worst.relative, worst.family, iterations)


def _score_refined(
    times: tuple[float, float],
    request: GaitRequest,
    trajectory: RefinedTrajectory,
    spring: KneeSpring,
    status: str,
) -> Score:
    length = foot_2_ahead(walker(), trajectory.states[-1, -1])
    gait = RefinedGait(trajectory, spring, length, Certificate(()))
    worst = certify_refined(walker(), request, gait).worst
    return Score(*times, trajectory.torque_effort, status, worst.relative, worst.family)


def ours_one_start(request: GaitRequest, free_contacts: bool) -> Score:
    """Solve from the first kinematic start on the full grid, and then with free contacts."""
    settings = solver_settings()
    clock = Clock()
    session = SolveSession(settings, settings.time_limit, None)
    one = Search(request, walker(), session, settings.relaxation)
    found = one.from_start(kinematic_starts(walker(), request.spring_mode)[0], request.points)
    if free_contacts:
        found = one.with_free_contacts(found, settings.contact_rounds, settings.contact_iterations)
    times, status = clock.read(), found.status.value
    return score_points(times, request, found.points, found.spring, status, session.iterations)


def plain_one_start(request: GaitRequest, free_contacts: bool) -> Score:
    """Do the same in the plain transcription."""
    start = kinematic_starts(walker(), request.spring_mode)[0]
    clock = Clock()
    found = FixedSchedule(request, walker()).solve(kinematic_points(request, walker(), start))
    if free_contacts:
        found = with_free_contacts(request, walker(), found)
    return _score_plain(clock, request, found)


def ours_search(request: GaitRequest, refine: bool = False) -> Score:
    """Solve a request as a user does."""
    clock = Clock()
    outcome = optimize(request, walker(), refine=refine)
    times, gait, report = clock.read(), outcome.gait, outcome.report
    if gait is None:
        raise RuntimeError(report.message)
    points = gait.trajectory.stacked()
    return score_points(times, request, points, gait.spring, report.status.value, report.iterations)


def ours_table(requests: list[GaitRequest]) -> list[Score]:
    """Solve and refine requests one after the other, as a script does."""
    return [ours_search(request, refine=True) for request in requests]


def ours_search_without_cache(request: GaitRequest) -> Score:
    """Solve a request where nothing has been compiled before."""
    with tempfile.TemporaryDirectory() as empty:
        os.environ["XDG_CACHE_HOME"] = empty
        return ours_search(request)


def plain_search(request: GaitRequest) -> tuple[Score, PlainSolution]:
    """Try the package's starts in the plain transcription."""
    starts = kinematic_starts(walker(), request.spring_mode)
    clock = Clock()
    found = search(request, walker(), starts)
    if found is None:
        raise RuntimeError("no start converged")
    return _score_plain(clock, request, found), found


def _score_plain(clock: Clock, request: GaitRequest, found: PlainSolution) -> Score:
    times = clock.read()
    return score_points(times, request, found.points, found.spring, found.status, found.iterations)


def plain_refinement(request: GaitRequest, found: PlainSolution, model: RefinedGait) -> Score:
    """Refine a plain gait on the phases and the mesh of a refined gait of the package."""
    clock = Clock()
    problem = PlainRefined(request.spring_mode, walker(), phases_of(model.trajectory))
    start = replace(model, trajectory=_on_mesh(model.trajectory, request, found), spring=found.spring)
    solution = problem.solve(start, request.step_length, request.step_time)
    return _score_refined(clock.read(), request, solution.trajectory, solution.spring, solution.status)


def refined_library_gait(request: GaitRequest) -> RefinedGait:
    """Return the accurate solution of the packaged table for a request."""
    refined = library_gait(request).refined
    if refined is None:
        raise RuntimeError("the table's gait is not refined")
    return refined


def _on_mesh(mesh: RefinedTrajectory, request: GaitRequest, found: PlainSolution) -> RefinedTrajectory:
    """Interpolate a solution of the Euler grid on a mesh."""
    grid = np.arange(1, request.points + 1) * request.interval
    nodes = mesh.breaks[:-1, None] + mesh.lengths[:, None] * NODES_WITH_START
    nodes *= request.step_time / mesh.step_time
    net = found.points[[15, 17, 18, 20]] - np.vstack([found.points[16], 0 * grid, found.points[19], 0 * grid])
    net[:, :2] = net[:, 2:3]  # the impulse of the impact, spread over the first interval

    def at(rows: FloatArray, when: FloatArray) -> FloatArray:
        return np.stack([np.interp(when, grid, row) for row in rows], axis=-1)

    return replace(
        mesh,
        states=at(found.points[:12], nodes),
        torques=at(found.points[12:15], nodes[:, 1:]),
        forces=at(net, nodes[:, 1:]),
        impulses=np.zeros_like(mesh.impulses),
    )


def ours_resolve(request: GaitRequest, neighbour: Gait) -> Score:
    """Solve for a new speed from a gait of the library; `again` is what it takes in a process that runs."""
    clock = Clock()
    refined = resolved(request, neighbour)
    score = _score_refined(clock.read(), request, refined.trajectory, refined.spring, "solved")
    return replace(score, again=_median_time(lambda: resolved(request, neighbour)))


def _median_time(solve: Callable[[], object]) -> float:
    """Return the median wall time in [s] of some solves, one after the other."""
    times = []
    for _ in range(REPEATS):
        clock = Clock()
        solve()
        times.append(clock.read()[0])
    return median(times)


def resolved(request: GaitRequest, neighbour: Gait) -> RefinedGait:
    """Return the refined gait that continues a neighbour: the one place that knows how it is asked for."""
    settings = solver_settings()
    gait = resolve(request, [neighbour], SolveSession(settings, settings.time_limit, None))
    if gait is None:
        raise RuntimeError("the neighbour leads to no certified gait")
    return gait


def plain_resolve(request: GaitRequest, neighbour: RefinedGait) -> Score:
    """Do the same in the plain transcription, on the neighbour's phases and mesh."""
    clock = Clock()
    problem = PlainRefined(request.spring_mode, walker(), phases_of(neighbour.trajectory))
    solution = problem.solve(neighbour, request.step_length, request.step_time)
    first = clock.read()
    score = _score_refined(first, request, solution.trajectory, solution.spring, solution.status)
    again = _median_time(lambda: problem.solve(neighbour, request.step_length, request.step_time))
    return replace(score, again=again, iterations=solution.iterations)


def plain_without_library(request: GaitRequest, neighbour: RefinedGait) -> Score:
    """Solve for a new speed as who has no library must: a search, then a refinement on the same mesh."""
    clock = Clock()
    _, found = plain_search(request)
    score = plain_refinement(request, found, neighbour)
    seconds, processor = clock.read()
    return replace(score, seconds=seconds, processor=processor)


def ours_growth(points: int) -> Score:
    """Solve one fixed schedule of N points, twice."""
    request = growth_request(points)
    first = ours_one_start(request, False)
    return replace(first, again=ours_one_start(request, False).seconds)


def plain_growth(points: int) -> Score:
    """Do the same in the plain transcription."""
    request = growth_request(points)
    start = kinematic_points(request, walker(), kinematic_starts(walker(), request.spring_mode)[0])
    clock = Clock()
    problem = FixedSchedule(request, walker())
    found = problem.solve(start)
    first, clock = clock.read(), Clock()
    problem.solve(start)
    again = clock.read()
    score = score_points(first, request, found.points, found.spring, found.status, found.iterations)
    return replace(score, again=again[0])


def growth_request(points: int) -> GaitRequest:
    """Return the request whose cost is measured against N: 1.92 km/h, no springs."""
    return GaitRequest.for_step(0.35, 0.655, SpringMode.NONE, points)
