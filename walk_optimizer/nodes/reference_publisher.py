"""Node `reference_publisher`: streams the references of a gait, and records them."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rclpy.parameter import Parameter
from std_msgs.msg import Float64
from walk_optimizer_interfaces.srv import GetGait, GetJointTrajectory, SetGait, StartRecording, StopRecording

from walk_optimizer.errors import GaitNotFoundError, WalkOptimizerError
from walk_optimizer.nodes.bag import StreamBag, new_bag_folder
from walk_optimizer.nodes.cycle_message import cycle_to_message
from walk_optimizer.nodes.joint_stream import JointStream, StreamedGait
from walk_optimizer.nodes.publisher_settings import SETTINGS, recorder_settings
from walk_optimizer.nodes.qos import COMMAND
from walk_optimizer.nodes.running import run_node
from walk_optimizer.nodes.suite_node import ServiceUnavailableError, SuiteNode
from walk_optimizer.references import sample_cycle
from walk_optimizer.request import GaitRequest

# Before the library is up, a walk from the start is tried again after this time in [s].
_RETRY_PERIOD = 1.0
# The executor may hold Python's lock for that long in [s]; the usual 5 ms are several ticks.
_SWITCH_INTERVAL = 0.0005


class ReferencePublisherNode(SuiteNode):
    """Takes speeds, gets gaits from the library, and streams them.

    Owns which gait is walked and when a bag is recorded. Does not own the stream (`joint_stream`).
    """

    def __init__(self) -> None:
        """Offer the topics and services, and wait for a command."""
        super().__init__("reference_publisher", SETTINGS)
        self._bag = StreamBag()
        self._stream = JointStream(self, self._bag, self.parameters["rate"], self.parameters["longest_gap"])
        self._library = self.connect(GetGait, self.parameters["library_service"])
        self._target: GaitRequest | None = None
        self._following = False
        self.create_subscription(
            Float64, "~/target_speed", self._on_target_speed, COMMAND, callback_group=self.group
        )
        self.serve(SetGait, "~/set_gait", self._set_gait)
        self.serve(GetJointTrajectory, "~/joint_trajectory", self._joint_trajectory)
        self.serve(StartRecording, "~/start_recording", self._start_recording)
        self.serve(StopRecording, "~/stop_recording", self._stop_recording)
        self.parameters.apply_changes(self._apply)
        self._apply({"streaming", "torque_order", "frame_id"})
        self.get_logger().info("ready")

    def begin(self) -> None:
        """Do what the parameters ask for from the start; called when an executor is there."""
        if self.parameters["record"]:
            self._apply({"record"})
        if self.parameters["initial_speed"] != 0:
            self.later(self._walk_from_the_start)

    def close(self) -> None:
        """Stop the stream and close the bag."""
        self._stream.close()
        if self._bag.recorder is not None:
            status = self._bag.stop()
            self.get_logger().info(f"closed {status.directory} with {status.messages} messages")

    async def _fetch(self, request: GaitRequest) -> StreamedGait:
        """Return a gait of the library.

        Raises:
            WalkOptimizerError: the library refused, or is not there.
        """
        wanted = GetGait.Request(speed=request.speed, spring_mode=request.spring_mode.value)
        answer = await self.call(self._library, wanted, self.parameters["library_timeout"])
        if not answer.success:
            raise GaitNotFoundError(answer.message)
        return StreamedGait.from_message(answer.gait)

    async def _set_gait(self, request: SetGait.Request, response: SetGait.Response) -> None:
        wanted = GaitRequest.for_speed(request.speed, request.spring_mode)
        self._target = None  # A speed that is still being fetched is older than this command.
        gait = await self._fetch(wanted)
        response.message = self._walk(gait)

    def _walk(self, gait: StreamedGait) -> str:
        """Stream a gait, and return what is streamed."""
        self._stream.walk(gait)
        text = f"{gait} from the next step on"
        self.get_logger().info(text, throttle_duration_sec=1.0)
        return text

    def _on_target_speed(self, message: Float64) -> None:
        try:
            self._target = GaitRequest.for_speed(message.data, self.parameters["spring_mode"])
        except WalkOptimizerError as error:
            self.get_logger().warning(f"target speed refused: {error}", throttle_duration_sec=1.0)
            return
        if not self._following:
            self._following = True
            self.later(self._follow)

    async def _follow(self) -> None:
        """Walk at the target speed; of speeds that come meanwhile the last one counts."""
        try:
            while (target := self._target) is not None:
                gait = await self._fetch(target)
                if target == self._target:
                    self._target = None
                    self._walk(gait)
        except WalkOptimizerError as error:
            self._target = None
            self.get_logger().warning(f"target speed refused: {error}")
        finally:
            self._following = False

    async def _walk_from_the_start(self) -> None:
        request = GaitRequest.for_speed(self.parameters["initial_speed"], self.parameters["spring_mode"])
        while self._stream.gait is None and await self._library_was_away(request):
            self.get_logger().warning("waiting for the library", throttle_duration_sec=10.0)
            await self.sleep(_RETRY_PERIOD)

    async def _library_was_away(self, request: GaitRequest) -> bool:
        """Walk as requested; return whether it is worth to try again."""
        try:
            self._walk(await self._fetch(request))
        except ServiceUnavailableError:
            return True
        except WalkOptimizerError as error:
            self.get_logger().error(f"initial_speed refused: {error}")
        return False

    async def _joint_trajectory(
        self, request: GetJointTrajectory.Request, response: GetJointTrajectory.Response
    ) -> None:
        gait = self._stream.gait
        if gait is None:
            raise GaitNotFoundError("no gait is streamed yet; call set_gait first")
        rate = request.rate if request.rate != 0 else self.parameters["rate"]
        response.trajectory = cycle_to_message(sample_cycle(gait.profile, rate))

    async def _start_recording(
        self, request: StartRecording.Request, response: StartRecording.Response
    ) -> None:
        directory = self._record(Path(request.directory) if request.directory else None)
        self._show_recording(True)
        response.directory = str(directory)
        response.message = f"recording to {directory}"

    async def _stop_recording(
        self, _request: StopRecording.Request, response: StopRecording.Response
    ) -> None:
        status = self._bag.stop()
        self._show_recording(False)
        response.directory, response.messages = str(status.directory), status.messages
        if status.error is not None:
            raise status.error
        response.message = f"{status.messages} messages, {status.dropped} dropped"

    def _record(self, directory: Path | None = None) -> Path:
        """Begin a bag and return its directory."""
        directory = directory or new_bag_folder(self.parameters["recording_folder"])
        self._bag.start(directory, recorder_settings(self.parameters))
        self._stream.announce_again()
        self.get_logger().info(f"recording to {directory}")
        return directory

    def _show_recording(self, running: bool) -> None:
        """Make the parameter `record` say what a service did."""
        if self.parameters["record"] != running:
            self.set_parameters([Parameter("record", value=running)])

    def _apply(self, names: set[str]) -> None:
        """Put parameters into effect that were set."""
        actions: dict[str, Callable[[Any], None]] = {
            "rate": self._stream.set_rate,
            "longest_gap": self._stream.set_longest_gap,
            "torque_order": self._stream.set_torque_order,
            "frame_id": self._stream.set_frame,
            "streaming": self._stream.set_running,
            "record": self._follow_record,
        }
        for name in names & actions.keys():
            actions[name](self.parameters[name])

    def _follow_record(self, wanted: bool) -> None:
        recording = self._bag.recorder is not None
        try:
            if wanted and not recording:
                self._record()
            elif recording and not wanted:
                self.get_logger().info(f"closed {self._bag.stop().directory}")
        except WalkOptimizerError as error:
            self.get_logger().error(f"record: {error}")


def main() -> int:
    """Run the node."""
    sys.setswitchinterval(_SWITCH_INTERVAL)
    return run_node(ReferencePublisherNode)


if __name__ == "__main__":
    sys.exit(main())
