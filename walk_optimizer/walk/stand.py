"""A stand as a pace of a walk: a pose that is held, for ever or for a time."""

import math

import numpy as np

from walk_optimizer.gait import read_only
from walk_optimizer.references.profile import StepSample, relabelled
from walk_optimizer.transition.standing import Standing


class StandProfile:
    """Holds a standing pose; it has no end of its own, and is no step: the legs keep their names."""

    method = "stand"
    step_time = math.inf
    step_length = rise = 0.0

    def __init__(self, standing: Standing) -> None:
        """Hold a pose."""
        self.standing = standing
        self._sample = StepSample(standing.q, read_only(np.zeros(6)), standing.torques)

    def sample(self, time: float) -> StepSample:  # noqa: ARG002  # it is the same at all times
        """Return the walker at any time."""
        return self._sample


class ArrivalProfile:
    """The pose of a stand for a time, in the words of the step that ends in it: foot 2 is ahead."""

    method = "stand"
    rise = 0.0

    def __init__(self, standing: Standing, step_time: float) -> None:
        """Hold the pose.

        Args:
            standing: What is arrived at.
            step_time: In [s].
        """
        self.step_time = step_time
        self.step_length = standing.feet_distance
        q = read_only(relabelled(standing.q, -self.step_length, -self.rise))
        u1, u2, u3 = standing.torques
        self._sample = StepSample(q, read_only(np.zeros(6)), read_only(np.array([-u1, u3, u2])))

    def sample(self, time: float) -> StepSample:  # noqa: ARG002  # it is the same at all times
        """Return the walker at any time."""
        return self._sample
