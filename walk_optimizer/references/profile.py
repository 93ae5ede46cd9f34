"""One step of a gait as a function of time: coordinates, velocities and torques between grid points."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait import Gait, RefinedGait, Trajectory, read_only
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.kinematics import HIP_X, HIP_Y, RELABELLED

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StepSample:
    """The walker at one instant of a step; leg 1 is the stance leg.

    Attributes:
        q: Coordinates in [m] and [rad], (6,).
        qdot: Their velocities in [m/s] and [rad/s], (6,).
        u: Hip torque and knee torques of leg 1 and leg 2 in [N m], (3,).
    """

    q: FloatArray
    qdot: FloatArray
    u: FloatArray


class StepProfile(Protocol):
    """A step that can be sampled at any time; q is continuous, and qdot is its derivative."""

    @property
    def method(self) -> str:
        """Name of the method that the gait was solved with."""

    @property
    def step_time(self) -> float:
        """Duration of the step in [s]."""

    @property
    def step_length(self) -> float:
        """Distance that the step covers along the way, in [m]."""

    @property
    def rise(self) -> float:
        """How much higher the step ends in [m]."""

    def sample(self, time: float) -> StepSample:
        """Return the walker at a time in [s] from the start of the step, 0 <= time <= step_time."""


def relabelled(q: FloatArray, step_length: float, rise: float) -> FloatArray:
    """Return coordinates (6,) as the next step sees them: legs exchanged, origin where foot 2 stands.

    Args:
        q: Coordinates at the end of a step, (6,).
        step_length: Of the step in [m].
        rise: How much higher it ends in [m].
    """
    exchanged = q[list(RELABELLED)]
    exchanged[HIP_X] -= step_length
    exchanged[HIP_Y] -= rise
    return exchanged


def join_error(before: StepProfile, after: StepProfile) -> float:
    """Return how far a step begins from where the one before it ends, at most, in [m] or [rad].

    What has no end of its own is no step: it is left as it is, the legs keep their names.
    """
    end = before.sample(before.step_time).q
    if math.isfinite(before.step_time):
        end = relabelled(end, before.step_length, before.rise)
    return float(np.max(np.abs(after.sample(0.0).q - end)))


class EulerProfile:
    """The interpolation that belongs to the report's grid (report section III, implicit Euler).

    Implicit Euler says q_i - q_(i-1) = h qdot_i, with the torque u_i acting on the whole interval. So
    on (t_(i-1), t_i] the velocity is (q_i - q_(i-1)) / h, the torque is u_i, and q is linear. The state
    before point 1 is point N relabelled.
    """

    method = "implicit_euler"

    def __init__(self, trajectory: Trajectory, step_length: float, rise: float, step_time: float) -> None:
        """Tabulate the intervals.

        Args:
            trajectory: States and torques on an even grid.
            step_length: In [m].
            rise: How much higher the step ends in [m].
            step_time: In [s].
        """
        self._step_time, self._step_length, self._rise = step_time, step_length, rise
        self._count = trajectory.points
        self._interval = step_time / trajectory.points
        before = relabelled(trajectory.q[:, -1], step_length, rise)
        ends = np.column_stack([before, trajectory.q])
        # One row an interval, so that a sample is a few views and one sum.
        self._starts = read_only(ends[:, :-1].T)
        self._velocities = read_only(np.diff(ends, axis=1).T / self._interval)
        self._torques = read_only(trajectory.u.T)

    @classmethod
    def of(cls, gait: Gait) -> "EulerProfile":
        """Return the profile of a gait."""
        rise = _rise_of(gait, gait.step_length)
        return cls(gait.trajectory, gait.step_length, rise, gait.request.step_time)

    @property
    def step_time(self) -> float:
        """Duration of the step in [s]."""
        return self._step_time

    @property
    def step_length(self) -> float:
        """Distance that the step covers along the way, in [m]."""
        return self._step_length

    @property
    def rise(self) -> float:
        """How much higher the step ends in [m]."""
        return self._rise

    def sample(self, time: float) -> StepSample:
        """Return the walker at a time in [s] from the start of the step, 0 <= time <= step_time."""
        index = min(max(math.ceil(time / self._interval) - 1, 0), self._count - 1)
        qdot = self._velocities[index]
        q = self._starts[index] + (time - index * self._interval) * qdot
        q.setflags(write=False)
        return StepSample(q, qdot, self._torques[index])


class RefinedProfile:
    """The polynomials of the refined solution: q cubic, qdot its exact derivative, u quadratic.

    q is continuous, also across the exchange of the legs. Where a foot lands qdot jumps; between other
    intervals it agrees as closely as the solution is accurate.
    """

    method = "radau"

    def __init__(self, trajectory: RefinedTrajectory, step_length: float, rise: float) -> None:
        """Take a trajectory.

        Args:
            trajectory: One step on collocation intervals.
            step_length: In [m].
            rise: How much higher the step ends in [m].
        """
        self._trajectory, self._step_length, self._rise = trajectory, step_length, rise

    @classmethod
    def of(cls, step: RefinedGait, rise: float = 0.0) -> "RefinedProfile":
        """Return the profile of a step.

        Args:
            step: The refined part of a gait, or a step between two paces.
            rise: How much higher it ends in [m]; steps between paces are on level ground.
        """
        return cls(step.trajectory, step.step_length, rise)

    @property
    def step_time(self) -> float:
        """Duration of the step in [s]."""
        return self._trajectory.step_time

    @property
    def step_length(self) -> float:
        """Distance that the step covers along the way, in [m]."""
        return self._step_length

    @property
    def rise(self) -> float:
        """How much higher the step ends in [m]."""
        return self._rise

    def sample(self, time: float) -> StepSample:
        """Return the walker at a time in [s] from the start of the step, 0 <= time <= step_time."""
        values = self._trajectory.motion(*self._trajectory.locate(time))
        values.setflags(write=False)
        return StepSample(values[:6], values[6:12], values[12:])


def profile_of(gait: Gait) -> StepProfile:
    """Return how a gait is walked: refined where that is certified, else as on the report's grid."""
    refined = gait.refined
    if refined is None or not refined.certificate.certified:
        return EulerProfile.of(gait)
    return RefinedProfile.of(refined, _rise_of(gait, refined.step_length))


def _rise_of(gait: Gait, step_length: float) -> float:
    """Return how much higher a step of a gait ends in [m], whose treads are as long as was asked for."""
    return float(gait.walker.terrain.height(step_length, gait.request.step_length))
