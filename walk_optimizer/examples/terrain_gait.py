"""A gait on a slope or stairs whose contacts nobody gives: both feet carry the walker in the guess."""

from dataclasses import dataclass

import numpy as np

from walk_optimizer.certificate.grid import certify, landing_distance
from walk_optimizer.contact.observation import schedule_of
from walk_optimizer.examples.finding import Finding
from walk_optimizer.examples.relaxation import Way, best_of_ways, follow_relaxation
from walk_optimizer.gait import Trajectory
from walk_optimizer.guess.kinematic import FloatArray, GuessShape, kinematic_guess
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.transcription import layout
from walk_optimizer.transcription.problems import complementarity_problem, from_scaled, to_scaled
from walk_optimizer.transcription.scaling import torque_unit


@dataclass(frozen=True, eq=False)
class TerrainGait:
    """A gait whose contacts were found.

    Attributes:
        walker: The walker with its terrain.
        request: What was asked for.
        trajectory: One step.
        finding: Its contacts and residuals.
    """

    walker: WalkerParameters
    request: GaitRequest
    trajectory: Trajectory
    finding: Finding


def unscheduled_guess(walker: WalkerParameters, request: GaitRequest, shape: GuessShape) -> FloatArray:
    """Return the kinematic guess, (23, N) in SI units, with half the weight on each foot throughout."""
    points = kinematic_guess(walker, request, shape)
    points[layout.REACTION] = 0.0
    points[layout.REACTION][[2, 5]] = walker.weight / 2
    return points


def find_contacts(
    walker: WalkerParameters, request: GaitRequest, shape: GuessShape, session: SolveSession
) -> TerrainGait:
    """Return the best periodic gait that complementarity alone leads to."""
    return best_of_ways(lambda way: _found(walker, request, shape, way, session))


def _found(
    walker: WalkerParameters,
    request: GaitRequest,
    shape: GuessShape,
    way: Way,
    session: SolveSession,
) -> TerrainGait:
    begin = session.elapsed
    x, solves = follow_relaxation(
        lambda relaxation: complementarity_problem(request, walker, relaxation),
        to_scaled(walker, unscheduled_guess(walker, request, shape), KneeSpring()),
        session,
        torque_unit(walker) ** 2,
        way,
    )
    points, spring = from_scaled(walker, x)
    trajectory = Trajectory.from_stacked(points, request.step_time)
    parts = (trajectory.q, trajectory.p, trajectory.reaction)
    finding = Finding(
        title=_title(walker, landing_distance(walker, trajectory)),
        points=("stance foot", "swing foot"),
        schedule=schedule_of(walker, request.step_length, *parts),
        interval=request.interval,
        effort=trajectory.torque_cost * request.interval,
        solves=solves,
        seconds=session.elapsed - begin,
        certificate=certify(walker, request, spring, trajectory),
    )
    return TerrainGait(walker, request, trajectory, finding)


def _title(walker: WalkerParameters, step_length: float) -> str:
    terrain = walker.terrain
    ground = f"slope {np.degrees(terrain.slope):+.3g} degrees, step-up {100 * terrain.step_up:g} cm"
    return f"A gait with steps of {step_length:.3f} m: {ground}"
