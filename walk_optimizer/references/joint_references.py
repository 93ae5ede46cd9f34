"""From a gait and the time to references of the joints: left and right from leg 1 and leg 2.

Joints are listed in the order of `JOINTS`. The base of the robot is the hip; it does not rotate, so

- a hip joint is the angle of that upper leg from the downward vertical, 0 straight down, forward
  positive (q3 or q5);
- a knee joint is the inner angle between upper and lower leg, pi stretched, smaller when bent; the
  lower leg is at hip + knee - pi from the downward vertical (q4 or q6);
- a positive hip effort drives that upper leg forward, a positive knee effort stretches that knee. The
  one hip torque acts between the legs: its effort on the left hip is the opposite of that on the right.

A gait knows a stance leg (1) and a swing leg (2). Left is leg 1 in the first step and in every second
one after it; the legs exchange roles where a step ends.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.kinematics import HIP_X, HIP_Y, KNEE_1, KNEE_2, UPPER_1, UPPER_2
from walk_optimizer.references.profile import StepProfile, StepSample

FloatArray = NDArray[np.float64]

JOINTS = ("left_hip", "left_knee", "right_hip", "right_knee")
# The same joints of the other leg.
EXCHANGED_JOINTS = ("right_hip", "right_knee", "left_hip", "left_knee")

# Rows of q for JOINTS, with left as the stance leg (leg 1) and as the swing leg (leg 2).
_LEFT_IS_STANCE = np.array([UPPER_1, KNEE_1, UPPER_2, KNEE_2])
_LEFT_IS_SWING = np.array([UPPER_2, KNEE_2, UPPER_1, KNEE_1])
_BASE = np.array([HIP_X, HIP_Y])
# Points per second of a cycle that memory is taken for, in [Hz].
_HIGHEST_RATE = 10_000.0


@dataclass(frozen=True, eq=False)
class Reference:
    """What a controller shall track at one instant.

    Attributes:
        position: Of `JOINTS` in [rad], (4,).
        velocity: Of `JOINTS` in [rad/s], (4,).
        effort: Feed-forward torques of `JOINTS` in [N m], (4,).
        base: Hip position (x, y) in [m] since the start of the walk, (2,).
        base_velocity: In [m/s], (2,).
        step: Number of the step, from 0; left is the stance leg of even steps.
        time: Since the start of the step in [s].
    """

    position: FloatArray
    velocity: FloatArray
    effort: FloatArray
    base: FloatArray
    base_velocity: FloatArray
    step: int
    time: float

    def __post_init__(self) -> None:
        """Make every array read-only."""
        for array in (self.position, self.velocity, self.effort, self.base, self.base_velocity):
            array.setflags(write=False)

    @property
    def torques(self) -> FloatArray:
        """u1 (positive on the left hip, negative on the right), u2 left knee, u3 right knee, [N m], (3,)."""
        return self.effort[[0, 1, 3]]


def make_reference(
    sample: StepSample, step: int, time: float, origin: FloatArray, rate: float = 1.0
) -> Reference:
    """Return the reference of a sample.

    Args:
        sample: The walker in its step.
        step: Number of the step.
        time: Since the start of the step in [s].
        origin: Where the step's coordinates begin (x, y) in [m] since the start of the walk, (2,).
        rate: Time of the walk for each time of the clock, in [0, 1]. Velocities scale with it; so do the
            torques, because those of a walk hold no walker that stands still in the middle of a step.
    """
    u1, u2, u3 = (sample.u * rate).tolist()
    left_is_stance = step % 2 == 0
    rows = _LEFT_IS_STANCE if left_is_stance else _LEFT_IS_SWING
    effort = [u1, u2, -u1, u3] if left_is_stance else [-u1, u3, u1, u2]
    base = sample.q[_BASE] + origin
    qdot = sample.qdot * rate
    return Reference(sample.q[rows], qdot[rows], np.array(effort), base, qdot[_BASE], step, time)


@dataclass(frozen=True, eq=False)
class Cycle:
    """A full cycle, one left and one right step, sampled evenly with both ends.

    Attributes:
        time: From the start of the cycle in [s], (M,).
        position: Of `JOINTS` in [rad], (4, M).
        velocity: Of `JOINTS` in [rad/s], (4, M).
        effort: Feed-forward torques of `JOINTS` in [N m], (4, M).
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    effort: FloatArray


def cycle_reference(profile: StepProfile, time: float) -> Reference:
    """Return the reference at a time in [s] of the cycle, 0 <= time <= 2 step_time."""
    step = int(time > profile.step_time)
    local = min(max(time - step * profile.step_time, 0.0), profile.step_time)
    origin = np.array([step * profile.step_length, step * profile.rise])
    return make_reference(profile.sample(local), step, local, origin)


def require_rate(rate: float, highest: float) -> None:
    """Refuse a number of points per second in [Hz] that is not in 1 to `highest`.

    Raises:
        InvalidRequestError: says what is allowed.
    """
    if not 1 <= rate <= highest:
        raise InvalidRequestError(f"rate is {rate:g} Hz, allowed is 1 to {highest:g} Hz")


def sample_cycle(profile: StepProfile, rate: float) -> Cycle:
    """Return a full cycle with at least `rate` points per second in [Hz].

    Raises:
        InvalidRequestError: the rate is not in 1 to 10000 Hz.
    """
    require_rate(rate, _HIGHEST_RATE)
    duration = 2 * profile.step_time
    times = np.linspace(0.0, duration, math.ceil(duration * rate) + 1)
    references = [cycle_reference(profile, time) for time in times.tolist()]
    position, velocity, effort = (
        np.column_stack([getattr(reference, name) for reference in references])
        for name in ("position", "velocity", "effort")
    )
    return Cycle(times, position, velocity, effort)
