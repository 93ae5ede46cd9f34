"""A node's diagnostics on `/diagnostics`, once a second, as diagnostic_updater publishes them."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from walk_optimizer.nodes.diagnostics import Diagnostics, Finding
from walk_optimizer.nodes.log_text import value_text
from walk_optimizer.nodes.qos import STREAM

# Global, unlike all other topics of the suite: aggregators and monitors listen there.
TOPIC = "/diagnostics"
# In [s].
PERIOD = 1.0


class DiagnosticsPublisher:
    """Publishes what a node's checks find."""

    def __init__(self, node: Node, diagnostics: Diagnostics) -> None:
        """Create the topic.

        Args:
            node: Whose diagnostics they are.
            diagnostics: Its checks.
        """
        self._node, self._diagnostics = node, diagnostics
        # As diagnostic_updater names them: `namespace/node: check`.
        self._name = node.get_fully_qualified_name().lstrip("/")
        self._hardware = node.get_namespace().strip("/") or "walker"
        self._publisher = node.create_publisher(DiagnosticArray, TOPIC, STREAM)

    def publish(self) -> None:
        """Publish what the checks find now."""
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.status = [
            self._status(name, finding) for name, finding in self._diagnostics.findings().items()
        ]
        self._publisher.publish(message)

    def _status(self, name: str, finding: Finding) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=bytes([finding.level]),
            name=f"{self._name}: {name}",
            message=finding.message,
            hardware_id=self._hardware,
            values=[KeyValue(key=key, value=value_text(value)) for key, value in finding.values.items()],
        )
