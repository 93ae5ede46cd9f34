"""What the nodes publish while they walk, kept as a display keeps it."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import rclpy
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray
from walk_optimizer_interfaces.srv import GetGait, SetGait

from walk_optimizer.cli.processes import NodeProcess, isolated_environment
from walk_optimizer.nodes.qos import LATCHED, STREAM
from walk_optimizer.request import gait_table_settings

FloatArray = NDArray[np.float64]

# The nodes and their parameters: how the walk begins is not in the picture, so nothing is solved for it.
NODES = {
    "gait_library": (),
    "reference_publisher": ("-p", "transitions:=blended"),
    "walker_visualizer": (),
}
SPEED, MODE = gait_table_settings().table_speeds()[3], "stiffness_and_equilibrium"
# Long enough for a start from standing, and for the paths that the feet have walked, [s].
WALKING = 8.0
PATIENCE = 300.0


@dataclass
class Recording:
    """What the nodes published.

    Attributes:
        description: The URDF.
        transforms: Last transform of each frame: parent and 4 x 4 matrix.
        markers: Last markers by namespace and number.
    """

    description: str = ""
    transforms: dict[str, tuple[str, FloatArray]] = field(default_factory=dict)
    markers: dict[tuple[str, int], Marker] = field(default_factory=dict)

    def take_description(self, message: String) -> None:
        """Keep the URDF."""
        self.description = message.data

    def take_transforms(self, message: TFMessage) -> None:
        """Keep the last transform of each frame."""
        for one in message.transforms:
            t, r = one.transform.translation, one.transform.rotation
            matrix = pose_matrix((t.x, t.y, t.z), (r.x, r.y, r.z, r.w))
            self.transforms[one.child_frame_id] = one.header.frame_id, matrix

    def take_markers(self, message: MarkerArray) -> None:
        """Add and delete markers as a display does."""
        for marker in message.markers:
            if marker.action == Marker.DELETE:
                self.markers.pop((marker.ns, marker.id), None)
            else:
                self.markers[marker.ns, marker.id] = marker

    def placement(self, frame: str) -> FloatArray:
        """Return where a frame is in the fixed one, (4, 4)."""
        total = np.eye(4)
        while frame in self.transforms:
            frame, own = self.transforms[frame]
            total = own @ total
        return total


def pose_matrix(translation: tuple[float, ...], quaternion: tuple[float, ...]) -> FloatArray:
    """Return the 4 x 4 matrix of a translation and a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = translation
    return matrix


@contextmanager
def running() -> Iterator[None]:
    """Run the nodes."""
    nodes: list[NodeProcess] = []
    with tempfile.TemporaryDirectory() as logs:
        try:
            for name, parameters in NODES.items():
                nodes.append(NodeProcess(name, Path(logs) / f"{name}.log", parameters, os.environ))
            yield
        finally:
            for node in nodes:
                node.stop()


def record() -> Recording:
    """Have the nodes walk, and return what they published."""
    os.environ.update(isolated_environment(os.environ))
    recording = Recording()
    with running():
        rclpy.init(args=[])
        node, executor = Node("draw_displays"), SingleThreadedExecutor()
        executor.add_node(node)
        for kind, name, take, qos in (
            (String, "robot_description", recording.take_description, LATCHED),
            (TFMessage, "tf", recording.take_transforms, STREAM),
            (MarkerArray, "walker_visualizer/markers", recording.take_markers, STREAM),
        ):
            node.create_subscription(kind, name, take, qos)
        _walk(node, executor)
        _spin(executor, PATIENCE, lambda: is_early_in_right_step(recording))
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()
    return recording


def is_early_in_right_step(recording: Recording) -> bool:
    """Whether the near leg stands and the other one swings behind it, so that neither hides the other."""
    ahead = recording.markers.get(("feet_ahead", 0))
    return ("ground_reaction", 1) in recording.markers and ahead is not None and 44 <= len(ahead.points) <= 50


def _walk(node: Node, executor: SingleThreadedExecutor) -> None:
    library = node.create_client(GetGait, "gait_library/get_gait")
    client = node.create_client(SetGait, "reference_publisher/set_gait")
    _spin(executor, PATIENCE, lambda: library.service_is_ready() and client.service_is_ready())
    _spin(executor, 1.0)
    future = client.call_async(SetGait.Request(speed=SPEED, spring_mode=MODE))
    _spin(executor, PATIENCE, future.done)
    if not future.result().success:
        raise SystemExit(future.result().message)
    _spin(executor, WALKING)


def _spin(executor: SingleThreadedExecutor, seconds: float, done: Callable[[], bool] = lambda: False) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and not done():
        executor.spin_once(timeout_sec=0.05)
