"""What a walk is doing, in a word and in a sentence."""

import math
from dataclasses import dataclass
from typing import Any

from walk_optimizer_interfaces.msg import WalkState

from walk_optimizer.nodes.streamed_gait import StreamedGait
from walk_optimizer.walk.phase_clock import Motion
from walk_optimizer.walk.walk import Walk

_SENTENCES = {
    "standing": "stands",
    "starting": "starts from standing to {speed:.4f} m/s",
    "walking": "walks at {speed:.4f} m/s",
    "changing": "changes its speed to {speed:.4f} m/s",
    "stopping": "comes to a stand",
    "paused": "holds its pose; call ~/resume to let it go on",
    "emergency_stop": "emergency stop, holds its pose without torques; ~/resume releases, once more goes on",
    "inactive": "nothing is streamed, the node is not active",
}
_SILENT = "holds its pose, and nothing is streamed; set `streaming` to true to let it go on"


@dataclass(frozen=True)
class WalkReport:
    """What a walk is doing.

    Attributes:
        state: A key of the sentences above.
        speed: Of the gait that is walked, or that the running steps lead to, in [m/s]; 0 for a stand.
        target_speed: That comes after it in [m/s].
        silent: Whether it is paused because nothing is to be streamed.
    """

    state: str
    speed: float
    target_speed: float
    silent: bool = False

    @classmethod
    def of(cls, walk: Walk, gait: StreamedGait | None, goal: StreamedGait | None) -> "WalkReport":
        """Return what a walk is doing.

        Args:
            walk: The walk.
            gait: Of its pace; None for a stand.
            goal: Of its goal; None for a stand.
        """
        speed = 0.0 if gait is None else gait.speed
        target_speed = 0.0 if goal is None else goal.speed
        clock = walk.clock
        silent = clock.suspended and clock.motion is not Motion.EMERGENCY_STOP
        return cls(Motion.PAUSED.value if silent else _state(walk), speed, target_speed, silent)

    def __str__(self) -> str:
        """Return the sentence, with the target where that differs."""
        text = (_SILENT if self.silent else _SENTENCES[self.state]).format(speed=self.speed)
        if self.target_speed == self.speed:
            return text
        then = f"{self.target_speed:.4f} m/s" if self.target_speed else "a stand"
        return f"{text}; then {then}"

    def to_message(self, stamp: Any, step: int) -> WalkState:
        """Return the report as a message of a time, in a step of that number."""
        return WalkState(
            stamp=stamp,
            state=self.state,
            speed=self.speed,
            target_speed=self.target_speed,
            step=step,
            message=str(self),
        )


# Before a walk is begun, and after it.
INACTIVE = WalkReport("inactive", 0.0, 0.0)


def _state(walk: Walk) -> str:
    if walk.clock.motion is not Motion.RUNNING:
        return walk.clock.motion.value
    to_stand = math.isinf(walk.pace.step_time)
    if not walk.is_changing:
        return "standing" if to_stand else "walking"
    if to_stand:
        return "stopping"
    return "starting" if math.isinf(walk.former.step_time) else "changing"
