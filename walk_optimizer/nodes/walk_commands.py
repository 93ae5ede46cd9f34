"""From commands to steps: which speed is to be walked, and how the walk gets there."""

from typing import Any

from walk_optimizer_interfaces.srv import GetGait

from walk_optimizer.blending import blended
from walk_optimizer.errors import GaitNotFoundError, WalkOptimizerError
from walk_optimizer.joint_limits import JointLimits, peaks_of
from walk_optimizer.nodes.joint_stream import JointStream
from walk_optimizer.nodes.lifecycle import ManagedNode
from walk_optimizer.nodes.remote_service import RemoteService
from walk_optimizer.nodes.streamed_gait import StreamedGait
from walk_optimizer.nodes.suite_node import ServiceUnavailableError
from walk_optimizer.phase_clock import Motion
from walk_optimizer.profile import StepProfile
from walk_optimizer.request import GaitRequest

# Before the library is up, it is tried again after this time in [s].
_RETRY_PERIOD = 1.0


class SupersededError(WalkOptimizerError):
    """A later command came before this one could begin."""


class EmergencyStopError(WalkOptimizerError):
    """The emergency stop is still in force."""


class WalkCommands:
    """Gives a stream its goals, one at a time: of several commands the last one counts.

    Owns which command counts, and what a gait must meet to be walked. Does not own where commands come
    from, nor the stream. Everything here runs in the node's executor.
    """

    def __init__(self, node: ManagedNode, stream: JointStream, library: RemoteService) -> None:
        """Begin without a command.

        Args:
            node: That asks the library.
            stream: That walks.
            library: RemoteService of its service.
        """
        self._node, self._stream, self._library = node, stream, library
        self.limits = JointLimits()
        self._newest = 0

    def begin(self, stand: StepProfile, leg_length: float) -> None:
        """Take commands for a stream that has just begun with a stand.

        Args:
            stand: What a stop leads to.
            leg_length: Of a stretched leg in [m].
        """
        self._stand, self._leg_length = stand, leg_length
        self._peaks = peaks_of([stand])

    def require_met(self, limits: JointLimits) -> None:
        """Refuse limits that what is walked now does not meet.

        Raises:
            JointLimitError: names the joint and both numbers.
        """
        limits.require(self._peaks)

    async def walk_at(self, request: GaitRequest, wait_for_library: bool = False) -> str:
        """Have a gait walked, and return a sentence about it.

        Args:
            request: The gait.
            wait_for_library: Whether a library that is not there yet is waited for.

        Raises:
            WalkOptimizerError: there is no such gait, the joints can't do it, or it was superseded.
        """
        self._require_no_emergency()
        order = self._take_order()
        while True:
            try:
                gait = await self._fetch(request)
                break
            except ServiceUnavailableError:
                if not wait_for_library:
                    raise
            self._require_newest(order)
            self._node.get_logger().warning("waiting for the library", throttle_duration_sec=10.0)
            await self._node.sleep(_RETRY_PERIOD)
        peaks = peaks_of([gait.profile])
        self.limits.require(peaks)
        await self._lead_to(gait.profile, gait, order)
        self._peaks = peaks
        return f"{gait} from the next step on"

    async def stop(self) -> str:
        """Have the walk come to a stand, and return a sentence about it."""
        await self._lead_to(self._stand, None, self._take_order())
        self._peaks = peaks_of([self._stand])
        return "comes to a stand after the running step"

    def _require_no_emergency(self) -> None:
        if self._stream.walk.clock.motion is Motion.EMERGENCY_STOP:
            raise EmergencyStopError("emergency stop; call ~/resume to release it, then ask again")

    def _take_order(self) -> int:
        """Return the number of a command; those with lower numbers don't count any more."""
        self._newest += 1
        return self._newest

    def _require_newest(self, order: int) -> None:
        if order != self._newest:
            raise SupersededError("a later command came first")

    async def _fetch(self, request: GaitRequest) -> StreamedGait:
        """Return a gait of the library.

        Raises:
            WalkOptimizerError: the library refused, or is not there.
        """
        wanted = GetGait.Request(speed=request.speed, spring_mode=request.spring_mode.value)
        timeout: Any = self._node.parameters["library_timeout"]
        answer = await self._node.call(self._library, wanted, timeout)
        if not answer.success:
            raise GaitNotFoundError(answer.message)
        return StreamedGait.from_message(answer.gait)

    async def _lead_to(self, goal: StepProfile, gait: StreamedGait | None, order: int) -> None:
        """Have the stream walk to another pace from the one that it then has."""
        while True:
            self._require_newest(order)
            if self._stream.walk.stay(goal):
                return
            plan = blended(self._stream.walk.pace, goal, self._leg_length)
            if self._stream.follow(plan, gait):
                return
