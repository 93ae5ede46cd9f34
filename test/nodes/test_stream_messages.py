import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

pytest.importorskip("rclpy")
from nodes.walking import stamp_ns
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from walk_optimizer.nodes.message_template import MessageTemplate
from walk_optimizer.nodes.stream_messages import TORQUES, StreamFormat, StreamMessages
from walk_optimizer.recording.ros_messages import serialize
from walk_optimizer.references import JOINTS, Reference

FOUR = arrays(np.float64, 4)
NAMES = st.permutations(JOINTS)
TEXTS = st.text(st.characters(exclude_characters="\0"), min_size=1, max_size=5)
TIMES = st.integers(min_value=0, max_value=(2**31 - 1) * 10**9)


def reference(position, velocity, effort):
    return Reference(position, velocity, effort, np.zeros(2), np.zeros(2), 0, 0.0)


@settings(max_examples=50, deadline=None)
@given(FOUR, FOUR, FOUR, NAMES, st.text("héelbow/ö", max_size=9), TIMES)
def test_joint_states_hold_the_reference_in_the_order_that_is_asked_for(
    position, velocity, effort, names, frame, time_ns
):
    messages = StreamMessages(StreamFormat(joint_names=names, frame_id=frame))
    data = messages.joint_state(reference(position, velocity, effort), time_ns)
    message = deserialize_message(data, JointState)
    assert message.name == names
    assert message.header.frame_id == frame
    assert stamp_ns(message) == time_ns
    for field, values in (("position", position), ("velocity", velocity), ("effort", effort)):
        expected = [values[JOINTS.index(name)] for name in names]
        np.testing.assert_array_equal(getattr(message, field), expected)


@settings(max_examples=50, deadline=None)
@given(FOUR, FOUR, FOUR, NAMES, st.permutations(TORQUES), st.sampled_from(["position", "velocity", "effort"]))
def test_arrays_hold_the_reference_in_the_order_of_their_labels(
    position, velocity, effort, names, torques, interface
):
    form = StreamFormat(joint_names=names, torque_order=torques, command_interface=interface)
    messages, wanted = StreamMessages(form), reference(position, velocity, effort)
    message = deserialize_message(messages.torques(wanted), Float64MultiArray)
    assert message.layout.dim[0].label == ",".join(torques)
    np.testing.assert_array_equal(message.data, [effort[[0, 1, 3]][TORQUES.index(one)] for one in torques])
    message = deserialize_message(messages.commands(wanted), Float64MultiArray)
    assert message.layout.dim[0].label == ",".join(names)
    np.testing.assert_array_equal(
        message.data, [getattr(wanted, interface)[JOINTS.index(one)] for one in names]
    )


@settings(max_examples=50, deadline=None)
@given(FOUR, FOUR, FOUR, TIMES, st.lists(TEXTS, min_size=4, max_size=4))
def test_a_template_makes_the_message_in_its_size(position, velocity, effort, time_ns, names):
    fields = {"position": position, "velocity": velocity, "effort": effort}
    template = MessageTemplate(JointState(name=names), tuple(fields), 4)
    data = template.stamped(time_ns, *fields.values())
    message = deserialize_message(data, JointState)
    assert {name: np.array(getattr(message, name)).tobytes() for name in fields} == {
        name: values.tobytes() for name, values in fields.items()
    }
    assert (message.name, message.header.frame_id) == (names, "")
    assert stamp_ns(message) == time_ns
    # Not the bytes: rclpy fills gaps between fields with whatever the memory held.
    assert len(serialize(message)) == len(data)


def test_a_template_hands_out_bytes_that_it_does_not_change_any_more():
    template = MessageTemplate(Float64MultiArray(), ("data",), 3)
    first = template.filled(np.array([1.0, 2.0, 3.0]))
    template.filled(np.array([4.0, 5.0, 6.0]))
    np.testing.assert_array_equal(deserialize_message(first, Float64MultiArray).data, [1.0, 2.0, 3.0])
