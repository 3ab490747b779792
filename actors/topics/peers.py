"""What the two ends of a topic ask of each other and of the graph, as Protocols.

An end of a topic is in this process (`actors.topics.publisher.Publisher`, `actors.topics.subscription.Subscription`) or somewhere else, and
then a stand-in takes its place in the graph. Neither the graph nor the other end can tell the difference: they know what is written here.

Peers are matched, counted and told of each other; targets are what `Publisher.publish` calls. They are kept apart because one target may
serve many peers: a transport has one target for each publisher, however many remote subscriptions it stands for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS

__all__ = ["Participant", "Peer", "PublisherPeer", "SubscriptionPeer", "Target", "TopicRegistry"]

Target: TypeAlias = Callable[[Any], None]
"""Takes each message of a publisher, at once and in order. It never blocks and never raises.

From a publisher with a lifespan it takes every message as an `actors.inbox.expiring.ExpiringMessage`, else the message itself.
"""


class Participant(Protocol):
    """A node, as far as the graph knows it."""

    @property
    def fqn(self) -> str:
        """Its fully qualified name."""
        ...

    def warn(self, event: str, **fields: object) -> None:
        """Log a warning in the node's name; a stand-in leaves that to the process where the node runs. Never raises."""
        ...


class Peer(Protocol):
    """One end of a topic, as the graph and the ends at the other side see it. Two peers are the same if they are the same object."""

    @property
    def node(self) -> Participant: ...

    @property
    def entry(self) -> TopicRegistry:
        """The topic."""
        ...

    @property
    def type(self) -> type[Message]: ...

    @property
    def qos(self) -> QoS:
        """What a publisher offers, or a subscription requests; it never changes."""
        ...

    def notify(self) -> None:
        """The status of this end may have changed: those who wait for its events are to look. Never raises."""
        ...

    def count_incompatible_qos(self, policy: str) -> None:
        """A peer was found that does not match because of its quality of service. `policy` is the last policy that keeps them apart."""
        ...

    def count_incompatible_type(self) -> None:
        """A peer was found that does not match because it has another type."""
        ...


class PublisherPeer(Peer, Protocol):
    """A publisher, as the graph and its subscriptions see it."""

    @property
    def count(self) -> int:
        """How many messages it has published, as far as this process knows. It never shrinks."""
        ...

    @property
    def latched(self) -> list[Any]:
        """The messages that late joiners would get now, oldest first; empty for a volatile publisher.

        A message that was delivered before is the same object here, so that nobody gets it twice.
        """
        ...

    def replay(self, target: Target, depth: int) -> None:
        """Hand what is latched to `target`, oldest first and at most the newest `depth`.

        A stand-in may do nothing, and let the messages follow when it has them.
        """
        ...

    def alive(self, lease_ns: int | None) -> bool:
        """Whether the publisher has shown within `lease_ns` nanoseconds (None: within its own lease) that it is alive."""
        ...

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        """When, in nanoseconds and after `now`, `alive` becomes false if nothing is heard until then; None for never."""
        ...

    def join(self, subscription: SubscriptionPeer) -> None:
        """Match `subscription`: from the next `publish` on, its target is called. Called once for each match."""
        ...

    def part(self, subscription: SubscriptionPeer) -> None:
        """Undo `join`; nothing happens if `subscription` is not matched."""
        ...

    def leave(self) -> tuple[SubscriptionPeer, ...]:
        """Part with every matched subscription and return them, in the order in which they were matched."""
        ...

    def add_tap(self, tap: Callable[[Any], None]) -> None:
        """Hand every message to `tap` as well, without its lifespan, for as long as the publisher lives."""
        ...


class SubscriptionPeer(Peer, Protocol):
    """A subscription, as the graph and its publishers see it."""

    @property
    def received(self) -> int:
        """How many messages it has received, as far as this process knows. It never shrinks."""
        ...

    @property
    def dropped(self) -> int:
        """How many messages it has lost, as far as this process knows. It never shrinks."""
        ...

    @property
    def waiting(self) -> int:
        """How many messages wait in it, as far as this process knows."""
        ...

    @property
    def full(self) -> bool:
        """Whether `Publisher.send` has to wait for this subscription: only if it is reliable, keeps all and has no room."""
        ...

    async def room(self) -> None:
        """Wait until the subscription may have room, or has left. Only called while it is `full`."""
        ...

    def target(self, publisher: PublisherPeer) -> Target:
        """What `publisher` calls to reach this subscription.

        It is asked for after each change of the matched subscriptions. Peers that return equal targets are reached by one call.
        """
        ...

    def join(self, publisher: PublisherPeer) -> None:
        """Match `publisher`. Called once for each match."""
        ...

    def part(self, publisher: PublisherPeer) -> None:
        """Undo `join`; nothing happens if `publisher` is not matched."""
        ...

    def leave(self) -> tuple[PublisherPeer, ...]:
        """Part with every matched publisher and return them, in the order in which they were matched."""
        ...

    def catch_up(self, publisher: PublisherPeer) -> None:
        """Get what `publisher`, just matched, has latched, before anything new. Called for transient local subscriptions.

        A stand-in does nothing: its own process sees to that.
        """
        ...


class TopicRegistry(Protocol):
    """One topic of the graph, as its endpoints use it."""

    @property
    def name(self) -> str:
        """The topic's full name."""
        ...

    @property
    def publishers(self) -> list[PublisherPeer]:
        """The publishers as they are now, in the order in which they came."""
        ...

    @property
    def subscriptions(self) -> list[SubscriptionPeer]:
        """The subscriptions as they are now, in the order in which they came."""
        ...

    def target(self, publisher: PublisherPeer, subscription: SubscriptionPeer) -> Target:
        """What `publisher` calls to reach `subscription`: its own target, or what the graph puts in front of it."""
        ...

    def add_publisher(self, publisher: PublisherPeer) -> None:
        """Let `publisher` meet the topic's subscriptions; both sides of each match are joined."""
        ...

    def remove_publisher(self, publisher: PublisherPeer) -> None:
        """Undo `add_publisher`. Twice is fine."""
        ...

    def add_subscription(self, subscription: SubscriptionPeer) -> None:
        """Let `subscription` meet the topic's publishers; both sides of each match are joined, then a late joiner catches up."""
        ...

    def remove_subscription(self, subscription: SubscriptionPeer) -> None:
        """Undo `add_subscription`. Twice is fine."""
        ...

    def forget(self, node: str) -> None:
        """The node of this name will not come back; called when it has no endpoint here any more."""
        ...
