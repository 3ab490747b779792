"""Publishers with time limits: a lifespan of their messages, a deadline between messages, or a lease of liveliness."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import get_ident
from typing import TYPE_CHECKING

from actors.checks import create
from actors.inbox.expiring import ExpiringMessage
from actors.interfaces.message import M
from actors.qos.policies import Liveliness, QoS
from actors.topics.endpoint import nanoseconds
from actors.topics.publisher import Publisher

if TYPE_CHECKING:
    from actors.topics.peers import Participant, Target, TopicRegistry


def publisher_for(node: Participant, entry: TopicRegistry, type: type[M], qos: QoS) -> Publisher[M]:
    """Create a publisher that has yet to join `entry`. Only a publisher with a lifespan, deadline or lease reads the clock when it
    publishes."""
    manual = qos.liveliness is Liveliness.MANUAL_BY_TOPIC
    timed = qos.lifespan is not None or qos.deadline is not None or (manual and _lease_of(qos) is not None)
    return create(TimedPublisher if timed else Publisher, node, entry, type, qos)


def _lease_of(qos: QoS) -> int | None:
    """The lease that the publisher can lose, in nanoseconds. Automatic liveliness cannot be lost while the process runs, so it is None."""
    return nanoseconds(qos.liveliness_lease) if qos.liveliness is Liveliness.MANUAL_BY_TOPIC else None


class TimedPublisher(Publisher[M]):
    """A publisher with a lifespan, a deadline, or a lease of manual_by_topic liveliness.

    A message older than the lifespan, measured from `publish`, is delivered neither to handlers and streams nor to late joiners. The
    publisher, and each subscription that requested a deadline, counts every deadline that passes without a message. A lease that passes
    without a message or `assert_liveliness()` is counted in the same way; matched subscriptions then see the publisher as not alive until
    its next sign of life.
    """

    # Invariants:
    # * With a lifespan, `history` and `targets` receive every message as an `ExpiringMessage`; taps receive the bare message.
    # * `kept_events` is never None. It has a deadline watch and a lease watch exactly if the quality of service has a deadline and a lease.

    __slots__ = ("_lifespan_ns", "_loop")

    def __init__(self, node: Participant, entry: TopicRegistry, type: type[M], qos: QoS) -> None:
        from actors.qos.watches import DeadlineWatch, LeaseWatch

        super().__init__(node, entry, type, qos)
        self._loop = asyncio.get_running_loop()
        self._lifespan_ns = nanoseconds(qos.lifespan)
        events = self.keep_events()
        if (period := nanoseconds(qos.deadline)) is not None:
            events.deadline = DeadlineWatch(period)
            events.deadline.start(events.now())
        if (lease := _lease_of(qos)) is not None:
            events.lease = LeaseWatch(lease, events.now())

    def publish(self, message: M) -> None:
        """Publish as `Publisher.publish` does, and record the time."""
        if message.__class__ is not self._expects or get_ident() != self._thread:
            self._refuse(message)
            return
        events = self.keep_events()
        now = events.now()
        if events.deadline is not None:
            events.deadline.message(now)
        self._show_alive(now)
        self.count += 1
        sent: M | ExpiringMessage[M] = message
        if self._lifespan_ns is not None:
            sent = ExpiringMessage(message, now + self._lifespan_ns, self._loop.time)
        if self.history is not None:
            self.history.append(sent)
        for deliver in self.targets:
            deliver(sent)

    __call__ = publish

    def assert_liveliness(self) -> None:
        super().assert_liveliness()
        self._show_alive(self.keep_events().now())

    def alive(self, lease_ns: int | None) -> bool:
        events = self.keep_events()
        return events.lease is None or events.now() - events.lease.asserted <= (lease_ns or events.lease.lease_ns)

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        lease = self.keep_events().lease
        if lease is None:
            return None
        instant = lease.asserted + (lease_ns or lease.lease_ns) + 1
        return instant if instant > now else None

    def due(self, now: int) -> int | None:
        events = self.keep_events()
        instants: list[int | None] = []
        if events.deadline is not None:
            events.deadline.advance(now)
            instants.append(events.deadline.due())
        if events.lease is not None:
            events.lease.advance(now)
            instants.append(events.lease.due())
        return min((instant for instant in instants if instant is not None), default=None)

    def add_tap(self, tap: Callable[[M], None]) -> None:
        super().add_tap(tap if self._lifespan_ns is None else lambda expiring: tap(expiring.message))

    def replay(self, target: Target, depth: int) -> None:
        if self._lifespan_ns is None:
            super().replay(target, depth)
            return
        for expiring in self._fresh()[-depth:]:
            target(expiring)

    @property
    def latched(self) -> list[M]:
        return super().latched if self._lifespan_ns is None else [expiring.message for expiring in self._fresh()]

    def _fresh(self) -> list[ExpiringMessage[M]]:
        return [expiring for expiring in self.history or () if expiring.fresh]

    def _show_alive(self, now: int) -> None:
        lease = self.keep_events().lease
        if lease is not None and lease.assert_alive(now):
            self.notify()
            for subscription in self.peers:
                subscription.notify()
