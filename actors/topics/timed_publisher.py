"""Publishers that promise something about time: how long a message is worth something, how often one comes, that they live."""

from __future__ import annotations

import asyncio
from threading import get_ident
from typing import TYPE_CHECKING, TypeVar

from actors.inbox.expiring import ExpiringMessage
from actors.qos.policies import Liveliness
from actors.topics.channel import Publisher, Subscription
from actors.topics.endpoint import nanoseconds

if TYPE_CHECKING:
    from actors.graph.graph import Participant, TopicEntry
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS

__all__ = ["TimedPublisher", "publisher_for"]

M = TypeVar("M", bound="Message")


def publisher_for(node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> Publisher[M]:
    """A publisher with this quality of service; it must still join `entry`. Only one that makes promises about time looks at the clock."""
    timed = qos.lifespan is not None or qos.deadline is not None or _lease_of(qos) is not None
    return (TimedPublisher if timed else Publisher)(node, entry, type, qos)


def _lease_of(qos: QoS) -> int | None:
    """The lease that a publisher can lose, nanoseconds. An automatic one it keeps as long as its process runs, and so do its readers."""
    return nanoseconds(qos.liveliness_lease) if qos.liveliness is Liveliness.MANUAL_BY_TOPIC else None


class TimedPublisher(Publisher[M]):
    """A publisher with a lifespan, a deadline or a lease of liveliness manual_by_topic.

    Messages older than the lifespan, counted from `publish`, are not delivered any more, neither from queues nor to late joiners.
    Each deadline without a message is counted here, and in the subscriptions that requested one. So is each lease without a message or
    `assert_liveliness()`; to the subscriptions the publisher is then not alive until the next one.
    """

    __slots__ = ("_lifespan_ns", "_loop")

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> None:
        from actors.qos.events import DeadlineWatch, LeaseWatch

        super().__init__(node, entry, type, qos)
        self._loop = asyncio.get_running_loop()
        self._lifespan_ns = nanoseconds(qos.lifespan)
        met = self.happening()
        if (period := nanoseconds(qos.deadline)) is not None:
            met.deadline = DeadlineWatch(period)
            met.deadline.start(met.now())
        if (lease := _lease_of(qos)) is not None:
            met.lease = LeaseWatch(lease, met.now())

    def publish(self, message: M) -> None:
        """As `Publisher.publish`; it also looks at the clock."""
        if message.__class__ is not self._expects or get_ident() != self._thread:
            self._refuse(message)
            return
        met = self.happening()
        now = met.now()
        if met.deadline is not None:
            met.deadline.message(now)
        self._show_alive(now)
        self.count += 1
        if self._lifespan_ns is None:
            if self.history is not None:
                self.history.append(message)
            for deliver in self.targets:
                deliver(message)
            return
        aged = ExpiringMessage(message, now + self._lifespan_ns, self._loop.time)
        if self.history is not None:
            self.history.append(aged)
        for queue in self.peers:
            self._hand(aged, queue)
        for tap in self.taps:
            tap(message)

    __call__ = publish

    def assert_liveliness(self) -> None:
        super().assert_liveliness()
        self._show_alive(self.happening().now())

    def alive(self, lease_ns: int | None) -> bool:
        met = self.happening()
        return met.lease is None or met.now() - met.lease.asserted <= (lease_ns or met.lease.lease_ns)

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        lease = self.happening().lease
        if lease is None:
            return None
        instant = lease.asserted + (lease_ns or lease.lease_ns) + 1
        return instant if instant > now else None

    def due(self, now: int) -> int | None:
        met = self.happening()
        instants: list[int | None] = []
        if met.deadline is not None:
            met.deadline.advance(now)
            instants.append(met.deadline.due())
        if met.lease is not None:
            met.lease.advance(now)
            instants.append(met.lease.due())
        return min((instant for instant in instants if instant is not None), default=None)

    def replay(self, queue: Subscription[M]) -> None:
        if self._lifespan_ns is None:
            super().replay(queue)
            return
        for aged in self._fresh()[-queue.depth :]:
            self._hand(aged, queue)

    @property
    def latched(self) -> list[M]:
        return super().latched if self._lifespan_ns is None else [aged.message for aged in self._fresh()]

    def _fresh(self) -> list[ExpiringMessage[M]]:
        return [aged for aged in self.history or () if aged.fresh]

    def _hand(self, aged: ExpiringMessage[M], queue: Subscription[M]) -> None:
        self.entry.graph.entrance(queue)(queue.aging(aged))

    def _show_alive(self, now: int) -> None:
        lease = self.happening().lease
        if lease is not None and lease.assert_alive(now):
            self.tell()
            for queue in self.peers:
                queue.tell()
