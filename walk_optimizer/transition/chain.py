"""From paces to the end of a chain of steps, and from a solved chain to its steps.

In a chain the legs keep the names that they have in its first step.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from walk_optimizer.gait import Certificate, RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.kinematics import HIP_X
from walk_optimizer.model.mechanics import foot_2_ahead
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.transcription.boundary import JOINT_ROWS
from walk_optimizer.transcription.mesh import Mesh
from walk_optimizer.transcription.transition import End
from walk_optimizer.transition.paces import (
    EXCHANGED,
    Pace,
    border_state,
    former_step_sees,
    velocity,
    with_legs_exchanged,
)
from walk_optimizer.transition.plan import ContactPlan
from walk_optimizer.transition.standing import Standing


def end_in(target: Pace, plan: ContactPlan) -> End:
    """Return the end of a chain of steps that leads to a pace."""
    state = former_step_sees(target.walker, border_state(target))
    if len(plan.steps) % 2 == 0:
        state = state[EXCHANGED]
    joints = list(JOINT_ROWS)
    speeds = velocity(target.walker, state)[joints]
    return End(state[joints], speeds, plan.landing, at_rest=isinstance(target, Standing))


def steps_of(
    walker: WalkerParameters,
    spring: KneeSpring,
    trajectory: RefinedTrajectory,
    mesh: Mesh,
    phases: Sequence[int],
) -> list[RefinedGait]:
    """Return the steps of a chain, each seen from its own stance foot, as yet without certificates.

    Args:
        walker: The walker.
        spring: K and q_eq of both knees.
        trajectory: The whole chain.
        mesh: Its phases and intervals.
        phases: Number of phases of each step.
    """
    counts = np.array([part.size for part in mesh.parts])
    ends = np.cumsum([int(own.sum()) for own in np.split(counts, np.cumsum(phases)[:-1])])
    steps, origin = [], 0.0
    for number, (first, end) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
        step = _seen_from(_cut(trajectory, int(first), int(end)), origin, exchanged=number % 2 == 1)
        length = foot_2_ahead(walker, step.states[-1, -1])
        steps.append(RefinedGait(step, spring, length, Certificate(())))
        origin += length
    return steps


def _cut(trajectory: RefinedTrajectory, first: int, end: int) -> RefinedTrajectory:
    """Return some of the intervals, their time beginning with 0."""
    part = slice(first, end)
    return RefinedTrajectory(
        trajectory.breaks[first : end + 1] - trajectory.breaks[first],
        trajectory.states[part],
        trajectory.torques[part],
        trajectory.forces[part],
        trajectory.impulses[part],
    )


def _seen_from(trajectory: RefinedTrajectory, origin: float, exchanged: bool) -> RefinedTrajectory:
    """Return a trajectory as a step sees it whose stance foot is at a place in [m] along the way."""
    seen = with_legs_exchanged(trajectory) if exchanged else trajectory
    states = np.array(seen.states)
    states[:, :, HIP_X] -= origin
    return replace(seen, states=states)
