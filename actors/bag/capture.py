"""Subscriptions of a recorder: they adapt to what is offered, and pass each message on at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.qos.policies import Durability, QoS, Reliability
from actors.topics.endpoint import nanoseconds
from actors.topics.stream import StreamSubscription

if TYPE_CHECKING:
    from actors.bag.ring import Channel
    from actors.interfaces.message import Message
    from actors.runtime.incarnation import Incarnation
    from actors.topics.peers import PublisherPeer, Target, TopicRegistry

__all__ = ["Capture", "Taker", "fitting"]

DEPTH: Final = 1000
"""What the network holds for a recorder that is busy, in messages, if nothing larger is offered."""

Taker: TypeAlias = "Callable[[Channel, PublisherPeer, Message], None]"
"""Receives each message of a capture, with the publisher that sent it."""


def fitting(offered: Sequence[QoS]) -> QoS:
    """What matches all these publishers and asks for the most: reliable, or transient local, if all of them are."""
    reliable = all(qos.reliable for qos in offered)
    latched = bool(offered) and all(qos.transient_local for qos in offered)
    return QoS(
        depth=max([DEPTH, *(qos.limit for qos in offered)]),
        reliability=Reliability.RELIABLE if reliable else Reliability.BEST_EFFORT,
        durability=Durability.TRANSIENT_LOCAL if latched else Durability.VOLATILE,
    )


class Capture(StreamSubscription[Any]):
    """A subscription without a queue: each message is given to `take` while it is published.

    `dropped` counts what was lost on its way here.
    """

    __slots__ = ("channel", "take")

    def __init__(self, life: Incarnation, entry: TopicRegistry, channel: Channel, qos: QoS, take: Taker) -> None:
        super().__init__(life, entry, channel.type, qos, life.streams.remove)
        self.channel = channel
        self.take = take
        life.streams.append(self)
        entry.add_subscription(self)

    def target(self, publisher: PublisherPeer) -> Target:
        channel, take = self.channel, self.take
        expires = nanoseconds(publisher.qos.lifespan) is not None

        def deliver(message: Any) -> None:
            self.received += 1
            take(channel, publisher, message.message if expires else message)

        return deliver
