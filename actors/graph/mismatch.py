"""Why a publisher and a subscription do not fit, and how both are told."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from actors.interfaces.foreign import difference
from actors.qos import Compatibility, compatible

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.topics.peers import PublisherPeer, SubscriptionPeer

verdict_on: Final = lru_cache(maxsize=1024)(compatible)
"""`compatible`, cached: a topic has many pairs of endpoints but few pairs of profiles."""


def mismatch_of(publisher: PublisherPeer, subscription: SubscriptionPeer) -> QosMismatch | TypeMismatch | None:
    """Return why the two do not match; None if they do."""
    if publisher.type is not subscription.type and (why := difference(publisher.type, subscription.type)):
        return TypeMismatch(publisher, subscription, why)
    if publisher.qos is subscription.qos:
        return None
    verdict = verdict_on(publisher.qos, subscription.qos)
    return QosMismatch(publisher, subscription, verdict) if verdict.level == "error" else None


class TypeMismatch:
    """A mismatch because the types differ."""

    kind: Final = "type"
    matches: Final = False

    def __init__(self, publisher: PublisherPeer, subscription: SubscriptionPeer, difference: tuple[str, str]) -> None:
        self.publisher = publisher
        self.subscription = subscription
        offered, requested = difference
        self.why = f"it is published as {offered} and subscribed as {requested}: one topic has one type"

    def count(self) -> None:
        """Count the mismatch at both endpoints."""
        self.publisher.count_incompatible_type()
        self.subscription.count_incompatible_type()

    def warn(self, topic: str) -> None:
        """Log the mismatch at both nodes."""
        for node in (self.publisher.node, self.subscription.node):
            node.warn(
                f"Incompatible types on topic '{topic}'",
                publisher=self.publisher.node.fqn,
                subscriber=self.subscription.node.fqn,
                why=self.why,
                remedy="give one of the two topics another name, or both sides the same type",
            )


class QosMismatch:
    """A mismatch because the offered quality of service does not satisfy the requested one."""

    kind: Final = "qos"

    def __init__(self, publisher: PublisherPeer, subscription: SubscriptionPeer, verdict: Compatibility) -> None:
        self.publisher = publisher
        self.subscription = subscription
        self.verdict = verdict
        self.matches = not (publisher.checks_qos and subscription.checks_qos)
        """Whether messages are exchanged all the same, because one of the two is of ROS 2 over Zenoh, which does not check what is asked for."""
        self.why = verdict.reason

    def count(self) -> None:
        """Count the mismatch at both endpoints."""
        self.publisher.count_incompatible_qos(self.verdict.event_policy)
        self.subscription.count_incompatible_qos(self.verdict.event_policy)

    def warn(self, topic: str) -> None:
        """Log the mismatch at both nodes."""
        publisher, subscription = self.publisher, self.subscription
        fields = {
            "offered": repr(publisher.qos),
            "requested": repr(subscription.qos),
            "why": self.why,
            "remedy": remedy(publisher.qos, subscription.qos, self.verdict),
        }
        unchecked = "rmw_zenoh does not check that: messages are exchanged all the same."
        publisher.node.warn(
            f"New subscription discovered on topic '{topic}', requesting incompatible QoS. "
            f"{unchecked if self.matches else 'No messages will be sent to it.'} "
            f"Last incompatible policy: {self.verdict.event_policy}",
            subscriber=subscription.node.fqn,
            **fields,
        )
        subscription.node.warn(
            f"New publisher discovered on topic '{topic}', offering incompatible QoS. "
            f"{unchecked if self.matches else 'No messages will be received from it.'} "
            f"Last incompatible policy: {self.verdict.event_policy}",
            publisher=publisher.node.fqn,
            **fields,
        )


def remedy(offered: QoS, requested: QoS, verdict: Compatibility) -> str:
    """What to change so that the two match, with one clause for each incompatible policy."""
    fields = {"liveliness_lease_duration": "liveliness_lease"}
    clauses: list[str] = []
    for policy in verdict.policies:
        field = fields.get(policy, policy)
        offer, request = getattr(offered, field), getattr(requested, field)
        clauses.append(
            f"let the publisher offer {field}={_said(request)}, or the subscription request {field}={_said(offer)}"
        )
    return "; ".join(clauses)


def _said(policy: object) -> str:
    return f"{policy:g}" if isinstance(policy, float) else str(policy)
