"""Subscriptions of a recorder: they adapt to what is offered, and pass each message on at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.qos.policies import Durability, QoS, Reliability
from actors.topics.endpoint import nanoseconds
from actors.topics.lazy_message import LazyMessage
from actors.topics.stream import StreamSubscription

if TYPE_CHECKING:
    from actors.bag.ring import Channel
    from actors.runtime.incarnation import Incarnation
    from actors.topics.peers import PublisherPeer, Target, TopicRegistry

DEPTH: Final = 1000
"""What the network holds for a recorder that is busy, in messages, if nothing larger is offered."""

Taker: TypeAlias = "Callable[[Channel, PublisherPeer, LazyMessage], None]"
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

    What other processes publish comes as it was sent, and may be no message of its type at all, unless it is to be `decoded`: what cannot be
    is then lost. With `patience` it may wait for so long for more, which costs less (see `SubscriptionPeer.patience`). `dropped` counts what was
    lost on its way here.
    """

    __slots__ = ("_decoded", "channel", "take")

    def __init__(
        self,
        life: Incarnation,
        entry: TopicRegistry,
        channel: Channel,
        qos: QoS,
        take: Taker,
        *,
        decoded: bool = False,
        patience: float = 0.0,
    ) -> None:
        super().__init__(life, entry, channel.type, qos, life.endpoints.stream_closed, patience=patience)
        self._decoded = decoded
        self.channel = channel
        self.take = take
        life.endpoints.join(self)

    def target(self, publisher: PublisherPeer) -> Target:
        channel, take = self.channel, self.take
        expires = nanoseconds(publisher.qos.lifespan) is not None

        def undecoded(arrival: LazyMessage) -> None:
            self.received += 1
            take(channel, publisher, arrival)

        def deliver(message: Any) -> None:
            bare, arrival = message.message if expires else message, publisher.arrival
            undecoded(LazyMessage(bare) if arrival is None or arrival.message is not bare else arrival)

        return deliver if self._decoded or publisher.here else _Undecoded(deliver, undecoded)


class _Undecoded:
    """An `UndecodedTarget` made of two functions."""

    __slots__ = ("_deliver", "undecoded")

    def __init__(self, deliver: Target, undecoded: Callable[[LazyMessage], None]) -> None:
        self._deliver = deliver
        self.undecoded = undecoded

    def __call__(self, message: object) -> None:
        self._deliver(message)
