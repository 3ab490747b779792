"""Topics at work: publishers hand messages to subscription queues, at once and in order.

`Publisher.publish` is synchronous: it puts the message into the queue of every matched subscription, in the order in which they
subscribed, and returns. It never waits and never fails because a reader is slow: KEEP_LAST queues drop their oldest and count it.
A message is a value, so it is passed by reference.

Handlers (`actors.topics.handler`) and streams (`actors.topics.stream`) take from the queues. What a publisher promises about time is kept by
`actors.topics.timed_publisher`; publishers and queues without such promises pay nothing for it.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from actors.errors import NotStarted, WrongThread, WrongType, described
from actors.inbox.expiring import ExpiringMessage
from actors.topics.endpoint import Endpoint, EventStream, nanoseconds

if TYPE_CHECKING:
    from actors.graph.graph import Participant, TopicEntry
    from actors.interfaces.message import Message
    from actors.qos.events import PublisherEvent, PublisherStatus, SubscriptionEvent, SubscriptionStatus
    from actors.qos.policies import QoS

__all__ = ["Publisher", "Subscription"]

M = TypeVar("M", bound="Message")


class _Closed:
    """Stands in for the message type of a publisher that has ended, so that the hot path needs no second check."""


class Publisher(Endpoint["PublisherEvent"], Generic[M]):
    """One node's right to publish on one topic. Call it, or `publish`.

    `count` is the number of messages published so far, `status` what else has happened, `events()` tells it as it happens.

    It has no public constructor: `publishes` and `Node.publisher` give one.
    """

    __slots__ = (
        "_expects", "_outdated", "_thread", "count", "gated", "history", "matched", "suspended", "taps", "targets", "type",
    )  # fmt: skip

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> None:
        super().__init__(node, entry, qos)
        self.type = type
        self.count = 0
        self.suspended = False
        self.gated = True
        """Whether a lifecycle node's state counts for this publisher."""
        self.matched: dict[Subscription[M], None] = {}
        """The matched subscriptions, in subscription order."""
        self.taps: tuple[Callable[[M], None], ...] = ()
        """What takes every message without being a subscription: see `Graph.tap`."""
        self.targets: tuple[Callable[[M], None], ...] = ()
        """What `publish` calls: the ways into the peers, and the taps. After a change, what brings it up to date first."""
        self._outdated = False
        self.history: deque[Any] | None = deque(maxlen=qos.limit) if qos.transient_local else None
        """What late joiners get: the last `depth` messages; with KEEP_ALL as many as its limit."""
        self._expects: Any = type
        self._thread = get_ident()

    def __repr__(self) -> str:
        return f"<publisher of {self.entry.name} [{self.type.__name__}] in {self.node.fqn}: {self.count} sent>"

    def publish(self, message: M) -> None:
        """Hand `message` to every matched subscription, in subscription order. Never waits.

        Raises `WrongType` for a message of another type, `WrongThread` outside the node's event loop, `NotStarted` after the
        node's end. Between a lifecycle node's deactivation and activation messages are discarded silently.
        """
        if message.__class__ is not self._expects or get_ident() != self._thread:
            self._refuse(message)
            return
        self.count += 1
        if self.history is not None:
            self.history.append(message)
        for deliver in self.targets:
            deliver(message)

    __call__ = publish

    async def send(self, message: M) -> None:
        """Publish, but first wait until every reliable KEEP_ALL subscription has room: back-pressure instead of loss.

        Best effort, of either side, holds nobody back. Raises what `publish` raises, and what is wrong with the message before it waits.
        """
        if message.__class__ is not self._expects:
            self._refuse(message)
            return
        if self.qos.reliable:
            waited = True
            while waited:  # after a wait, others may be full again
                waited = False
                for queue in tuple(self.matched):
                    if queue.full:
                        await queue.room()
                        waited = True
                        break
        self.publish(message)

    def assert_liveliness(self) -> None:
        """Say "I am alive" without a message. It counts for liveliness manual_by_topic; publishing says the same.

        Raises `WrongThread` outside the node's event loop, `NotStarted` after the node's end.
        """
        if get_ident() != self._thread or (self._expects is _Closed and not self.suspended):
            self._refuse(None)

    def alive(self, lease_ns: int | None) -> bool:
        """Whether the publisher has shown within a lease that it lives. One that need not lives as long as its node."""
        return True

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        """When after `now` that ends by silence, nanoseconds; None for not at all."""
        return None

    @property
    def peers(self) -> tuple[Subscription[M], ...]:
        """The matched subscriptions as they are now, in subscription order."""
        return tuple(self.matched)

    @property
    def subscription_count(self) -> int:
        """How many subscriptions receive what is published here."""
        return len(self.matched)

    @property
    def status(self) -> PublisherStatus:
        """What this publisher has met so far, in totals: see `actors.qos.events`."""
        from actors.qos.events import PublisherStatus

        met = self.happenings
        if met is None:
            return PublisherStatus(matched=len(self.matched), matched_total=self.matched_total)
        return PublisherStatus(
            matched=len(self.matched),
            matched_total=self.matched_total,
            deadline_missed=met.missed(),
            liveliness_lost=met.lost(),
            incompatible_qos=met.incompatible_qos,
            last_policy_kind=met.last_policy,
            incompatible_type=met.incompatible_type,
        )

    def events(self) -> EventStream[PublisherEvent]:
        """The QoS events of this publisher from now on: ``async for event in publisher.events()``."""
        return EventStream(self)

    def due(self, now: int) -> int | None:
        return None

    def join(self, queue: Subscription[M]) -> None:
        """Begin to deliver to a matched subscription."""
        self.matched[queue] = None
        self.matched_total += 1
        self._outdate()
        self.tell()

    def part(self, queue: Subscription[M]) -> None:
        """Deliver no more to a subscription that leaves, if it was matched."""
        if queue in self.matched:
            del self.matched[queue]
            self._outdate()
            self.tell()

    def tapped(self, tap: Callable[[M], None]) -> None:
        """Hand every message to `tap`, too, for good."""
        self.taps += (tap,)
        self._outdate()

    def leave(self) -> tuple[Subscription[M], ...]:
        """Deliver to nobody any more. Returns who received until now."""
        peers, self.matched, self.targets, self._outdated = self.peers, {}, (), False
        return peers

    def _outdate(self) -> None:
        """A change of the peers: the next `publish` pays for all since the last one, so n changes cost n, not n times the peers."""
        if not self._outdated:
            self._outdated = True
            self.targets = (self._deliver_anew,)

    def _deliver_anew(self, message: M) -> None:
        """Stands for the targets while they are out of date."""
        self._outdated = False
        self.targets = targets = (*map(self.entry.graph.entrance, self.peers), *self.taps)
        for deliver in targets:
            deliver(message)

    @property
    def latched(self) -> list[M]:
        """What late joiners would get now, oldest first; empty for a volatile publisher."""
        return list(self.history or ())

    def replay(self, queue: Subscription[M]) -> None:
        """Give a late joiner what is latched, oldest first and no more than it holds."""
        deliver = self.entry.graph.entrance(queue)
        for message in self.latched[-queue.depth :]:
            deliver(message)

    def suspend(self) -> None:
        """Discard what is published from now on (an inactive lifecycle node)."""
        self.suspended = True
        self._expects = _Closed

    def resume(self) -> None:
        """Publish again."""
        self.suspended = False
        self._expects = self.type

    def close(self) -> None:
        """Leave the topic; what was latched is gone with it. Closing twice is fine."""
        self.suspended = False
        self._expects = _Closed
        self.end_events()
        self.entry.remove_publisher(self)

    def _refuse(self, message: object) -> None:
        if get_ident() != self._thread:
            raise WrongThread(
                f"{self.node.fqn} published on {self.entry.name} from a foreign thread: "
                "use node.threadsafe(publisher.publish, message)"
            )
        if message is not None and message.__class__ is not self.type:
            raise WrongType(
                f"{self.node.fqn} publishes {self.type.__name__} on {self.entry.name}, not {described(message)}"
            )
        if not self.suspended:
            raise NotStarted(f"{self.node.fqn} has ended: it can no longer publish on {self.entry.name}")


class Subscription(Endpoint["SubscriptionEvent"], Generic[M]):
    """The waiting messages of one subscription, bounded by its depth.

    `received` counts what was delivered into it, `dropped` what was lost because the reader was slower than the depth allows.
    `status` says what else has happened, `events()` tells it as it happens.
    """

    __slots__ = ("attended", "depth", "dropped", "keep_all", "messages", "received", "rooms", "type")

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> None:
        super().__init__(node, entry, qos)
        self.type = type
        self.depth = qos.limit if qos.keep_all else qos.depth
        self.keep_all = qos.keep_all
        self.messages: deque[M] = deque()
        self.received: int = 0
        self.dropped = 0
        self.rooms: list[asyncio.Future[None]] | None = None
        self.attended = False
        """Whether taking a message is more than that: senders have waited for room, or messages may be `ExpiringMessage`. See `taken`."""
        if (period := nanoseconds(qos.deadline)) is not None:
            from actors.qos.events import DeadlineWatch

            self.happening().deadline = DeadlineWatch(period)

    def __repr__(self) -> str:
        waiting = f"{len(self.messages)} waiting, {self.dropped} dropped"
        return f"<subscription of {self.entry.name} [{self.type.__name__}] in {self.node.fqn}: {waiting}>"

    def deliver(self, message: M) -> None:
        """Take a message from a publisher. Never blocks, never raises."""
        raise NotImplementedError

    @property
    def inlet(self) -> Callable[[M], None]:
        """Where publishers put their messages."""
        return self.deliver if self.happenings is None or self.happenings.deadline is None else self._deliver_in_time

    def _deliver_in_time(self, message: M) -> None:
        met = cast("Any", self.happenings)
        met.deadline.message(met.now())
        self.deliver(message)

    def aging(self, aged: ExpiringMessage[M]) -> M:
        """What to deliver here for a message with a lifespan: by default just the message."""
        return aged.message

    def taken(self, message: M | ExpiringMessage[M]) -> M | None:
        """A message has been taken out of an attended queue: make room known. None if it is too old to be delivered."""
        if self.rooms is not None:
            self.made_room()
        if isinstance(message, ExpiringMessage):
            return message.message if message.fresh else None
        return message

    # -- the subscription's place in the graph ------------------------------------------------------------------------------

    @property
    def publishers(self) -> list[Publisher[Any]]:
        """The matched publishers."""
        return [publisher for publisher in self.entry.publishers if self in publisher.matched]

    @property
    def publisher_count(self) -> int:
        """How many publishers this subscription receives from."""
        return len(self.publishers)

    @property
    def status(self) -> SubscriptionStatus:
        """What this subscription has met so far, in totals: see `actors.qos.events`."""
        from actors.qos.events import SubscriptionStatus

        publishers = self.publishers
        lease = nanoseconds(self.qos.liveliness_lease)
        alive = sum(publisher.alive(lease) for publisher in publishers)
        met = self.happenings
        return SubscriptionStatus(
            matched=len(publishers),
            matched_total=self.matched_total,
            deadline_missed=0 if met is None else met.missed(),
            incompatible_qos=0 if met is None else met.incompatible_qos,
            last_policy_kind="INVALID" if met is None else met.last_policy,
            incompatible_type=0 if met is None else met.incompatible_type,
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
        if self.happenings is not None and self.happenings.deadline is not None:
            self.happenings.deadline.advance(now)
            instants.append(self.happenings.deadline.due())
        return min((instant for instant in instants if instant is not None), default=None)

    def join(self, publisher: Publisher[Any]) -> None:
        """A publisher has been matched. The first one starts the clock of the deadline."""
        self.matched_total += 1
        if self.happenings is not None:
            if self.happenings.deadline is not None:
                self.happenings.deadline.start(self.happenings.now())
            self.happenings.tell()

    def close(self) -> None:
        """Leave the topic. Closing twice is fine."""
        self.end_events()
        self.entry.remove_subscription(self)
        self.made_room()

    # -- room ---------------------------------------------------------------------------------------------------------------

    @property
    def full(self) -> bool:
        """Whether a sender has to wait: a reliable KEEP_ALL queue without room."""
        return (
            self.keep_all and len(self.messages) >= self.depth and self.qos.reliable and not self._oldest_has_expired()
        )

    async def room(self) -> None:
        """Wait until a message has been taken out, or the oldest has expired."""
        loop = asyncio.get_running_loop()
        future: asyncio.Future[None] = loop.create_future()
        self.attended = True
        if self.rooms is None:
            self.rooms = []
        self.rooms.append(future)
        oldest: Any = self.messages[0]
        expires = oldest.expires if isinstance(oldest, ExpiringMessage) else math.inf
        expiry = loop.call_at((expires + 1) / 1e9, self.made_room) if expires < math.inf else None
        try:
            await future
        finally:
            if expiry is not None:
                expiry.cancel()
            self._give_up_on(future)

    def _give_up_on(self, room: asyncio.Future[None]) -> None:
        if self.rooms is not None and room in self.rooms:
            self.rooms.remove(room)

    def made_room(self) -> None:
        """Wake the senders that wait for room."""
        if self.rooms is not None:
            for future in self.rooms:
                if not future.done():
                    future.set_result(None)
            self.rooms = None

    def _oldest_has_expired(self) -> bool:
        oldest: Any = self.messages[0]
        return isinstance(oldest, ExpiringMessage) and not oldest.fresh

    def _overflow(self, message: M) -> None:
        """The queue is full: KEEP_LAST loses its oldest message, KEEP_ALL (which never overwrites) the new one.

        A message that nobody would get any more makes place without being missed.
        """
        expired = self.attended and self._oldest_has_expired()
        if expired or not self.keep_all:
            self.messages.popleft()
            self.messages.append(message)
        if not expired:
            self.dropped += 1
            self.tell()
