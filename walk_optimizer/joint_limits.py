"""The largest torques and speeds that a robot's joints can do, and what steps need of them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from walk_optimizer.errors import ConfigurationError, WalkOptimizerError
from walk_optimizer.profile import StepProfile
from walk_optimizer.references import EXCHANGED_JOINTS, JOINTS, cycle_reference

# Of a step: so fine that the polynomials of a step peak less than a part in a thousand higher between.
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


def peaks_of(steps: Iterable[StepProfile]) -> JointPeaks:
    """Return the most that steps need: a joint may be in the stance leg or in the swing leg of each."""
    torque, speed = np.zeros(len(JOINTS)), np.zeros(len(JOINTS))
    for step in steps:
        duration = step.step_time if math.isfinite(step.step_time) else 0.0
        for time in np.linspace(0.0, duration, _SAMPLES).tolist():
            reference = cycle_reference(step, time)
            torque = np.maximum(torque, np.abs(reference.effort))
            speed = np.maximum(speed, np.abs(reference.velocity))
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

    @classmethod
    def of(cls, purpose: str, steps: Iterable[StepProfile]) -> "JointNeed":
        """Return what steps need."""
        return cls(purpose, peaks_of(steps))


@dataclass(frozen=True)
class JointLimits:
    """What each joint of `JOINTS` can do; infinite where there is no limit.

    Attributes:
        torque: Largest torque in [N m], (4,).
        speed: Largest speed in [rad/s], (4,).
    """

    torque: tuple[float, ...] = (math.inf,) * len(JOINTS)
    speed: tuple[float, ...] = (math.inf,) * len(JOINTS)

    def lowered_from(self, former: "JointLimits") -> "JointLimits":
        """Return those limits that are lower than former ones; the others are none."""
        return JointLimits(_lower(self.torque, former.torque), _lower(self.speed, former.speed))

    def require(self, need: JointNeed) -> None:
        """Refuse steps that need more.

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
            if needed > limit * (1 + _TOLERANCE)
        ]
        if excesses:
            raise JointLimitError(f"{need.purpose}, {'; '.join(excesses)}")


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
