"""Paths of the feet: the step that lies ahead, and what was walked."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.scene.gait import Place, ShownGait
from walk_optimizer.scene.tracking import WalkerPose

FloatArray = NDArray[np.float64]


def paths_ahead(gait: ShownGait, pose: WalkerPose, place: Place) -> tuple[FloatArray, FloatArray]:
    """Return the paths of left and right foot from now until each has made its next step.

    Args:
        gait: That is walked.
        pose: Of the walker.
        place: Where in the gait that is.

    Returns:
        x and y in [m], (2, K) each: the rest of the running step and the whole next one.
    """
    standing = pose.feet[place.stance]
    landing = standing + gait.stride
    remaining = gait.swing_path[:, gait.path_times > place.time] + standing[:, None]
    swing = np.column_stack([pose.feet[1 - place.stance], remaining])
    following = gait.swing_path + landing[:, None]
    # The next step begins where the foot stands now.
    return (following, swing) if place.stance == 0 else (swing, following)


class Trail:
    """The paths that both feet have walked in the last seconds."""

    def __init__(self, duration: float) -> None:
        """Begin with nothing.

        Args:
            duration: Older points are forgotten, in [s].
        """
        self.duration = duration
        self._points: deque[tuple[float, FloatArray]] = deque()

    def add(self, time: float, pose: WalkerPose) -> None:
        """Add where the feet are at a time in [s]; a time before the last one begins anew."""
        if self._points and time < self._points[-1][0]:
            self._points.clear()
        self._points.append((time, pose.feet))
        while self._points[0][0] < time - self.duration:
            self._points.popleft()

    def paths(self) -> tuple[FloatArray, FloatArray]:
        """Return the paths of left and right foot: x and y in [m], (2, K) each."""
        feet = np.array([feet for _, feet in self._points]).reshape(-1, 2, 2)
        return feet[:, 0].T, feet[:, 1].T
