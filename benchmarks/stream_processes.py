"""The processes that the stream is measured beside and with: a bare publisher, a listener, a bare service."""

import argparse
import json
import signal
import struct
import sys
import time
from array import array

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

# So many messages may wait: none is lost while the listener is held up.
DEPTH = 10_000
# The stamp of a JointState, behind the four bytes of CDR's encapsulation.
_STAMP = struct.Struct("<iI")
_STAMP_OFFSET = 4


def bare_publisher(node, rate):
    """A timer of rclpy that publishes: the least that a Python node can do."""
    publisher = node.create_publisher(JointState, "~/joint_reference", 10)
    message = JointState(name=["left_hip", "left_knee", "right_hip", "right_knee"])
    message.position = message.velocity = message.effort = array("d", [0.0] * 4)
    clock = node.get_clock()

    def tick():
        message.header.stamp = clock.now().to_msg()
        publisher.publish(message)

    node.create_timer(1 / rate, tick)


def listener(node, topic, received):
    """A subscriber that notes when each message was stamped and when it arrived, in [ns]."""

    def take(data):
        arrived = time.time_ns()
        seconds, nanoseconds = _STAMP.unpack_from(data, _STAMP_OFFSET)
        received.append((seconds * 1_000_000_000 + nanoseconds, arrived))

    node.create_subscription(JointState, topic, take, QoSProfile(depth=DEPTH), raw=True)


def main():
    """Run until SIGTERM; a listener then prints what it has noted."""
    parser = argparse.ArgumentParser()
    parser.add_argument("kind", choices=["bare", "listener", "service"])
    parser.add_argument("--rate", type=float, default=500.0)
    parser.add_argument("--topic", default="")
    args = parser.parse_args()
    stop = []
    signal.signal(signal.SIGTERM, lambda *_: stop.append(True))
    rclpy.init(args=[], signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    node, received = Node(args.kind), []
    if args.kind == "bare":
        bare_publisher(node, args.rate)
    elif args.kind == "service":
        node.create_service(Trigger, "~/bare", lambda _, response: response)
    else:
        listener(node, args.topic, received)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    # What waits in the publisher while a listener is discovered arrives late, and all at once.
    while args.kind == "listener" and not (received or stop):
        executor.spin_once(timeout_sec=0.1)
    print("ready", flush=True)
    while not stop:
        executor.spin_once(timeout_sec=0.1)
    if args.kind == "listener":
        json.dump(received, sys.stdout)


if __name__ == "__main__":
    main()
