"""Start and stop a node: Ctrl-C and SIGTERM end it in order, with exit code 0."""

import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Callable

import rclpy
from rclpy.exceptions import InvalidParameterTypeException, ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import remove_ros_args

from walk_optimizer.errors import ConfigurationError, WalkOptimizerError
from walk_optimizer.nodes.suite_node import SuiteNode

# How long the node still answers after it was told to stop, in [s].
_LAST_WORDS = 0.2


def run_node(make: Callable[[], SuiteNode]) -> int:
    """Run a node until it is told to stop, and return the exit code: 1 where it can't start."""
    stop = _stop_on_signals()
    try:
        _require_no_arguments()
        # rclpy's own handlers would take the context away before the bag is closed.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        node = make()
    except (WalkOptimizerError, ParameterException, RuntimeError) as error:
        rclpy.try_shutdown()
        return _refused(error)
    try:
        _spin(node, stop)
    except WalkOptimizerError as error:  # Of `begin`: those of callbacks are answers.
        return _refused(error)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _require_no_arguments() -> None:
    """Refuse arguments that ROS takes no notice of.

    Raises:
        ConfigurationError: names them, and says how parameters are given.
    """
    unknown = remove_ros_args(sys.argv)[1:]
    if unknown:
        raise ConfigurationError(
            f"unknown arguments {' '.join(unknown)}; parameters are given as --ros-args -p NAME:=VALUE, and "
            "`ros2 param describe` tells of each while the node runs"
        )


def _refused(error: Exception) -> int:
    advice = ""
    if isinstance(error, InvalidParameterTypeException) and "DOUBLE" in str(error):
        advice = "; real numbers need a point, as in 200.0"
    print(f"can't start: {error}{advice}", file=sys.stderr)
    return 1


def _stop_on_signals() -> Future:
    """Return a future that SIGINT and SIGTERM complete.

    Python runs handlers in the main thread, which waits outside of Python for the executor's next event. So
    another thread is told by way of a pipe: a main thread that looked every so often would hold up others.
    """
    stop, (outlet, inlet) = Future(), os.pipe()

    def watch() -> None:
        while os.read(outlet, 1):
            stop.set_result(None)

    os.set_blocking(inlet, False)
    signal.set_wakeup_fd(inlet)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: None)
    threading.Thread(target=watch, name="signals", daemon=True).start()
    return stop


def _spin(node: SuiteNode, stop: Future) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    # A task ends its waiting; to be woken up alone does not.
    stop.add_done_callback(lambda _: executor.create_task(lambda: None))
    try:
        node.begin()
        node.announce()
        _forget_the_start()
        while not stop.done():
            _spin_once(node, executor)
    finally:
        node.close()
        _answer_the_waiting(node, executor)
        executor.shutdown()


def _forget_the_start() -> None:
    """Have Python no longer look for garbage among what the start has made, which stays."""
    gc.collect()
    gc.freeze()


def _answer_the_waiting(node: SuiteNode, executor: SingleThreadedExecutor) -> None:
    """Let clients have the answers that closing the node has brought about."""
    end = time.monotonic() + _LAST_WORDS
    while time.monotonic() < end:
        _spin_once(node, executor, _LAST_WORDS / 10)


def _spin_once(node: SuiteNode, executor: SingleThreadedExecutor, timeout: float | None = None) -> None:
    try:
        executor.spin_once(timeout_sec=timeout)
    except Exception as error:  # noqa: BLE001  # e.g. a client that left before its answer: the node lives on
        node.get_logger().error(f"callback failed: {error!r}")
