"""A primal-dual interior-point method for condensed steps, made for starts near a solution.

Mehrotra's predictor and corrector [Mehrotra1992], with Gondzio's centrality correctors [Gondzio1996]: a
direction costs an eighth of a factorisation here, so several are made of each. There is no line search.
A start that is too far away shows in iterations that do not end, and another method has to take it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.condensed.ends import Ends, JoinedEnds
from walk_optimizer.condensed.kernel import GAP_LIMIT
from walk_optimizer.condensed.step import CondensedStep
from walk_optimizer.solve.solution import IterationState, Monitor
from walk_optimizer.solve.status import Status

FloatArray = NDArray[np.float64]

_MOST_ITERATIONS = 40
# After so many without a smaller infeasibility the start is taken for too far away.
_MOST_IN_VAIN = 12
# First products of slacks and multipliers add up to so many times the objective.
_FIRST_BARRIER = 3.0
# They add up to this part of it at the end, or to less: what the objective may be above the optimum.
_GAP = 1e-6
# No product is wanted smaller than this part of what it may be at the end.
_LEAST_PRODUCT = 0.3
# Largest change of an angular velocity in [rad/s], and of K and q_eq in their units, by the last step.
_LAST_STEP = 1e-2
# Products stay this part of the objective above zero for each unit of infeasibility: iterates that are on
# their bounds before they meet the equations come to a halt.
_PRODUCTS_FOR_INFEASIBILITY = 0.1
# No first slack is smaller, in natural units.
_LEAST_SLACK = 1e-3
_TO_THE_BOUNDARY = 0.995
_CORRECTORS = 3
# Products may be so many times smaller and larger than wanted before a corrector sees to it.
_SMALLEST, _LARGEST = 0.1, 10.0
# Steps that a corrector has to be longer by, and by how much it tries.
_LONGER, _TRIED_LONGER = 0.01, 0.3
# Shares of the Lagrangian's curvature: less where it is not convex. The first multipliers know nothing of it.
_CURVATURES = (1.0, 0.5, 0.25, 0.0)
_FIRST_CURVATURES = (0.0,)
_SMALLEST_NUMBER = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class _Direction:
    """A direction with the longest steps along it.

    Attributes:
        change: Of all unknowns.
        primal: Longest step of the primal ones that keeps slacks positive, at most 1.
        dual: The same of the multipliers.
    """

    change: FloatArray
    primal: float
    dual: float

    @property
    def shorter(self) -> float:
        return min(self.primal, self.dual)


class InteriorPoint:
    """Finds the step of least torque near the iterate of a condensed step."""

    def __init__(self, step: CondensedStep, ends: Ends, tolerance: float) -> None:
        """Take the first iterate: angular velocities, start, springs and torques are set.

        Args:
            step: The step; its iterate is changed in place.
            ends: Its ends.
            tolerance: Largest violation of an equation, in natural units, and largest mean product of
                slacks and multipliers, at which the step counts as solved.
        """
        self._step, self._ends, self._tolerance = step, ends, tolerance
        at_nodes = np.ones(step.limits.shape, dtype=bool)
        at_nodes[-1, GAP_LIMIT] = False  # of the foot that lands
        self._used = np.concatenate([at_nodes.ravel(), ends.used])
        self._unused, self._count = np.flatnonzero(~self._used), int(self._used.sum())
        step.evaluate(settle=True)
        ends.evaluate(step)
        self._objective = step.objective()
        self._slacks, self._multipliers = self._of("slacks"), self._of("multipliers")
        self._slacks[:] = np.where(self._used, np.maximum(self._limits(), _LEAST_SLACK), 1.0)
        self._multipliers[:] = np.where(self._used, _FIRST_BARRIER * self._share() / self._slacks, 0.0)
        self._infeasibility, self._moved = self._largest_violation(), np.inf

    def solve(self, monitor: Monitor) -> tuple[Status, int]:
        """Iterate to the optimum and return how that ended, and after how many iterations.

        Args:
            monitor: Told of the first iterate, and after each iteration.
        """
        least, in_vain = np.inf, 0
        for iteration in range(_MOST_ITERATIONS + 1):
            if not np.isfinite(self._infeasibility):
                return Status.EVALUATION_ERROR, iteration
            verdict = monitor(IterationState(iteration, self._objective, self._infeasibility))
            if verdict is not None:
                return verdict, iteration
            if self._is_done():
                return Status.SOLVED, iteration
            in_vain = 0 if self._infeasibility < least else in_vain + 1
            least = min(least, self._infeasibility)
            if in_vain > _MOST_IN_VAIN or iteration == _MOST_ITERATIONS:
                break
            joined = self._factored(_CURVATURES if iteration else _FIRST_CURVATURES)
            if joined is None:
                return Status.SOLVER_ERROR, iteration
            self._move(self._best_direction(joined))
        return Status.ITERATION_LIMIT, iteration

    def _of(self, name: str) -> FloatArray:
        return self._step.unknowns.of(self._step.iterate, name)

    def _limits(self) -> FloatArray:
        return np.concatenate([self._step.limits.ravel(), self._ends.limits])

    def _share(self) -> float:
        """Return the objective for each inequality."""
        return self._objective / self._count

    def _is_done(self) -> bool:
        small = self._infeasibility < self._tolerance and self._product() < self._last_product()
        return small and self._moved < _LAST_STEP

    def _last_product(self) -> float:
        """Return the mean product below which the objective is close enough to the optimum."""
        return min(self._tolerance, _GAP * self._share())

    def _largest_violation(self) -> float:
        of_limits = np.abs(self._limits() - self._slacks)[self._used].max()
        return float(np.max([self._step.infeasibility(), np.abs(self._ends.rows).max(), of_limits]))

    def _product(self) -> float:
        """Return the mean product of slacks and multipliers."""
        return float(self._slacks @ self._multipliers) / self._count

    def _factored(self, curvatures: tuple[float, ...]) -> JoinedEnds | None:
        """Factor with as much of the curvature as is convex."""
        step, ends = self._step, self._ends
        step.evaluate_curvature()
        of_ends = slice(-ends.size, None)
        ends.evaluate_curvature(self._of("joints"), self._multipliers[of_ends])
        weights = self._multipliers[of_ends] / self._slacks[of_ends]
        for curvature in curvatures:
            hessian = step.eliminated(curvature)
            joined = None if hessian is None else ends.joined(hessian, step, weights, curvature)
            if joined is not None:
                return joined
        return None

    def _best_direction(self, joined: JoinedEnds) -> _Direction:
        """Return the direction of predictor and correctors."""
        affine = self._direction(joined, np.zeros(self._slacks.size), 1.0)
        of_slacks, of_multipliers = self._changes(affine.change)
        ahead = (self._slacks + affine.primal * of_slacks) @ (
            self._multipliers + affine.dual * of_multipliers
        )
        product = self._product()
        centring = (float(ahead) / self._count / product) ** 3
        floor = min(product, _PRODUCTS_FOR_INFEASIBILITY * self._share() * self._infeasibility)
        target = max(centring * product, _LEAST_PRODUCT * self._last_product(), floor)
        # The part of second order belongs to a full step: a shorter one takes less of it [Colombo2008].
        targets = target - affine.primal * affine.dual * of_slacks * of_multipliers
        best = self._direction(joined, targets, _TO_THE_BOUNDARY)
        for _ in range(_CORRECTORS):
            targets = targets + self._correction(best, target)
            corrected = self._direction(joined, targets, _TO_THE_BOUNDARY)
            if corrected.shorter < best.shorter + _LONGER:
                break
            best = corrected
        return best

    def _correction(self, direction: _Direction, target: float) -> FloatArray:
        """Return what brings products that a longer step would leave behind nearer to the target."""
        of_slacks, of_multipliers = self._changes(direction.change)
        primal, dual = (min(1.0, one + _TRIED_LONGER) for one in (direction.primal, direction.dual))
        products = (self._slacks + primal * of_slacks) * (self._multipliers + dual * of_multipliers)
        wanted = np.clip(products, _SMALLEST * target, _LARGEST * target)
        return np.maximum(wanted - products, -_LARGEST * target)

    def _direction(self, joined: JoinedEnds, targets: FloatArray, to_the_boundary: float) -> _Direction:
        """Return the Newton direction to wanted products of slacks and multipliers, set to 0 where unused."""
        step, of_ends = self._step, slice(-self._ends.size, None)
        targets[self._unused] = 0.0
        slacks, multipliers = self._slacks[of_ends], self._multipliers[of_ends]
        excess = self._ends.limits - slacks
        held = np.where(self._ends.used, (targets[of_ends] - multipliers * excess) / slacks, 0.0)
        ends, joints, change = joined.solved(step.gathered(targets), held)
        step.spread(ends, targets)
        direction = step.direction.copy()
        of_slacks, of_multipliers = self._changes(direction)
        of_slacks[of_ends] = excess + change
        of_multipliers[of_ends] = (targets[of_ends] - multipliers * of_slacks[of_ends]) / slacks - multipliers
        of_slacks[self._unused] = of_multipliers[self._unused] = 0.0
        unknowns = step.unknowns
        unknowns.of(direction, "passive")[:] -= self._of("passive")
        unknowns.of(direction, "joints")[:] = joints - self._of("joints")
        unknowns.of(direction, "start")[:] = ends[:8]
        unknowns.of(direction, "springs")[:] = ends[8:10]
        primal = _longest(self._slacks, of_slacks, to_the_boundary)
        return _Direction(direction, primal, _longest(self._multipliers, of_multipliers, to_the_boundary))

    def _changes(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        unknowns = self._step.unknowns
        return unknowns.of(vector, "slacks"), unknowns.of(vector, "multipliers")

    def _move(self, direction: _Direction) -> None:
        unknowns, iterate = self._step.unknowns, self._step.iterate
        iterate[unknowns.primal] += direction.primal * direction.change[unknowns.primal]
        iterate[unknowns.dual] += direction.dual * direction.change[unknowns.dual]
        self._step.evaluate()
        self._ends.evaluate(self._step)
        changes = (unknowns.of(direction.change, name) for name in ("omega", "springs"))
        self._moved = max(float(np.abs(change).max()) for change in changes)
        self._objective, self._infeasibility = self._step.objective(), self._largest_violation()


def _longest(values: FloatArray, changes: FloatArray, to_the_boundary: float) -> float:
    """Return the longest step, at most 1, that leaves a part of each positive value.

    Values of 0 take no part and do not change.
    """
    fastest = float(np.max(-changes / np.maximum(values, _SMALLEST_NUMBER)))
    return 1.0 if fastest <= to_the_boundary else to_the_boundary / fastest
