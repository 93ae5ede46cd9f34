"""A service of another node, and whether that node lives.

ROS takes a killed process for alive until the lease of its discovery is over, 20 s by default. So each
node of the suite has a topic `~/alive`, with one latched message that tells one process from its
successor. The liveliness of the topic is asserted by the middleware, not by Python, and lapses `LEASE`
after the process is gone.

The message also tells that answers will arrive. ROS knows when a client has found a service, not when the
service has found the client, and until then drops answers without a word. Who gets the message has been
found by its sender, and so has a client that was created before the subscription.
"""

from uuid import uuid4

from rclpy.callback_groups import CallbackGroup
from rclpy.client import Client
from rclpy.duration import Duration
from rclpy.event_handler import QoSLivelinessChangedInfo, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile
from std_msgs.msg import String

from walk_optimizer.nodes.diagnostics import Finding, Level
from walk_optimizer.nodes.qos import SERVICE

# In [s]; much longer than a busy machine keeps the middleware's thread waiting.
LEASE = 3.0
_ALIVE = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    liveliness=LivelinessPolicy.AUTOMATIC,
    liveliness_lease_duration=Duration(seconds=LEASE),
)


def announce_life(node: Node) -> None:
    """Offer `~/alive`, once the node's services are there."""
    node.create_publisher(String, "~/alive", _ALIVE).publish(String(data=uuid4().hex))


class RemoteService:
    """A client that knows whether it is worth to wait.

    Attributes:
        losses: How often a node that offers the service has gone, also if another was there at once.
    """

    def __init__(self, node: Node, kind: type, name: str, group: CallbackGroup) -> None:
        """Look for a service and for the life of its node.

        Args:
            node: That asks.
            kind: Service type.
            name: Of the service, which is `~/something` of a node of the suite.
            group: Callback group of the client.
        """
        self.client: Client = node.create_client(kind, name, qos_profile=SERVICE, callback_group=group)
        self.losses, self._lost = 0, False
        self._life, self._mute = "", False
        folder = self.name.rpartition("/")[0]
        node.create_subscription(
            String,
            f"{folder}/alive",
            self._on_start,
            _ALIVE,
            callback_group=group,
            event_callbacks=SubscriptionEventCallbacks(liveliness=self._on_liveliness),
        )

    @property
    def name(self) -> str:
        """Full name of the service."""
        return str(self.client.service_name)

    @property
    def available(self) -> bool:
        """Whether a node offers the service that is not known to be dead."""
        return bool(self.client.service_is_ready()) and not self._lost

    @property
    def will_answer(self) -> bool:
        """Whether the service is there, and its answers find us as far as one can know."""
        return self.available and (bool(self._life) or self._mute)

    def take_for_mute(self) -> None:
        """Take note that the service's node has told no life for long: it is none of the suite."""
        self._mute = True

    def finding(self, noun: str, without_it: str) -> Finding:
        """Return whether the service is there, for operators.

        Args:
            noun: What they call its node.
            without_it: What can't be done while it is away, and what to do.
        """
        values = {"service": self.name}
        if self.available:
            return Finding(Level.OK, f"the {noun} is there", values)
        return Finding(Level.WARN, f"the {noun} is not there: {without_it}", values)

    def _on_start(self, message: String) -> None:
        """Note a node that has just started: its first assertion of liveliness takes seconds.

        Its predecessor is gone, also if that never came to assert its own.
        """
        if self._life not in ("", message.data):
            self.losses += 1
        self._life, self._lost, self._mute = message.data, False, False

    def _on_liveliness(self, change: QoSLivelinessChangedInfo) -> None:
        """Note whether anybody lives; a node without the topic is never heard of, and counts as alive."""
        if change.alive_count_change < 0 or change.not_alive_count_change > 0:
            self.losses += 1
            self._life = ""  # Its successor's message counts it no second time.
        self._lost = change.alive_count == 0
