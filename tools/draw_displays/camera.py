"""The camera of RViz."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from recording import Recording

FloatArray = NDArray[np.float64]

FIELD_OF_VIEW = 45.0


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
