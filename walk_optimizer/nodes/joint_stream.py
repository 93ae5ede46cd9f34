"""The stream of references: each tick of the clock becomes the messages of that instant."""

import time

from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from walk_optimizer_interfaces.msg import Gait as GaitMessage
from walk_optimizer_interfaces.msg import KneeSpring as KneeSpringMessage
from walk_optimizer_interfaces.msg import WalkState

from walk_optimizer.nodes.bag import RecordedTopic, StreamBag
from walk_optimizer.nodes.pacer import Pacer
from walk_optimizer.nodes.qos import LATCHED, STREAM
from walk_optimizer.nodes.stream_messages import StreamFormat, StreamMessages
from walk_optimizer.nodes.streamed_gait import Goal, StreamedGait
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.nodes.walk_report import INACTIVE, WalkReport
from walk_optimizer.references.profile import StepProfile
from walk_optimizer.walk.phase_clock import PhaseClock
from walk_optimizer.walk.stand import StandProfile
from walk_optimizer.walk.tick_statistics import Punctuality
from walk_optimizer.walk.walk import StepPlan, Walk


class JointStream:
    """Publishes what a walk asks of the joints, and latched what is walked.

    Owns the thread that publishes. The rest is called from the node's executor.
    """

    def __init__(self, node: SuiteNode, bag: StreamBag, clock: PhaseClock) -> None:
        """Create the topics; nothing is published before `start`.

        Args:
            node: That publishes.
            bag: That records what is published.
            clock: That moves the walks, one after the other.
        """
        self._node, self._bag, self._clock = node, bag, clock
        self._joints = RecordedTopic(node, JointState, "~/joint_reference", STREAM, bag)
        self._torques = RecordedTopic(node, Float64MultiArray, "~/feedforward_torques", STREAM, bag)
        self._commands = RecordedTopic(node, Float64MultiArray, "~/commands", STREAM, bag)
        self._gaits = RecordedTopic(node, GaitMessage, "~/gait", LATCHED, bag)
        self._springs = RecordedTopic(node, KneeSpringMessage, "~/knee_spring", LATCHED, bag)
        self._states = RecordedTopic(node, WalkState, "~/state", LATCHED, bag)
        self._messages = StreamMessages(StreamFormat())
        self._report: WalkReport | None = None
        self._pacer: Pacer | None = None

    @property
    def gait(self) -> StreamedGait | None:
        """The gait that is walked, or that the running steps lead to; None for a stand."""
        return self._known.get(self.walk.pace)

    @property
    def pace(self) -> Goal:
        """The gait or the stand that is kept, or that the running steps lead to."""
        pace = self.walk.pace
        return pace if isinstance(pace, StandProfile) else self._known[pace]

    @property
    def report(self) -> WalkReport:
        """What the walk is doing."""
        return INACTIVE if self._pacer is None else self._of_walk(self.gait)

    @property
    def running(self) -> bool:
        """Whether references are to be published."""
        return not self._clock.suspended

    @property
    def silence(self) -> float:
        """Time since the last reference in [s] of the wall clock."""
        return time.monotonic() - self._published

    @property
    def missed(self) -> int:
        """Ticks that came too late and were dropped, since `start`."""
        return self._pacer.missed if self._pacer is not None else 0

    def punctuality(self) -> Punctuality | None:
        """Return how punctual the stream was in about the last second; None before `start`."""
        return self._pacer.punctuality() if self._pacer is not None else None

    def start(self, stand: StandProfile, rate: float) -> None:
        """Begin to publish a walk that stands, in the format and with the settings that there are by then.

        Args:
            stand: Its pose.
            rate: In [Hz].
        """
        self._clock.restart()
        self.walk = Walk(stand, self._clock)
        self._known: dict[StepProfile, StreamedGait] = {}
        self._announced: StepProfile | None = None
        self._report = None
        self._begin_ns = self._node.get_clock().now().nanoseconds
        self._last_ns = -1
        self._published = time.monotonic()
        self._pacer = Pacer(1 / rate, self._tick)

    def stop(self) -> None:
        """Stop publishing, and say so."""
        if self._pacer is None:
            return
        self._pacer.stop()
        self._pacer = None
        self._publish_state(INACTIVE, self._node.get_clock().now())

    def follow(self, plan: StepPlan, goal: Goal) -> bool:
        """Take a plan from the end of the running step on.

        Args:
            plan: Steps to another pace.
            goal: What it leads to.

        Returns:
            Whether the plan begins at the present pace; if not, nothing has changed.
        """
        kept = [self._known.get(profile) for profile in (self.walk.pace, self.walk.goal)]
        gaits = [one for one in (*kept, goal) if isinstance(one, StreamedGait)]
        # Replaced as a whole, for the stream's thread, and before it may walk the plan; former gaits are
        # forgotten.
        before, self._known = self._known, {gait.profile: gait for gait in gaits}
        followed = self.walk.follow(plan)
        if not followed:
            self._known = before
        return followed

    def announce_again(self) -> None:
        """Publish once more what is latched, so that a bag which has just begun holds it."""
        self._announced = self._report = None

    def set_rate(self, rate: float) -> None:
        """Publish at a rate in [Hz]."""
        if self._pacer is not None:
            self._pacer.period = 1 / rate

    def set_running(self, running: bool) -> None:
        """Publish, or come to a hold and be silent then; from there the walk goes on as after a pause."""
        self._clock.suspended = not running

    def set_format(self, form: StreamFormat) -> None:
        """Publish in a format."""
        # Replaced as a whole: the stream's thread may be about to publish.
        self._messages = StreamMessages(form)

    def _tick(self) -> None:
        """Publish what there is to say now; called by the pacer's thread."""
        try:
            self._publish()
        except Exception as error:  # noqa: BLE001  # the stream must not end because one message failed
            self._node.get_logger().error(f"reference lost: {error!r}", throttle_duration_sec=1.0)

    def _publish(self) -> None:
        now = self._node.get_clock().now()
        if now.nanoseconds != self._last_ns:  # A simulation that stands still: no new reference.
            if self._last_ns == 0:
                self.announce_again()  # Simulated time begins: what was said before it is in no bag.
            self._last_ns = now.nanoseconds
            self._move_on(now)
        self._announce(now)
        self._bag.rest()

    def _move_on(self, now: Time) -> None:
        """Move the walk on and publish its references, but none once it is held because none are wanted."""
        silent = self._clock.suspended and self._clock.at_rest
        # Counted from the begin: a float of the seconds since 1970 resolves a quarter microsecond.
        reference = self.walk.advance((now.nanoseconds - self._begin_ns) * 1e-9)
        if silent:
            return
        messages = self._messages
        self._joints.publish(messages.joint_state(reference, now.nanoseconds), now.nanoseconds)
        self._torques.publish(messages.torques(reference), now.nanoseconds)
        self._commands.publish(messages.commands(reference), now.nanoseconds)
        self._published = time.monotonic()

    def _announce(self, now: Time) -> None:
        """Publish what is latched where that has changed."""
        gait = self.gait
        report = self._of_walk(gait)
        if report != self._report:
            self._publish_state(report, now)
        if gait is not None and gait.profile is not self._announced:
            self._gaits.publish(gait.message, now.nanoseconds)
            spring = KneeSpringMessage(
                stamp=now.to_msg(), stiffness=gait.spring.stiffness, equilibrium=gait.spring.equilibrium
            )
            self._springs.publish(spring, now.nanoseconds)
            self._announced = gait.profile

    def _of_walk(self, gait: StreamedGait | None) -> WalkReport:
        """Return what the walk is doing, whose gait that is."""
        return WalkReport.of(self.walk, gait, self._known.get(self.walk.goal))

    def _publish_state(self, report: WalkReport, now: Time) -> None:
        self._states.publish(report.to_message(now.to_msg(), self.walk.step), now.nanoseconds)
        self._report = report
