"""The stream of references: each tick of the clock becomes the messages of that instant."""

import threading
from dataclasses import dataclass
from weakref import WeakKeyDictionary

from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension
from walk_optimizer_interfaces.msg import Gait as GaitMessage

from walk_optimizer.errors import SolveFailedError
from walk_optimizer.nodes.bag import RecordedTopic, StreamBag
from walk_optimizer.nodes.conversions import doubles, refined_from_message, trajectory_from_message
from walk_optimizer.nodes.pacer import Pacer
from walk_optimizer.nodes.publisher_settings import TORQUES
from walk_optimizer.nodes.qos import LATCHED, STREAM
from walk_optimizer.profile import EulerProfile, StepProfile, most_accurate
from walk_optimizer.references import JOINTS, Reference, ReferenceGenerator


@dataclass(frozen=True, eq=False)
class StreamedGait:
    """A gait as the stream needs it.

    Attributes:
        message: As it is announced.
        profile: As it is walked.
    """

    message: GaitMessage
    profile: StepProfile

    @classmethod
    def from_message(cls, message: GaitMessage) -> "StreamedGait":
        """Return the gait of a message; its refined part is walked if that is certified.

        Raises:
            GaitFileError: its arrays don't fit.
            SolveFailedError: it is not certified.
        """
        if not message.certificate.certified:
            raise SolveFailedError("only certified gaits are streamed; this one is not")
        euler = EulerProfile(trajectory_from_message(message), message.step_length, message.step_time)
        return cls(message, most_accurate(euler, refined_from_message(message)))

    def __str__(self) -> str:
        """Return the speed that is walked, and by the solution of which method."""
        return f"{self.profile.step_length / self.profile.step_time:.4f} m/s ({self.profile.method})"


class JointStream:
    """Publishes `~/joint_reference`, `~/feedforward_torques` and `~/gait`.

    Owns the thread that publishes. The rest is called from the node's executor.
    """

    def __init__(self, node: Node, bag: StreamBag, rate: float, longest_gap: float) -> None:
        """Create the topics and wait for a gait.

        Args:
            node: That publishes.
            bag: That records what is published.
            rate: In [Hz].
            longest_gap: Of the clock, in [s], see ReferenceGenerator.
        """
        self._node, self._longest_gap = node, longest_gap
        self._joints = RecordedTopic(node, JointState, "~/joint_reference", STREAM, bag)
        self._torques = RecordedTopic(node, Float64MultiArray, "~/feedforward_torques", STREAM, bag)
        self._gaits = RecordedTopic(node, GaitMessage, "~/gait", LATCHED, bag)
        self._joint_message = JointState(name=list(JOINTS))
        self.set_torque_order(list(TORQUES))
        self._running = True
        self._generator: ReferenceGenerator | None = None
        # The generator drops former gaits; their messages go with them.
        self._messages: WeakKeyDictionary[StepProfile, GaitMessage] = WeakKeyDictionary()
        self._announced: StepProfile | None = None
        self._begin_ns = self._last_ns = 0
        self._lock = threading.Lock()
        self._pacer = Pacer(1 / rate, self._tick)

    @property
    def gait(self) -> StreamedGait | None:
        """The gait of the running step; None before the first."""
        if self._generator is None:
            return None
        profile = self._generator.gait
        return StreamedGait(self._messages[profile], profile)

    @property
    def missed(self) -> int:
        """Ticks that came too late and were dropped."""
        return self._pacer.missed

    def walk(self, gait: StreamedGait) -> None:
        """Walk with a gait, from the next step on if there is a running one."""
        with self._lock:
            self._messages[gait.profile] = gait.message
            if self._generator is None:
                self._begin_ns = self._node.get_clock().now().nanoseconds
                self._generator = ReferenceGenerator(gait.profile, self._longest_gap)
            else:
                self._generator.change(gait.profile)

    def announce_again(self) -> None:
        """Publish the gait once more, so that a bag which has just begun holds it."""
        self._announced = None

    def set_rate(self, rate: float) -> None:
        """Publish at a rate in [Hz]."""
        self._pacer.period = 1 / rate

    def set_running(self, running: bool) -> None:
        """Publish, or stand still."""
        self._running = running

    def set_longest_gap(self, gap: float) -> None:
        """Take a larger move of the clock for a jump, in [s]."""
        self._longest_gap = gap
        if self._generator is not None:
            self._generator.longest_gap = gap

    def set_frame(self, frame_id: str) -> None:
        """Name the frame of the header."""
        self._joint_message.header.frame_id = frame_id

    def set_torque_order(self, order: list[str]) -> None:
        """Order the torques; the label of the layout lists them."""
        size = len(order)
        message = Float64MultiArray()
        message.layout.dim = [MultiArrayDimension(label=",".join(order), size=size, stride=size)]
        # Replaced as a whole: the stream's thread may be about to publish with the old order.
        self._torque_layout = message, [TORQUES.index(name) for name in order]

    def close(self) -> None:
        """Stop publishing."""
        self._pacer.stop()

    def _tick(self) -> None:
        """Publish the references of now; called by the pacer's thread."""
        if self._generator is None or not self._running:
            return
        try:
            self._publish(self._generator)
        except Exception as error:  # noqa: BLE001  # the stream must not end because one message failed
            self._node.get_logger().error(f"reference lost: {error!r}", throttle_duration_sec=1.0)

    def _publish(self, generator: ReferenceGenerator) -> None:
        now = self._node.get_clock().now()
        if now.nanoseconds == self._last_ns:
            return  # A simulation that stands still: nothing new to say.
        self._last_ns = now.nanoseconds
        # Counted from the begin: a float of the seconds since 1970 resolves a quarter microsecond.
        reference = generator.advance((now.nanoseconds - self._begin_ns) * 1e-9)
        if generator.gait is not self._announced:
            self._announce(generator.gait, now.nanoseconds)
        self._publish_joints(reference, now)
        message, rows = self._torque_layout
        message.data = doubles(reference.torques[rows])
        self._torques.publish(message, now.nanoseconds)

    def _publish_joints(self, reference: Reference, now: Time) -> None:
        message = self._joint_message
        message.header.stamp = now.to_msg()
        message.position = doubles(reference.position)
        message.velocity = doubles(reference.velocity)
        message.effort = doubles(reference.effort)
        self._joints.publish(message, now.nanoseconds)

    def _announce(self, profile: StepProfile, time_ns: int) -> None:
        self._gaits.publish(self._messages[profile], time_ns)
        self._announced = profile
