"""Feedback laws: the time since touch-down and the state to torques."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from walk_optimizer.simulation.pinned_walker import STATE_WIDTH
from walk_optimizer.simulation.reference import StepReference

FloatArray = NDArray[np.float64]

# Where the torques stand behind the states.
_TORQUES = slice(STATE_WIDTH, STATE_WIDTH + 3)


class Controller(Protocol):
    """What drives the walker."""

    def torque(self, elapsed: float, state: FloatArray) -> FloatArray:
        """Return torques in [N m], (3,).

        Args:
            elapsed: Time since touch-down in [s].
            state: Joint angles and their rates, (8,).
        """


@dataclass(frozen=True, eq=False)
class FeedForward:
    """The torques of the gait against time, without feedback; they begin anew at every touch-down."""

    reference: StepReference

    @cached_property
    def _torques(self) -> CubicSpline:
        return CubicSpline(self.reference.time, self.reference.torques)

    def torque(self, elapsed: float, state: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the gait's torques; after its step time the last ones."""
        torques: FloatArray = self._torques(min(elapsed, self.reference.step_time))
        return torques


@dataclass(frozen=True, eq=False)
class PathFeedback:
    """u = u*(s) + K(s) (x - x*(s)) within the motors' limit, s being how far the hip has come.

    Attributes:
        reference: The step x*, u*.
        gains: K at the reference's places, (PLACES, 3, 8).
        torque_limit: Of each motor in [N m].
    """

    reference: StepReference
    gains: FloatArray
    torque_limit: float

    @cached_property
    def _law(self) -> CubicSpline:
        reference = self.reference
        return CubicSpline(
            reference.progress,
            np.hstack([reference.states, reference.torques, self.gains.reshape(len(self.gains), -1)]),
        )

    def torque(self, elapsed: float, state: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the torques; they do not depend on the time."""
        wanted, torque, gain = self._at(self.reference.model.hip(state)[0])
        limited: FloatArray = np.clip(torque + gain @ (state - wanted), -self.torque_limit, self.torque_limit)
        return limited

    def deviation(self, state: FloatArray) -> FloatArray:
        """Return the state less that of the gait where the hip is as far, (8,)."""
        return state - self._at(self.reference.model.hip(state)[0])[0]

    def linearized(self, progress: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return x* (8,), u* (3,) and the derivative of the law by the state there, (3, 8).

        du/dx = du*/ds h' + K (I - dx*/ds h'), h being the derivative of s by the state.
        """
        state, torque, gain = self._at(progress)
        slopes = self._law(progress, 1)
        along = self.reference.model.hip_gradient(state)
        across = np.eye(STATE_WIDTH) - np.outer(slopes[:STATE_WIDTH], along)
        return state, torque, np.outer(slopes[_TORQUES], along) + gain @ across

    def _at(self, progress: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return x*, u* and K at s in [m]; beyond the ends of the step the path runs on straight."""
        ends, slopes = self.reference.progress, self.reference.path_slopes[0]
        inside = min(max(progress, ends[0]), ends[-1])
        values = self._law(inside)
        state = values[:STATE_WIDTH]
        if inside != progress:
            state = state + slopes[0 if progress < inside else -1] * (progress - inside)
        return state, values[_TORQUES], values[_TORQUES.stop :].reshape(3, STATE_WIDTH)
