"""From a gait and the time to references of the joints: an endless walk of left and right steps.

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
import threading
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.kinematics import HIP_X, HIP_Y, KNEE_1, KNEE_2, UPPER_1, UPPER_2
from walk_optimizer.profile import BlendedProfile, StepProfile, StepSample, relabelled

FloatArray = NDArray[np.float64]

JOINTS = ("left_hip", "left_knee", "right_hip", "right_knee")

# Rows of q for JOINTS, with left as the stance leg (leg 1) and as the swing leg (leg 2).
_LEFT_IS_STANCE = np.array([UPPER_1, KNEE_1, UPPER_2, KNEE_2])
_LEFT_IS_SWING = np.array([UPPER_2, KNEE_2, UPPER_1, KNEE_1])
_BASE = np.array([HIP_X, HIP_Y])


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


def make_reference(sample: StepSample, step: int, time: float, origin: float) -> Reference:
    """Return the reference of a sample.

    Args:
        sample: The walker in its step.
        step: Number of the step.
        time: Since the start of the step in [s].
        origin: Where the step's coordinates begin along the way, in [m].
    """
    u1, u2, u3 = sample.u.tolist()
    left_is_stance = step % 2 == 0
    rows = _LEFT_IS_STANCE if left_is_stance else _LEFT_IS_SWING
    effort = [u1, u2, -u1, u3] if left_is_stance else [-u1, u3, u1, u2]
    base = sample.q[_BASE]
    base[0] += origin
    return Reference(
        sample.q[rows], sample.qdot[rows], np.array(effort), base, sample.qdot[_BASE], step, time
    )


class ReferenceGenerator:
    """The phase clock of a walk: follows a clock that may stall, jump or be reset, never backwards.

    One thread advances; any thread may ask for another gait, which begins at the next step.
    """

    def __init__(self, profile: StepProfile, longest_gap: float = 0.1) -> None:
        """Stand at the start of a step.

        Args:
            profile: The gait to begin with.
            longest_gap: A clock that moved further than this since the last call, in [s], or not
                forwards, has jumped: the phase then holds instead of jumping with it.
        """
        self.longest_gap = longest_gap
        self._gait, self._current = profile, profile
        self._pending: StepProfile | None = None
        self._lock = threading.Lock()
        self._clock: float | None = None
        self._step, self._time, self._origin = 0, 0.0, 0.0

    @property
    def gait(self) -> StepProfile:
        """The gait of the running step."""
        return self._gait

    def change(self, profile: StepProfile) -> None:
        """Walk with another gait from the next step on; of several, the last one counts."""
        with self._lock:
            self._pending = profile

    def advance(self, clock: float) -> Reference:
        """Move on to a time of the clock in [s] and return the reference there."""
        elapsed = clock - self._clock if self._clock is not None else 0.0
        self._clock = clock
        if 0 < elapsed <= self.longest_gap:
            self._time += elapsed
        while self._time >= self._current.step_time:
            self._next_step()
        sample = self._current.sample(self._time)
        return make_reference(sample, self._step, self._time, self._origin)

    def _next_step(self) -> None:
        ended = self._current
        self._time -= ended.step_time
        self._step += 1
        self._origin += ended.step_length
        with self._lock:
            pending, self._pending = self._pending, None
        if pending is None:
            self._current = self._gait
            return
        # Leaves the former gait where it ends, and joins the new one over a step.
        end = relabelled(ended.sample(ended.step_time).q, ended.step_length)
        self._gait, self._current = pending, BlendedProfile(pending, end)


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
    return make_reference(profile.sample(local), step, local, step * profile.step_length)


def sample_cycle(profile: StepProfile, rate: float) -> Cycle:
    """Return a full cycle with at least `rate` points per second in [Hz].

    Raises:
        InvalidRequestError: the rate is not in 1 to 10000 Hz.
    """
    if not 1 <= rate <= 10_000:
        raise InvalidRequestError(f"rate is {rate:g} Hz, allowed is 1 to 10000 Hz")
    duration = 2 * profile.step_time
    times = np.linspace(0.0, duration, math.ceil(duration * rate) + 1)
    references = [cycle_reference(profile, time) for time in times.tolist()]
    position, velocity, effort = (
        np.column_stack([getattr(reference, name) for reference in references])
        for name in ("position", "velocity", "effort")
    )
    return Cycle(times, position, velocity, effort)
