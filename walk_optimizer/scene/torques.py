"""Joint torques as arcs around the joints: from the segment that is driven to where it is driven."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.references import JOINTS
from walk_optimizer.scene.tracking import WalkerPose

FloatArray = NDArray[np.float64]

_RADIUS = 0.13
_HEAD_LENGTH = 0.04
# The sides of an arrow's head are turned so far from its shaft, [rad].
_HEAD_ANGLE = 0.45
_POINTS = 16
# More than most of a turn can't be told from less, [rad].
_LARGEST_SWEEP = 5.5


@dataclass(frozen=True, eq=False)
class TorqueArc:
    """The torque of a joint.

    Attributes:
        joint: Name of the joint.
        torque: In [N m]; positive drives forward or stretches.
        centre: Of the joint: x, y in [m], (2,).
        points: Of the arc with its head: x, y in [m], (2, K).
    """

    joint: str
    torque: float
    centre: FloatArray
    points: FloatArray


def torque_arcs(
    walker: WalkerParameters, pose: WalkerPose, effort: FloatArray, scale: float
) -> list[TorqueArc]:
    """Return the arcs of all joints.

    Args:
        walker: The walker.
        pose: Where it is.
        effort: Torques of `references.JOINTS` in [N m], (4,).
        scale: Angle of an arc in [rad/(N m)].
    """
    arcs = []
    for leg in range(2):
        hip, knee = pose.position[2 * leg : 2 * leg + 2]
        knee_place = pose.base + walker.upper_leg_length * _direction(hip)
        arcs += [(pose.base, hip), (knee_place, hip + knee - np.pi)]
    return [
        TorqueArc(joint, float(torque), centre, centre[:, None] + _arc(segment, float(torque) * scale))
        for joint, torque, (centre, segment) in zip(JOINTS, effort, arcs, strict=True)
    ]


def _direction(angle: FloatArray) -> FloatArray:
    """Return unit vectors at angles from the downward vertical, forward positive, (2, ...)."""
    return np.array([np.sin(angle), -np.cos(angle)])


def _arc(start: float, sweep: float) -> FloatArray:
    """Return an arc around the origin from an angle by a sweep in [rad], with an arrow's head, (2, K)."""
    sweep = float(np.clip(sweep, -_LARGEST_SWEEP, _LARGEST_SWEEP))
    arc = _RADIUS * _direction(start + np.linspace(0.0, sweep, _POINTS))
    tip = arc[:, -1]
    # Back along the arc at its tip, to both sides.
    back = start + sweep - np.sign(sweep) * np.pi / 2
    sides = [tip + _HEAD_LENGTH * _direction(back + turn) for turn in (_HEAD_ANGLE, -_HEAD_ANGLE)]
    return np.column_stack([arc, sides[0], tip, sides[1]])
