"""What the visualizer tells operators about itself on `/diagnostics`."""

from rclpy.clock import Clock

from walk_optimizer.nodes.diagnostics import Diagnostics, Finding, Level
from walk_optimizer.scene.tracking import WalkerPose

# References that don't come for longer are missed, [s].
_PATIENCE = 2.0


class VisualizerHealth:
    """The check of the visualizer: whether references come, and whether they are those of the gait."""

    def __init__(self, diagnostics: Diagnostics, wall: Clock, topic: str) -> None:
        """Add the check to a node's.

        Args:
            diagnostics: Of the node.
            wall: A clock that never stands still.
            topic: That references come on.
        """
        self._wall, self._topic = wall, topic
        self._came_ns: int | None = None
        self._pose: WalkerPose | None = None
        diagnostics.add("references", self._finding)

    def note(self, pose: WalkerPose) -> None:
        """Remember that a reference has come, and what it means."""
        self._came_ns, self._pose = self._wall.now().nanoseconds, pose

    def _finding(self) -> Finding:
        if self._came_ns is None or self._pose is None:
            return Finding(Level.WARN, f"no joint reference on {self._topic} yet; is the publisher active?")
        silence = (self._wall.now().nanoseconds - self._came_ns) * 1e-9
        values = {"silence": silence, "distance": float(self._pose.base[0])}
        if silence > _PATIENCE:
            text = f"no joint reference on {self._topic} for {silence:.0f} s; is the publisher active?"
            return Finding(Level.WARN, text, values)
        if self._pose.place is None:
            return Finding(Level.OK, "the references are not those of a gait, so no forces are shown", values)
        return Finding(Level.OK, "the references are those of the gait", values)
