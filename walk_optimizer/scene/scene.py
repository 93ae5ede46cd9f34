"""All that there is to show of a walk at one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.scene.gait import ShownGait
from walk_optimizer.scene.ground import ground_around
from walk_optimizer.scene.paths import Trail, paths_ahead
from walk_optimizer.scene.torques import TorqueArc, torque_arcs
from walk_optimizer.scene.tracking import WalkerPose, WalkTracker

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """The walker on its ground.

    Attributes:
        pose: Of the walker.
        walked: Paths of left and right foot behind them, x and y in [m], (2, K) each.
        ahead: The same for the step ahead; (2, 0) while the references are not those of the gait.
        reaction: Ground reaction on left and right foot, x and y in [N], (2, 2); one row a foot; zero
            while the references are not those of the gait.
        torques: Of the joints that tell one.
        ground: Points of the ground from behind the walker to before it, x and y in [m], (2, G).
    """

    pose: WalkerPose
    walked: tuple[FloatArray, FloatArray]
    ahead: tuple[FloatArray, FloatArray]
    reaction: FloatArray
    torques: list[TorqueArc]
    ground: FloatArray


class WalkScene:
    """Follows a walk from its joint references, and tells what there is to show of it."""

    def __init__(self, walker: WalkerParameters, trail_duration: float, torque_scale: float) -> None:
        """Wait for a first reference.

        Args:
            walker: That walks.
            trail_duration: How long the paths of the feet are kept, in [s].
            torque_scale: Angle of the arcs of joint torques in [rad/(N m)].
        """
        self._walker = walker
        self._tracker = WalkTracker(walker)
        self._gait: ShownGait | None = None
        self.trail = Trail(trail_duration)
        self.torque_scale = torque_scale

    def follow(self, gait: ShownGait) -> None:
        """Take the references for those of a gait from now on."""
        self._gait = gait
        self._tracker.follow(gait)

    @property
    def patience(self) -> float:
        """How long references may be left out before steps are lost count of, in [s]."""
        return self._tracker.patience

    def move(self, position: FloatArray, velocity: FloatArray | None = None) -> WalkerPose:
        """Move the joints, and return where that brings the walker.

        Args:
            position: To these in [rad], (4,).
            velocity: At these in [rad/s], (4,); None where they are not known.
        """
        return self._tracker.take(position, velocity)

    def show(self, time: float, pose: WalkerPose, effort: FloatArray | None) -> Scene:
        """Return what there is to show.

        Args:
            time: Of the pose in [s].
            pose: Of the walker.
            effort: Torques of `references.JOINTS` in [N m], (4,); None where they are not known.
        """
        self.trail.add(time, pose)
        ahead, reaction = (np.zeros((2, 0)), np.zeros((2, 0))), np.zeros((2, 2))
        if self._gait is not None and pose.place is not None:
            ahead = paths_ahead(self._gait, pose, pose.place)
            # The gait knows a standing and a swinging foot.
            order = [pose.place.stance, 1 - pose.place.stance]
            reaction[order] = self._gait.reaction(pose.place.time)
        torques = torque_arcs(self._walker, pose, effort, self.torque_scale) if effort is not None else []
        ground = ground_around(self._walker, self._gait, float(pose.base[0]))
        return Scene(pose, self.trail.paths(), ahead, reaction, torques, ground)
