"""The client of the demonstration: calls the suite's services, and listens to its references."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from walk_optimizer_interfaces.msg import Gait as GaitMessage
from walk_optimizer_interfaces.msg import WalkState
from walk_optimizer_interfaces.srv import OptimizeGait, SetGait, StartRecording, StopRecording

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.gait import Gait
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.conversions import gait_from_message
from walk_optimizer.nodes.qos import LATCHED, STREAM
from walk_optimizer.nodes.streamed_gait import ReceivedGait
from walk_optimizer.nodes.suite_node import ServiceUnavailableError
from walk_optimizer.references import JOINTS
from walk_optimizer.references.check import CycleMatcher
from walk_optimizer.request import GaitRequest

_POLL = 0.05
# ROS tells when we know a service, not when it knows us; until then its answers are lost, [s].
_SETTLING = 0.5


@dataclass(frozen=True)
class Reception:
    """What a subscriber received, compared with the gait.

    Attributes:
        messages: Number of joint references.
        span: From the first stamp to the last in [s].
        position: Largest deviation from the gait in [rad].
        velocity: The same in [rad/s].
        effort: The same in [N m].
        in_order: Whether every stamp is later than the one before.
    """

    messages: int
    span: float
    position: float
    velocity: float
    effort: float
    in_order: bool

    @property
    def right(self) -> bool:
        """Whether everything agrees with the gait."""
        deviation = max(self.position, self.velocity, self.effort)
        return self.messages > 0 and self.in_order and deviation < 1e-5


class DemoClient:
    """Calls services one after the other, and keeps the references that arrive meanwhile."""

    def __init__(self, node: Node, executor: SingleThreadedExecutor, alive: Callable[[], None]) -> None:
        """Subscribe.

        Args:
            node: Of the client.
            executor: That has the node.
            alive: Raises when it makes no sense to wait any longer.
        """
        self._node, self._executor, self._alive = node, executor, alive
        self._references: list[JointState] = []
        self._gait: GaitMessage | None = None
        self._state = ""
        node.create_subscription(
            JointState, "reference_publisher/joint_reference", self._references.append, STREAM
        )
        node.create_subscription(GaitMessage, "reference_publisher/gait", self._take_gait, LATCHED)
        node.create_subscription(WalkState, "reference_publisher/state", self._take_state, LATCHED)

    def optimize(self, request: GaitRequest, walker: WalkerParameters, timeout: float) -> Gait:
        """Return the gait that the optimizer's service answers with."""
        message = OptimizeGait.Request(
            speed=request.speed, spring_mode=request.spring_mode.value, points=request.points
        )
        answer = self._call(OptimizeGait, "gait_optimizer/optimize_gait", message, timeout)
        return gait_from_message(answer.gait, answer.report, walker, request)

    def set_gait(self, request: GaitRequest, timeout: float) -> str:
        """Have the publisher walk, and return its answer."""
        message = SetGait.Request(speed=request.speed, spring_mode=request.spring_mode.value)
        answer = self._call(SetGait, "reference_publisher/set_gait", message, timeout)
        return str(answer.message)

    def start_recording(self, directory: str) -> None:
        """Have the publisher record."""
        message = StartRecording.Request(directory=directory)
        self._call(StartRecording, "reference_publisher/start_recording", message)

    def stop_recording(self) -> str:
        """Have the publisher close the bag, and return its answer."""
        answer = self._call(StopRecording, "reference_publisher/stop_recording", StopRecording.Request())
        return str(answer.message)

    def wait(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Listen until something is done.

        Raises:
            ServiceUnavailableError: it was not done within the timeout in [s].
        """
        deadline = time.monotonic() + timeout
        while not done():
            self._alive()
            if time.monotonic() > deadline:
                raise ServiceUnavailableError(f"{what} took longer than {timeout:g} s")
            self._executor.spin_once(timeout_sec=_POLL)

    def pause(self, seconds: float) -> None:
        """Listen for some time in [s]."""
        end = time.monotonic() + seconds
        self.wait(lambda: time.monotonic() >= end, seconds + 30.0, "listening")

    def listen(self, seconds: float) -> Reception:
        """Return what arrives in some time in [s], compared with the gait that the publisher announced."""
        # The steps that lead to the gait are not part of it.
        self.wait(lambda: self._gait is not None and self._state == "walking", 30.0, "the gait")
        self._references.clear()
        self.pause(seconds)
        assert self._gait is not None  # noqa: S101  # waited for above
        return compare(self._references, self._gait, WalkerParameters.from_yaml())

    def _take_gait(self, message: GaitMessage) -> None:
        self._gait = message

    def _take_state(self, message: WalkState) -> None:
        self._state = message.state

    def _call(self, kind: Any, name: str, request: Any, timeout: float = 30.0) -> Any:
        client = self._node.create_client(kind, name)
        try:
            self.wait(client.service_is_ready, 60.0, f"waiting for {name}")
            self.pause(_SETTLING)
            future = client.call_async(request)
            self.wait(future.done, timeout, name)
        finally:
            self._node.destroy_client(client)
        answer = future.result()
        if not answer.success:
            raise SolveFailedError(f"{name}: {answer.message}")
        return answer


def compare(references: list[JointState], message: GaitMessage, walker: WalkerParameters) -> Reception:
    """Return how far received references are from a gait; names decide which joint is which."""
    matcher = CycleMatcher(ReceivedGait.from_message(message, walker).profile)
    matches = []
    for reference in references:
        rows = [list(reference.name).index(joint) for joint in JOINTS]
        values = (np.array(getattr(reference, name))[rows] for name in ("position", "velocity", "effort"))
        matches.append(matcher.match(*values))
    stamps = [one.header.stamp.sec + one.header.stamp.nanosec * 1e-9 for one in references]
    return Reception(
        messages=len(references),
        span=stamps[-1] - stamps[0] if stamps else 0.0,
        position=max((match.position for match in matches), default=0.0),
        velocity=max((match.velocity for match in matches), default=0.0),
        effort=max((match.effort for match in matches), default=0.0),
        in_order=bool(np.all(np.diff(stamps) > 0)),
    )


@contextmanager
def demo_client(alive: Callable[[], None]) -> Iterator[DemoClient]:
    """Take part in the ROS graph as long as the context lasts; signals stay the caller's."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node, executor = Node("walk_optimizer_demo"), SingleThreadedExecutor()
    executor.add_node(node)
    try:
        yield DemoClient(node, executor, alive)
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()
