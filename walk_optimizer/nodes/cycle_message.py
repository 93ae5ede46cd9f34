"""A cycle of references as joint_trajectory_controller takes it."""

import math
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor

from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from walk_optimizer.nodes.conversions import doubles
from walk_optimizer.references import JOINTS, Cycle, require_rate, sample_cycle
from walk_optimizer.references.profile import StepProfile
from walk_optimizer.solve.worker import BusyError

# Controllers interpolate between the points. To send more of them would hold up the stream.
_HIGHEST_RATE = 1000.0
# A cycle takes a third of a second at the highest rate.
_WAITING_LIMIT = 16


class CycleMessages:
    """Makes cycles in a thread, one after the other, so that the node answers others meanwhile."""

    def __init__(self) -> None:
        """Start the thread."""
        self._thread = ThreadPoolExecutor(1, "cycles")
        self._waiting: list[Future[JointTrajectory]] = []

    def make(
        self, profile: StepProfile, rate: float, joint_names: Sequence[str], effort: bool
    ) -> "Future[JointTrajectory]":
        """Return what will be the cycle of a gait, with so many points per second in [Hz].

        Raises:
            InvalidRequestError: the rate is out of range.
            BusyError: too many others wait.
        """
        require_rate(rate, _HIGHEST_RATE)
        self._waiting = [future for future in self._waiting if not future.done()]
        if len(self._waiting) >= _WAITING_LIMIT:
            raise BusyError(f"busy: {len(self._waiting)} cycles are being made; ask again later")
        names = tuple(joint_names)
        future = self._thread.submit(lambda: cycle_to_message(sample_cycle(profile, rate), names, effort))
        self._waiting.append(future)
        return future

    def close(self) -> None:
        """End the thread after what it does now."""
        self._thread.shutdown(wait=False, cancel_futures=True)


def cycle_to_message(
    cycle: Cycle, joint_names: Sequence[str] = JOINTS, effort: bool = True
) -> JointTrajectory:
    """Return a cycle as a message, with the joints in the given order.

    Args:
        cycle: The cycle.
        joint_names: Order of the joints.
        effort: Whether the feed-forward torques are in it: a controller without an effort command
            interface refuses a trajectory that has them.

    The stamp stays 0, which means "begin when it arrives"; with a real one, a replay is refused as
    past. The last velocity is 0, because a trajectory that does not end at rest is refused unless the
    controller is told otherwise.
    """
    rows = [JOINTS.index(name) for name in joint_names]
    velocity = cycle.velocity.copy()
    velocity[:, -1] = 0.0
    return JointTrajectory(
        joint_names=list(joint_names),
        points=[
            JointTrajectoryPoint(
                positions=doubles(cycle.position[rows, index]),
                velocities=doubles(velocity[rows, index]),
                effort=doubles(cycle.effort[rows, index]) if effort else [],
                time_from_start=_duration(time),
            )
            for index, time in enumerate(cycle.time.tolist())
        ],
    )


def _duration(seconds: float) -> Duration:
    whole = math.floor(seconds)
    return Duration(sec=whole, nanosec=min(round((seconds - whole) * 1e9), 999_999_999))
