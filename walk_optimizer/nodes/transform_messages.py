"""Transforms of frames as messages of tf2."""

from collections.abc import Iterable

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from tf2_msgs.msg import TFMessage

from walk_optimizer.description.transforms import FrameTransform


def transforms_to_message(transforms: Iterable[FrameTransform], stamp: Time) -> TFMessage:
    """Return transforms of one instant as a message."""
    return TFMessage(transforms=[_stamped(transform, stamp) for transform in transforms])


def _stamped(transform: FrameTransform, stamp: Time) -> TransformStamped:
    message = TransformStamped(child_frame_id=transform.child)
    message.header.stamp, message.header.frame_id = stamp, transform.parent
    message.transform.translation = Vector3(**dict(zip("xyz", transform.translation, strict=True)))
    message.transform.rotation = Quaternion(**dict(zip("xyzw", transform.rotation, strict=True)))
    return message
