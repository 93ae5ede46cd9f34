"""Adapts the mesh of a refined solution to an estimate of its error."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.refined import excess_between
from walk_optimizer.certificate.replay import interval_errors
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints

FloatArray = NDArray[np.float64]

_MOST_PARTS = 4
_SAFETY = 0.5
# Largest difference of an interval from its replay, in [rad] or [m].
LOCAL_ERROR = 2e-7
# How far a bound may be left between nodes, in [rad] or [m]: what is left there is torque saved.
LARGEST_EXCESS = 5e-6


@dataclass(frozen=True, eq=False)
class MeshErrors:
    """How far the intervals of a solution are from the truth and beyond their bounds.

    Attributes:
        local: Difference of each interval from its replay in [rad] or [m], (n,).
        excess: How far each leaves its bounds between the nodes in [rad] or [m], (n,).
    """

    local: FloatArray
    excess: FloatArray

    @classmethod
    def of(
        cls, walker: WalkerParameters, tread: float, spring: KneeSpring, trajectory: RefinedTrajectory
    ) -> "MeshErrors":
        """Estimate the errors of a trajectory; treads are `tread` in [m] long."""
        excess = np.max(excess_between(walker, tread, trajectory), axis=0)
        return cls(interval_errors(walker, spring, trajectory), excess)

    @property
    def met(self) -> bool:
        """Whether the mesh is fine enough."""
        return bool(self.local.max() <= LOCAL_ERROR and self.excess.max() <= LARGEST_EXCESS)

    def divided(self, mesh: Mesh) -> Mesh:
        """Return the mesh with parts of the intervals that are too long.

        The local error of an interval falls with the sixth power of its length, what it leaves of a
        bound between its nodes with the second.
        """
        of_local = (self.local / (_SAFETY * LOCAL_ERROR)) ** (1 / 6)
        of_excess = np.sqrt(self.excess / (_SAFETY * LARGEST_EXCESS))
        # An error that is infinite, or no number, is that of a replay that came to no end.
        parts = np.nan_to_num(np.maximum(of_local, of_excess), nan=_MOST_PARTS, posinf=_MOST_PARTS)
        return mesh.divided(np.clip(np.ceil(parts), 1, _MOST_PARTS).astype(int))

    def halved(self, mesh: Mesh) -> Mesh:
        """Return the mesh with the less accurate half of its intervals halved.

        Standing feet drift by the errors of all intervals together, which may add up to too much even
        where each interval is accurate enough.
        """
        return mesh.divided(np.where(self.local > np.median(self.local), 2, 1))


def torque_saved(
    walker: WalkerParameters, step_length: float, trajectory: RefinedTrajectory, prices: FloatArray
) -> float:
    """Return which part of the objective a solution saves by leaving its bounds between the nodes.

    It is an estimate: how far each interval leaves them, times the multipliers at its own nodes.

    Args:
        walker: The walker.
        step_length: Of the request, in [m].
        trajectory: The solution.
        prices: What each interval's joint limits cost per [rad], and the ground per [m], as parts of the
            objective, (n, 2).
    """
    excess = excess_between(walker, step_length, trajectory)
    return float(np.sum(np.stack(excess, axis=1) * prices))


def trajectory_on(mesh: Mesh, points: RefinedPoints) -> RefinedTrajectory:
    """Return the values on a mesh as a trajectory."""
    breaks = np.concatenate([[0.0], np.cumsum(mesh.lengths(points.durations))])
    impulses = np.zeros((mesh.intervals, 4))
    impulses[mesh.first_intervals] = points.impulses
    return RefinedTrajectory(breaks, points.states, points.torques, points.forces, impulses)


def resampled(old: RefinedTrajectory, spring: KneeSpring, old_mesh: Mesh, mesh: Mesh) -> RefinedPoints:
    """Evaluate the polynomials of a solution at the nodes of a mesh of the same phases."""
    first = old_mesh.first_intervals
    ends = [*old.breaks[first], old.step_time]
    if mesh is old_mesh:
        values = old.states, old.torques, old.forces
        return RefinedPoints(*values, np.diff(ends), old.impulses[first], spring)
    nodes = mesh.node_times(np.diff(ends))
    intervals = [old.locate(float((when[0] + when[-1]) / 2))[0] for when in nodes]
    places = [
        (when - old.breaks[index]) / old.lengths[index] for index, when in zip(intervals, nodes, strict=True)
    ]
    pairs = list(zip(intervals, places, strict=True))
    return RefinedPoints(
        states=np.array([[old.state(i, x) for x in place] for i, place in pairs]),
        torques=np.array([[old.torque(i, x) for x in place[1:]] for i, place in pairs]),
        forces=np.array([[old.force(i, x) for x in place[1:]] for i, place in pairs]),
        durations=np.diff(ends),
        impulses=old.impulses[first],
        spring=spring,
    )
