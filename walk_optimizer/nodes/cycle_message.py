"""A cycle of references as joint_trajectory_controller takes it."""

import math
from collections.abc import Sequence

from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from walk_optimizer.nodes.conversions import doubles
from walk_optimizer.references import JOINTS, Cycle


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
