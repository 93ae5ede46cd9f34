"""What a gait with its feedback gets over."""

from dataclasses import dataclass

import numpy as np

from walk_optimizer.simulation.closed_loop import ClosedLoop
from walk_optimizer.simulation.ending import Ending
from walk_optimizer.simulation.pinned_walker import STATE_WIDTH

# Pushes are bracketed from here by doubling, up to there, and told apart so finely, in [N s].
_SMALLEST_PUSH, _LARGEST_PUSH, _PUSH_RESOLUTION = 1.0, 64.0, 0.5
# Steps within which a push shows whether it is survived.
_STEPS_AFTER_PUSH = 8
# The disturbances of the table: onto lower ground in [m], masses, a swing leg that is ahead in [rad].
STEP_DOWN, HEAVIER, START_ERROR = 0.01, 1.05, 0.01
_SWING_UPPER_LEG = 2


@dataclass(frozen=True)
class Robustness:
    """How walks end, and the largest pushes that do not end one.

    Attributes:
        alone: Without a disturbance.
        step_down: With a step onto ground that lies 1 cm lower.
        heavier: With masses that are 5 % larger than the feedback knows.
        start_error: With the swing leg 0.01 rad ahead at first.
        push_forward: In [N s]; 0 where none of 1 N s is survived.
        push_backward: The same against the walk, in [N s].
    """

    alone: Ending
    step_down: Ending
    heavier: Ending
    start_error: Ending
    push_forward: float
    push_backward: float


def robustness(loop: ClosedLoop, steps: int) -> Robustness:
    """Walk `steps` steps with each disturbance and find the largest pushes."""
    error = np.zeros(STATE_WIDTH)
    error[_SWING_UPPER_LEG] = START_ERROR
    return Robustness(
        loop.walk(steps).ending,
        loop.walk(steps, loop.disturbance(step_down=STEP_DOWN)).ending,
        loop.heavier(HEAVIER).walk(steps).ending,
        loop.walk(steps, start=loop.start + error).ending,
        largest_push(loop, 1.0),
        largest_push(loop, -1.0),
    )


def largest_push(loop: ClosedLoop, direction: float) -> float:
    """Return the largest push on the hip that is survived in [N s], by bisection.

    Where a larger push is survived and a smaller one is not, the one that is found may be either.

    Args:
        loop: The gait with its feedback.
        direction: 1 forward, -1 backward.
    """
    survived, fatal = 0.0, _SMALLEST_PUSH
    while _survives(loop, direction * fatal):
        survived, fatal = fatal, 2 * fatal
        if survived >= _LARGEST_PUSH:
            return survived
    while survived and fatal - survived > _PUSH_RESOLUTION:
        middle = (survived + fatal) / 2
        if _survives(loop, direction * middle):
            survived = middle
        else:
            fatal = middle
    return survived


def _survives(loop: ClosedLoop, impulse: float) -> bool:
    steps = loop.settings.disturbed_step + _STEPS_AFTER_PUSH
    return not loop.walk(steps, loop.disturbance(push=impulse)).ending.is_fall
