"""The base class of subscriptions: a queue of messages for one reader, bounded by the depth of its quality of service.

A subscription never delays `Publisher.publish`. A full KEEP_LAST subscription drops its oldest message, a full KEEP_ALL subscription the
new one, and both count it. The two kinds differ in who takes the messages out: a handler (`actors.topics.handler`) or a task that iterates
over a stream (`actors.topics.stream`).
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, cast

from actors.checks import create
from actors.inbox.boundary import asked
from actors.inbox.expiring import ExpiringMessage
from actors.inbox.inbox import NOTHING
from actors.interfaces.message import M
from actors.topics.endpoint import Endpoint, EventStream, nanoseconds
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.contracts.content_filter import ContentFilter
    from actors.qos.events import SubscriptionEvent, SubscriptionStatus
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, PublisherPeer, Target, TopicRegistry


class Subscription(Endpoint, Generic[M]):
    """One subscription and its queue of waiting messages, bounded by its depth.

    `received` is the number of messages delivered to it, `dropped` the number lost because the reader was slower than the depth allows.
    `status` holds the totals of its QoS events, and `events()` reports them as they occur.
    """

    # Invariants:
    # * `messages` holds at most `depth` messages, oldest first. With `late_queue` it is `NOTHING` until there is one.
    # * `must_unwrap` is true while a waiting message may be wrapped (`ExpiringMessage`) or a sender waits for room. The reader then passes
    #   each message that it takes out to `unwrap`. Otherwise a `popleft` is enough.
    # * A publisher is in `matched` exactly as long as it is matched with this subscription.

    __slots__ = (
        "depth", "dropped", "filter", "keep_all", "matched", "messages", "must_unwrap", "patience", "received", "senders", "type",
    )  # fmt: skip

    late_queue: ClassVar[bool] = False
    """Whether `messages` is made by the derived class, when the first message comes."""

    def __init__(
        self,
        node: Participant,
        entry: TopicRegistry,
        type: type[M],
        qos: QoS,
        patience: float = 0.0,
        filter: ContentFilter | None = None,
    ) -> None:
        super().__init__(node, entry, qos)
        self.type = type
        self.filter = filter
        """What it takes of its messages; None for all."""
        self.patience = patience
        """For how long what arrives from other processes may wait for more, seconds."""
        self.depth = qos.limit if qos.keep_all else qos.depth
        self.keep_all = qos.keep_all
        self.messages: deque[M] = NOTHING if self.late_queue else deque()
        self.received: int = 0
        self.dropped = 0
        self.matched: dict[PublisherPeer, None] = {}
        """The matched publishers, in the order in which they were matched."""
        self.senders: Waiters | None = None
        """The tasks that wait in `room`; None until the first one does."""
        self.must_unwrap = False
        if qos.deadline is not None and (period := nanoseconds(qos.deadline)) is not None:
            from actors.qos.watches import DeadlineWatch

            self.keep_events().deadline = DeadlineWatch(period)

    def __repr__(self) -> str:
        waiting = f"{len(self.messages)} waiting, {self.dropped} dropped"
        return f"<subscription of {self.entry.name} [{self.type.__name__}] in {self.node.fqn}: {waiting}>"

    def deliver(self, message: M) -> None:
        """Receive a message from a publisher. Never blocks and never raises."""
        raise NotImplementedError  # each kind of subscription has its own

    def count_lost(self, messages: int) -> None:
        """Count messages that were lost on their way here. They appear in `status` like those that this end has dropped."""
        self.dropped += messages
        self.notify()

    def target(self, publisher: PublisherPeer) -> Target:
        """Return the function that `publisher` calls to deliver a message to this subscription."""
        deliver: Target = self.deliver
        if nanoseconds(publisher.qos.lifespan) is not None:
            deliver = self._deliver_expiring
        elif self.kept_events is not None and self.kept_events.deadline is not None:
            deliver = self._deliver_in_time
        return deliver if self.filter is None else partial(self._deliver_taken, deliver)

    def _takes(self, message: M | ExpiringMessage[M]) -> bool:
        """Whether the filter, if there is one, takes a message, or the one in a wrapper."""
        bare: object = message.message if isinstance(message, ExpiringMessage) else message
        return self.filter is None or self.filter.takes(bare)

    def _deliver_taken(self, deliver: Target, message: Any) -> None:
        if self._takes(message):
            deliver(message)

    def _deliver_in_time(self, message: M) -> None:
        """Deliver a message, and record its arrival for the deadline."""
        kept = cast("Any", self.kept_events)
        kept.deadline.message(kept.now())
        self.deliver(message)

    def _deliver_expiring(self, expiring: ExpiringMessage[M]) -> None:
        """Deliver a message that has a lifespan."""
        message = self.wrapped(expiring)
        if self.kept_events is None or self.kept_events.deadline is None:
            self.deliver(message)
        else:
            self._deliver_in_time(message)

    def wrapped(self, expiring: ExpiringMessage[M]) -> M:
        """Return what to keep for a message with a lifespan. By default that is the bare message, which then no longer expires."""
        return expiring.message

    def unwrap(self, message: M | ExpiringMessage[M]) -> M | None:
        """Return the message to handle for one that has been taken out, or None if its lifespan has passed. Wake the senders that wait for
        room."""
        if self.senders:
            self.senders.wake_all()
        if isinstance(message, ExpiringMessage):
            return message.message if message.fresh else None
        return message

    # -- the subscription's place in the graph ------------------------------------------------------------------------------

    @property
    def publishers(self) -> list[PublisherPeer]:
        """The publishers matched now, in the order in which they were matched."""
        return list(self.matched)

    @property
    def publisher_count(self) -> int:
        """The number of publishers matched with this subscription."""
        return len(self.matched)

    @property
    def waiting(self) -> int:
        """The number of messages that wait to be taken out."""
        return len(self.messages)

    @property
    def status(self) -> SubscriptionStatus:
        """The running totals of this subscription's QoS events; see `actors.qos.events`."""
        from actors.qos.events import SubscriptionStatus

        publishers = self.publishers
        lease = nanoseconds(self.qos.liveliness_lease)
        alive = asked(self._alive, lease)
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
        return create(EventStream, self)  # pyright: ignore[reportUnknownVariableType]

    def due(self, now: int) -> int | None:
        lease = nanoseconds(self.qos.liveliness_lease)
        instants = list(asked(self._due_alive, lease, now))
        if self.kept_events is not None and self.kept_events.deadline is not None:
            self.kept_events.deadline.advance(now)
            instants.append(self.kept_events.deadline.due())
        return min((instant for instant in instants if instant is not None), default=None)

    def _alive(self, lease: int | None) -> int:
        return sum(publisher.alive(lease) for publisher in self.matched)

    def _due_alive(self, lease: int | None, now: int) -> list[int | None]:
        return [publisher.due_alive(lease, now) for publisher in self.matched]

    def join(self, publisher: PublisherPeer) -> None:
        """Match `publisher`. The first match starts the deadline."""
        self.matched[publisher] = None
        self.matched_total += 1
        if self.kept_events is not None:
            if self.kept_events.deadline is not None:
                self.kept_events.deadline.start(self.kept_events.now())
            self.kept_events.notify()

    def part(self, publisher: PublisherPeer) -> None:
        """Undo `join`. Does nothing if `publisher` is not matched."""
        if publisher in self.matched:
            del self.matched[publisher]
            self.notify()

    def leave(self) -> tuple[PublisherPeer, ...]:
        """Part with all matched publishers and return them. Their own side of each match is left to the caller."""
        publishers, self.matched = tuple(self.matched), {}
        return publishers

    def catch_up(self, publisher: PublisherPeer) -> None:
        """Receive the messages that a matched publisher keeps for late joiners, oldest first and at most `depth` of them."""
        publisher.replay(self.entry.target(publisher, self), self.depth)

    def close(self) -> None:
        """Leave the topic. Closing twice is harmless."""
        self.end_events()
        self.entry.remove_subscription(self)
        if self.senders:
            self.senders.wake_all()

    # -- room ---------------------------------------------------------------------------------------------------------------

    @property
    def full(self) -> bool:
        """Whether `Publisher.send` has to wait: the subscription is reliable and KEEP_ALL, and has no room."""
        return (
            self.keep_all and len(self.messages) >= self.depth and self.qos.reliable and not self._oldest_has_expired()
        )

    async def room(self) -> None:
        """Wait until a message has been taken out, the oldest one has expired, or the subscription has been closed."""
        self.must_unwrap = True
        if self.senders is None:
            self.senders = Waiters()
        oldest: object = self.messages[0]
        expires = oldest.expires if isinstance(oldest, ExpiringMessage) else math.inf
        loop = asyncio.get_running_loop()
        expiry = loop.call_at((expires + 1) / 1e9, self.senders.wake_all) if expires < math.inf else None
        try:
            await self.senders.wait()
        finally:
            if expiry is not None:
                expiry.cancel()

    def _oldest_has_expired(self) -> bool:
        oldest: object = self.messages[0]
        return isinstance(oldest, ExpiringMessage) and not oldest.fresh

    def _overflow(self, message: M) -> None:
        """Handle a message that arrives at a full subscription: KEEP_LAST drops the oldest message, KEEP_ALL drops the new one.

        If the oldest message has expired, it is removed instead and not counted as dropped.
        """
        expired = self.must_unwrap and self._oldest_has_expired()
        if expired or not self.keep_all:
            self.messages.popleft()
            self.messages.append(message)
        if not expired:
            self.dropped += 1
            self.notify()
