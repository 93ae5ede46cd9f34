"""Draws what a 3D display shows: the robot, frames, markers."""

from __future__ import annotations

import itertools
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
from camera import Camera
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray
from recording import Recording
from visualization_msgs.msg import Marker

FloatArray = NDArray[np.float64]


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
