"""From commands to steps: which speed is to be walked, and how the walk gets there."""

from walk_optimizer_interfaces.srv import GetGait

from walk_optimizer.errors import GaitNotFoundError, WalkOptimizerError
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.joint_stream import JointStream
from walk_optimizer.nodes.lifecycle import ManagedNode
from walk_optimizer.nodes.remote_service import RemoteService
from walk_optimizer.nodes.streamed_gait import ReceivedGait, StreamedGait, profile_of_goal
from walk_optimizer.nodes.suite_node import ServiceUnavailableError
from walk_optimizer.nodes.transition_planner import TransitionPlanner
from walk_optimizer.nodes.walk_order import WalkOrder
from walk_optimizer.request import GaitRequest
from walk_optimizer.transition.settings import transition_settings
from walk_optimizer.transition.standing import standing_pose
from walk_optimizer.walk.joint_limits import JointLimits, JointNeed, JointPeaks, peaks_of, peaks_of_gait
from walk_optimizer.walk.needs import PaceNeeds, WalkNeeds
from walk_optimizer.walk.phase_clock import Motion
from walk_optimizer.walk.stand import StandProfile

# Before the library is up, it is tried again after this time in [s].
_RETRY_PERIOD = 1.0
_TO_STAND = "to stand"
_STOPS = "comes to a stand after the running step"
_ONCE_RESUMED = {
    Motion.RUNNING: "",
    Motion.PAUSED: ", once ~/resume is called",
    Motion.EMERGENCY_STOP: ", once ~/resume is called twice",
}
_ONCE_STREAMED = ", once `streaming` is true"


class EmergencyStopError(WalkOptimizerError):
    """The emergency stop is still in force."""


class WalkCommands:
    """Gives a stream its goals, one at a time: of several commands the last one counts.

    Owns which command counts, and what a gait must meet to be walked. Does not own where commands come
    from, nor the stream. Everything here runs in the node's executor.

    Attributes:
        limits: What the joints can do.
        refusal: Why the last command was refused, of those that come as topics or parameters and so have no
            answer; empty once one is carried out.
    """

    def __init__(
        self,
        node: ManagedNode,
        stream: JointStream,
        planner: TransitionPlanner,
        library: RemoteService,
        walker: WalkerParameters,
    ) -> None:
        """Begin without a command.

        Args:
            node: That asks the library.
            stream: That walks.
            planner: Of the steps between paces.
            library: Its service.
            walker: That walks.
        """
        self._node, self._stream, self._planner, self._library = node, stream, planner, library
        self._walker = walker
        settings = transition_settings()
        self._standing = standing_pose(walker, settings.feet_distance, settings.knee_bend)
        self.limits = JointLimits()
        self.refusal = ""
        self._order: WalkOrder | None = None

    def begin(self) -> StandProfile:
        """Return what the stream begins with.

        Raises:
            JointLimitError: the joints can't even stand.
        """
        stand = StandProfile(self._standing)
        standing = self._needed(_TO_STAND, peaks_of([stand]))
        self._needs = WalkNeeds(stand, PaceNeeds((standing,)))
        self.refusal = ""
        return stand

    @property
    def under_way(self) -> str:
        """What is being fetched or solved for, and since when; empty for nothing."""
        return "" if self._order is None else str(self._order)

    def require_met(self, limits: JointLimits) -> None:
        """Refuse to lower limits below what is walked now, what is about to be, or its stop needs.

        Raises:
            JointLimitError: says what for, names the joint and both numbers.
        """
        self._needs.require(limits.lowered_from(self.limits), self._stream.walk)

    async def walk_at(self, request: GaitRequest, wait_for_library: bool = False) -> str:
        """Have a gait walked, and return a sentence about it.

        Nothing is begun that could not be stopped within the limits: the steps to a stand are planned before.

        Args:
            request: The gait.
            wait_for_library: Whether a library that is not there yet is waited for.

        Raises:
            WalkOptimizerError: there is no such gait or no way to it, the joints can't do it, or a later
                command came first.
        """
        self._require_no_emergency()
        self.supersede()
        self._order = order = WalkOrder(request)
        try:
            return await self._carry_out(request, order, wait_for_library)
        except WalkOptimizerError:
            order.require_valid()  # If it does not count any more, nothing else matters.
            raise
        finally:
            order.end("it has been carried out")

    async def _carry_out(self, request: GaitRequest, order: WalkOrder, wait_for_library: bool) -> str:
        gait, source = await self._fetch(request, order, wait_for_library)
        order.require_valid()
        keeping = self._needed(f"to walk at {gait.speed:.4f} m/s", peaks_of_gait(gait.gait))
        stand = self._stand_after(gait)
        stop = await self._planner.plan(gait, stand, self.limits.hip_and_knee_torque)
        stopping = self._needed(f"to stop from {gait.speed:.4f} m/s", stop.peaks | peaks_of([stand]))
        await self._lead_to(StreamedGait.of(gait, stop), order, (keeping, stopping))
        self.refusal = ""
        return f"{gait} from the next step on{self._once_resumed}; {source}"

    def stop(self) -> str:
        """Have the walk come to a stand, and return a sentence about it; it waits for nothing."""
        self.supersede()
        self.refusal = ""
        while not self._turns_to_stand():
            pass  # The stream has gone on to another pace meanwhile.
        walk = self._stream.walk
        stands = isinstance(walk.pace, StandProfile) and not walk.is_changing
        return "stands already" if stands else f"{_STOPS}{self._once_resumed}"

    def supersede(self) -> None:
        """End what is under way: another command counts from now on."""
        self._end_order("superseded by a newer command")

    def give_up(self) -> None:
        """Let nothing begin any more that was asked for before an emergency stop, except a stop.

        Also a gait that only waits for the end of the step is dropped: nobody who releases an emergency stop
        expects it any more.
        """
        self._end_order("given up because of the emergency stop; release it by ~/resume, then ask again")
        walk = self._stream.walk
        if not isinstance(walk.goal, StandProfile):
            walk.stay(walk.pace)

    def _require_no_emergency(self) -> None:
        if self._stream.walk.clock.motion is Motion.EMERGENCY_STOP:
            raise EmergencyStopError("emergency stop; call ~/resume to release it, then ask again")

    def _end_order(self, reason: str) -> None:
        if self._order is not None:
            self._order.end(reason)
        self._planner.give_up()

    async def _fetch(
        self, request: GaitRequest, order: WalkOrder, wait_for_library: bool
    ) -> tuple[ReceivedGait, str]:
        """Return a gait of the library, and the sentence that it came with.

        Args:
            request: The gait.
            order: Command that it is for.
            wait_for_library: Whether a library that is not there yet is waited for.

        Raises:
            WalkOptimizerError: the library refused, or is not there, or the command does not count any more.
        """
        wanted = GetGait.Request(
            speed=request.speed,
            spring_mode=request.spring_mode.value,
            selection=self._node.parameters["selection"],
        )
        while True:
            try:
                timeout = self._node.parameters["library_timeout"]
                answer = await self._node.call(self._library, wanted, timeout, order.require_valid)
                break
            except ServiceUnavailableError:
                if not wait_for_library:
                    raise
            order.require_valid()
            self._node.get_logger().warning("waiting for the library", throttle_duration_sec=10.0)
            await self._node.sleep(_RETRY_PERIOD)
        if not answer.success:
            raise GaitNotFoundError(answer.message)
        return ReceivedGait.from_message(answer.gait, self._walker), answer.message

    def _turns_to_stand(self) -> bool:
        """Have the present pace be followed by a stand, and return whether it still is the present one."""
        walk, pace = self._stream.walk, self._stream.pace
        if not isinstance(pace, StreamedGait):
            return walk.stay(profile_of_goal(pace))
        stop = pace.stop
        if not self._stream.follow(stop.plan, stop.leads_to):
            return False
        stand = profile_of_goal(stop.leads_to)
        standing = JointNeed(_TO_STAND, peaks_of([stand]))
        self._needs.add(walk, stand, PaceNeeds((standing,), JointNeed("to stop", stop.peaks)))
        return True

    async def _lead_to(self, goal: StreamedGait, order: WalkOrder, staying: tuple[JointNeed, ...]) -> None:
        """Have the stream walk to a gait, which needs something itself, from the pace that it then has."""
        while True:
            order.require_valid()
            pace = self._stream.pace
            if isinstance(pace, StreamedGait) and pace.message == goal.message:
                # The same gait again: another copy would only cost a transition to itself.
                if self._stream.walk.stay(pace.profile):
                    return
                continue
            way = await self._planner.plan(pace, goal, self.limits.hip_and_knee_torque)
            order.require_valid()
            for need in staying:  # Limits may have been lowered meanwhile.
                self.limits.require(need)
            leading = self._needed(f"to get to {goal.speed:.4f} m/s", way.peaks)
            if self._stream.follow(way.plan, goal):
                self._needs.add(self._stream.walk, goal.profile, PaceNeeds(staying, leading))
                return

    def _needed(self, purpose: str, peaks: JointPeaks) -> JointNeed:
        """Return what something needs of the joints.

        Raises:
            JointLimitError: the joints can't do it.
        """
        need = JointNeed(purpose, peaks)
        self.limits.require(need)
        return need

    def _stand_after(self, gait: ReceivedGait) -> StandProfile:
        """Return the stand that a gait is stopped in: its knee springs stay as they are."""
        return StandProfile(self._standing.on(gait.spring))

    @property
    def _once_resumed(self) -> str:
        """What has to happen before anything moves; empty for nothing."""
        clock = self._stream.walk.clock
        return _ONCE_RESUMED[clock.motion] + (_ONCE_STREAMED if clock.suspended else "")
