"""What is watched while a step is integrated: the landing of the swing foot, and what counts as a fall."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.simulation.controllers import Controller
from walk_optimizer.simulation.ending import Ending
from walk_optimizer.simulation.ground import StepGround
from walk_optimizer.simulation.pinned_walker import SPEEDS, STATE_WIDTH, PinnedWalker
from walk_optimizer.simulation.settings import SimulationSettings

FloatArray = NDArray[np.float64]

# Joints that turn faster than this do not walk, in [rad/s].
_FASTEST = 1e3


@dataclass(frozen=True, eq=False)
class Watch:
    """A quantity that falls through zero when a step ends, in the form that SciPy's integrators take.

    Attributes:
        ending: How the step then ends.
        value: Of time since touch-down and state (8,).
    """

    ending: Ending
    value: Callable[[float, FloatArray], float]
    terminal = True
    direction = -1.0

    def __call__(self, time: float, values: FloatArray) -> float:
        """Return the quantity; what follows the state in the integrator's values does not matter."""
        return self.value(time, values[:STATE_WIDTH])


@dataclass(frozen=True, eq=False)
class Watcher:
    """Makes the watches of a step.

    Attributes:
        plant: The walker.
        controller: What drives it.
        settings: Where the limits are.
        ground: Under this step.
    """

    plant: PinnedWalker
    controller: Controller
    settings: SimulationSettings
    ground: StepGround

    def watches(self, push: float) -> list[Watch]:
        """Return all watches under a push on the hip in [N]."""

        def load(time: float, state: FloatArray) -> float:
            return float(self._reaction(time, state, push)[1])

        def grip(time: float, state: FloatArray) -> float:
            tangential, normal = self._reaction(time, state, push)
            return float(self.plant.walker.friction_coefficient * normal - abs(tangential))

        return [
            Watch(Ending.LANDED, self._above_landing),
            Watch(Ending.STUMBLED, self._above_stumbling),
            Watch(Ending.HIP_TOO_LOW, self._hip_height),
            Watch(Ending.LIFTED, load),
            Watch(Ending.SLIPPED, grip),
            Watch(Ending.TOO_FAST, _calm),
        ]

    def _reaction(self, time: float, state: FloatArray, push: float) -> FloatArray:
        return self.plant.reaction(state, self.controller.torque(time, state), push)

    def _in_zone(self, foot: FloatArray) -> bool:
        """Return whether a foot at (2,) in [m] is where it may land."""
        return bool(foot[0] > self.settings.landing_zone * self.ground.tread)

    def _above_landing(self, _: float, state: FloatArray) -> float:
        foot = self.plant.swing_foot(state)
        return self.ground.gap(foot) if self._in_zone(foot) else 1.0

    def _above_stumbling(self, _: float, state: FloatArray) -> float:
        foot = self.plant.swing_foot(state)
        return 1.0 if self._in_zone(foot) else self.ground.gap(foot) + self.settings.deepest_brush

    def _hip_height(self, _: float, state: FloatArray) -> float:
        lowest = self.settings.lowest_hip * self.plant.walker.leg_length
        return float(self.plant.hip(state)[1]) - lowest


def _calm(_: float, state: FloatArray) -> float:
    return _FASTEST - float(np.abs(state[SPEEDS]).max())
