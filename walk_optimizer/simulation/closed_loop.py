"""A gait with its feedback, ready to walk."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait import Gait
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.simulation.controllers import Controller, FeedForward, PathFeedback
from walk_optimizer.simulation.linearization import LinearizedStep
from walk_optimizer.simulation.pinned_walker import PinnedWalker
from walk_optimizer.simulation.reference import StepReference, step_reference
from walk_optimizer.simulation.regulator import regulator_gains
from walk_optimizer.simulation.settings import SimulationSettings
from walk_optimizer.simulation.step import Push, StepSimulator
from walk_optimizer.simulation.walk import Disturbance, SimulatedWalk, walk

FloatArray = NDArray[np.float64]

_MASSES = ("hip_mass", "upper_leg_mass", "lower_leg_mass")


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A gait, its feedback, and the walker that walks it.

    Attributes:
        step: The gait's step and what is linear about it.
        feedback: The feedback law.
        plant: The walker that walks; it may differ from that of the gait.
        settings: What ends a walk, and how it is disturbed.
    """

    step: LinearizedStep
    feedback: PathFeedback
    plant: PinnedWalker
    settings: SimulationSettings

    @property
    def reference(self) -> StepReference:
        """The gait's step."""
        return self.step.reference

    @property
    def start(self) -> FloatArray:
        """State of the gait after touch-down, (8,)."""
        state: FloatArray = self.reference.states[0]
        return state

    def simulator(self, controller: Controller | None = None) -> StepSimulator:
        """Return the simulator of single steps, under the feedback or another controller."""
        driven = controller or self.feedback
        return StepSimulator(self.plant, driven, self.settings, self.reference.step_time)

    def walk(
        self, steps: int, disturbance: Disturbance | None = None, start: FloatArray | None = None
    ) -> SimulatedWalk:
        """Walk under feedback from the gait's start or another state (8,)."""
        first = self.start if start is None else start
        return walk(self.simulator(), first, self.reference.step_length, steps, disturbance)

    def walk_without_feedback(self, steps: int) -> SimulatedWalk:
        """Walk on the gait's torques against time alone."""
        simulator = self.simulator(FeedForward(self.reference))
        return walk(simulator, self.start, self.reference.step_length, steps)

    def disturbance(self, push: float = 0.0, step_down: float = 0.0) -> Disturbance:
        """Return what goes wrong in the step that the settings name.

        Args:
            push: On the hip, forward positive, in [N s].
            step_down: The step leads down by so much, in [m].
        """
        start = self.settings.push_phase * self.reference.step_time
        push_then = Push(push, start, self.settings.push_duration)
        return Disturbance(self.settings.disturbed_step, push_then, step_down)

    def heavier(self, factor: float) -> "ClosedLoop":
        """Return the same feedback on a walker whose masses are so many times as large."""
        walker = self.plant.walker
        return self._on(replace(walker, **{name: factor * getattr(walker, name) for name in _MASSES}))

    def on_ground(self, friction: float) -> "ClosedLoop":
        """Return the same feedback on ground of another friction coefficient."""
        return self._on(replace(self.plant.walker, friction_coefficient=friction))

    def _on(self, walker: WalkerParameters) -> "ClosedLoop":
        return replace(self, plant=PinnedWalker(walker, self.plant.spring, self.plant.stop))

    def largest_deviation(self, result: SimulatedWalk) -> float:
        """Return how far any joint was from the gait at the same place of the hip, in [rad]."""
        deviations = (self.feedback.deviation(state) for stride in result.strides for state in stride.states)
        return float(max(np.abs(deviation[:4]).max() for deviation in deviations))


def closed_loop(gait: Gait, settings: SimulationSettings) -> ClosedLoop:
    """Return a gait with its feedback, on the walker that it was made for.

    Raises:
        InvalidRequestError: the gait has no accurate solution, or is no plain walking.
        SolveFailedError: no feedback holds it.
    """
    reference = step_reference(gait)
    step = LinearizedStep(reference)
    gains = regulator_gains(step, settings.weights)
    feedback = PathFeedback(reference, gains, settings.torque_limit)
    plant = PinnedWalker(gait.walker, reference.model.spring, settings.knee_stop)
    return ClosedLoop(step, feedback, plant, settings)
