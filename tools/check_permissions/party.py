"""A party of nodes.py: a process that tries what it can do with the running nodes, and prints it as JSON.

    party.py ROLE SECONDS [--ros-args --enclave ENCLAVE]

ROLE is the name of a function below. Without an enclave's keys, which SROS2's environment variables tell, the
party is a stranger.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable

import rclpy
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from walk_optimizer_interfaces.msg import WalkState
from walk_optimizer_interfaces.srv import GetGait, StartRecording, StopRecording

PUBLISHER = "/reference_publisher"
REFERENCES = f"{PUBLISHER}/joint_reference"
# A gait of the table that ships, in [m/s], and the frame that tells a forged reference from a true one.
SPEED, FORGED = 0.3185, "forged"
STREAM, LATCHED = QoSProfile(depth=1000), QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PERIOD = 0.1
# ROS tells when we know a service, not when it knows us; until then its answers are lost, in [s].
SETTLING = 1.0


class Party:
    """A node, and how long it tries each thing."""

    def __init__(self, node: Node, seconds: float) -> None:
        """Take part for some time in [s]."""
        self.node, self.seconds = node, seconds

    def spin(self, seconds: float, done: Callable[[], bool] = lambda: False) -> None:
        """Take part for some time in [s], or until something is done."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not done():
            rclpy.spin_once(self.node, timeout_sec=PERIOD)

    def hear(self, kind: type, name: str, qos: QoSProfile = STREAM) -> list:
        """Return the list that messages are put into as they arrive."""
        heard: list = []
        self.node.create_subscription(kind, name, heard.append, qos)
        return heard

    def say(self, message: object, name: str) -> None:
        """Publish a message again and again."""
        publisher = self.node.create_publisher(type(message), name, 1)
        for _ in range(round(self.seconds / PERIOD)):
            publisher.publish(message)
            self.spin(PERIOD)

    def call(self, kind: type, name: str, **fields: object) -> object:
        """Return the answer of a service; None when there is none."""
        client = self.node.create_client(kind, name)
        self.spin(self.seconds, client.service_is_ready)
        if not client.service_is_ready():
            return None
        self.spin(SETTLING)
        future = client.call_async(kind.Request(**fields))
        self.spin(self.seconds, future.done)
        return future.result() if future.done() else None


def is_served(party: Party) -> bool:
    """Return whether the library serves a gait."""
    answer = party.call(GetGait, "/gait_library/get_gait", speed=SPEED, spring_mode="stiffness")
    return answer is not None and answer.success


def changes_a_parameter(party: Party) -> bool:
    """Return whether the publisher takes the rate that it has already, in [Hz]."""
    value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=500.0)
    rate = Parameter(name="rate", value=value)
    answer = party.call(SetParameters, f"{PUBLISHER}/set_parameters", parameters=[rate])
    return answer is not None and answer.results[0].successful


def hears_references(party: Party) -> bool:
    """Return whether references of the publisher arrive."""
    heard = party.hear(JointState, REFERENCES)
    party.spin(party.seconds, lambda: bool(heard))
    return bool(heard)


def says_a_speed(party: Party) -> bool:
    """Return whether a speed can be sent; a witness sees whether it is heard."""
    party.say(Float64(data=SPEED), f"{PUBLISHER}/target_speed")
    return True


def says_references(party: Party) -> bool:
    """Return whether references can be sent; a witness sees whether they are heard."""
    message = JointState()
    message.header.frame_id = FORGED
    party.say(message, REFERENCES)
    return True


def attempt(party: Party) -> dict[str, bool]:
    """Try everything."""
    tried = (hears_references, is_served, changes_a_parameter, says_a_speed, says_references)
    return {what.__name__: allowed(what, party) for what in tried}


def allowed(what: Callable[[Party], bool], party: Party) -> bool:
    """Return whether something can be done; the party's own middleware may refuse it too."""
    try:
        return what(party)
    except RuntimeError:
        return False


def witness(party: Party) -> dict[str, bool]:
    """Look whether a speed is obeyed and whether forged references arrive."""
    references = party.hear(JointState, REFERENCES)
    states = party.hear(WalkState, f"{PUBLISHER}/state", LATCHED)
    party.spin(party.seconds)
    return {
        "obeyed": any(state.target_speed > 0 for state in states),
        "believed": any(reference.header.frame_id == FORGED for reference in references),
        "present": bool(states and references),
    }


def record(party: Party) -> dict[str, object]:
    """Have the publisher record for some time."""
    started = party.call(StartRecording, f"{PUBLISHER}/start_recording")
    party.spin(party.seconds)
    stopped = party.call(StopRecording, f"{PUBLISHER}/stop_recording")
    return {"bag": started.directory, "messages": stopped.messages}


def main() -> None:
    """Play the role, and print what came of it."""
    role, seconds = sys.argv[1], float(sys.argv[2])
    rclpy.init(args=sys.argv)
    # The policy of the operator and the controller is for nodes of these names.
    node = Node("operator" if "/walk_optimizer/operator" in sys.argv else "controller")
    roles = {one.__name__: one for one in (attempt, witness, record)}
    print(json.dumps(roles[role](Party(node, seconds))), flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
