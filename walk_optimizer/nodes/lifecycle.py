"""Managed nodes: the ROS 2 life cycle around a suite node, with a manager or without one.

A node inherits from `ManagedNode` and fills in up to four steps; each may raise a WalkOptimizerError,
which fails the transition with that sentence:

- `configure`: read parameters, load, create topics and services with `create_*`, `serve`, `connect`.
- `activate`: begin to work.
- `deactivate`: the opposite of `activate`.
- `cleanup`: the opposite of `configure`, for what is no ROS entity: entities that `configure` created
  are destroyed by the base class, so that the node can be configured again.

What belongs in the constructor is what an unconfigured node has: its parameters and checks. Services
exist from `configure` on and refuse politely until the node is active. Waits (`call`, `sleep`,
`finished`) that are under way when it is deactivated raise NotActiveError, so that whoever waits for an
answer gets it. Topics and timers that must be quiet while inactive are the node's own business:
`self.active` tells.

`ros2 lifecycle set NODE configure` and so on work as for any managed node. With the parameter
`autostart` (the default) the node configures and activates itself, needs no manager and no bond, and
ends with exit code 1 where that fails. A signal shuts it down in order from any state.
"""

import traceback
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.lifecycle.node import LifecycleNodeMixin

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.nodes.diagnostics import Finding, Level
from walk_optimizer.nodes.parameters import Setting
from walk_optimizer.nodes.suite_node import SuiteNode

AUTOSTART = Setting(
    "autostart",
    True,
    "Whether the node configures and activates itself; false: a manager or `ros2 lifecycle set` does.",
    read_only=True,
)

_ACTIVE, _FINALIZED = "active", "finalized"
_ENTITIES = ("publisher", "subscription", "service", "client", "timer")


class TransitionError(WalkOptimizerError):
    """A transition of the life cycle failed; the message says why."""


class NotActiveError(WalkOptimizerError):
    """The node is not active, and works for nobody."""


class ManagedNode(LifecycleNodeMixin, SuiteNode):
    """A suite node with a life cycle (see the module)."""

    def __init__(self, name: str, settings: Sequence[Setting]) -> None:
        """Create the node, unconfigured, and declare its parameters and `autostart`."""
        SuiteNode.__init__(self, name, [*settings, AUTOSTART])
        LifecycleNodeMixin.__init__(self, callback_group=self.group)
        self._trouble = ""
        self._configured: list[tuple[str, Any]] = []
        self._transit = self._service_change_state.callback
        self._service_change_state.callback = self._on_change_state
        self.diagnostics.add("lifecycle", self._lifecycle_finding)

    def configure(self) -> None:
        """Load, and create topics and services; after an error the node can be configured again."""

    def activate(self) -> None:
        """Begin to work."""

    def deactivate(self) -> None:
        """Stop working."""

    def cleanup(self) -> None:
        """Give back what `configure` took and what is no ROS entity; also called after it failed."""

    @property
    def state(self) -> str:
        """Where the node is in its life cycle: unconfigured, inactive, active, finalized."""
        return str(self._state_machine.current_state[1])

    @property
    def active(self) -> bool:
        """Whether the node is to work."""
        return self.state == _ACTIVE

    def begin(self) -> None:
        """Configure and activate the node if it is to do so by itself.

        Raises:
            TransitionError: that failed; the message says why.
        """
        if self.parameters["autostart"]:
            for transition in (self.trigger_configure, self.trigger_activate):
                if transition() != TransitionCallbackReturn.SUCCESS:
                    raise TransitionError(self._trouble)

    def close(self) -> None:
        """Shut the node down in order, whatever it is doing."""
        if self.state != _FINALIZED:
            self.trigger_shutdown()

    def require_active(self) -> None:
        """Refuse services and calls while the node is not active.

        Raises:
            NotActiveError: says how to activate it.
        """
        if not self.active:
            raise NotActiveError(f"{self.get_fully_qualified_name()} is {self.state}; {self._advice()}")

    def on_configure(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Configure, or leave no trace."""
        before = self._entities()
        result = self._perform("configure", self.configure)
        self._configured = [entity for entity in self._entities() if entity not in before]
        if result == TransitionCallbackReturn.FAILURE:
            self.cleanup()
            self._destroy_configured()
        return result

    def on_activate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Activate."""
        return self._perform("activate", self.activate)

    def on_deactivate(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Deactivate, and answer all who wait."""
        self._end_work("was deactivated; activate it and ask again")
        return self._perform("deactivate", self.deactivate)

    def on_cleanup(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Clean up."""
        result = self._perform("clean up", self.cleanup)
        if result == TransitionCallbackReturn.SUCCESS:
            self._destroy_configured()
        return result

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop and clean up; topics and services stay, so that those who wait get an answer."""
        self._end_work("is shutting down; ask again when it runs")
        if state.label == _ACTIVE:
            self._perform("deactivate", self.deactivate)
        return self._perform("clean up", self.cleanup)

    def on_error(self, _state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to unconfigured after an error that nobody expected; if that fails too, to the end."""
        self._end_work("has failed; configure it again, and ask again")
        result = self._perform("clean up", self.cleanup)
        self._destroy_configured()
        return result

    def _perform(self, what: str, step: Callable[[], None]) -> TransitionCallbackReturn:
        """Take a step, and return how it ended, as rclpy wants it."""
        try:
            step()
        except WalkOptimizerError as error:
            self._trouble = f"{error}"
            self.get_logger().error(f"can't {what}: {error}")
            return TransitionCallbackReturn.FAILURE
        except Exception as error:  # noqa: BLE001  # rclpy would drop it without a word
            self._trouble = f"internal error: {error!r}"
            self.get_logger().error(f"can't {what}: {traceback.format_exc()}")
            return TransitionCallbackReturn.ERROR
        self._trouble = ""
        return TransitionCallbackReturn.SUCCESS

    def _on_change_state(self, request: Any, response: Any) -> Any:
        """Answer also a transition that the present state does not have; rclpy would not answer at all."""
        try:
            return self._transit(request, response)
        except Exception as error:  # noqa: BLE001  # RCLError, which rclpy does not export
            self.get_logger().debug(f"no such transition while {self.state}: {error}")
            response.success = False
            return response

    def _end_work(self, reason: str) -> None:
        self.end_waits(NotActiveError(f"{self.get_fully_qualified_name()} {reason}"))

    def _entities(self) -> list[tuple[str, Any]]:
        """Return the node's topics, services, clients and timers with their kinds."""
        return [(kind, entity) for kind in _ENTITIES for entity in getattr(self, f"{kind}s")]

    def _destroy_configured(self) -> None:
        for kind, entity in self._configured:
            getattr(self, f"destroy_{kind}")(entity)
        self._configured = []

    def _lifecycle_finding(self) -> Finding:
        values = {"state": self.state}
        if self._trouble:
            return Finding(Level.ERROR, f"{self.state}, the last transition failed: {self._trouble}", values)
        if not self.active:
            return Finding(Level.WARN, f"{self.state}; {self._advice()}", values)
        return Finding(Level.OK, self.state, values)

    def _advice(self) -> str:
        """Return what gets a node that is not active further."""
        transition = {"unconfigured": "configure", "inactive": "activate"}.get(self.state)
        if transition is None:
            return "start it again"
        return f"to get on: ros2 lifecycle set {self.get_fully_qualified_name()} {transition}"
