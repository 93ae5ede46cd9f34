"""What tests of the publisher have in common: commands, and waiting for what they lead to."""

from contextlib import contextmanager

import numpy as np
from nodes.graph import SETTLING
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from walk_optimizer_interfaces.msg import WalkState
from walk_optimizer_interfaces.srv import SetGait

from walk_optimizer.nodes.qos import LATCHED

MODE = "stiffness_and_equilibrium"
NODE = "reference_publisher"
ALL = QoSProfile(depth=20_000)
# Blended, because nobody can solve for steps between gaits that are made up. A test machine may stall for
# long; the phase shall then go on with the clock.
BLENDED = {"rate": 100.0, "transitions": "blended", "longest_gap": 10.0}
# Between two references of 100 Hz a joint is up to 0.04 rad/s faster than at both; more at a lower rate.
MARGIN = 0.5
# References that are further apart than this in [s], and what no joint exceeds between them in [rad/s].
STALL, FASTEST = 0.03, 40.0
PAUSE_TIME_NS = 300_000_000


class Walker:
    """A publisher that a test commands."""

    def __init__(self, graph, namespace=""):
        self.graph = graph
        self.node = f"{namespace}/{NODE}".lstrip("/")
        self.states = graph.subscribe(WalkState, f"{self.node}/state", LATCHED)

    def topic(self, name):
        return f"{self.node}/{name}"

    def trigger(self, name):
        answer = self.graph.call(Trigger, self.topic(name))
        assert answer.success, answer.message
        return answer.message

    def set_gait(self, speed, mode=MODE):
        return self.graph.call(SetGait, self.topic("set_gait"), speed=speed, spring_mode=mode)

    def walk(self, speed):
        """Have a gait walked, and wait until the steps that lead to it are over."""
        answer = self.set_gait(speed)
        assert answer.success, answer.message
        self.wait_for("walking", speed)

    def pause(self):
        """Pause, and wait for the rest that follows by the default of `pause_time`."""
        self.trigger("pause")
        joints = self.listen(JointState, "joint_reference")

        def at_rest():
            return joints and stamp_ns(joints[-1]) - stamp_ns(joints[0]) > 2 * PAUSE_TIME_NS

        self.graph.spin_until(at_rest, "the rest")

    def wait_for(self, state, speed=None):
        def there():
            last = self.states[-1] if self.states else None
            return last and last.state == state and (speed is None or abs(last.speed - speed) < 1e-6)

        self.graph.spin_until(there, f"{state} at {speed} m/s")

    def listen(self, kind, name):
        return self.graph.subscribe(kind, self.topic(name), ALL)

    def talk(self, kind, name):
        """Return a publisher that the node hears."""
        publisher = self.graph.publisher(kind, self.topic(name))
        self.graph.spin_for(SETTLING)
        return publisher


@contextmanager
def standing_walker(graph, publisher):
    """Hand out a publisher that stands, and have it stand again afterwards."""
    walker = Walker(graph)
    walker.wait_for("standing")
    yield walker
    walker.trigger("stop")
    walker.wait_for("standing")
    assert publisher.exit_code is None


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def assert_continuous(joints):
    """Assert that no joint moves further than its velocities allow."""
    velocities = np.abs([message.velocity for message in joints])
    moved = np.abs(np.diff([message.position for message in joints], axis=0))
    elapsed = np.diff([stamp_ns(message) for message in joints]) * 1e-9
    assert np.all(elapsed > 0)
    at_ends = np.maximum(velocities[:-1], velocities[1:])
    # A test machine may stall for long: then the ends say nothing about what was between.
    fastest = np.where(elapsed[:, None] < STALL, at_ends + MARGIN, FASTEST)
    assert np.all(moved <= fastest * elapsed[:, None])
