"""Draw what RViz and Foxglove show of a walk, from messages of the running nodes.

    .venv/bin/python tools/draw_displays.py docs/images

Starts the nodes as processes, has them walk, records what they
publish, and draws the last instant as rviz/walker.rviz and foxglove/walker.json say: their topics, camera,
colours, panels. Neither program is run; fonts and shading are matplotlib's.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import rclpy
import yaml
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray
from walk_optimizer_interfaces.srv import GetGait, SetGait

from walk_optimizer.cli.processes import NodeProcess, isolated_environment
from walk_optimizer.nodes.qos import LATCHED, STREAM

FloatArray = NDArray[np.float64]

ROOT = Path(__file__).resolve().parent.parent
# The nodes and their parameters: how the walk begins is not in the picture, so nothing is solved for it.
NODES = {
    "gait_library": (),
    "reference_publisher": ("-p", "transitions:=blended"),
    "walker_visualizer": (),
}
SPEED, MODE = 0.5338, "stiffness_and_equilibrium"
# Room for the recorder to stall, so that plots have no gaps of its making.
DEEP = QoSProfile(depth=5000)
# Long enough for a start from standing, and for the plots, [s].
WALKING = 8.0
PATIENCE = 300.0
FIELD_OF_VIEW = 45.0
# Length of a frame's axes when a layout says nothing, [m].
FOXGLOVE_AXIS = 0.154


# ------------------------------------------------------------------------------------------ recording
@dataclass
class Recording:
    """What the nodes published.

    Attributes:
        description: The URDF.
        transforms: Last transform of each frame: parent and 4 x 4 matrix.
        markers: Last markers by namespace and number.
        references: All joint references.
    """

    description: str = ""
    transforms: dict[str, tuple[str, FloatArray]] = field(default_factory=dict)
    markers: dict[tuple[str, int], Marker] = field(default_factory=dict)
    references: list[JointState] = field(default_factory=list)

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
            (JointState, "reference_publisher/joint_reference", recording.references.append, DEEP),
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


def _spin(executor: SingleThreadedExecutor, seconds: float, done: Any = lambda: False) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and not done():
        executor.spin_once(timeout_sec=0.05)


# ------------------------------------------------------------------------------------------ camera
class Camera:
    """A perspective view of points in the fixed frame."""

    def __init__(self, eye: FloatArray, target: FloatArray) -> None:
        """Look from a place to another; z is up."""
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        self._eye, self._rows = eye, np.array([right, np.cross(right, forward), forward])
        self._focal = 1 / np.tan(np.radians(FIELD_OF_VIEW / 2))

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where points (N, 3) are seen, (N, 2), half the picture's height being 1, and how far."""
        local = (np.atleast_2d(points) - self._eye) @ self._rows.T
        depth = local[:, 2]
        return self._focal * local[:, :2] / depth[:, None], depth

    def size(self, length: float, depth: float) -> float:
        """Return how large a length is seen at a distance."""
        return float(self._focal * length / depth)


def rviz_camera(view: dict[str, Any], recording: Recording) -> Camera:
    """Return the camera of RViz's Orbit view."""
    target = recording.placement(view["Target Frame"])[:3, 3]
    target = target + [view["Focal Point"][axis] for axis in "XYZ"]
    yaw, pitch = view["Yaw"], view["Pitch"]
    away = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    return Camera(target + view["Distance"] * away, target)


def foxglove_camera(panel: dict[str, Any], recording: Recording) -> Camera:
    """Return the camera of a 3D panel that follows a frame."""
    state = panel["cameraState"]
    target = recording.placement(panel["followTf"])[:3, 3] + state["targetOffset"]
    phi, theta = np.radians(state["phi"]), np.radians(state["thetaOffset"])
    away = np.array([np.sin(phi) * -np.sin(theta), -np.sin(phi) * np.cos(theta), np.cos(phi)])
    return Camera(target + state["distance"] * away, target)


# ------------------------------------------------------------------------------------------ drawing
class View3D:
    """Draws the robot, frames and markers, far ones first."""

    def __init__(self, axes: Axes, camera: Camera, recording: Recording, aspect: float) -> None:
        """Take an empty picture of some width for a height of 2."""
        self._axes, self._camera, self._recording = axes, camera, recording
        axes.set(xlim=(-aspect, aspect), ylim=(-1, 1), xticks=[], yticks=[], aspect="equal")

    def robot(self) -> None:
        """Draw the visuals of the URDF."""
        robot = ET.fromstring(self._recording.description)
        colours = {
            material.get("name"): np.array(
                [float(part) for part in material.find("color").get("rgba").split()]
            )
            for material in robot.findall("material")
        }
        for link in robot.findall("link"):
            frame = self._recording.placement(link.get("name"))
            for visual in link.findall("visual"):
                origin = np.array([float(part) for part in visual.find("origin").get("xyz").split()])
                colour = colours[visual.find("material").get("name")][:3]
                (shape,) = visual.find("geometry")
                self._shape(shape, frame, origin, colour)

    def _shape(self, shape: ET.Element, frame: FloatArray, origin: FloatArray, colour: FloatArray) -> None:
        radius = float(shape.get("radius"))
        if shape.tag == "sphere":
            self._ball((frame @ [*origin, 1])[:3], radius, colour)
            return
        half = float(shape.get("length")) / 2
        steps = np.linspace(-half, half, 13)
        x, y, z = origin
        ends = np.array([(frame @ [x, y, z + step, 1.0])[:3] for step in steps])
        for begin, end in itertools.pairwise(ends):
            self._rod(begin, end, radius, colour)

    def _ball(self, centre: FloatArray, radius: float, colour: FloatArray) -> None:
        (place,), (depth,) = self._camera.project(centre)
        size = self._camera.size(radius, depth)
        for part in np.linspace(1.0, 0.15, 8):
            shade = np.clip(colour * (0.75 + 0.6 * (1 - part)), 0, 1)
            middle = place + size * (1 - part) * np.array([-0.35, 0.4])
            self._axes.add_patch(Circle(middle, size * part, color=shade, linewidth=0, zorder=-depth))

    def _rod(self, begin: FloatArray, end: FloatArray, radius: float, colour: FloatArray) -> None:
        places, depths = self._camera.project(np.array([begin, end]))
        along = (places[1] - places[0]) / max(float(np.linalg.norm(places[1] - places[0])), 1e-9)
        across = np.array([-along[1], along[0]])
        widths = [self._camera.size(radius, depth) for depth in depths]
        for low, high in zip(np.linspace(-1, 1, 9)[:-1], np.linspace(-1, 1, 9)[1:], strict=True):
            shade = np.clip(colour * (1.05 - 0.45 * abs((low + high) / 2 + 0.3)), 0, 1)
            corners = [
                places[0] + widths[0] * low * across,
                places[1] + widths[1] * low * across,
                places[1] + widths[1] * high * across,
                places[0] + widths[0] * high * across,
            ]
            self._axes.add_patch(Polygon(corners, color=shade, linewidth=0.3, zorder=-float(depths.mean())))

    def frames(self, length: float) -> None:
        """Draw the axes of all frames: x red, y green, z blue."""
        for name in self._recording.transforms:
            frame = self._recording.placement(name)
            for axis, colour in enumerate(("#d62728", "#2ca02c", "#1f4fd6")):
                tip = frame[:3, 3] + length * frame[:3, axis]
                self._line(np.array([frame[:3, 3], tip]), 0.006, colour, nearer=0.3)

    def markers(self, shown: set[str]) -> None:
        """Draw the markers of some namespaces."""
        drawings = {
            Marker.LINE_STRIP: self._line_strip,
            Marker.LINE_LIST: self._line_list,
            Marker.TRIANGLE_LIST: self._triangles,
            Marker.ARROW: self._arrow,
            Marker.TEXT_VIEW_FACING: self._text,
        }
        for (namespace, _), marker in self._recording.markers.items():
            if namespace in shown:
                drawings[marker.type](marker)

    def _line(self, points: FloatArray, width: float, colour: Any, nearer: float = 0.02) -> None:
        places, depths = self._camera.project(points)
        # A picture is 2 high; a point is 1/72 inch.
        box = self._axes.get_window_extent()
        points_per_unit = box.height / self._axes.figure.dpi * 72 / 2
        thickness = self._camera.size(width, float(depths.mean())) * points_per_unit
        self._axes.plot(
            *places.T,
            color=colour,
            linewidth=max(thickness, 0.6),
            solid_capstyle="round",
            zorder=-float(depths.mean()) + nearer,
        )

    def _line_strip(self, marker: Marker) -> None:
        self._line(points_of(marker), marker.scale.x, colour_of(marker))

    def _line_list(self, marker: Marker) -> None:
        points = points_of(marker)
        for pair in points.reshape(-1, 2, 3):
            self._line(pair, marker.scale.x, colour_of(marker), nearer=-50.0)

    def _triangles(self, marker: Marker) -> None:
        # Each triangle is there twice, seen from both sides.
        for corners in points_of(marker).reshape(-1, 3, 3):
            places, _ = self._camera.project(corners)
            self._axes.add_patch(Polygon(places, color=colour_of(marker), linewidth=0, zorder=-100))

    def _arrow(self, marker: Marker) -> None:
        tail, tip = points_of(marker)
        along = (tip - tail) / np.linalg.norm(tip - tail)
        neck = tip - marker.scale.z * along
        self._line(np.array([tail, neck]), marker.scale.x, colour_of(marker), nearer=0.2)
        places, depths = self._camera.project(np.array([neck, tip]))
        across = places[1] - places[0]
        across = np.array([-across[1], across[0]]) / np.linalg.norm(across)
        half = self._camera.size(marker.scale.y / 2, float(depths[0]))
        corners = [places[0] + half * across, places[1], places[0] - half * across]
        self._axes.add_patch(Polygon(corners, color=colour_of(marker), zorder=-float(depths.mean()) + 0.2))

    def _text(self, marker: Marker) -> None:
        position = marker.pose.position
        (place,), (depth,) = self._camera.project(np.array([position.x, position.y, position.z]))
        box = self._axes.get_window_extent()
        height = self._camera.size(marker.scale.z, depth) * box.height / self._axes.figure.dpi * 72 / 2
        self._axes.text(
            *place,
            marker.text,
            fontsize=height,
            color=colour_of(marker),
            ha="center",
            va="center",
            zorder=10,
            clip_on=True,
        )


def points_of(marker: Marker) -> FloatArray:
    """Return the points of a marker, (N, 3); its pose is the identity."""
    return np.array([[point.x, point.y, point.z] for point in marker.points])


def colour_of(marker: Marker) -> tuple[float, float, float, float]:
    """Return red, green, blue, opacity."""
    return marker.color.r, marker.color.g, marker.color.b, marker.color.a


def draw_rviz(recording: Recording, path: Path) -> None:
    """Draw the view of RViz with its list of displays."""
    config = yaml.safe_load((ROOT / "rviz" / "walker.rviz").read_text(encoding="utf-8"))
    manager = config["Visualization Manager"]
    figure = new_figure(12.0, 7.2)
    side, middle = figure.add_axes((0.0, 0.0, 0.25, 1.0)), figure.add_axes((0.25, 0.0, 0.75, 1.0))
    colour = [int(part) / 255 for part in manager["Global Options"]["Background Color"].split(";")]
    middle.set_facecolor(colour)
    view = View3D(middle, rviz_camera(manager["Views"]["Current"], recording), recording, 9.0 / 7.2)
    lines = [("Global Options", f"Fixed Frame: {manager['Global Options']['Fixed Frame']}")]
    for display in manager["Displays"]:
        kind = display["Class"].split("/")[1]
        topic = display.get("Description Topic") or display.get("Topic") or {"Value": "tf"}
        lines.append((f"{display['Name']} ({kind})", topic["Value"]))
        if kind == "RobotModel":
            view.robot()
        elif kind == "TF":
            view.frames(0.2 * display["Marker Scale"])
        else:
            shown = {name for name, enabled in display["Namespaces"].items() if enabled}
            view.markers(shown)
            lines += [("", f"    {name}") for name in sorted(shown)]
    list_displays(side, lines)
    figure.savefig(path, dpi=110)


def list_displays(axes: Axes, lines: list[tuple[str, str]]) -> None:
    """Write what a program displays."""
    axes.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[])
    axes.set_facecolor("#fafafa")
    y = 0.965
    axes.text(0.05, y, "Displays", fontsize=12, weight="bold", va="center")
    for title, text in lines:
        if title:
            y -= 0.05
            axes.text(0.05, y, f"\N{BALLOT BOX WITH CHECK} {title}", fontsize=9.5, va="center")
        y -= 0.03
        axes.text(0.12, y, text, fontsize=8.5, color="#555555", va="center", family="monospace")


def draw_foxglove(recording: Recording, path: Path) -> None:
    """Draw the panels of the Foxglove layout."""
    layout = json.loads((ROOT / "foxglove" / "walker.json").read_text(encoding="utf-8"))
    figure = new_figure(13.0, 7.2)
    for name, (left, bottom, width, height) in rectangles(layout["layout"], (0.0, 0.0, 1.0, 1.0)).items():
        panel = layout["configById"][name]
        title = figure.add_axes((left, bottom + height - 0.045, width, 0.045))
        title.set(xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[], facecolor="#ffffff")
        title.text(0.012, 0.45, panel["foxglovePanelTitle"], fontsize=10, va="center")
        body = (left, bottom, width, height - 0.045)
        if name.startswith("3D!"):
            axes = figure.add_axes(body)
            axes.set_facecolor(panel["scene"]["backgroundColor"])
            aspect = body[2] * 13.0 / (body[3] * 7.2)
            view = View3D(axes, foxglove_camera(panel, recording), recording, aspect)
            view.robot()
            view.frames(FOXGLOVE_AXIS)
            (topic,) = (one for one in panel["topics"].values() if one["visible"])
            view.markers({name for name, settings in topic["namespaces"].items() if settings["visible"]})
        else:
            inner = (left + 0.052, bottom + 0.055, width - 0.066, height - 0.13)
            plot(figure.add_axes(inner), panel, recording.references)
    figure.savefig(path, dpi=110)


def rectangles(part: Any, box: tuple[float, float, float, float]) -> dict[str, tuple[float, ...]]:
    """Return the place of each panel of a layout: left, bottom, width, height."""
    if isinstance(part, str):
        return {part: box}
    left, bottom, width, height = box
    share = part["splitPercentage"] / 100
    if part["direction"] == "row":
        first = left, bottom, width * share, height
        second = left + width * share, bottom, width * (1 - share), height
    else:
        first = left, bottom + height * (1 - share), width, height * share
        second = left, bottom, width, height * (1 - share)
    return rectangles(part["first"], first) | rectangles(part["second"], second)


def plot(axes: Axes, panel: dict[str, Any], references: list[JointState]) -> None:
    """Draw the lines of a plot panel over the time that it follows."""
    stamps = np.array([one.header.stamp.sec + one.header.stamp.nanosec * 1e-9 for one in references])
    window = stamps > stamps[-1] - panel["followingViewWidth"]
    for line in panel["paths"]:
        field_name, index = line["value"].rsplit(".", 1)[1].rstrip("]").split("[")
        values = np.array([getattr(one, field_name)[int(index)] for one in references])
        axes.plot(
            stamps[window] - stamps[-1],
            values[window],
            color=line["color"],
            linewidth=1.2,
            label=line["label"],
        )
    axes.set_ylabel(panel["yAxisLabel"], fontsize=8)
    axes.set_xlim(-panel["followingViewWidth"], 0)
    axes.set_xlabel("time [s], 0 is now", fontsize=8, labelpad=1)
    axes.tick_params(labelsize=8)
    axes.grid(color="#e4e6ea", linewidth=0.6)
    axes.legend(
        loc="lower left", bbox_to_anchor=(-0.02, 0.98), ncols=4, fontsize=8, frameon=False, columnspacing=1.0
    )


def new_figure(width: float, height: float) -> Figure:
    """Return an empty picture of a size in [inch]."""
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def main() -> None:
    """Record, and draw both pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where rviz.png and foxglove.png go")
    folder = parser.parse_args().folder
    recording = record()
    if not recording.markers:
        raise SystemExit("nothing was received")
    draw_rviz(recording, folder / "rviz.png")
    draw_foxglove(recording, folder / "foxglove.png")
    print(
        f"{folder / 'rviz.png'}, {folder / 'foxglove.png'}: {len(recording.references)} references received"
    )


if __name__ == "__main__":
    main()
