"""Where the walker's frames are, from its joint positions and its base."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from walk_optimizer.description.skeleton import BASE, Joint, Skeleton


@dataclass(frozen=True)
class FrameTransform:
    """A frame in another.

    Attributes:
        parent: Name of the other frame.
        child: Name of the frame.
        translation: x, y, z in [m].
        rotation: Unit quaternion x, y, z, w.
    """

    parent: str
    child: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


def base_transform(fixed_frame: str, base: Iterable[float]) -> FrameTransform:
    """Return the floating base, which moves in a plane and does not turn.

    Args:
        fixed_frame: Name of the frame that the ground is in.
        base: Hip position in the optimiser's plane, (x, y) in [m]; its y is up.
    """
    x, y = map(float, base)
    return FrameTransform(fixed_frame, BASE, (x, 0.0, y), _turned_forward(0.0))


def link_transforms(skeleton: Skeleton, position: Iterable[float]) -> list[FrameTransform]:
    """Return the transform of every joint.

    Args:
        skeleton: The walker.
        position: Of the revolute joints in their order, in [rad].
    """
    angles = iter(position)
    return [_joint_transform(joint, next(angles) if joint.limits else 0.0) for joint in skeleton.joints]


def _joint_transform(joint: Joint, position: float) -> FrameTransform:
    return FrameTransform(
        joint.parent, joint.child, joint.origin, _turned_forward(joint.zero + float(position))
    )


def _turned_forward(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a turn about -y by an angle in [rad]."""
    return 0.0, -math.sin(angle / 2), 0.0, math.cos(angle / 2)
