"""Node `walker_visualizer`: what RViz and Foxglove show of a walk, from its joint references."""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
from walk_optimizer_interfaces.msg import Gait as GaitMessage

from walk_optimizer.description.settings import description_settings
from walk_optimizer.description.skeleton import skeleton_of
from walk_optimizer.description.transforms import base_transform, link_transforms
from walk_optimizer.description.urdf import walker_urdf
from walk_optimizer.errors import ConfigurationError, WalkOptimizerError
from walk_optimizer.nodes.parameters import Setting, require_frame, require_name
from walk_optimizer.nodes.qos import LATCHED, STREAM
from walk_optimizer.nodes.running import run_node
from walk_optimizer.nodes.scene_markers import SceneMarkers
from walk_optimizer.nodes.streamed_gait import ReceivedGait
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.nodes.transform_messages import transforms_to_message
from walk_optimizer.nodes.visualizer_health import VisualizerHealth
from walk_optimizer.nodes.walker_setting import WALKER_FILE, walker_of
from walk_optimizer.references import JOINTS
from walk_optimizer.scene.gait import ShownGait
from walk_optimizer.scene.scene import WalkScene
from walk_optimizer.scene.tracking import WalkerPose

FloatArray = NDArray[np.float64]


SETTINGS = [
    WALKER_FILE,
    Setting(
        "joint_reference",
        "reference_publisher/joint_reference",
        "Topic of the joint references.",
        check=require_name,
        read_only=True,
    ),
    Setting(
        "gait",
        "reference_publisher/gait",
        "Topic of the gait that is walked.",
        check=require_name,
        read_only=True,
    ),
    Setting("rate", 30.0, "Pictures per second [Hz].", 1.0, 100.0),
    Setting(
        "fixed_frame",
        "odom",
        "Frame of the ground; base_link moves in it.",
        read_only=True,
        check=require_frame,
    ),
    Setting(
        "link_transforms",
        True,
        "Whether the transforms of the links are published; false beside robot_state_publisher.",
    ),
    Setting("force_scale", 0.0008, "Length of the arrows of ground reactions [m/N].", 1e-6, 1.0),
    Setting("torque_scale", 0.3, "Angle of the arcs of joint torques [rad/(N m)].", 1e-6, 100.0),
    Setting("trail_duration", 3.0, "How long the paths of the feet are kept [s].", 0.1, 60.0),
]


class WalkerVisualizerNode(SuiteNode):
    """Publishes `robot_description`, `tf` and `~/markers`.

    Owns when a picture is due. Does not own where the walker is (`scene`) nor how it looks (`description`,
    `scene_markers`). Pictures follow the stamps of the references, so no timer is needed.
    """

    def __init__(self) -> None:
        """Describe the robot, and wait for references."""
        super().__init__("walker_visualizer", SETTINGS)
        self._walker, settings = walker_of(self.parameters["walker_file"]), description_settings()
        self._skeleton = skeleton_of(self._walker, settings)
        self._scene = WalkScene(
            self._walker, self.parameters["trail_duration"], self.parameters["torque_scale"]
        )
        self._drawing = SceneMarkers(self.parameters["fixed_frame"], settings.leg_spacing)
        self._shown_ns: int | None = None
        self._moved_ns = 0
        self._description = self.create_publisher(String, "robot_description", LATCHED)
        self._transforms = self.create_publisher(TFMessage, "tf", STREAM)
        self._markers = self.create_publisher(MarkerArray, "~/markers", STREAM)
        self._listen(GaitMessage, "gait", self._take_gait, LATCHED)
        references = self._listen(JointState, "joint_reference", self._take_reference, STREAM)
        self._health = VisualizerHealth(self.diagnostics, self._wall, references)
        self.parameters.apply_changes(self._apply)
        self._description.publish(String(data=walker_urdf(self._walker, settings)))
        self.get_logger().info("ready")

    def _listen(self, kind: type, setting: str, callback: Callable[[Any], None], qos: QoSProfile) -> str:
        """Subscribe to the topic that a parameter names, and return its full name."""
        topic = self.parameters[setting]
        subscription = self.create_subscription(kind, topic, callback, qos, callback_group=self.group)
        return str(subscription.topic_name)

    def _apply(self, names: set[str]) -> None:
        if "trail_duration" in names:
            self._scene.trail.duration = self.parameters["trail_duration"]
        if "torque_scale" in names:
            self._scene.torque_scale = self.parameters["torque_scale"]

    def _take_gait(self, message: GaitMessage) -> None:
        try:
            gait = ShownGait(ReceivedGait.from_message(message, self._walker).gait)
        except WalkOptimizerError as error:
            self.get_logger().warning(f"gait not shown: {error}")
            return
        self._scene.follow(gait)

    def _take_reference(self, message: JointState) -> None:
        stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        due = self._is_due(stamp_ns)
        if not due and stamp_ns - self._moved_ns < self._scene.patience * 1e9:
            return
        try:
            position = joint_values(message, "position")
            effort = joint_values(message, "effort") if message.effort else None
        except WalkOptimizerError as error:
            self.get_logger().warning(f"reference not shown: {error}", throttle_duration_sec=1.0)
            return
        pose = self._scene.move(position, _velocity_of(message))
        self._moved_ns = stamp_ns
        self._health.note(pose)
        if due:
            self._show(message, pose, effort)

    def _is_due(self, stamp_ns: int) -> bool:
        """Whether a picture is due; a clock that went back counts as one."""
        if self._shown_ns is not None and 0 <= stamp_ns - self._shown_ns < 1e9 / self.parameters["rate"]:
            return False
        self._shown_ns = stamp_ns
        return True

    def _show(self, message: JointState, pose: WalkerPose, effort: FloatArray | None) -> None:
        stamp = message.header.stamp
        transforms = [base_transform(self.parameters["fixed_frame"], pose.base)]
        if self.parameters["link_transforms"]:
            transforms += link_transforms(self._skeleton, pose.position)
        self._transforms.publish(transforms_to_message(transforms, stamp))
        scene = self._scene.show(stamp.sec + stamp.nanosec * 1e-9, pose, effort)
        self._markers.publish(self._drawing.draw(scene, stamp, self.parameters["force_scale"]))


def joint_values(message: JointState, field: str) -> FloatArray:
    """Return a field's numbers of the walker's joints, found by their names, (4,).

    Raises:
        ConfigurationError: a joint is missing, or a number is.
    """
    found = dict(zip(message.name, getattr(message, field), strict=False))
    missing = [name for name in JOINTS if name not in found]
    if missing:
        raise ConfigurationError(f"no {field} of {', '.join(missing)}")
    values = np.array([found[name] for name in JOINTS])
    if not np.isfinite(values).all():
        raise ConfigurationError(f"a number of {field} is not finite")
    return values


def _velocity_of(message: JointState) -> FloatArray | None:
    """Return the velocities of the walker's joints in [rad/s], (4,); None where they can't help."""
    try:
        return joint_values(message, "velocity")
    except WalkOptimizerError:
        return None


def main() -> int:
    """Run the node."""
    return run_node(WalkerVisualizerNode)


if __name__ == "__main__":
    sys.exit(main())
