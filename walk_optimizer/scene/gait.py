"""A gait as displays need it: a place in its cycle for joint positions, feet, ground reactions."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.gait import Gait
from walk_optimizer.model.mechanics import foot_arm, horizontal_and_vertical
from walk_optimizer.references.check import CycleSearch
from walk_optimizer.references.profile import RefinedProfile, StepProfile, profile_of

FloatArray = NDArray[np.float64]

# Points of a foot's path over a step.
_PATH_POINTS = 60


@dataclass(frozen=True)
class Place:
    """A place in the cycle of a gait.

    Attributes:
        time: Since the start of the step in [s].
        stance: Side that stands, 0 left, 1 right.
        deviation: Largest deviation of a joint from the gait there in [rad].
    """

    time: float
    stance: int
    deviation: float


class ShownGait:
    """A gait, as it is walked."""

    def __init__(self, gait: Gait) -> None:
        """Prepare the search in its cycle.

        Args:
            gait: Its refined part is shown if that is certified.

        Raises:
            InvalidRequestError: the step is much shorter or longer than any walker's.
        """
        self.profile: StepProfile = profile_of(gait)
        self._gait = gait
        self._search = CycleSearch(self.profile)

    def locate(
        self, position: FloatArray, velocity: FloatArray | None = None, before: Place | None = None
    ) -> Place:
        """Return the place of the cycle that a reference belongs to.

        Args:
            position: Of the joints in [rad], (4,).
            velocity: In [rad/s], (4,); None where it is not known.
            before: Place of the reference before it; None where it is not known.
        """
        step_time = self.profile.step_time
        former = before.time + before.stance * step_time if before is not None else None
        time, deviation = self._search.nearest(position, velocity, former)
        stance = int(time >= step_time)
        return Place(time - stance * step_time, stance, deviation)

    @cached_property
    def swing_path(self) -> FloatArray:
        """The foot of leg 2 over a step, from where the foot of leg 1 stands: x, y in [m], (2, K)."""
        q = np.column_stack([self.profile.sample(time).q for time in self.path_times.tolist()])
        stance, swing = (foot_arm(self._gait.walker, q, leg).position for leg in range(2))
        path: FloatArray = swing - stance
        return path

    @cached_property
    def path_times(self) -> FloatArray:
        """Times of `swing_path` since the start of the step in [s], (K,)."""
        return np.linspace(0.0, self.profile.step_time, _PATH_POINTS)

    @property
    def stride(self) -> FloatArray:
        """Where a foot lands, from the one that stands: x, y in [m], (2,)."""
        landing: FloatArray = self.swing_path[:, -1]
        return landing

    def reaction(self, time: float) -> FloatArray:
        """Return the ground reactions in [N] at a time in [s] of the step.

        Returns:
            (2, 2): rows are the foot that stands and the one that swings, columns x and y.
        """
        refined, euler = self._gait.refined, self._gait.trajectory
        if refined is not None and isinstance(self.profile, RefinedProfile):
            return refined.trajectory.force(*refined.trajectory.locate(time)).reshape(2, 2)
        index = int(np.searchsorted(euler.time, time))
        net = horizontal_and_vertical(self._gait.walker, euler.net_reaction())
        return net[:, min(index, net.shape[1] - 1)].reshape(2, 2)
