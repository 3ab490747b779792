"""The Protocols between the two ends of a topic, and between an end and the graph.

Each end is either an object of this process (`actors.topics.publisher.Publisher`, `actors.topics.subscription.Subscription`) or a stand-in
for an endpoint of another process. The graph and the opposite end use only these Protocols and treat both alike.

Peers are matched, counted and notified of each other; targets are the functions that `Publisher.publish` calls. The two are separate
because several peers may share one target: a transport has one target per publisher, for all the remote subscriptions that it represents.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS
    from actors.topics.lazy_message import LazyMessage

Target: TypeAlias = Callable[[Any], None]
"""Receives each message of a publisher, immediately and in order. It never blocks and never raises.

A publisher with a lifespan passes each message as an `actors.inbox.expiring.ExpiringMessage`, any other publisher the message itself.
"""


@runtime_checkable
class DeliversAll(Protocol):
    """A subscription to which several messages can be delivered at once."""

    def deliver(self, message: object) -> None: ...

    def deliver_all(self, messages: list[object]) -> None:
        """Do what `deliver` does with each of them."""
        ...


class Participant(Protocol):
    """What the graph requires of a node."""

    @property
    def fqn(self) -> str:
        """The node's fully qualified name."""
        ...

    def warn(self, event: str, **fields: object) -> None:
        """Log a warning in the node's name. A stand-in does nothing: the process that runs the node logs it. Never raises."""
        ...


@runtime_checkable
class Elsewhere(Protocol):
    """What a stand-in for an end of another process tells of the way to it."""

    @property
    def carried_bytes(self) -> int:
        """The size of the messages that have come from a publisher, or were sent for a subscription."""
        ...

    @property
    def missed(self) -> int:
        """How many messages of a publisher did not get here; 0 for a subscription, which counts them itself."""
        ...


class Peer(Protocol):
    """One end of a topic, as seen by the graph and by the opposite ends. Two peers are the same if they are the same object."""

    @property
    def here(self) -> bool:
        """Whether the endpoint belongs to this process. Two endpoints of other processes are not matched here."""
        ...

    @property
    def checks_qos(self) -> bool:
        """Whether its process exchanges nothing with an endpoint whose quality of service does not fit. ROS 2 over Zenoh does not check it."""
        ...

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
        """The quality of service that a publisher offers or a subscription requests. It never changes."""
        ...

    def notify(self) -> None:
        """Wake the tasks that wait for events of this end, because its status may have changed. Never raises."""
        ...

    def count_incompatible_qos(self, policy: str) -> None:
        """Count a peer that is not matched because of its quality of service. `policy` is the last policy that is incompatible."""
        ...

    def count_incompatible_type(self) -> None:
        """Count a peer that is not matched because its type differs."""
        ...


class PublisherPeer(Peer, Protocol):
    """A publisher, as seen by the graph and by its subscriptions."""

    @property
    def count(self) -> int:
        """The number of messages it has published, as far as this process knows. It never decreases."""
        ...

    @property
    def arrival(self) -> LazyMessage | None:
        """While a message of another process is delivered: that message, as it was received."""
        ...

    @property
    def latched(self) -> list[Any]:
        """The messages kept for late joiners, oldest first; empty for a volatile publisher.

        A message that has been delivered is the same object here, so that a receiver can recognise it.
        """
        ...

    def replay(self, target: Target, depth: int) -> None:
        """Call `target` with the messages kept for late joiners, oldest first and at most the newest `depth`.

        A stand-in may do nothing here and deliver those messages later.
        """
        ...

    def alive(self, lease_ns: int | None) -> bool:
        """Whether the publisher has shown a sign of life within `lease_ns` nanoseconds; None stands for its own lease."""
        ...

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        """The time, in nanoseconds and later than `now`, at which `alive` becomes false without a sign of life; None for never."""
        ...

    def join(self, subscription: SubscriptionPeer) -> None:
        """Match `subscription`: its target is called from the next `publish` on. Called once for each match."""
        ...

    def part(self, subscription: SubscriptionPeer) -> None:
        """Undo `join`. Does nothing if `subscription` is not matched."""
        ...

    def leave(self) -> tuple[SubscriptionPeer, ...]:
        """Part with all matched subscriptions and return them, in the order in which they were matched."""
        ...

    def add_tap(self, tap: Callable[[Message], None]) -> None:
        """Call `tap` with every bare message from now on, for as long as the publisher lives.

        A stand-in knows only the messages that arrive because a subscription of this process is matched.
        """
        ...


class SubscriptionPeer(Peer, Protocol):
    """A subscription, as seen by the graph and by its publishers."""

    @property
    def received(self) -> int:
        """The number of messages it has received, as far as this process knows. It never decreases."""
        ...

    @property
    def dropped(self) -> int:
        """The number of messages it has lost, as far as this process knows. It never decreases."""
        ...

    @property
    def waiting(self) -> int:
        """The number of messages that wait in it, as far as this process knows."""
        ...

    @property
    def patience(self) -> float:
        """For how long what arrives from other processes may wait for more, seconds."""
        ...

    @property
    def full(self) -> bool:
        """Whether `Publisher.send` has to wait for this subscription. True only if it is reliable and KEEP_ALL, and has no room."""
        ...

    async def room(self) -> None:
        """Wait until the subscription may have room or has left the topic. Called only while it is `full`."""
        ...

    def count_lost(self, messages: int) -> None:
        """Count messages that were lost on their way to this subscription."""
        ...

    def target(self, publisher: PublisherPeer) -> Target:
        """Return the function that `publisher` calls to reach this subscription.

        It is requested again after each change of the matched subscriptions. Peers that return equal targets are reached by one call.
        """
        ...

    def join(self, publisher: PublisherPeer) -> None:
        """Match `publisher`. Called once for each match."""
        ...

    def part(self, publisher: PublisherPeer) -> None:
        """Undo `join`. Does nothing if `publisher` is not matched."""
        ...

    def leave(self) -> tuple[PublisherPeer, ...]:
        """Part with all matched publishers and return them, in the order in which they were matched."""
        ...

    def catch_up(self, publisher: PublisherPeer) -> None:
        """Receive the messages that `publisher`, which has just been matched, keeps for late joiners. Called if this end is transient
        local.

        They are received before any new message. A stand-in does nothing: the process of the subscription does this.
        """
        ...


class TopicRegistry(Protocol):
    """One topic of the graph, as used by its endpoints."""

    @property
    def name(self) -> str:
        """The topic's full name."""
        ...

    @property
    def publishers(self) -> list[PublisherPeer]:
        """The present publishers, in the order in which they were added."""
        ...

    @property
    def subscriptions(self) -> list[SubscriptionPeer]:
        """The present subscriptions, in the order in which they were added."""
        ...

    def meant(self) -> str:
        """``; did you mean '/scan'?`` if nobody publishes here, but somebody on a topic of nearly this name; else empty."""
        ...

    def target(self, publisher: PublisherPeer, subscription: SubscriptionPeer) -> Target:
        """Return the function that `publisher` calls to reach `subscription`: its target, behind the interceptors of the graph."""
        ...

    def outward(self, publisher: PublisherPeer, targets: tuple[Target, ...]) -> tuple[Target, ...]:
        """Return the functions that `publisher` calls with each message: `targets`, behind the interceptors of the graph."""
        ...

    def add_publisher(self, publisher: PublisherPeer) -> None:
        """Add `publisher` and match it with the topic's subscriptions; both sides of each match are joined."""
        ...

    def remove_publisher(self, publisher: PublisherPeer) -> None:
        """Undo `add_publisher`. Calling it twice is harmless."""
        ...

    def add_subscription(self, subscription: SubscriptionPeer) -> None:
        """Add `subscription` and match it with the topic's publishers; both sides are joined before it catches up."""
        ...

    def remove_subscription(self, subscription: SubscriptionPeer) -> None:
        """Undo `add_subscription`. Calling it twice is harmless."""
        ...

    def forget(self, node: str) -> None:
        """Forget the node of this name, which has ended for good. Called when it has no endpoint here any more."""
        ...
