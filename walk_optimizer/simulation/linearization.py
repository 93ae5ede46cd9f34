"""Small deviations from a gait, within a step and over its touch-down."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from walk_optimizer.simulation.controllers import PathFeedback
from walk_optimizer.simulation.pinned_walker import STATE_WIDTH
from walk_optimizer.simulation.reference import StepReference

FloatArray = NDArray[np.float64]

_TOLERANCES = {"rtol": 1e-8, "atol": 1e-8}


@dataclass(frozen=True, eq=False)
class LinearizedStep:
    """Small deviations from a gait: d' = A d + B v within the step, d+ = G d as it ends.

    Attributes:
        reference: The step.
    """

    reference: StepReference

    @cached_property
    def _jacobians(self) -> tuple[FloatArray, FloatArray]:
        model = self.reference.model
        pairs = [
            model.linearized(*pair)
            for pair in zip(self.reference.states, self.reference.torques, strict=True)
        ]
        return np.array([state for state, _ in pairs]), np.array([torque for _, torque in pairs])

    @property
    def timed(self) -> FloatArray:
        """A under torques that follow the clock, (PLACES, 8, 8)."""
        return self._jacobians[0]

    @property
    def input(self) -> FloatArray:
        """B, (PLACES, 8, 3)."""
        return self._jacobians[1]

    @cached_property
    def hip_gradients(self) -> FloatArray:
        """Derivative h of s by the state at each place, (PLACES, 8)."""
        return np.array([self.reference.model.hip_gradient(state) for state in self.reference.states])

    @cached_property
    def following(self) -> FloatArray:
        """A under torques u*(s) that follow the hip: A + B du*/ds h', (PLACES, 8, 8)."""
        slopes = self.reference.path_slopes[1]
        matrices: FloatArray = self.timed + np.einsum(
            "nij,nj,nk->nik", self.input, slopes, self.hip_gradients
        )
        return matrices

    @cached_property
    def across(self) -> FloatArray:
        """What a deviation has across the path, x - x*(s): I - dx*/ds h', (PLACES, 8, 8)."""
        slopes = self.reference.path_slopes[0]
        along = np.einsum("ni,nk->nik", slopes, self.hip_gradients)
        matrices: FloatArray = np.eye(STATE_WIDTH) - along
        return matrices

    @cached_property
    def jump(self) -> FloatArray:
        """G, the saltation of a touch-down (8, 8).

        A deviation d meets the ground by dt = -n'd / n'f later, n being the gradient of the foot's gap:
        G = dD/dx (I - f n' / n'f) with D the touch-down. The next step begins where it lands, so what a
        saltation matrix has of the motion after the impact is left out [Manchester2011], [Aizerman1958].
        """
        project = np.eye(STATE_WIDTH) - np.outer(self._last_rate, self._gap_gradient) / self.landing_speed
        jump: FloatArray = self.reference.model.touch_down_jacobian(self.reference.states[-1]) @ project
        return jump

    @cached_property
    def _last_rate(self) -> FloatArray:
        return self.reference.model.rate(self.reference.states[-1], self.reference.torques[-1])

    @cached_property
    def _gap_gradient(self) -> FloatArray:
        """Derivative of the swing foot's gap by the state at the end of the step, (8,)."""
        rows = self.reference.model.swing_foot_jacobian(self.reference.states[-1])
        normal: FloatArray = self.reference.model.walker.terrain.along_and_normal(rows)[1]
        return normal

    def _transition(self, matrix: Callable[[float], FloatArray]) -> FloatArray:
        """Return what becomes of deviations within the step under d' = A(t) d, (8, 8)."""

        def rate(time: float, flat: FloatArray) -> FloatArray:
            change: FloatArray = matrix(time) @ flat.reshape(STATE_WIDTH, STATE_WIDTH)
            return change.ravel()

        start, span = np.eye(STATE_WIDTH).ravel(), (0.0, self.reference.step_time)
        end: FloatArray = solve_ivp(rate, span, start, method="DOP853", **_TOLERANCES).y[:, -1]
        return end.reshape(STATE_WIDTH, STATE_WIDTH)

    @cached_property
    def landing_speed(self) -> float:
        """Speed at which the swing foot meets the ground, n'f, downward negative, in [m/s]."""
        return float(self._gap_gradient @ self._last_rate)

    @cached_property
    def open_loop(self) -> FloatArray:
        """Monodromy matrix under the gait's torques against time, which begin anew at touch-down, (8, 8)."""
        reference = self.reference
        path = CubicSpline(reference.time, np.hstack([reference.states, reference.torques]))

        def matrix(time: float) -> FloatArray:
            values = path(time)
            return reference.model.linearized(values[:STATE_WIDTH], values[STATE_WIDTH:])[0]

        return self.jump @ self._transition(matrix)

    def closed_loop(self, feedback: PathFeedback) -> FloatArray:
        """Return the monodromy matrix under feedback, (8, 8)."""
        reference = self.reference
        progress = CubicSpline(reference.time, reference.progress)

        def matrix(time: float) -> FloatArray:
            state, torque, gradient = feedback.linearized(float(progress(time)))
            by_state, by_torque = reference.model.linearized(state, torque)
            return by_state + by_torque @ gradient

        return self.jump @ self._transition(matrix)


def largest_multiplier(monodromy: FloatArray) -> float:
    """Return the largest magnitude of the eigenvalues: deviations are so many times larger a step later."""
    return float(np.abs(np.linalg.eigvals(monodromy)).max())
