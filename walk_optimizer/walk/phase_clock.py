"""How far a walk moves on: follows a clock, pauses smoothly, stops at once in an emergency.

The walk moves through its steps at a rate r of the clock: 1 while it runs, 0 while it is held. All
velocities scale with r, so the references stay the derivative of each other whatever r does.
"""

import threading
from dataclasses import dataclass
from enum import Enum

# What rounding may add to the distance of two times of the clock, in [s].
_ROUNDING = 1e-6


class Motion(Enum):
    """What the clock of a walk does."""

    RUNNING = "running"
    PAUSED = "paused"
    EMERGENCY_STOP = "emergency_stop"


@dataclass(frozen=True)
class Advance:
    """What one call has moved the walk by.

    Attributes:
        phase: Time of the walk that passed in [s].
        rate: Time of the walk for each time of the clock, now, in [0, 1].
    """

    phase: float
    rate: float


def smooth_rate(progress: float) -> float:
    """Return the rate at a part of the ramp between hold and run: 3 x^2 - 2 x^3, with even ends."""
    return progress**2 * (3 - 2 * progress)


def _integral(progress: float) -> float:
    """Return the integral of `smooth_rate` from 0: x^3 - x^4 / 2."""
    return progress**3 * (1 - progress / 2)


class PhaseClock:
    """Follows a clock that may stall, jump or be reset, never backwards.

    One thread advances; any thread may pause and resume.

    Attributes:
        holds: How often the clock has jumped, so that the walk held.
        suspended: Whether the walk comes to a hold, over the ramp, whatever else is asked for.
    """

    def __init__(self, longest_gap: float = 0.1, ramp: float = 0.3) -> None:
        """Begin with the first time that the clock shows.

        Args:
            longest_gap: A clock that moved further than this since the last call, in [s], or not
                forwards, has jumped: the walk then holds instead of jumping with it. From the second jump
                in a row on it is at rest, and begins to run again over the ramp.
            ramp: Time from a run to a hold, and back, in [s].
        """
        self.longest_gap, self.ramp = longest_gap, ramp
        self.holds = 0
        self.suspended = False
        self._jumped = False
        self._clock: float | None = None
        self._motion = Motion.RUNNING
        self._progress = 1.0
        self._lock = threading.Lock()

    def restart(self) -> None:
        """Begin a new walk with the next time that the clock shows; an emergency stop stays in force."""
        with self._lock:
            self.holds, self._jumped, self._clock = 0, False, None
            if self._motion is Motion.PAUSED:
                self._motion = Motion.RUNNING
            self._progress = 1.0 if self._runs else 0.0

    @property
    def motion(self) -> Motion:
        """What was last asked for; a ramp may still be under way."""
        return self._motion

    @property
    def at_rest(self) -> bool:
        """Whether the walk is held and no ramp is under way."""
        return not self._runs and self._progress == 0

    @property
    def _runs(self) -> bool:
        """Whether the walk is to move."""
        return self._motion is Motion.RUNNING and not self.suspended

    def pause(self) -> Motion:
        """Come to a hold over the ramp, and return what it is now: an emergency stop stays one."""
        with self._lock:
            if self._motion is Motion.RUNNING:
                self._motion = Motion.PAUSED
            return self._motion

    def resume(self) -> Motion:
        """Release an emergency stop into a pause, and a pause into the run; return what it is now.

        Releasing an emergency stop must not move anything by itself (ISO 13850): that takes a second
        call.
        """
        with self._lock:
            stopped = self._motion is Motion.EMERGENCY_STOP
            self._motion = Motion.PAUSED if stopped else Motion.RUNNING
            return self._motion

    def stop_at_once(self) -> None:
        """Hold from now on, without a ramp, until it is resumed twice."""
        with self._lock:
            self._motion = Motion.EMERGENCY_STOP
            self._progress = 0.0

    def advance(self, clock: float) -> Advance:
        """Move on to a time of the clock in [s]."""
        elapsed = clock - self._clock if self._clock is not None else 0.0
        self._clock = clock
        with self._lock:
            if not 0 <= elapsed <= self.longest_gap + _ROUNDING:
                return self._held()
            self._jumped = False
            return self._moved(elapsed)

    def _held(self) -> Advance:
        """Hold for a jump: a single one changes no velocity, several in a row are a rest."""
        self.holds += 1
        if self._jumped:
            self._progress = 0.0
        self._jumped = True
        return Advance(0.0, smooth_rate(self._progress))

    def _moved(self, elapsed: float) -> Advance:
        """Follow the ramp, then hold or run for what is left of the time; no time leaves all as it is."""
        running = self._runs
        begin, goal = self._progress, 1.0 if running else 0.0
        on_ramp = min(elapsed, abs(goal - begin) * self.ramp)
        # Exactly at the goal once it is reached, whatever rounding says.
        reached = on_ramp < elapsed
        end = goal if reached else begin + (on_ramp if running else -on_ramp) / self.ramp
        self._progress = min(max(end, 0.0), 1.0)
        phase = self.ramp * abs(_integral(self._progress) - _integral(begin))
        phase += (elapsed - on_ramp) * goal
        return Advance(phase, smooth_rate(self._progress))
