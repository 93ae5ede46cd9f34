"""The largest torques and speeds that a robot's joints can do, and what steps need of them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import ConfigurationError, WalkOptimizerError
from walk_optimizer.gait import Gait, RefinedGait
from walk_optimizer.gait.refined_peaks import speed_peaks, torque_peaks
from walk_optimizer.references import EXCHANGED_JOINTS, JOINTS, cycle_reference
from walk_optimizer.references.profile import RefinedProfile, StepProfile, profile_of

FloatArray = NDArray[np.float64]

# Of a step that is blended, or a stand.
_SAMPLES = 400
# What rounding may add.
_TOLERANCE = 1e-9


class JointLimitError(WalkOptimizerError):
    """Steps that need more of a joint than it can do; the message names the joint and both numbers."""


@dataclass(frozen=True)
class JointPeaks:
    """The most that steps need of each joint of `JOINTS`, whichever leg begins.

    Attributes:
        torque: In [N m], (4,).
        speed: In [rad/s], (4,).
    """

    torque: tuple[float, ...]
    speed: tuple[float, ...]

    def __or__(self, other: "JointPeaks") -> "JointPeaks":
        """Return the most that either needs."""
        return JointPeaks(_larger(self.torque, other.torque), _larger(self.speed, other.speed))


def peaks_of_solved(steps: Iterable[RefinedGait]) -> JointPeaks:
    """Return the most that solved steps need, between their nodes too."""
    trajectories = [step.trajectory for step in steps]
    hip, *knees = np.max([torque_peaks(one) for one in trajectories], axis=0)
    speed = np.max([speed_peaks(one) for one in trajectories], axis=0)
    return _of_either_leg(np.array([hip, knees[0], hip, knees[1]]), speed)


def peaks_of_gait(gait: Gait) -> JointPeaks:
    """Return the most that a gait needs as it is walked (`profile_of`)."""
    profile = profile_of(gait)
    if gait.refined is not None and isinstance(profile, RefinedProfile):
        return peaks_of_solved([gait.refined])
    # On the report's grid torques and velocities are constant in each interval: their middles, and the ends.
    return peaks_of([profile], 2 * gait.trajectory.points + 1)


def peaks_of(steps: Iterable[StepProfile], samples: int = _SAMPLES) -> JointPeaks:
    """Return the most that steps need at so many times of each."""
    torque, speed = np.zeros(len(JOINTS)), np.zeros(len(JOINTS))
    for step in steps:
        duration = step.step_time if math.isfinite(step.step_time) else 0.0
        for time in np.linspace(0.0, duration, samples).tolist():
            reference = cycle_reference(step, time)
            torque = np.maximum(torque, np.abs(reference.effort))
            speed = np.maximum(speed, np.abs(reference.velocity))
    return _of_either_leg(torque, speed)


def _of_either_leg(torque: FloatArray, speed: FloatArray) -> JointPeaks:
    """Return peaks of `JOINTS`, (4,) each: a joint may be in the stance leg or in the swing leg of a step."""
    exchanged = [JOINTS.index(name) for name in EXCHANGED_JOINTS]
    torque, speed = (np.maximum(peaks, peaks[exchanged]) for peaks in (torque, speed))
    return JointPeaks(tuple(torque.tolist()), tuple(speed.tolist()))


@dataclass(frozen=True)
class JointNeed:
    """What something that a walker does needs of its joints.

    Attributes:
        purpose: What it does, such as "to stand".
        peaks: The most that this needs.
    """

    purpose: str
    peaks: JointPeaks


@dataclass(frozen=True)
class JointLimits:
    """What each joint of `JOINTS` can do; infinite where there is no limit.

    Attributes:
        torque: Largest torque in [N m], (4,).
        speed: Largest speed in [rad/s], (4,).
    """

    torque: tuple[float, ...] = (math.inf,) * len(JOINTS)
    speed: tuple[float, ...] = (math.inf,) * len(JOINTS)

    @property
    def hip_and_knee_torque(self) -> tuple[float, float]:
        """Torque limit of a hip and of a knee in [N m], left or right: the legs take turns."""
        left_hip, left_knee, right_hip, right_knee = self.torque
        return min(left_hip, right_hip), min(left_knee, right_knee)

    def lowered_from(self, former: "JointLimits") -> "JointLimits":
        """Return those limits that are lower than former ones; the others are none."""
        return JointLimits(_lower(self.torque, former.torque), _lower(self.speed, former.speed))

    def require(self, need: JointNeed) -> None:
        """Refuse steps that need more, or what is no finite number, whatever the limits are.

        Raises:
            JointLimitError: names each joint that can't do them, what they need and what is allowed.
        """
        peaks = need.peaks
        excesses = [
            f"{joint} needs {needed:.4g} {unit}, its limit is {limit:.4g} {unit}"
            for peak, limits, unit in (
                (peaks.torque, self.torque, "N m"),
                (peaks.speed, self.speed, "rad/s"),
            )
            for joint, needed, limit in zip(JOINTS, peak, limits, strict=True)
            if not (math.isfinite(needed) and needed <= limit * (1 + _TOLERANCE))
        ]
        if excesses:
            raise JointLimitError(f"{need.purpose}, {'; '.join(excesses)}")


def _larger(one: Sequence[float], other: Sequence[float]) -> tuple[float, ...]:
    """Return the larger of two numbers each; one that is not a number stays so, which `max` would drop."""
    return tuple(np.maximum(one, other).tolist())


def _lower(limits: Sequence[float], former: Sequence[float]) -> tuple[float, ...]:
    return tuple(new if new < old else math.inf for new, old in zip(limits, former, strict=True))


def limits_of(values: Sequence[float]) -> tuple[float, ...]:
    """Return a limit for each joint from one number for all of them, or one for each; 0 means none.

    Raises:
        ConfigurationError: there are neither one nor four, or one is negative or not finite.
    """
    if len(values) not in (1, len(JOINTS)):
        raise ConfigurationError(
            f"{len(values)} numbers, expected 1 or {len(JOINTS)} (of {', '.join(JOINTS)})"
        )
    for value in values:
        if not (math.isfinite(value) and value >= 0):
            raise ConfigurationError(f"a limit is {value}, allowed are finite numbers from 0 (no limit)")
    limits = tuple(value if value > 0 else math.inf for value in values)
    return limits if len(limits) == len(JOINTS) else limits * len(JOINTS)
