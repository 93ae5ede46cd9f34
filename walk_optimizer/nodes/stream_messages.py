"""References as the messages that robots take, in the order and form that parameters ask for."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from walk_optimizer.nodes.conversions import doubles
from walk_optimizer.references import JOINTS, Reference

TORQUES = ("u1", "u2", "u3")
# Command interfaces of ros2_control; each is an attribute of a reference.
INTERFACES = ("position", "velocity", "effort")


@dataclass(frozen=True)
class StreamFormat:
    """What the streamed messages look like.

    Attributes:
        joint_names: The joints in the order of all messages.
        torque_order: The torques u1, u2, u3 in the order of ~/feedforward_torques.
        command_interface: What ~/commands holds: position, velocity or effort.
        frame_id: Of the header.
    """

    joint_names: Sequence[str] = JOINTS
    torque_order: Sequence[str] = TORQUES
    command_interface: str = "position"
    frame_id: str = ""


class StreamMessages:
    """Makes the messages of one format; each is made once and filled again for every reference."""

    def __init__(self, form: StreamFormat) -> None:
        """Prepare the messages."""
        self._rows = [JOINTS.index(name) for name in form.joint_names]
        self._torque_rows = [TORQUES.index(name) for name in form.torque_order]
        self._interface = form.command_interface
        self._joints = JointState(name=list(form.joint_names))
        self._joints.header.frame_id = form.frame_id
        self._torques = _labelled(form.torque_order)
        self._commands = _labelled(form.joint_names)

    def joint_state(self, reference: Reference, stamp: Any) -> JointState:
        """Return positions, velocities and feed-forward torques of the joints."""
        message = self._joints
        message.header.stamp = stamp
        message.position = doubles(reference.position[self._rows])
        message.velocity = doubles(reference.velocity[self._rows])
        message.effort = doubles(reference.effort[self._rows])
        return message

    def torques(self, reference: Reference) -> Float64MultiArray:
        """Return the feed-forward torques u1, u2, u3."""
        self._torques.data = doubles(reference.torques[self._torque_rows])
        return self._torques

    def commands(self, reference: Reference) -> Float64MultiArray:
        """Return one value for each joint, as forward_command_controller takes them."""
        self._commands.data = doubles(getattr(reference, self._interface)[self._rows])
        return self._commands


def _labelled(names: Sequence[str]) -> Float64MultiArray:
    """Return an array whose layout names its elements."""
    size = len(names)
    message = Float64MultiArray()
    message.layout.dim = [MultiArrayDimension(label=",".join(names), size=size, stride=size)]
    return message
