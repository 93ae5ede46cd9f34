"""Compare joint references, as somebody received them, with the gait that they claim to be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.profile import StepProfile
from walk_optimizer.references import cycle_reference, sample_cycle

FloatArray = NDArray[np.float64]

# Where an interval begins, rounding decides which velocity and torque hold: both are right, [s].
_EDGE = 1e-9
_COARSE_RATE = 1000.0
_APART = 0.5 / _COARSE_RATE


@dataclass(frozen=True)
class Match:
    """The place in the cycle that is nearest to a received reference, and how far off it is.

    Attributes:
        time: In the cycle in [s].
        position: Largest deviation of a joint in [rad].
        velocity: In [rad/s].
        effort: In [N m].
    """

    time: float
    position: float
    velocity: float
    effort: float


class CycleMatcher:
    """Finds received references in the full cycle of a gait."""

    def __init__(self, profile: StepProfile) -> None:
        """Tabulate the cycle."""
        self._profile = profile
        self.period = 2 * profile.step_time
        self._cycle = sample_cycle(profile, _COARSE_RATE)

    def match(self, position: FloatArray, velocity: FloatArray, effort: FloatArray) -> Match:
        """Return the nearest place of the cycle.

        Args:
            position: Of the joints in [rad], (4,).
            velocity: In [rad/s], (4,).
            effort: In [N m], (4,).
        """
        coarse = np.argmin(np.sum((self._cycle.position - position[:, None]) ** 2, axis=0))
        middle = float(self._cycle.time[coarse])
        # From both sides: where the velocity jumps, the search from one side may end on the wrong one.
        times = [self._refined(middle + shift, position) for shift in (-_APART, 0.0, _APART)]
        places = {(time + shift) % self.period for time in times for shift in (-_EDGE, 0.0, _EDGE)}
        found = [self._deviation(place, position, velocity, effort) for place in places]
        return min(found, key=lambda match: match.position + match.velocity + match.effort)

    def _refined(self, time: float, position: FloatArray) -> float:
        """Return the time of least distance to a position, by Gauss-Newton along the cycle."""
        for _ in range(20):
            time %= self.period
            reference = cycle_reference(self._profile, time)
            speed = reference.velocity
            step = float(speed @ (position - reference.position)) / max(float(speed @ speed), 1e-12)
            time += step
            if abs(step) < _EDGE / 10:
                break
        return time

    def _deviation(
        self, time: float, position: FloatArray, velocity: FloatArray, effort: FloatArray
    ) -> Match:
        reference = cycle_reference(self._profile, time)
        pairs = (
            (reference.position, position),
            (reference.velocity, velocity),
            (reference.effort, effort),
        )
        return Match(time, *(float(np.max(np.abs(ours - theirs))) for ours, theirs in pairs))
