"""The floating base, from joint positions: the foot that stands does not move.

A publisher of joint references says how the legs are bent, not where the walker is. But one foot stands on
the ground, so the hip is where that foot is, less the way from hip to foot. Where the references are those
of the gait, the gait tells which foot stands and where the next one lands. Where they are not (standing,
or on the way from one gait to another) it is the foot that is lowest and moves backwards fastest.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.mechanics import foot_arm
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.scene.gait import Place, ShownGait
from walk_optimizer.scene.ground import ground_height

FloatArray = NDArray[np.float64]

# References further than this from every place of the gait are not the gait's, [rad].
GAIT_TOLERANCE = 2e-3
# A foot less than this above the lower one may be the one that stands, [m].
_HEIGHT_TOLERANCE = 2e-3
# A phase that goes back by less than this has not gone back, [s].
_PHASE_NOISE = 1e-3


@dataclass(frozen=True, eq=False)
class WalkerPose:
    """The walker on the ground.

    Attributes:
        position: Of `references.JOINTS` in [rad], (4,).
        base: Hip in [m], (2,); the first standing foot is the origin.
        feet: Left and right foot in [m], (2, 2): one row a foot, x and y.
        stance: Side that stands, 0 left, 1 right.
        place: In the cycle of the gait; None while the references are not the gait's.
    """

    position: FloatArray
    base: FloatArray
    feet: FloatArray
    stance: int
    place: Place | None


class WalkTracker:
    """Follows a walk from one joint reference to the next."""

    def __init__(self, walker: WalkerParameters) -> None:
        """Stand at the origin.

        Args:
            walker: That walks.
        """
        self._walker = walker
        self._gait: ShownGait | None = None
        self._foot = np.zeros(2)  # Where the standing foot is.
        self._pose: WalkerPose | None = None

    def follow(self, gait: ShownGait) -> None:
        """Take the references for those of a gait from now on."""
        self._gait = gait
        if self._pose is not None:  # Its place is one of the former gait.
            self._pose = replace(self._pose, place=None)

    @property
    def patience(self) -> float:
        """How long references may be left out before steps are lost count of, in [s]."""
        # A gait tells where it leads; all else has to be followed from each reference to the next.
        if self._gait is None or self._pose is None or self._pose.place is None:
            return 0.0
        # Far less than the cycle in which every place comes again.
        return self._gait.profile.step_time / 2

    def take(self, position: FloatArray, velocity: FloatArray | None = None) -> WalkerPose:
        """Return where the walker is.

        Args:
            position: Of its joints in [rad], (4,).
            velocity: In [rad/s], (4,); None where it is not known.
        """
        reach = self._reach(position)
        place = self._place(position, velocity)
        stance = place.stance if place is not None else self._standing(reach)
        self._stand_on(stance, place, reach)
        base = self._foot - reach[stance]
        self._pose = WalkerPose(position, base, base + reach, stance, place)
        return self._pose

    def _reach(self, position: FloatArray) -> FloatArray:
        """Return both feet from the hip in [m], (2, 2): one row a foot."""
        q = np.concatenate([np.zeros(2), position])[:, None]
        return np.stack([foot_arm(self._walker, q, leg).position[:, 0] for leg in range(2)])

    def _place(self, position: FloatArray, velocity: FloatArray | None) -> Place | None:
        if self._gait is None:
            return None
        before = self._pose.place if self._pose is not None else None
        place = self._gait.locate(position, velocity, before)
        return place if place.deviation <= GAIT_TOLERANCE else None

    def _standing(self, reach: FloatArray) -> int:
        """Return the side that stands when no gait tells."""
        if self._pose is None:
            return int(np.argmin(reach[:, 1]))
        stance = self._pose.stance
        feet = self._foot + reach - reach[stance]
        height = feet[:, 1] - ground_height(self._walker, self._gait, feet[:, 0])
        if abs(height[1] - height[0]) > _HEIGHT_TOLERANCE:
            return int(np.argmin(height))
        # Of two feet on the ground the one that moves forward over it is not the one that stands.
        forward = reach[:, 0] - (self._pose.feet - self._pose.base)[:, 0]
        return 1 - stance if forward[1 - stance] < forward[stance] else stance

    def _stand_on(self, stance: int, place: Place | None, reach: FloatArray) -> None:
        """Move on to the foot that stands now."""
        before = self._pose
        if before is None:
            return
        if self._gait is not None and place is not None and before.place is not None:
            steps = _steps_between(before.place, place, self._gait.profile.step_time)
            self._foot = self._foot + steps * self._gait.stride
        elif stance != before.stance:
            # Both feet are on the ground now, and the one before is still where it was.
            x = self._foot[0] + reach[stance, 0] - reach[before.stance, 0]
            self._foot = np.array([x, ground_height(self._walker, self._gait, x)])


def _steps_between(before: Place, after: Place, step_time: float) -> int:
    """Return how many steps of a time in [s] ended between two places less than a cycle apart."""
    shift = (after.stance - before.stance) * step_time + after.time - before.time
    # Noise may lead back over the exchange of the legs.
    ahead = (shift + _PHASE_NOISE) % (2 * step_time) - _PHASE_NOISE
    return round((before.time + ahead - after.time) / step_time)
