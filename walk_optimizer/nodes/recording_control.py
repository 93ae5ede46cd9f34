"""Recording as operators start and stop it: two services, and the parameter `record`."""

import contextlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

from rclpy.parameter import Parameter
from walk_optimizer_interfaces.srv import StartRecording, StopRecording

from walk_optimizer.nodes.bag import ReceivedTopic, StreamBag, named_folder, new_bag_folder
from walk_optimizer.nodes.foreign_topics import ForeignTopics
from walk_optimizer.nodes.joint_stream import JointStream
from walk_optimizer.nodes.lifecycle import ManagedNode, NotActiveError
from walk_optimizer.nodes.publisher_settings import recorder_settings
from walk_optimizer.recording.errors import AlreadyRecordingError, NotRecordingError, RecordingError
from walk_optimizer.recording.status import RecorderStatus

# What a post-mortem looks at first: which speeds came.
_COMMANDS = ("~/target_speed", "~/cmd_vel")
_Result = TypeVar("_Result")


class _NodeLog:
    """Tells by a node's log what goes wrong with a recording; from the recorder's thread."""

    def __init__(self, node: ManagedNode, ended: Callable[[], None]) -> None:
        """Tell nothing yet.

        Args:
            node: Whose log it is.
            ended: Called by its executor when a recording has ended by itself.
        """
        self._node, self._ended = node, ended

    def warning(self, message: str) -> None:
        self._node.get_logger().warning(message)

    def error(self, message: str) -> None:
        self._node.get_logger().error(f"{message}; then set `record` again")
        self._node.later(self._ended)


class RecordingControl:
    """Starts and stops bags, one after the other. Does not own what is in them (`bag`).

    Owns the thread that waits for the disk meanwhile: the executor never does, for it also has to carry out
    an emergency stop. The parameter tells what is: it goes back to false when a bag can't be begun or ends by
    itself. A deactivation closes the bag; only one that the parameter has asked for is followed by another as
    soon as the node is active again.
    """

    def __init__(self, node: ManagedNode, bag: StreamBag, stream: JointStream) -> None:
        """Offer the services.

        Args:
            node: That offers them; it listens to its commands already.
            bag: That records.
            stream: That is recorded.
        """
        self._node, self._bag, self._stream = node, bag, stream
        self._foreign: ForeignTopics | None = None
        self._showing = False
        # Whether the parameter is true for a bag of the service, and nobody has set it.
        self._only_shown = False
        self._thread = ThreadPoolExecutor(1, "bags")
        self._log = _NodeLog(node, self._show)
        commands = {str(node.resolve_topic_name(name)) for name in _COMMANDS}
        for subscription in node.subscriptions:
            if subscription.topic_name in commands:
                ReceivedTopic(node, subscription, bag)
        node.serve(StartRecording, "~/start_recording", self._start)
        node.serve(StopRecording, "~/stop_recording", self._stop)

    def follow_parameter(self, wanted: bool) -> None:
        """Record, or don't, as the parameter `record` says; it is begun, and nothing is waited for."""
        if not self._showing:
            self._only_shown = False
            self._node.later(self._follow, wanted)

    def close(self) -> None:
        """Close the bag, if there is one, and wait for that: the node ends, or is deactivated."""
        # Behind what is still being done: a bag that is just being begun is closed too.
        with contextlib.suppress(NotRecordingError):
            self._tell_closed(self._thread.submit(self._bag.stop).result())
        self._listen_to_others()
        # Otherwise an activation would take it for a wish.
        if self._only_shown:
            self._show()

    def end(self) -> None:
        """Close the bag and end the thread."""
        self.close()
        self._thread.shutdown()

    async def _start(self, request: StartRecording.Request, response: StartRecording.Response) -> None:
        directory = await self._record(request.directory)
        response.directory = str(directory)
        response.message = f"recording to {directory}"

    async def _stop(self, _request: StopRecording.Request, response: StopRecording.Response) -> None:
        status, absent = await self._end()
        response.directory, response.messages = str(status.directory), status.messages
        if status.error is not None:
            raise status.error
        response.message = f"{status.messages} messages, {status.dropped} dropped{absent}"

    async def _follow(self, wanted: bool) -> None:
        if not self._node.active:
            return  # The parameter counts from the next activation on.
        try:
            await (self._record() if wanted else self._end())
        except (AlreadyRecordingError, NotRecordingError, NotActiveError):
            return  # It is as the parameter says, or will be with the next activation.
        except RecordingError as error:
            self._node.get_logger().error(f"not recording: {error}")
            self._bag.error = error
            self._show()

    async def _record(self, name: str = "") -> Path:
        """Begin a bag, of this name if there is one, and return its directory."""
        folder, settings = self._node.parameters["recording_folder"], recorder_settings(self._node.parameters)

        def begin() -> Path:
            directory = named_folder(name) if name else new_bag_folder(folder)
            return self._bag.start(directory, settings, self._log).directory

        directory = await self._done(begin)
        self._listen_to_others()
        self._show()
        self._stream.announce_again()
        self._node.get_logger().info(f"recording to {directory}")
        return directory

    async def _end(self) -> tuple[RecorderStatus, str]:
        """Close the bag and return what is in it, and in words what is not."""
        status = await self._done(self._bag.stop)
        absent = self._absent()
        self._tell_closed(status)
        self._listen_to_others()
        self._show()
        return status, absent

    async def _done(self, work: Callable[[], _Result]) -> _Result:
        """Have the thread do something, and return its result."""
        future = self._thread.submit(work)
        await self._node.finished(future)
        return future.result()

    def _listen_to_others(self) -> None:
        """Listen to the topics of other nodes for the bag that there is now, and for no other."""
        recorder = self._bag.recorder
        if self._foreign is not None and self._foreign.recorder is not recorder:
            self._foreign.close()
            self._foreign = None
        if recorder is not None and self._foreign is None:
            named = self._node.parameters["recording_topics"]
            names = {str(self._node.resolve_topic_name(name)) for name in named} - self._bag.names
            self._foreign = ForeignTopics(self._node, names, recorder)

    def _absent(self) -> str:
        """Return which topics the bag should hold and nobody has published, as the end of a sentence."""
        names = self._foreign.missing if self._foreign is not None else ()
        return f"; nobody published {', '.join(sorted(names))}" if names else ""

    def _tell_closed(self, status: RecorderStatus) -> None:
        text = f"closed {status.directory} with {status.messages} messages{self._absent()}"
        self._node.get_logger().info(text)

    def _show(self) -> None:
        """Make the parameter `record` say what is."""
        running = self._bag.recording
        if self._node.parameters["record"] == running:
            return
        self._only_shown, self._showing = running, True
        try:
            self._node.set_parameters([Parameter("record", value=running)])
        finally:
            self._showing = False
