"""One step of a walk: single support until the swing foot lands, or the walker falls."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from walk_optimizer.simulation.controllers import Controller
from walk_optimizer.simulation.ending import Ending
from walk_optimizer.simulation.ground import StepGround
from walk_optimizer.simulation.pinned_walker import STATE_WIDTH, PinnedWalker
from walk_optimizer.simulation.settings import SimulationSettings
from walk_optimizer.simulation.watches import Watch, Watcher

FloatArray = NDArray[np.float64]

_TOLERANCES = {"rtol": 1e-7, "atol": 1e-8}
# The motion is looked at so many times a step at least, so that no event hides between.
_LOOKS = 50


@dataclass(frozen=True)
class Push:
    """A horizontal force on the hip.

    Attributes:
        impulse: Forward positive, in [N s].
        start: Time since touch-down in [s].
        duration: In [s].
    """

    impulse: float
    start: float
    duration: float

    @property
    def force(self) -> float:
        """In [N], constant while it lasts."""
        return self.impulse / self.duration

    @property
    def end(self) -> float:
        """Time since touch-down in [s]."""
        return self.start + self.duration


@dataclass(frozen=True, eq=False)
class Stride:
    """What happened in a step.

    Attributes:
        time: Since touch-down in [s], (n,).
        states: Joint angles and their rates, (n, 8).
        torques: In [N m], (n, 3).
        effort: Integral of 1/2 |u|^2 in [(N m)^2 s].
        foot: Where the swing foot was at the end, from the stance foot, in [m], (2,).
        ending: How it ended.
        next_state: State after touch-down, the legs' names changed, (8,); None after a fall.
    """

    time: FloatArray
    states: FloatArray
    torques: FloatArray
    effort: float
    foot: FloatArray
    ending: Ending
    next_state: FloatArray | None


@dataclass(frozen=True, eq=False)
class StepSimulator:
    """Integrates steps of a walker, apart from the transcription that made its gait.

    Attributes:
        plant: The walker that walks, with its knee stops.
        controller: What drives it.
        settings: What ends a walk.
        step_time: Of the gait in [s].
    """

    plant: PinnedWalker
    controller: Controller
    settings: SimulationSettings
    step_time: float

    def run(self, state: FloatArray, ground: StepGround, push: Push | None = None) -> Stride:
        """Simulate a step from the state after touch-down (8,)."""
        watcher = Watcher(self.plant, self.controller, self.settings, ground)
        times, values = [np.zeros(1)], [np.append(state, 0.0)[None]]
        ending = None
        for start, end, force in self._stretches(push):
            stretch = self._integrate(values[-1][-1], (start, end), force, watcher.watches(force))
            times.append(stretch[0])
            values.append(stretch[1])
            ending = stretch[2]
            if ending is not None:
                break
        return self._stride(np.concatenate(times), np.concatenate(values), ending or Ending.NO_TOUCH_DOWN)

    def _stretches(self, push: Push | None) -> list[tuple[float, float, float]]:
        """Return start and end [s] and push [N] of the stretches of a step: forces change between."""
        latest = self.settings.latest_touch_down * self.step_time
        if push is None:
            return [(0.0, latest, 0.0)]
        breaks = [0.0, min(push.start, latest), min(push.end, latest), latest]
        forces = (0.0, push.force, 0.0)
        return [
            (start, end, force)
            for (start, end), force in zip(pairwise(breaks), forces, strict=True)
            if start < end
        ]

    def _integrate(
        self, start: FloatArray, span: tuple[float, float], push: float, watches: list[Watch]
    ) -> tuple[FloatArray, FloatArray, Ending | None]:
        """Return times, states with their effort, and how the step ended if it did."""
        for watch in watches:
            # The integrator sees only what changes sign.
            if watch(span[0], start) < 0:
                return np.zeros(0), np.zeros((0, STATE_WIDTH + 1)), watch.ending

        def rate(time: float, values: FloatArray) -> FloatArray:
            state = values[:STATE_WIDTH]
            torque = self.controller.torque(time, state)
            return np.append(self.plant.rate(state, torque, push), torque @ torque / 2)

        solution = solve_ivp(
            rate,
            span,
            start,
            method="DOP853",
            events=watches,
            max_step=self.step_time / _LOOKS,
            **_TOLERANCES,
        )
        happened = [
            watch.ending for watch, found in zip(watches, solution.t_events, strict=True) if found.size
        ]
        ending = happened[0] if happened else None if solution.success else Ending.TOO_FAST
        return solution.t[1:], solution.y.T[1:], ending

    def _stride(self, time: FloatArray, values: FloatArray, ending: Ending) -> Stride:
        """Return the record of a step, with the impact if it ended in one."""
        states, following = values[:, :STATE_WIDTH], None
        if ending is Ending.LANDED:
            ending, following = self._landed(states[-1])
        torques = [self.controller.torque(*pair) for pair in zip(time, states, strict=True)]
        foot = self.plant.swing_foot(states[-1])
        return Stride(time, states, np.array(torques), float(values[-1, -1]), foot, ending, following)

    def _landed(self, state: FloatArray) -> tuple[Ending, FloatArray | None]:
        """Return whether the foot holds, and the state after touch-down if it does."""
        after, impulse = self.plant.touch_down(state)
        if abs(impulse[0]) > self.plant.walker.friction_coefficient * impulse[1]:
            return Ending.BAD_LANDING, None
        return Ending.LANDED, after
