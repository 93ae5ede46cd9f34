"""Speeds that come as topics: `~/target_speed`, sent once, and `~/cmd_vel`, a stream that must go on."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import Twist
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_msgs.msg import Float64

from walk_optimizer.errors import InvalidRequestError, WalkOptimizerError
from walk_optimizer.nodes.lifecycle import ManagedNode
from walk_optimizer.nodes.planar_twist import IgnoredParts, forward_speed
from walk_optimizer.nodes.qos import COMMAND
from walk_optimizer.nodes.qos_warnings import warn_of_publishers
from walk_optimizer.nodes.walk_commands import WalkCommands
from walk_optimizer.nodes.walk_order import SupersededError
from walk_optimizer.request import GaitRequest
from walk_optimizer.walk.command_watch import CommandWatch

# How often it is looked whether a stream of commands has fallen silent, in [s].
_WATCH_PERIOD = 0.05
# A stream's speed that was refused is not asked for again within this time, however often it comes, in [s].
_REFUSAL_HOLDS = 1.0
# Commands of which all but the last are superseded, and about to end.
_MOST_UNDER_WAY = 3


@dataclass(frozen=True)
class _Target:
    """What a speed asks for.

    Attributes:
        request: Gait to walk; None for a stand.
    """

    request: GaitRequest | None


_STAND = _Target(None)


class SpeedCommands:
    """Follows speeds as they come: of those that come while a gait is fetched, the last one counts.

    A set-point supersedes what is under way at once. A stream does so when it holds a speed, that is sends it
    twice in a row: of one that changes all the time, one speed after the other is followed to its end.

    A speed that is refused changes nothing, and keeps a stream alive only as long as it is worked on. Speed
    0 is a stop.
    """

    def __init__(self, node: ManagedNode, commands: WalkCommands) -> None:
        """Subscribe.

        Args:
            node: That subscribes.
            commands: That carry out what is asked for.
        """
        self._node, self._commands = node, commands
        self.watch = CommandWatch(node.parameters["command_timeout"])
        self._waiting: _Target | None = None
        self._current: _Target | None = None
        self._refused: tuple[_Target, float] | None = None
        self._last_of_stream: _Target | None = None
        self._under_way = 0
        self._ignored = IgnoredParts()
        self._timer: Timer | None = None
        self._subscribe(Float64, "~/target_speed", self._on_target_speed)
        self._stream = self._subscribe(Twist, "~/cmd_vel", self._on_twist)

    @property
    def silence(self) -> str:
        """What is wrong with a stream that has fallen silent, or is refused all the time; or empty."""
        if not self.watch.stale:
            return ""
        text = f"no speed on {self._stream.topic_name} for {self.watch.timeout:g} s"
        refusal = self._commands.refusal
        return f"{text} that can be followed: {refusal}" if refusal else f"{text}, send speeds again"

    def forget(self) -> None:
        """Drop what was asked for: another command has come than by these topics."""
        self._waiting = self._current = None
        self.watch.end()
        self._settle()

    def give_up(self) -> None:
        """Drop what was asked for, because of an emergency stop; a stream must go on none the less.

        If it does not, the walk that goes on after the emergency comes to a stand.
        """
        self._waiting = self._current = None
        self.watch.refused()

    @contextmanager
    def set_point(self) -> Iterator[None]:
        """Drop what was asked for while another command is carried out, which holds until the next one.

        If it is refused, a stream that came before has to go on.
        """
        self._waiting = self._current = None
        self.watch.suspend()
        try:
            yield
        except SupersededError:  # What becomes of the watch is up to the command that came since.
            raise
        except Exception:
            self._refuse()
            raise
        self._settle()

    def _on_target_speed(self, message: Float64) -> None:
        target = self._target(message.data) if self._node.active else None
        if target is not None:
            self.watch.suspend()
            self._take(target, supersedes=True)

    def _on_twist(self, message: Twist) -> None:
        target = self._twist_target(message) if self._node.active else None
        if target is None:
            return
        if not self._was_just_refused(target):
            self.watch.heard(self._now())
            # Only now: each time that the executor wakes costs the stream a tick at 1 kHz.
            if self._timer is None:
                self._timer = self._node.repeat(_WATCH_PERIOD, self._look)
            self._take(target, supersedes=target == self._last_of_stream)
        self._last_of_stream = target

    def _twist_target(self, message: Twist) -> _Target | None:
        """Return what a velocity asks for, and warn of what it asks for in vain; None where it is refused."""
        try:
            speed = forward_speed(message)
        except InvalidRequestError as error:
            self._tell_refusal(error)
            return None
        warning = self._ignored.warning(message, time.monotonic())
        if warning is not None:
            self._node.get_logger().warning(f"{self._stream.topic_name}: {warning}")
        return self._target(speed)

    def _target(self, speed: float) -> _Target | None:
        """Return what a speed in [m/s] asks for; None where it is refused."""
        if speed == 0:
            return _STAND
        try:
            return _Target(GaitRequest.for_speed(speed, self._node.parameters["spring_mode"]))
        except WalkOptimizerError as error:
            self._tell_refusal(error)
            return None

    def _take(self, target: _Target, supersedes: bool) -> None:
        """Follow a target, unless that is done already.

        Args:
            target: The last one that was asked for.
            supersedes: Whether what is under way ends at once, instead of being followed before.
        """
        if target == self._current:
            self._waiting, self._commands.refusal = None, ""
            if not self._commands.under_way:
                self._settle()
            return
        if target == _STAND:
            # A stop waits for nothing; what is being fetched then comes too late to count.
            self._waiting, self._current = None, target
            self._node.later(self._carry_out, target)
            return
        self._waiting = target
        if supersedes:
            self._commands.supersede()
        if self._under_way < (_MOST_UNDER_WAY if supersedes else 1):
            self._under_way += 1
            self._node.later(self._follow)

    async def _follow(self) -> None:
        """Carry out the targets that wait; of those that come meanwhile, the last one counts."""
        try:
            while (target := self._waiting) is not None:
                self._waiting, self._current = None, target
                await self._carry_out(target)
        finally:
            self._under_way -= 1

    async def _carry_out(self, target: _Target) -> None:
        try:
            request = target.request
            text = self._commands.stop() if request is None else await self._commands.walk_at(request)
        except SupersededError:
            return
        except Exception as error:
            if self._current is target:
                self._current = None
            if isinstance(error, WalkOptimizerError):
                self._tell_refusal(error)
                self._refused = target, time.monotonic()
            self._refuse()
            if not isinstance(error, WalkOptimizerError):
                raise
            return
        self._settle()
        self._node.get_logger().info(text, throttle_duration_sec=1.0)

    def _was_just_refused(self, target: _Target) -> bool:
        if self._refused is None:
            return False
        refused, when = self._refused
        return target == refused and time.monotonic() - when < _REFUSAL_HOLDS

    def _subscribe(self, kind: type, topic: str, callback: Callable[[Any], None]) -> Subscription:
        return self._node.create_subscription(
            kind,
            topic,
            callback,
            COMMAND,
            callback_group=self._node.group,
            event_callbacks=warn_of_publishers(self._node, topic, COMMAND),
        )

    def _tell_refusal(self, error: WalkOptimizerError) -> None:
        self._commands.refusal = str(error)
        self._node.get_logger().warning(f"target speed refused: {error}", throttle_duration_sec=1.0)

    def _settle(self) -> None:
        """Take note that what was asked for last is carried out."""
        self.watch.followed()
        self._look_no_more()

    def _refuse(self) -> None:
        """Take note that what was asked for last is refused: a stream before it may be stale by now."""
        self.watch.refused()
        self._look()
        self._look_no_more()

    def _look_no_more(self) -> None:
        """End the looking where there is no stream to look at."""
        if self._timer is not None and not self.watch.active:
            self._node.destroy_timer(self._timer)
            self._timer = None

    def _look(self) -> None:
        """Stop the walk when a stream of speeds has fallen silent."""
        self.watch.timeout = self._node.parameters["command_timeout"]
        if self.watch.fell_silent(self._now()):
            self._node.get_logger().warning(f"coming to a stand: {self.silence}")
            self._take(_STAND, supersedes=True)

    def _now(self) -> float:
        """Return the time of the node's clock in [s]."""
        return self._node.get_clock().now().nanoseconds * 1e-9
