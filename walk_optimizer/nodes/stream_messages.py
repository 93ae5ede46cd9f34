"""References as the messages that robots take, in the order and form that parameters ask for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from walk_optimizer.nodes.message_template import MessageTemplate
from walk_optimizer.references import JOINTS, Reference

FloatArray = NDArray[np.float64]

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
    """Makes the messages of one format, serialised."""

    def __init__(self, form: StreamFormat) -> None:
        """Prepare the messages."""
        self._rows = np.array([JOINTS.index(name) for name in form.joint_names])
        self._torque_rows = np.array([TORQUES.index(name) for name in form.torque_order])
        self._interface = form.command_interface
        joints = JointState(name=list(form.joint_names))
        joints.header.frame_id = form.frame_id
        self._joints = MessageTemplate(joints, ("position", "velocity", "effort"), len(form.joint_names))
        self._torques = _labelled(form.torque_order)
        self._commands = _labelled(form.joint_names)

    def joint_state(self, reference: Reference, time_ns: int) -> bytes:
        """Return positions, velocities and feed-forward torques of the joints at a time in [ns]."""
        rows = self._rows
        return self._joints.stamped(
            time_ns, reference.position[rows], reference.velocity[rows], reference.effort[rows]
        )

    def torques(self, reference: Reference) -> bytes:
        """Return the feed-forward torques u1, u2, u3."""
        return self._torques.filled(reference.torques[self._torque_rows])

    def commands(self, reference: Reference) -> bytes:
        """Return one value for each joint, as forward_command_controller takes them."""
        values: FloatArray = getattr(reference, self._interface)
        return self._commands.filled(values[self._rows])


def _labelled(names: Sequence[str]) -> MessageTemplate:
    """Return an array whose layout names its elements."""
    size = len(names)
    message = Float64MultiArray()
    message.layout.dim = [MultiArrayDimension(label=",".join(names), size=size, stride=size)]
    return MessageTemplate(message, ("data",), size)
