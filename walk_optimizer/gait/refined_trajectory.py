"""The refined solution of a step: polynomials on the collocation intervals."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.transcription.tableau import NODE_COEFFICIENTS, QUADRATURE, STATE_COEFFICIENTS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class RefinedTrajectory:
    """A step on collocation intervals; arrays are read-only.

    States are cubic in each interval, torques and ground reactions quadratic. States jump between
    intervals where a foot lands.

    Attributes:
        breaks: Ends of the intervals from 0 to the step time in [s], (n + 1,).
        states: q (6) and p (6) at the start of each interval and at its three nodes, (n, 4, 12).
        torques: u at the nodes in [N m], (n, 3, 3).
        forces: Ground reactions at the nodes in [N], (n, 3, 4): x, y of foot 1, then of foot 2.
        impulses: Of the impact before each interval in [N s], (n, 4); zero where there is none.
    """

    breaks: FloatArray
    states: FloatArray
    torques: FloatArray
    forces: FloatArray
    impulses: FloatArray

    def __post_init__(self) -> None:
        """Make every array read-only."""
        for name in ("breaks", "states", "torques", "forces", "impulses"):
            copy = np.array(getattr(self, name), dtype=np.float64)
            copy.setflags(write=False)
            object.__setattr__(self, name, copy)

    @property
    def intervals(self) -> int:
        """Number n of intervals."""
        return self.breaks.size - 1

    @property
    def step_time(self) -> float:
        """Duration of the step in [s]."""
        return float(self.breaks[-1])

    @property
    def is_finite(self) -> bool:
        """Whether every value is a finite number."""
        values = (self.breaks, self.states, self.torques, self.forces, self.impulses)
        return all(bool(np.isfinite(one).all()) for one in values)

    @cached_property
    def lengths(self) -> FloatArray:
        """Lengths of the intervals in [s], (n,)."""
        return np.diff(self.breaks)

    @property
    def torque_effort(self) -> float:
        """Integral over the step of 1/2 |u|^2 dt in [(N m)^2 s], by the method's own quadrature."""
        return float(np.einsum("n,j,njk->", self.lengths, QUADRATURE, self.torques**2) / 2)

    @cached_property
    def _state_polynomials(self) -> FloatArray:
        coefficients: FloatArray = np.einsum("kj,njs->nks", STATE_COEFFICIENTS, self.states)
        return coefficients

    @cached_property
    def _torque_polynomials(self) -> FloatArray:
        coefficients: FloatArray = np.einsum("kj,njs->nks", NODE_COEFFICIENTS, self.torques)
        return coefficients

    @cached_property
    def _force_polynomials(self) -> FloatArray:
        coefficients: FloatArray = np.einsum("kj,njs->nks", NODE_COEFFICIENTS, self.forces)
        return coefficients

    @cached_property
    def motion_polynomials(self) -> FloatArray:
        """Coefficients of powers, lowest first, of q, qdot and u side by side, (n, 4, 15).

        A fast loop evaluates all of them by one product. Those of qdot and u have no cubes.
        """
        q = self._state_polynomials[:, :, :6]
        qdot, u = np.zeros_like(q), np.zeros((self.intervals, 4, 3))
        qdot[:, :3] = np.arange(1, 4)[:, None] * q[:, 1:] / self.lengths[:, None, None]
        u[:, :3] = self._torque_polynomials
        return np.concatenate([q, qdot, u], axis=2)

    def locate(self, time: float) -> tuple[int, float]:
        """Return the interval of a time in [s] and the place in it, in [0, 1]."""
        index = min(max(int(self.breaks.searchsorted(time, side="left")) - 1, 0), self.intervals - 1)
        return index, (time - self.breaks[index]) / float(self.lengths[index])

    def state(self, index: int, place: float) -> FloatArray:
        """Return q and p, (12,), at a place of an interval."""
        values: FloatArray = place ** np.arange(4) @ self._state_polynomials[index]
        return values

    def states_at(self, places: FloatArray) -> FloatArray:
        """Return q and p at the same m places of all intervals, (n, m, 12)."""
        values: FloatArray = np.einsum(
            "mk,nks->nms", places[:, None] ** np.arange(4), self._state_polynomials
        )
        return values

    def motion(self, index: int, place: float) -> FloatArray:
        """Return q, qdot (the derivative of the polynomial q) and u, (15,), at a place of an interval."""
        powers = np.array([1.0, place, place**2, place**3])
        values: FloatArray = powers @ self.motion_polynomials[index]
        return values

    def torque(self, index: int, place: float) -> FloatArray:
        """Return u in [N m], (3,), at a place of an interval."""
        values: FloatArray = place ** np.arange(3) @ self._torque_polynomials[index]
        return values

    def torques_at(self, indices: IntArray, place: float) -> FloatArray:
        """Return u in [N m], (n, 3), at the same place of n intervals."""
        values: FloatArray = np.einsum("k,nks->ns", place ** np.arange(3), self._torque_polynomials[indices])
        return values

    def force(self, index: int, place: float) -> FloatArray:
        """Return the ground reactions in [N], (4,), at a place of an interval."""
        values: FloatArray = place ** np.arange(3) @ self._force_polynomials[index]
        return values
