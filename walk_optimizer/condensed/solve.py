"""Solves for the gait of a new speed from one nearby, in single support."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.condensed.ends import EXCHANGED, Ends
from walk_optimizer.condensed.functions import ANGLES, hip_functions
from walk_optimizer.condensed.interior_point import InteriorPoint
from walk_optimizer.condensed.kernel import GAP_LIMIT, LIMITS, kernel
from walk_optimizer.condensed.step import CondensedStep, Unknowns
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.sharing import free_processors
from walk_optimizer.solve.solution import Monitor
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.compilation import compiled
from walk_optimizer.transcription.mesh import RefinedPoints
from walk_optimizer.transcription.scaling import spring_units, torque_unit
from walk_optimizer.transcription.tableau import BUTCHER, DIFFERENTIATION, STAGES, STATE_COEFFICIENTS

FloatArray = NDArray[np.float64]

_ANGLE_ROWS, _FORWARD_ROW = slice(2, 6), 6
_MOST_THREADS = 2


@dataclass(frozen=True, eq=False)
class CondensedSolution:
    """Where a condensed solve ended.

    Attributes:
        status: How it ended.
        iterations: Number of iterations.
        points: The solution; None unless it was solved.
        prices: What each interval's joint limits cost per [rad], and the ground under foot 2 per [m], as
            parts of the objective, (n, 2); None without a solution.
    """

    status: Status
    iterations: int
    points: RefinedPoints | None = None
    prices: FloatArray | None = None


def solve_condensed(
    request: GaitRequest,
    walker: WalkerParameters,
    lengths: FloatArray,
    guess: RefinedPoints,
    tolerance: float,
    monitor: Monitor,
) -> CondensedSolution:
    """Return the solution near a guess; without a C compiler there is none.

    It solves the equations of the refined problem of single support. Only the gap of foot 2 is measured from
    a stance foot at the origin, and not from one that drifts by the error of the collocation.

    Args:
        request: Speed, step and spring mode.
        walker: The walker.
        lengths: Of the intervals in [s], (n,); they add up to the time of the step.
        guess: First guess on these intervals.
        tolerance: Violation of the equations, scaled, and product of slacks and multipliers at the end.
        monitor: Told at each iteration.
    """
    code = kernel()
    if code is None:
        return CondensedSolution(Status.SOLVER_ERROR, 0)
    ends = Ends(request, walker)
    unknowns = Unknowns(lengths.size, len(ends.equations), ends.size)
    threads = min(_MOST_THREADS, free_processors())
    step = CondensedStep(code, walker, request.step_length, lengths, unknowns, threads)
    begin(step, ends, walker, guess)
    status, iterations = InteriorPoint(step, ends, tolerance).solve(monitor)
    if status is not Status.SOLVED:
        return CondensedSolution(status, iterations)
    points = _solution(step, ends, walker)
    if points.states[0, 0, _FORWARD_ROW] < 0 or points.impulses[0, 1] < 0:
        # The only bounds of the refined problem that are no inequalities here: no gait is known that
        # reaches them.
        return CondensedSolution(Status.SOLVER_ERROR, iterations)
    return CondensedSolution(status, iterations, points, _prices(step, walker))


def begin(step: CondensedStep, ends: Ends, walker: WalkerParameters, guess: RefinedPoints) -> None:
    """Set the iterate to a guess, its angles closed to a cycle, its springs within their bounds."""
    angles, lengths = guess.states[:, :, _ANGLE_ROWS], step.lengths
    omega = np.einsum("ij,nja->nia", DIFFERENTIATION, angles) / lengths[:, None, None]
    travelled = np.einsum("n,j,nja->a", lengths, BUTCHER[-1], omega)
    first = angles[0, 0]
    omega += (first[EXCHANGED] - first - travelled) / lengths.sum()
    after = STATE_COEFFICIENTS[1] @ angles[0] / lengths[0]
    unknowns, iterate = step.unknowns, step.iterate
    unknowns.of(iterate, "omega")[:] = omega.reshape(-1, ANGLES)
    unknowns.of(iterate, "start")[:] = np.concatenate([first, after])
    springs = np.array([guess.spring.stiffness, guess.spring.equilibrium])
    unknowns.of(iterate, "springs")[:] = ends.bounded(springs / np.array(spring_units(walker), dtype=float))
    unknowns.of(iterate, "torques")[:] = guess.torques.reshape(-1, 3) / float(torque_unit(walker))


def _prices(step: CondensedStep, walker: WalkerParameters) -> FloatArray:
    """Return the prices of a solution: the multipliers of its inequalities."""
    at_nodes = step.unknowns.of(step.iterate, "multipliers")[: step.limits.size]
    of_intervals = at_nodes.reshape(-1, STAGES, LIMITS).sum(axis=1)
    angles, gap = of_intervals[:, : 2 * ANGLES].sum(axis=1), of_intervals[:, GAP_LIMIT] / walker.leg_length
    return np.stack([angles, gap], axis=1) / step.objective()


def _solution(step: CondensedStep, ends: Ends, walker: WalkerParameters) -> RefinedPoints:
    """Return the values on the refined grid that angles and velocities of the iterate determine."""
    step.evaluate(settle=True)
    ends.evaluate(step)
    count = step.lengths.size
    start = step.unknowns.of(step.iterate, "start")
    angles = np.concatenate([start[None, :ANGLES], step.y[:, :ANGLES]])
    velocities = np.concatenate([start[None, ANGLES:], step.y[:, ANGLES : 2 * ANGLES]])
    places = _hip_places(step, angles, velocities)
    states = np.concatenate([places, angles, step.true_momenta], axis=1)
    nodes = states[1:].reshape(count, STAGES, 12)
    forces = np.zeros((count, STAGES, 4))
    forces[:, :, :2] = step.y[:, 8:10].reshape(count, STAGES, 2) + np.array([0.0, walker.weight])
    units = np.array(spring_units(walker), dtype=float)
    stiffness, equilibrium = step.unknowns.of(step.iterate, "springs") * units
    return RefinedPoints(
        states=np.concatenate([states[0 : 3 * count : STAGES][:, None], nodes], axis=1),
        torques=step.rows[:, :3].reshape(count, STAGES, 3) * float(torque_unit(walker)),
        forces=forces,
        durations=np.array([step.lengths.sum()]),
        impulses=np.concatenate([ends.impulse(), np.zeros(2)])[None],
        spring=KneeSpring(float(stiffness), float(equilibrium)),
    )


def _hip_places(step: CondensedStep, angles: FloatArray, velocities: FloatArray) -> FloatArray:
    """Return where the hip is at the start and the nodes, (1 + 3 n, 2), by collocation of its velocity."""
    count = step.lengths.size
    function = compiled(hip_functions)["condensed_hip"].map(len(angles))
    hip, hip_velocity = (np.asarray(one).T for one in function(angles.T, velocities.T, step.walker_vector))
    moved = np.einsum("n,ij,njx->nix", step.lengths, BUTCHER, hip_velocity[1:].reshape(count, STAGES, 2))
    starts = hip[0] + np.concatenate([np.zeros((1, 2)), np.cumsum(moved[:, -1], axis=0)[:-1]])
    return np.concatenate([hip[:1], (starts[:, None] + moved).reshape(-1, 2)])
