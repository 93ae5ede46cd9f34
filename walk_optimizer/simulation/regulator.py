"""Feedback gains: a linear-quadratic regulator along the periodic path of a gait."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.simulation.linearization import LinearizedStep
from walk_optimizer.simulation.pinned_walker import ANGLES, STATE_WIDTH
from walk_optimizer.simulation.reference import PLACES
from walk_optimizer.simulation.settings import RegulatorWeights

FloatArray = NDArray[np.float64]

_MOST_STEPS = 200
_CONVERGED = 1e-6


def regulator_gains(step: LinearizedStep, weights: RegulatorWeights) -> FloatArray:
    """Return K at each place, (PLACES, 3, 8): the cheapest way back to the path, over all steps to come.

    The Riccati equation of the cost d'P'Q P d + v'R v, P leaving of a deviation d what it has across the
    path, is followed backward over steps until it repeats, with S(T) = G' S(0) G at touch-downs
    [Manchester2011]. Torques are held between the places, 1 to 2 ms, as a computer does:
    K = -(R + B'S B)^-1 B'S A with the A, B of such an interval.

    Raises:
        SolveFailedError: it does not repeat: no feedback holds this gait.
    """
    recursion = _Recursion.of(step, weights)
    value, gains = recursion.cost[-1], np.zeros((PLACES, 3, STATE_WIDTH))
    for _ in range(_MOST_STEPS):
        former, (value, gains) = value, recursion.backward(step.jump.T @ value @ step.jump)
        if np.abs(value - former).max() < _CONVERGED * np.abs(value).max():
            return gains
    raise SolveFailedError(f"the regulator's Riccati equation did not settle in {_MOST_STEPS} steps")


@dataclass(frozen=True, eq=False)
class _Recursion:
    """The regulator's problem with torques held between places.

    Attributes:
        state: d of the next place by d of a place, (PLACES - 1, 8, 8).
        input: d of the next place by the torques, (PLACES - 1, 8, 3).
        cost: P'Q P of an interval at each place, (PLACES, 8, 8).
        torque_cost: R of an interval, (3, 3).
        across: P at each place, (PLACES, 8, 8).
    """

    state: FloatArray
    input: FloatArray
    cost: FloatArray
    torque_cost: FloatArray
    across: FloatArray

    @classmethod
    def of(cls, step: LinearizedStep, weights: RegulatorWeights) -> "_Recursion":
        """Return the problem of a step."""
        interval = step.reference.step_time / (PLACES - 1)
        both = np.concatenate([step.following, step.input], axis=2)
        generator = np.zeros((PLACES - 1, STATE_WIDTH + 3, STATE_WIDTH + 3))
        generator[:, :STATE_WIDTH] = interval * (both[:-1] + both[1:]) / 2
        transitions = expm(generator)
        size = np.full(STATE_WIDTH, weights.speed)
        size[ANGLES] = weights.angle
        return cls(
            transitions[:, :STATE_WIDTH, :STATE_WIDTH],
            transitions[:, :STATE_WIDTH, STATE_WIDTH:],
            interval * np.einsum("nij,i,nik->njk", step.across, size**-2, step.across),
            interval * np.eye(3) / weights.torque**2,
            step.across,
        )

    def backward(self, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return S at the start of a step and K at each place, S at its end being given."""
        value, gains = end, np.zeros((PLACES, 3, STATE_WIDTH))
        for place in reversed(range(PLACES - 1)):
            state, effect = self.state[place], self.input[place]
            gain = -np.linalg.solve(self.torque_cost + effect.T @ value @ effect, effect.T @ value @ state)
            value = self.cost[place] + state.T @ value @ (state + effect @ gain)
            # Along the path S is zero; rounding must not fill it.
            value = self.across[place].T @ (value + value.T) / 2 @ self.across[place]
            gains[place] = gain @ self.across[place]
        gains[-1] = gains[-2]
        return value, gains
