"""Recording as operators start and stop it: two services, and the parameter `record`."""

from pathlib import Path

from rclpy.parameter import Parameter
from walk_optimizer_interfaces.srv import StartRecording, StopRecording

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.nodes.bag import StreamBag, new_bag_folder
from walk_optimizer.nodes.foreign_topics import ForeignTopics
from walk_optimizer.nodes.joint_stream import JointStream
from walk_optimizer.nodes.lifecycle import ManagedNode
from walk_optimizer.nodes.publisher_settings import recorder_settings
from walk_optimizer.recording.status import RecorderStatus


class RecordingControl:
    """Starts and stops bags. Does not own what is in them (`bag`)."""

    def __init__(self, node: ManagedNode, bag: StreamBag, stream: JointStream) -> None:
        """Offer the services.

        Args:
            node: That offers them.
            bag: That records.
            stream: That is recorded.
        """
        self._node, self._bag, self._stream = node, bag, stream
        self._foreign: ForeignTopics | None = None
        node.serve(StartRecording, "~/start_recording", self._start)
        node.serve(StopRecording, "~/stop_recording", self._stop)

    def follow_parameter(self, wanted: bool) -> None:
        """Record, or don't, as the parameter `record` says."""
        recording = self._bag.recorder is not None
        try:
            if wanted and not recording:
                self._record()
            elif recording and not wanted:
                self.close()
        except WalkOptimizerError as error:
            self._node.get_logger().error(f"record: {error}")

    def close(self) -> None:
        """Close the bag, if there is one."""
        if self._bag.recorder is not None:
            self._end()

    async def _start(self, request: StartRecording.Request, response: StartRecording.Response) -> None:
        directory = self._record(
            Path(request.directory).expanduser().absolute() if request.directory else None
        )
        self._show(True)
        response.directory = str(directory)
        response.message = f"recording to {directory}"

    async def _stop(self, _request: StopRecording.Request, response: StopRecording.Response) -> None:
        status = self._end()
        self._show(False)
        response.directory, response.messages = str(status.directory), status.messages
        if status.error is not None:
            raise status.error
        response.message = f"{status.messages} messages, {status.dropped} dropped"

    def _record(self, directory: Path | None = None) -> Path:
        """Begin a bag and return its directory."""
        parameters = self._node.parameters
        directory = directory or new_bag_folder(parameters["recording_folder"])
        recorder = self._bag.start(directory, recorder_settings(parameters))
        self._forget_foreign()  # Of a recording that has ended by itself.
        self._foreign = ForeignTopics(self._node, parameters["recording_topics"], recorder)
        self._stream.announce_again()
        self._node.get_logger().info(f"recording to {directory}")
        return directory

    def _end(self) -> RecorderStatus:
        """Close the bag and return what is in it."""
        self._forget_foreign()
        status = self._bag.stop()
        self._node.get_logger().info(f"closed {status.directory} with {status.messages} messages")
        return status

    def _forget_foreign(self) -> None:
        if self._foreign is not None:
            self._foreign.close()
        self._foreign = None

    def _show(self, running: bool) -> None:
        """Make the parameter `record` say what a service did."""
        if self._node.parameters["record"] != running:
            self._node.set_parameters([Parameter("record", value=running)])
