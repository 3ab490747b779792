"""Subscriptions: the waiting messages of one reader, bounded by its depth.

They never hold a publisher up: a KEEP_LAST subscription that is full loses its oldest message and counts it. Subscriptions for handlers
(`actors.topics.handler`) and for streams (`actors.topics.stream`) are the two kinds; they differ in who takes the messages out.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from actors.inbox.expiring import ExpiringMessage
from actors.topics.endpoint import Endpoint, nanoseconds
from actors.topics.events import EventStream
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.qos.events import SubscriptionEvent, SubscriptionStatus
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, PublisherPeer, Target, TopicRegistry

__all__ = ["Subscription"]

M = TypeVar("M", bound="Message")


class Subscription(Endpoint, Generic[M]):
    """The waiting messages of one subscription, bounded by its depth.

    `received` counts what was delivered into it, `dropped` what was lost because the reader was slower than the depth allows.
    `status` says what else has happened, `events()` tells it as it happens.
    """

    # Invariants:
    # * `messages` holds at most `depth` messages, oldest first.
    # * `must_unwrap` is true whenever a waiting message may be wrapped (`ExpiringMessage`), or a sender has waited for room: then whoever takes a
    #   message out hands it to `unwrap`. While it is false, taking a message out is nothing but a `popleft`.
    # * A publisher is in `matched` exactly as long as this subscription is matched there.

    __slots__ = (
        "depth", "dropped", "keep_all", "matched", "messages", "must_unwrap", "received", "senders", "type",
    )  # fmt: skip

    def __init__(self, node: Participant, entry: TopicRegistry, type: type[M], qos: QoS) -> None:
        super().__init__(node, entry, qos)
        self.type = type
        self.depth = qos.limit if qos.keep_all else qos.depth
        self.keep_all = qos.keep_all
        self.messages: deque[M] = deque()
        self.received: int = 0
        self.dropped = 0
        self.matched: dict[PublisherPeer, None] = {}
        """The matched publishers, in the order of matching."""
        self.senders: Waiters | None = None
        """The tasks that wait in `room`; None before the first one."""
        self.must_unwrap = False
        if (period := nanoseconds(qos.deadline)) is not None:
            from actors.qos.events import DeadlineWatch

            self.keep_events().deadline = DeadlineWatch(period)

    def __repr__(self) -> str:
        waiting = f"{len(self.messages)} waiting, {self.dropped} dropped"
        return f"<subscription of {self.entry.name} [{self.type.__name__}] in {self.node.fqn}: {waiting}>"

    def deliver(self, message: M) -> None:
        """Take a message from a publisher. Never blocks, never raises."""
        raise NotImplementedError

    def target(self, publisher: PublisherPeer) -> Target:
        """What `publisher` calls to deliver here."""
        if nanoseconds(publisher.qos.lifespan) is not None:
            return self._deliver_expiring
        return self.deliver if self.kept_events is None or self.kept_events.deadline is None else self._deliver_in_time

    def _deliver_in_time(self, message: M) -> None:
        """Deliver, and count the message for the deadline."""
        kept = cast("Any", self.kept_events)
        kept.deadline.message(kept.now())
        self.deliver(message)

    def _deliver_expiring(self, expiring: ExpiringMessage[M]) -> None:
        """Deliver a message with a lifespan."""
        message = self.wrapped(expiring)
        if self.kept_events is None or self.kept_events.deadline is None:
            self.deliver(message)
        else:
            self._deliver_in_time(message)

    def wrapped(self, expiring: ExpiringMessage[M]) -> M:
        """What waits here for a message with a lifespan: by default just the message, which then does not expire any more."""
        return expiring.message

    def unwrap(self, message: M | ExpiringMessage[M]) -> M | None:
        """The message that has been taken out, None if its lifespan is over; and there is room now."""
        if self.senders:
            self.senders.wake_all()
        if isinstance(message, ExpiringMessage):
            return message.message if message.fresh else None
        return message

    # -- the subscription's place in the graph ------------------------------------------------------------------------------

    @property
    def publishers(self) -> list[PublisherPeer]:
        """The matched publishers as they are now, in the order of matching."""
        return list(self.matched)

    @property
    def publisher_count(self) -> int:
        """How many publishers this subscription receives from."""
        return len(self.matched)

    @property
    def waiting(self) -> int:
        """How many messages wait to be taken out."""
        return len(self.messages)

    @property
    def status(self) -> SubscriptionStatus:
        """What this subscription has met so far, in totals: see `actors.qos.events`."""
        from actors.qos.events import SubscriptionStatus

        publishers = self.publishers
        lease = nanoseconds(self.qos.liveliness_lease)
        alive = sum(publisher.alive(lease) for publisher in publishers)
        kept = self.kept_events
        return SubscriptionStatus(
            matched=len(publishers),
            matched_total=self.matched_total,
            deadline_missed=0 if kept is None else kept.missed(),
            incompatible_qos=0 if kept is None else kept.incompatible_qos,
            last_policy_kind="INVALID" if kept is None else kept.last_policy,
            incompatible_type=0 if kept is None else kept.incompatible_type,
            alive=alive,
            not_alive=len(publishers) - alive,
            message_lost=self.dropped,
        )

    def events(self) -> EventStream[SubscriptionEvent]:
        """The QoS events of this subscription from now on: ``async for event in subscription.events()``."""
        return EventStream(self)

    def due(self, now: int) -> int | None:
        lease = nanoseconds(self.qos.liveliness_lease)
        instants = [publisher.due_alive(lease, now) for publisher in self.publishers]
        if self.kept_events is not None and self.kept_events.deadline is not None:
            self.kept_events.deadline.advance(now)
            instants.append(self.kept_events.deadline.due())
        return min((instant for instant in instants if instant is not None), default=None)

    def join(self, publisher: PublisherPeer) -> None:
        """A publisher has been matched. The first one starts the clock of the deadline."""
        self.matched[publisher] = None
        self.matched_total += 1
        if self.kept_events is not None:
            if self.kept_events.deadline is not None:
                self.kept_events.deadline.start(self.kept_events.now())
            self.kept_events.notify()

    def part(self, publisher: PublisherPeer) -> None:
        """A publisher has left, if it was matched."""
        if publisher in self.matched:
            del self.matched[publisher]
            self.notify()

    def leave(self) -> tuple[PublisherPeer, ...]:
        """Receive from nobody any more. Returns the publishers that were matched until now."""
        publishers, self.matched = tuple(self.matched), {}
        return publishers

    def catch_up(self, publisher: PublisherPeer) -> None:
        """Get what a matched publisher has latched, oldest first and no more than fits."""
        publisher.replay(self.entry.target(publisher, self), self.depth)

    def close(self) -> None:
        """Leave the topic. Closing twice is fine."""
        self.end_events()
        self.entry.remove_subscription(self)
        if self.senders:
            self.senders.wake_all()

    # -- room ---------------------------------------------------------------------------------------------------------------

    @property
    def full(self) -> bool:
        """Whether a sender has to wait: a reliable KEEP_ALL subscription without room."""
        return (
            self.keep_all and len(self.messages) >= self.depth and self.qos.reliable and not self._oldest_has_expired()
        )

    async def room(self) -> None:
        """Wait until a message has been taken out, the oldest has expired, or the subscription has been closed."""
        self.must_unwrap = True
        if self.senders is None:
            self.senders = Waiters()
        oldest: Any = self.messages[0]
        expires = oldest.expires if isinstance(oldest, ExpiringMessage) else math.inf
        loop = asyncio.get_running_loop()
        expiry = loop.call_at((expires + 1) / 1e9, self.senders.wake_all) if expires < math.inf else None
        try:
            await self.senders.wait()
        finally:
            if expiry is not None:
                expiry.cancel()

    def _oldest_has_expired(self) -> bool:
        oldest: Any = self.messages[0]
        return isinstance(oldest, ExpiringMessage) and not oldest.fresh

    def _overflow(self, message: M) -> None:
        """There is no room: KEEP_LAST loses its oldest message, KEEP_ALL (which never overwrites) the new one.

        An oldest message whose lifespan is over makes room without being counted.
        """
        expired = self.must_unwrap and self._oldest_has_expired()
        if expired or not self.keep_all:
            self.messages.popleft()
            self.messages.append(message)
        if not expired:
            self.dropped += 1
            self.notify()
