"""The walker on its ground as visualization markers: paths of the feet, ground reactions, the ground."""

import math

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Vector3
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from walk_optimizer.scene.scene import Scene
from walk_optimizer.scene.torques import TorqueArc
from walk_optimizer.scene.tracking import WalkerPose

FloatArray = NDArray[np.float64]
Colour = tuple[float, float, float, float]

# Red, green, blue and opacity, 0 to 1.
_SIDE_COLOURS: tuple[Colour, Colour] = ((0.12, 0.31, 0.55, 1.0), (0.85, 0.45, 0.17, 1.0))
_FORCE_COLOUR: Colour = (0.80, 0.10, 0.16, 1.0)
_GROUND_COLOUR: Colour = (0.60, 0.62, 0.65, 1.0)
_TEXT_COLOUR: Colour = (0.10, 0.10, 0.10, 1.0)
_TORQUE_COLOUR: Colour = (0.45, 0.10, 0.55, 1.0)
# Sizes in [m].
_WALKED_WIDTH, _AHEAD_WIDTH, _TICK_WIDTH = 0.006, 0.012, 0.008
_SHAFT, _HEAD, _HEAD_LENGTH = 0.02, 0.045, 0.06
_TEXT_HEIGHT = 0.06
# RViz leaves more than a metre for a space unless scale.x tells how much; other displays ignore it.
_SPACE_WIDTH = 0.03
_GROUND_WIDTH = 0.6
_TORQUE_WIDTH = 0.012
# What is the left leg's is written behind the hip, what is the right leg's ahead: no leg swings as far.
_LABEL_AHEAD = (-0.38, 0.38)
# Arcs lie this much further outside than the legs [-].
_BESIDE_LEG = 1.3
# A smaller force is none, [N].
_LEAST_FORCE = 1.0


class SceneMarkers:
    """Turns scenes into marker arrays; each kind of marker has a namespace of its own."""

    def __init__(self, fixed_frame: str, leg_spacing: float) -> None:
        """Remember how to draw.

        Args:
            fixed_frame: Frame of the ground.
            leg_spacing: Left and right foot apart in [m].
        """
        self._frame = fixed_frame
        self._sideways = (leg_spacing / 2, -leg_spacing / 2)

    def draw(self, scene: Scene, stamp: Time, force_scale: float) -> MarkerArray:
        """Return all markers of a scene.

        Args:
            scene: To be drawn.
            stamp: Of the markers.
            force_scale: Length of an arrow in [m/N].
        """
        markers = self._ground(scene.ground)
        for side in range(len(self._sideways)):
            markers += [
                self._path("feet_walked", side, scene.walked[side], _WALKED_WIDTH),
                self._path("feet_ahead", side, scene.ahead[side], _AHEAD_WIDTH),
                *self._reaction(side, scene.pose, scene.reaction[side], force_scale),
            ]
        for number, arc in enumerate(scene.torques):
            markers += self._torque(number, arc, scene.pose)
        for marker in markers:
            marker.header.stamp = stamp
        return MarkerArray(markers=markers)

    def _marker(self, namespace: str, number: int, kind: int, colour: Colour) -> Marker:
        marker = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD)
        marker.header.frame_id = self._frame
        marker.pose.orientation.w = 1.0
        marker.color = ColorRGBA(**dict(zip("rgba", colour, strict=True)))
        return marker

    def _label(self, namespace: str, number: int, colour: Colour) -> Marker:
        label = self._marker(namespace, number, Marker.TEXT_VIEW_FACING, colour)
        label.scale.x, label.scale.z = _SPACE_WIDTH, _TEXT_HEIGHT
        return label

    def _path(self, namespace: str, side: int, path: FloatArray, width: float) -> Marker:
        marker = self._marker(namespace, side, Marker.LINE_STRIP, _SIDE_COLOURS[side])
        marker.scale.x = width
        marker.points = [_point(x, self._sideways[side], z) for x, z in path.T.tolist()]
        return marker if path.shape[1] > 1 else _removed(marker)

    def _reaction(self, side: int, pose: WalkerPose, force: FloatArray, scale: float) -> list[Marker]:
        """Return the arrow of a ground reaction, which begins at the foot, and its size in words."""
        arrow = self._marker("ground_reaction", side, Marker.ARROW, _FORCE_COLOUR)
        label = self._label("ground_reaction_size", side, _TEXT_COLOUR)
        foot = pose.feet[side]
        size = math.hypot(*force)
        if size < _LEAST_FORCE:
            return [_removed(arrow), _removed(label)]
        tip = foot + scale * force
        arrow.points = [_point(point[0], self._sideways[side], point[1]) for point in (foot, tip)]
        arrow.scale = Vector3(x=_SHAFT, y=_HEAD, z=_HEAD_LENGTH)
        height = foot[1] + 0.4 * scale * force[1]
        label.pose.position = _point(pose.base[0] + _LABEL_AHEAD[side], self._sideways[side], height)
        label.text = f"{size:.0f} N"
        return [arrow, label]

    def _torque(self, number: int, arc: TorqueArc, pose: WalkerPose) -> list[Marker]:
        """Return the arc of a joint torque, outside of the leg, and its size in words."""
        side = number // 2
        y = _BESIDE_LEG * self._sideways[side]
        line = self._marker("joint_torques", number, Marker.LINE_STRIP, _TORQUE_COLOUR)
        line.scale.x = _TORQUE_WIDTH
        line.points = [_point(x, y, z) for x, z in arc.points.T.tolist()]
        label = self._label("joint_torque_sizes", number, _TORQUE_COLOUR)
        label.text = f"{round(arc.torque, 1) + 0.0:.1f} N m"
        label.pose.position = _point(pose.base[0] + _LABEL_AHEAD[side], y, arc.centre[1] + _TEXT_HEIGHT)
        return [line, label]

    def _ground(self, ground: FloatArray) -> list[Marker]:
        """Return the surface, and a line with a number at each metre of the way."""
        surface = self._marker("ground", 0, Marker.TRIANGLE_LIST, _GROUND_COLOUR)
        surface.scale = Vector3(x=1.0, y=1.0, z=1.0)
        half = _GROUND_WIDTH / 2
        near, far = ([_point(x, y, z) for x, z in ground.T.tolist()] for y in (-half, half))
        for a, b, c, d in zip(near, near[1:], far, far[1:], strict=False):
            # Facing up; displays show the back too.
            surface.points += [a, b, c, c, b, d]
        # RViz's light comes from the camera and would leave flat ground black; coloured corners are not lit.
        surface.colors = [surface.color] * len(surface.points)
        metres = range(math.ceil(ground[0, 0]), math.floor(ground[0, -1]) + 1)
        heights = np.interp(metres, ground[0], ground[1]).tolist()
        lines = self._marker("ground_metres", 0, Marker.LINE_LIST, _TEXT_COLOUR)
        lines.scale.x = _TICK_WIDTH
        labels = []
        for metre, height in zip(metres, heights, strict=True):
            lines.points += [_point(metre, -half, height), _point(metre, half, height)]
            # Few numbers are in use, so that a new metre takes the marker of one that is out of sight.
            label = self._label("ground_metres", 1 + metre % 5, _TEXT_COLOUR)
            label.pose.position = _point(metre, -half, height - _TEXT_HEIGHT)
            label.text = f"{metre} m"
            labels.append(label)
        return [surface, lines, *labels]


def _point(x: float, y: float, z: float) -> Point:
    return Point(x=float(x), y=float(y), z=float(z))


def _removed(marker: Marker) -> Marker:
    marker.action = Marker.DELETE
    return marker
