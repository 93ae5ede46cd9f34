"""The walker sets off from standing feet: which foot it lifts, and when, is for the optimiser to find."""

from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.grid import certify_from
from walk_optimizer.contact.observation import schedule_of
from walk_optimizer.examples.finding import Finding
from walk_optimizer.examples.free_end import free_end_functions
from walk_optimizer.examples.relaxation import Way, best_of_ways, follow_relaxation
from walk_optimizer.examples.relaxed_solve import RelaxedSolve
from walk_optimizer.gait import Certificate, CertificateEntry, Trajectory
from walk_optimizer.guess.kinematic import leg_angles, resampled
from walk_optimizer.model.kinematics import HIP_X, HIP_Y
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters
from walk_optimizer.model.symbolic import SymbolicWalker
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.chain import assemble
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.euler_stage import euler_kind
from walk_optimizer.transcription.problems import complementarity_problem, from_scaled, to_scaled
from walk_optimizer.transcription.program import Nlp, Problem
from walk_optimizer.transcription.scaling import point_units, torque_unit
from walk_optimizer.transcription.stage import Ends, Stage

FloatArray = NDArray[np.float64]

_TOLERANCE = 1e-6


@dataclass(frozen=True)
class StandingStart:
    """Setting off from rest with both feet on level ground.

    Attributes:
        distance: How far the hip is ahead at the end, at least, in [m].
        speed: Speed of the centre of mass then, at least, in [m/s].
        duration: In [s].
        points: Number N of grid points.
        coarse_points: The same of the grid on which contacts are looked for first.
        spread: Distance of the feet at first in [m]; the hip is above their middle.
        flexion: How much shorter than stretched the legs are at first, as a fraction of the leg [-].
        lowest_hip: Height of the hip throughout, at least, as a fraction of the leg [-]: it walks upright.
    """

    distance: float = 0.6
    speed: float = 0.25
    duration: float = 2.0
    points: int = 50
    coarse_points: int = 25
    spread: float = 0.2
    flexion: float = 0.002
    lowest_hip: float = 0.97

    def standing(self, walker: WalkerParameters) -> FloatArray:
        """Return the state (12,) at rest with leg 1 ahead, the hip at x = 0."""
        leg = walker.leg_length * (1 - self.flexion)
        hip = np.array([[0.0], [np.sqrt(leg**2 - (self.spread / 2) ** 2)]])
        feet = (np.array([[x], [0.0]]) for x in (self.spread / 2, -self.spread / 2))
        angles = [leg_angles(walker, foot - hip) for foot in feet]
        return np.concatenate([np.vstack([hip, *angles])[:, 0], np.zeros(6)])

    @property
    def grid(self) -> GaitRequest:
        """The grid, and no springs; the step length of a request plays no part."""
        return GaitRequest(self.distance, self.duration, SpringMode.NONE, self.points)


@dataclass(frozen=True, eq=False)
class StandingMotion:
    """How the walker sets off.

    Attributes:
        walker: The walker.
        task: What was asked for.
        trajectory: Its motion.
        finding: Its contacts and residuals.
    """

    walker: WalkerParameters
    task: StandingStart
    trajectory: Trajectory
    finding: Finding


def start_functions() -> list[ca.Function]:
    """Return the functions of the chain's ends."""
    return free_end_functions("standing_start", SymbolicWalker().symbols, layout.STATE_WIDTH)


@lru_cache(maxsize=4)
def _assembled(points: int) -> Nlp:
    of_report = np.zeros(layout.ROW_WIDTH, dtype=bool)
    of_report[layout.REPORT_ROWS] = True
    stages = [Stage(euler_kind(), (0, 1), of_report)] * points
    ends = Ends("standing_start", compiled(start_functions))
    return assemble(stages, ends, layout.SPRING_WIDTH, np.zeros((0, layout.SPRING_WIDTH)))


def standing_problem(walker: WalkerParameters, task: StandingStart, relaxation: float) -> Problem:
    """Return the program with each complementarity product bounded.

    It is the report's problem, but that it begins in a given state and ends where the task says.

    Args:
        walker: The walker.
        task: What is asked for.
        relaxation: Bound on each product, in units of weight times 1 m or 1 m/s.
    """
    periodic = complementarity_problem(task.grid, walker, relaxation)
    lower = periodic.lower_x.copy()
    last = layout.POINT_WIDTH * (task.points - 1)
    lower[HIP_Y : last + layout.POINT_WIDTH : layout.POINT_WIDTH] = task.lowest_hip
    lower[last + HIP_X], lower[last + layout.P.start] = task.distance / walker.leg_length, task.speed
    start = task.standing(walker) / np.array(point_units(walker)[: layout.STATE_WIDTH])
    return replace(
        periodic,
        nlp=_assembled(task.points),
        parameters=np.concatenate([periodic.parameters, start]),
        lower_x=lower,
        lower_g=periodic.lower_g[:-1],
        upper_g=periodic.upper_g[:-1],
    )


def still_guess(walker: WalkerParameters, task: StandingStart) -> FloatArray:
    """Return the first guess, (23, N) in SI units: the walker stands still, half its weight on each foot."""
    points = np.zeros((layout.POINT_WIDTH, task.points))
    points[layout.STATE] = task.standing(walker)[:, None]
    points[layout.REACTION][[2, 5]] = walker.weight / 2
    return points


def set_off(walker: WalkerParameters, task: StandingStart, session: SolveSession) -> StandingMotion:
    """Return the motion of least torque that sets the walker off."""
    return best_of_ways(lambda way: _set_off(walker, task, way, session))


def _set_off(
    walker: WalkerParameters, task: StandingStart, way: Way, session: SolveSession
) -> StandingMotion:
    """Return where a way leads: contacts are found on a coarse grid, whose solution starts the other."""
    begin = session.elapsed
    coarse = replace(task, points=task.coarse_points)
    guess, found = _followed(walker, coarse, still_guess(walker, coarse), way, session)
    guess = resampled(guess, task.points)
    points, solves = _followed(walker, task, guess, way.last, session)
    trajectory = Trajectory.from_stacked(points, task.duration)
    finding = Finding(
        title=f"The walker sets off from standing feet: {task.distance:g} m in {task.duration:g} s",
        points=("foot 1, ahead at first", "foot 2, behind at first"),
        schedule=schedule_of(walker, task.distance, trajectory.q, trajectory.p, trajectory.reaction),
        interval=task.grid.interval,
        effort=trajectory.torque_cost * task.grid.interval,
        solves=found + solves,
        seconds=session.elapsed - begin,
        certificate=certify_standing(walker, task, trajectory),
    )
    return StandingMotion(walker, task, trajectory, finding)


def _followed(
    walker: WalkerParameters,
    task: StandingStart,
    guess: FloatArray,
    way: Way,
    session: SolveSession,
) -> tuple[FloatArray, tuple[RelaxedSolve, ...]]:
    """Return the points (23, N) in SI units that the relaxed solves lead to, and these."""
    x, solves = follow_relaxation(
        lambda relaxation: standing_problem(walker, task, relaxation),
        to_scaled(walker, guess, KneeSpring()),
        session,
        torque_unit(walker) ** 2,
        way,
    )
    return from_scaled(walker, x)[0], solves


def certify_standing(walker: WalkerParameters, task: StandingStart, trajectory: Trajectory) -> Certificate:
    """Return the residuals of a motion that sets off from standing feet."""
    motion = certify_from(walker, task.standing(walker), trajectory)
    hip_x, hip_y = trajectory.q[0, -1], trajectory.q[1].min()
    shortfalls = {
        "hip_distance": (task.distance - hip_x, "m"),
        "hip_height": (task.lowest_hip * walker.leg_length - hip_y, "m"),
        "speed": (task.speed - trajectory.p[0, -1] / walker.total_mass, "m/s"),
    }
    ends = [
        CertificateEntry(name, max(0.0, float(value)), unit, _TOLERANCE)
        for name, (value, unit) in shortfalls.items()
    ]
    return Certificate((*motion.entries, *ends))
