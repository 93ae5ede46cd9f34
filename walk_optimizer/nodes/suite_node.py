"""What the nodes of the suite share: services that refuse politely, and waiting without blocking."""

import concurrent.futures
import traceback
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.task import Future
from rclpy.timer import Timer

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.nodes.diagnostics import Diagnostics
from walk_optimizer.nodes.diagnostics_publisher import PERIOD, DiagnosticsPublisher
from walk_optimizer.nodes.parameters import NodeParameters, Setting
from walk_optimizer.nodes.qos import SERVICE
from walk_optimizer.nodes.remote_service import RemoteService, announce_life

# How often a wait looks whether the other node still lives, in [s].
_WATCH_PERIOD = 0.1
# A service may not be known yet for that long, or not know us, in [s].
_DISCOVERY = 3.0

Answer = Callable[[Any, Any], Awaitable[None]]


class ServiceUnavailableError(WalkOptimizerError):
    """Another node does not offer its service, or did not answer."""


class SuiteNode(Node):
    """A node whose callbacks may await: nothing here ever blocks the executor.

    All callbacks share a re-entrant group, so that others run while one awaits. The executor has one
    thread: between two awaits a callback is alone.
    """

    def __init__(self, name: str, settings: Sequence[Setting]) -> None:
        """Create the node and declare its parameters."""
        super().__init__(name)
        self.group = ReentrantCallbackGroup()
        self.parameters = NodeParameters(self, settings)
        # Waiting goes by the wall, also in a simulation that stands still.
        self._wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._waits: set[Future] = set()
        self.diagnostics = Diagnostics()
        self.repeat(PERIOD, DiagnosticsPublisher(self, self.diagnostics).publish)

    def begin(self) -> None:
        """Start what needs an executor; called once, before it spins.

        Raises:
            WalkOptimizerError: the node can't start.
        """

    def announce(self) -> None:
        """Let others know that the node lives; called once its services are there."""
        announce_life(self)

    def close(self) -> None:
        """Give back what the node holds beside ROS entities; called before it is destroyed."""

    def require_active(self) -> None:
        """Refuse to serve and to ask while the node must not: managed nodes do so, others are always active.

        Raises:
            WalkOptimizerError: says what would do.
        """

    def serve(self, kind: type, name: str, answer: Answer) -> None:
        """Offer a service whose response has `success` and `message`.

        Args:
            kind: Service type.
            name: Of the service.
            answer: Fills the response; a WalkOptimizerError that it raises is a refusal.
        """

        async def callback(request: Any, response: Any) -> Any:
            response.success = False
            try:
                self.require_active()
                await answer(request, response)
                response.success = True
            except WalkOptimizerError as error:
                response.message = str(error)
                self.get_logger().debug(f"{name} refused: {error}")
            except Exception as error:  # noqa: BLE001  # the client gets an answer, and the node lives on
                response.message = f"internal error: {error!r}"
                self.get_logger().error(f"{name} failed: {traceback.format_exc()}")
            return response

        self.create_service(kind, name, callback, qos_profile=SERVICE, callback_group=self.group)

    def connect(self, kind: type, name: str) -> RemoteService:
        """Return a service of another node, for `call`."""
        return RemoteService(self, kind, name, self.group)

    def later(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Have a function or coroutine run by the executor; may be called from any thread."""
        executor = self.executor
        if executor is not None:
            executor.create_task(function, *arguments)

    def end_waits(self, error: WalkOptimizerError) -> None:
        """Have all waits that are under way raise an error."""
        for future in tuple(self._waits):
            future.set_exception(error)

    async def finished(self, work: "concurrent.futures.Future[Any]") -> None:
        """Wait until work of another thread or process is done."""
        done = Future()
        work.add_done_callback(lambda _: self.later(done.set_result, None))
        await self._wait(done)

    async def sleep(self, seconds: float) -> None:
        """Wait for some time in [s] of the wall clock."""
        done = Future()
        timer = self.repeat(seconds, lambda: done.set_result(None))
        try:
            await self._wait(done)
        finally:
            self.destroy_timer(timer)

    def repeat(self, seconds: float, function: Callable[[], None]) -> Timer:
        """Have a function called after every so many [s] of the wall clock, until the timer is destroyed."""
        return self.create_timer(seconds, function, self.group, self._wall)

    async def call(
        self,
        service: RemoteService,
        request: Any,
        timeout: float,
        require_wanted: Callable[[], None] = lambda: None,
    ) -> Any:
        """Return the response of another node.

        Args:
            service: Of the other node.
            request: To send.
            timeout: Longest wait for the response in [s].
            require_wanted: Asked all the time; a WalkOptimizerError that it raises ends the wait.

        Raises:
            ServiceUnavailableError: nobody offers the service, or it went away, or gave no answer.
        """
        self.require_active()
        if not await self._offered(service, require_wanted):
            raise ServiceUnavailableError(f"service {service.name} is not there; is its node running?")
        future = service.client.call_async(request)
        begin, losses = self._wall.now(), service.losses

        def watch() -> None:
            try:
                require_wanted()
            except WalkOptimizerError as error:
                future.set_exception(error)
                return
            if not service.available or service.losses != losses:
                future.set_exception(_unavailable(service, "went away"))
            elif (self._wall.now() - begin).nanoseconds * 1e-9 > timeout:
                future.set_exception(_unavailable(service, f"gave no answer within {timeout:g} s"))

        timer = self.repeat(_WATCH_PERIOD, watch)
        try:
            return await self._wait(future)
        finally:
            self.destroy_timer(timer)

    async def _wait(self, future: Future) -> Any:
        """Return the result of a future; `end_waits` ends that too."""
        self._waits.add(future)
        try:
            return await future
        finally:
            self._waits.discard(future)

    async def _offered(self, service: RemoteService, require_wanted: Callable[[], None]) -> bool:
        """Return whether a service is there, after giving discovery some time."""
        for _ in range(round(_DISCOVERY / _WATCH_PERIOD)):
            if service.will_answer:
                return True
            require_wanted()
            await self.sleep(_WATCH_PERIOD)
        if service.available:
            service.take_for_mute()
        return service.available


def _unavailable(service: RemoteService, what: str) -> ServiceUnavailableError:
    return ServiceUnavailableError(f"service {service.name} {what}; ask again")
