"""Warnings about peers whose quality of service does not fit: who, on which topic, both policies."""

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.topic_endpoint_info import TopicEndpointInfo

from walk_optimizer.nodes.suite_node import SuiteNode

# A peer's quality of service is known before its name is; so long a warning waits for that, in [s].
_NAME_DELAY = 1.0
# What is offered and asked for in vain: the usual mistakes.
_MISFITS = (
    ("reliability", ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE),
    ("durability", DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL),
)


def warn_of_subscribers(node: SuiteNode, topic: str, offered: QoSProfile) -> PublisherEventCallbacks:
    """Return event callbacks of a publisher that warn of subscribers that get nothing.

    Args:
        node: That publishes.
        topic: Its name, as given to the publisher.
        offered: Quality of service of the publisher.
    """
    name = str(node.resolve_topic_name(topic))

    def reasons() -> list[str]:
        peers = node.get_subscriptions_info_by_topic(name)
        return [_misfit(peer, offered, peer.qos_profile) for peer in peers]

    return PublisherEventCallbacks(incompatible_qos=_warning(node, f"{name} does not reach", reasons))


def warn_of_publishers(node: SuiteNode, topic: str, requested: QoSProfile) -> SubscriptionEventCallbacks:
    """Return event callbacks of a subscription that warn of publishers that it does not hear.

    Args:
        node: That subscribes.
        topic: Its name, as given to the subscription.
        requested: Quality of service of the subscription.
    """
    name = str(node.resolve_topic_name(topic))

    def reasons() -> list[str]:
        peers = node.get_publishers_info_by_topic(name)
        return [_misfit(peer, peer.qos_profile, requested) for peer in peers]

    return SubscriptionEventCallbacks(incompatible_qos=_warning(node, f"{name} is not heard from", reasons))


def _misfit(peer: TopicEndpointInfo, offered: QoSProfile, requested: QoSProfile) -> str:
    """Return a peer and the policies of it that don't fit; empty if all do."""
    policies = [
        f"{policy} offered {vain.name.lower()}, requested {wanted.name.lower()}"
        for policy, vain, wanted in _MISFITS
        if getattr(offered, policy) == vain and getattr(requested, policy) == wanted
    ]
    return f"{peer.node_namespace.rstrip('/')}/{peer.node_name}: {', '.join(policies)}" if policies else ""


def _warning(node: SuiteNode, what: str, reasons: Callable[[], Sequence[str]]) -> Callable[[Any], None]:
    def warn(event: Any) -> None:
        def tell() -> None:
            node.destroy_timer(timer)
            found = (
                "; ".join(filter(None, reasons()))
                or f"some node: {qos_policy_name_from_kind(event.last_policy_kind)}"
            )
            node.get_logger().warning(f"{what} {found}")

        timer = node.repeat(_NAME_DELAY, tell)

    return warn
