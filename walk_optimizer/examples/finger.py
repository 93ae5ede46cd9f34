"""A finger moves a disc that it does not touch at first."""

from dataclasses import dataclass

import numpy as np

from walk_optimizer.examples.finding import Finding
from walk_optimizer.examples.finger_check import certify_finger, contacts_of
from walk_optimizer.examples.finger_model import Finger
from walk_optimizer.examples.finger_problem import (
    FingerTask,
    FloatArray,
    U,
    finger_problem,
    point_units,
    points_of,
    still_guess,
)
from walk_optimizer.examples.relaxation import Way, best_of_ways, follow_relaxation
from walk_optimizer.solve.session import SolveSession


@dataclass(frozen=True, eq=False)
class FingerMotion:
    """What the finger does.

    Attributes:
        finger: Finger and disc.
        task: What was asked for.
        points: All points in SI units, (20, N).
        finding: Its contacts and residuals.
    """

    finger: Finger
    task: FingerTask
    points: FloatArray
    finding: Finding


def move_disc(finger: Finger, task: FingerTask, session: SolveSession) -> FingerMotion:
    """Return the motion of least torque that moves the disc, from a guess in which nothing moves."""
    return best_of_ways(lambda way: _moved(finger, task, way, session))


def _moved(finger: Finger, task: FingerTask, way: Way, session: SolveSession) -> FingerMotion:
    """Return where a way leads."""
    begin = session.elapsed
    x, solves = follow_relaxation(
        lambda relaxation: finger_problem(finger, task, relaxation),
        still_guess(finger, task),
        session,
        point_units(finger)[U.start] ** 2,
        way,
    )
    points = points_of(finger, x)
    finding = Finding(
        title=f"A finger moves a disc by {task.distance:g} m in {task.duration:g} s",
        points=("tip on disc", "disc on table"),
        schedule=contacts_of(finger, points),
        interval=task.interval,
        effort=float(np.sum(points[U] ** 2) / 2 * task.interval),
        solves=solves,
        seconds=session.elapsed - begin,
        certificate=certify_finger(finger, task, points),
    )
    return FingerMotion(finger, task, points, finding)
