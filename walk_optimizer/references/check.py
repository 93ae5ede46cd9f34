"""Find joint references, as somebody received them, in the gait that they claim to be, and compare them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.references.joint_references import cycle_reference, sample_cycle
from walk_optimizer.references.profile import StepProfile

FloatArray = NDArray[np.float64]

# Where an interval begins, rounding decides which velocity and torque hold: both are right, [s].
_EDGE = 1e-9
# The cycle is tabulated at the ends of so many chords; even, so that both steps have the same.
_CHORDS = 1600
# Of two places that are less than this further from a position, the one that agrees better is taken, [rad].
_AMBIGUITY = 1e-3


class CycleSearch:
    """Finds the place in the full cycle of a gait that a reference belongs to.

    That is the nearest one in joint positions. But where the legs pass each other, the posture of one step
    and the mirrored posture of the next may coincide. There the legs swing in opposite directions, so the
    velocity decides; only its direction, because a pause scales it. What has none, because the walker
    stands still or nobody told it, follows soon after the place before.
    """

    def __init__(self, profile: StepProfile) -> None:
        """Tabulate the cycle.

        Args:
            profile: Of the gait.

        Raises:
            InvalidRequestError: the step is much shorter or longer than any walker's.
        """
        self.period = 2 * profile.step_time
        # No rounding adds a chord: the exchange of the legs, where the velocity jumps, has to be an entry.
        cycle = sample_cycle(profile, (_CHORDS - 0.5) / self.period)
        self._times = cycle.time
        # One row a chord between two entries of the table.
        self._starts = cycle.position.T[:-1]
        along = np.diff(cycle.position).T
        self._lengths = np.maximum(np.linalg.norm(along, axis=1), 1e-15)
        self._directions = along / self._lengths[:, None]

    def nearest(
        self, position: FloatArray, velocity: FloatArray | None = None, before: float | None = None
    ) -> tuple[float, float]:
        """Return the time of the place in [s], 0 <= time < period, and its largest deviation in [rad].

        Args:
            position: Of the joints in [rad], (4,).
            velocity: In [rad/s] or any other scale, (4,); None where it is not known.
            before: Time of the place of the reference before it in [s]; None where it is not known.
        """
        offsets = position - self._starts
        along = np.clip(np.sum(offsets * self._directions, axis=1), 0.0, self._lengths)
        offsets -= along[:, None] * self._directions
        distance = np.sum(offsets**2, axis=1)
        chord = int(np.argmin(distance - _AMBIGUITY**2 * self._agreement(velocity, before)))
        part = along[chord] / self._lengths[chord]
        time = self._times[chord] + part * (self._times[chord + 1] - self._times[chord])
        return float(time % self.period), float(np.max(np.abs(offsets[chord])))

    def _agreement(self, velocity: FloatArray | None, before: float | None) -> FloatArray | float:
        """Return how well every chord agrees with what else is known of a reference, at most 1.5, (M,)."""
        agreement: FloatArray | float = 0.0
        if velocity is not None:
            agreement += self._directions @ velocity / max(float(np.linalg.norm(velocity)), 1e-15)
        if before is not None:
            # Less than the direction: a reference that comes late may well be half a cycle further on.
            agreement += 0.5 * np.cos(2 * np.pi / self.period * (self._times[:-1] - before))
        return agreement


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
        """Tabulate the cycle.

        Args:
            profile: Of the gait.

        Raises:
            InvalidRequestError: the step is much shorter or longer than any walker's.
        """
        self._profile, self._search = profile, CycleSearch(profile)
        self.period = self._search.period

    def match(self, position: FloatArray, velocity: FloatArray, effort: FloatArray) -> Match:
        """Return the nearest place of the cycle.

        Args:
            position: Of the joints in [rad], (4,).
            velocity: In [rad/s], (4,).
            effort: In [N m], (4,).
        """
        middle, _ = self._search.nearest(position, velocity)
        apart = 0.5 * self.period / _CHORDS
        # From both sides: where the velocity jumps, the search from one side may end on the wrong one.
        times = [self._refined(middle + shift, position) for shift in (-apart, 0.0, apart)]
        # Postures before and after an exchange of the legs nearly agree, which hides what is just before it.
        times.append(round(middle / self._profile.step_time) * self._profile.step_time)
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
