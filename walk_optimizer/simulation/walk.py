"""Walks of many steps, and what may go wrong in them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.simulation.ending import Ending
from walk_optimizer.simulation.ground import StepGround
from walk_optimizer.simulation.step import Push, StepSimulator, Stride

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Disturbance:
    """What goes wrong in a step of a walk.

    Attributes:
        step: The step, counted from 1.
        push: A push in that step.
        step_down: The ground under the foot that ends that step lies lower by so much, in [m].
    """

    step: int
    push: Push
    step_down: float


@dataclass(frozen=True, eq=False)
class SimulatedWalk:
    """Steps, one after the other.

    Attributes:
        strides: The steps; only the last one may end in a fall.
    """

    strides: tuple[Stride, ...]

    @property
    def ending(self) -> Ending:
        """How the last step ended."""
        return self.strides[-1].ending

    @property
    def completed(self) -> list[Stride]:
        """The steps that ended on a foot."""
        return [stride for stride in self.strides if not stride.ending.is_fall]

    @property
    def mean_speed(self) -> float:
        """Distance over time of the completed steps in [m/s]; not a number without any."""
        time = sum(stride.time[-1] for stride in self.completed)
        return float(sum(stride.foot[0] for stride in self.completed) / time) if time else float("nan")

    @property
    def mean_effort(self) -> float:
        """Mean of the completed steps' integrals of 1/2 |u|^2 in [(N m)^2 s]; not a number without any."""
        efforts = [stride.effort for stride in self.completed]
        return float(np.mean(efforts)) if efforts else float("nan")

    @property
    def peak_torque(self) -> float:
        """Largest torque of any motor in [N m]."""
        return float(max(np.abs(stride.torques).max() for stride in self.strides))


def walk(
    simulator: StepSimulator,
    start: FloatArray,
    tread: float,
    steps: int,
    disturbance: Disturbance | None = None,
) -> SimulatedWalk:
    """Walk until the last step or a fall.

    Args:
        simulator: The walker with its feedback.
        start: State after touch-down, (8,).
        tread: Length of the gait's step in [m].
        steps: At most so many.
        disturbance: What goes wrong; None leaves the walk alone.
    """
    state, strides = start, list[Stride]()
    for number in range(1, steps + 1):
        push = disturbance.push if disturbance and number == disturbance.step else None
        ground = _ground(simulator, tread, number, disturbance)
        strides.append(simulator.run(state, ground, push))
        following = strides[-1].next_state
        if following is None:
            break
        state = following
    return SimulatedWalk(tuple(strides))


def _ground(
    simulator: StepSimulator, tread: float, number: int, disturbance: Disturbance | None
) -> StepGround:
    """Return the ground around the stance foot of a step."""
    drop, place = (disturbance.step_down, disturbance.step) if disturbance else (0.0, 0)
    ahead = drop if number == place else 0.0
    behind = -drop if number == place + 1 else 0.0
    return StepGround(simulator.plant.walker.terrain, tread, ahead, behind)
