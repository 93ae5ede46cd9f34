"""Node `reference_publisher`: streams the references of a walk, and records them."""

import sys
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger
from walk_optimizer_interfaces.srv import GetGait, GetJointTrajectory, SetGait

from walk_optimizer.errors import ConfigurationError, GaitNotFoundError, WalkOptimizerError
from walk_optimizer.nodes.bag import StreamBag
from walk_optimizer.nodes.cycle_message import CycleMessages
from walk_optimizer.nodes.joint_stream import JointStream
from walk_optimizer.nodes.lifecycle import ManagedNode, NotActiveError
from walk_optimizer.nodes.publisher_checks import (
    RATE_SETTINGS,
    require_level_ground,
    require_no_late_start,
    require_steady,
)
from walk_optimizer.nodes.publisher_health import PublisherHealth
from walk_optimizer.nodes.publisher_settings import (
    FORMAT_SETTINGS,
    LIMIT_SETTINGS,
    SETTINGS,
    joint_limits,
    stream_format,
)
from walk_optimizer.nodes.recording_control import RecordingControl
from walk_optimizer.nodes.running import run_node
from walk_optimizer.nodes.speed_commands import SpeedCommands
from walk_optimizer.nodes.transition_planner import TransitionPlanner
from walk_optimizer.nodes.walk_commands import WalkCommands
from walk_optimizer.nodes.walk_order import SupersededError
from walk_optimizer.nodes.walker_setting import walker_of
from walk_optimizer.request import GaitRequest
from walk_optimizer.walk.joint_limits import JointLimitError
from walk_optimizer.walk.phase_clock import Motion, PhaseClock

# The executor may hold Python's lock for that long in [s], several times a tick; the usual is 5 ms.
_SWITCH_INTERVAL = 0.00003


class ReferencePublisherNode(ManagedNode):
    """Offers the services around a walk; from activation on the walk is streamed, a stand at first.

    Does not own the stream (`joint_stream`), which command counts (`walk_commands`), the speeds that come
    as topics (`speed_commands`), nor bags (`recording_control`).
    """

    def __init__(self) -> None:
        """Declare the parameters; `configure` does the rest."""
        super().__init__("reference_publisher", SETTINGS)
        self._undo = ExitStack()
        # Outlives a deactivation, for an emergency stop has to.
        self._phase_clock = PhaseClock()
        self.add_on_set_parameters_callback(self._check_together)
        self.parameters.apply_changes(self._apply)

    def configure(self) -> None:
        """Create topics and services.

        Raises:
            ConfigurationError: the walker's file can't be used, or its terrain is not level.
            GaitFileError: the cache folder can't be used.
        """
        walker = walker_of(self.parameters["walker_file"])
        require_level_ground(walker)
        self._bag = StreamBag()
        self._stream = JointStream(self, self._bag, self._phase_clock)
        library = self.connect(GetGait, self.parameters["library_service"])
        self._planner = TransitionPlanner(self)
        self._cycles = CycleMessages()
        self._commands = WalkCommands(self, self._stream, self._planner, library, walker)
        self._speeds = SpeedCommands(self, self._commands)
        self._recording = RecordingControl(self, self._bag, self._stream)
        health = PublisherHealth(
            self.diagnostics, self._stream, self._commands, self._speeds, library, self._bag
        )
        planner, cycles = self._planner, self._cycles
        for end in (planner.close, cycles.close, health.close, self._recording.end, self._stream.stop):
            self._undo.callback(end)
        self.serve(SetGait, "~/set_gait", self._set_gait)
        self.serve(GetJointTrajectory, "~/joint_trajectory", self._joint_trajectory)
        for name in ("stop", "pause", "resume", "emergency_stop"):
            self.serve(Trigger, f"~/{name}", getattr(self, f"_{name}"))

    def activate(self) -> None:
        """Stream a stand, and do what the parameters ask for from the start.

        Raises:
            ConfigurationError: parameters don't fit each other, or the walker.
        """
        require_steady(self.parameters)
        self._commands.limits = joint_limits(self.parameters)
        try:
            stand = self._commands.begin()
        except JointLimitError as error:
            raise ConfigurationError(f"{' or '.join(sorted(LIMIT_SETTINGS))} too low: {error}") from error
        self._put_into_effect({setting.name for setting in SETTINGS})
        self._stream.start(stand, self.parameters["rate"])
        if self.parameters["initial_speed"] != 0:
            self.later(self._walk_from_the_start)
        self.get_logger().info("ready")

    def deactivate(self) -> None:
        """Stop the stream and what is solved for it, and close the bag."""
        self._speeds.forget()
        self._planner.give_up()
        self._stream.stop()
        self._recording.close()

    def cleanup(self) -> None:
        """End what is no ROS entity, as far as `configure` came."""
        self._undo.close()

    async def _set_gait(self, request: SetGait.Request, response: SetGait.Response) -> None:
        wanted = GaitRequest.for_speed(request.speed, request.spring_mode)
        with self._speeds.set_point():
            response.message = await self._commands.walk_at(wanted)
        self.get_logger().info(response.message)

    async def _stop(self, _request: Trigger.Request, response: Trigger.Response) -> None:
        self._speeds.forget()
        response.message = self._commands.stop()
        self.get_logger().info(response.message)

    async def _pause(self, _request: Trigger.Request, response: Trigger.Response) -> None:
        if self._phase_clock.pause() is Motion.EMERGENCY_STOP:
            response.message = "emergency stop, holds its pose already; ~/resume releases it into a pause"
        else:
            response.message = "holds its pose; ~/resume lets it go on"

    async def _resume(self, _request: Trigger.Request, response: Trigger.Response) -> None:
        goes_on = self._phase_clock.resume() is Motion.RUNNING
        response.message = "goes on" if goes_on else "released, and paused; call ~/resume once more to go on"

    async def _emergency_stop(self, _request: Trigger.Request, response: Trigger.Response) -> None:
        self._phase_clock.stop_at_once()
        self._speeds.give_up()
        self._commands.give_up()
        response.message = "holds its pose without torques; ~/resume releases, and once more goes on"
        self.get_logger().warning("emergency stop")

    async def _walk_from_the_start(self) -> None:
        """Walk at `initial_speed` as soon as the library is there, unless another command comes first."""
        request = GaitRequest.for_speed(self.parameters["initial_speed"], self.parameters["spring_mode"])
        try:
            self.get_logger().info(await self._commands.walk_at(request, wait_for_library=True))
        except (SupersededError, NotActiveError):
            return
        except WalkOptimizerError as error:
            self._commands.refusal = f"initial_speed: {error}"
            self.get_logger().error(f"initial_speed refused: {error}")

    async def _joint_trajectory(
        self, request: GetJointTrajectory.Request, response: GetJointTrajectory.Response
    ) -> None:
        gait = self._stream.gait
        if gait is None:
            raise GaitNotFoundError("no gait is walked now; call ~/set_gait first")
        rate = request.rate if request.rate != 0 else self.parameters["rate"]
        cycle = self._cycles.make(
            gait.profile, rate, self.parameters["joint_names"], self.parameters["trajectory_effort"]
        )
        await self.finished(cycle)
        response.trajectory = cycle.result()
        response.message = f"{gait}, two steps of it in {len(response.trajectory.points)} points"

    def _check_together(self, changes: list[Parameter]) -> SetParametersResult:
        """Refuse values that don't fit others, or limits that what is walked now does not meet."""
        values = {change.name: change.value for change in changes}
        try:
            if values.keys() & RATE_SETTINGS:
                require_steady(self.parameters, values)
            if self.active:
                require_no_late_start(self.parameters, values)
                if values.keys() & LIMIT_SETTINGS:
                    self._commands.require_met(joint_limits(self.parameters, values))
        except WalkOptimizerError as error:
            return SetParametersResult(successful=False, reason=f"{', '.join(values)}: {error}")
        return SetParametersResult(successful=True)

    def _apply(self, names: set[str]) -> None:
        """Put parameters into effect that were set; activation does so with all of them."""
        if self.active:
            self._put_into_effect(names)

    def _put_into_effect(self, names: set[str]) -> None:
        if names & FORMAT_SETTINGS:
            self._stream.set_format(stream_format(self.parameters))
        if names & LIMIT_SETTINGS:
            self._commands.limits = joint_limits(self.parameters)
        actions: dict[str, Callable[[Any], None]] = {
            "rate": self._stream.set_rate,
            "streaming": self._stream.set_running,
            "longest_gap": partial(setattr, self._phase_clock, "longest_gap"),
            "pause_time": partial(setattr, self._phase_clock, "ramp"),
            "record": self._recording.follow_parameter,
        }
        for name in names & actions.keys():
            actions[name](self.parameters[name])


def main() -> int:
    """Run the node."""
    sys.setswitchinterval(_SWITCH_INTERVAL)
    return run_node(ReferencePublisherNode)


if __name__ == "__main__":
    sys.exit(main())
