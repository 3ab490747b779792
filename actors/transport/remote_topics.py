"""Publishers and subscriptions of other processes, as they stand in the graph of this one."""

from __future__ import annotations

import asyncio
from bisect import insort
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeAlias

from actors.inbox.expiring import ExpiringMessage
from actors.interfaces.cdr import UNUSUAL, decoder
from actors.interfaces.errors import CdrError
from actors.interfaces.foreign import ForeignType
from actors.interfaces.message import Message
from actors.qos.policies import Liveliness, QoS
from actors.topics.endpoint import nanoseconds
from actors.topics.lazy_message import LazyMessage, UndecodedTarget
from actors.topics.peers import DeliversAll, Participant, PublisherPeer, SubscriptionPeer, Target, TopicRegistry
from actors.transport.local_side import LocalSide
from actors.transport.protocol import Wait
from actors.transport.sequence_numbers import SequenceNumbers

MessageType: TypeAlias = "type[Message]"


_MOST_KEPT: Final = 10_000
"""So many messages of one publisher are kept at most, whatever it says of itself."""


class _Match:
    """A matched subscription of this process, with what it has received of one publisher."""

    __slots__ = ("deliver_all", "numbers", "subscription", "target", "undecoded", "unread")

    def __init__(self, subscription: SubscriptionPeer, target: Target, last: int | None) -> None:
        self.subscription = subscription
        self.numbers = SequenceNumbers(last)
        """Those of the messages that it has received."""
        self.target = target
        self.undecoded = target.undecoded if isinstance(target, UndecodedTarget) else None
        """What is called in place of `target` if the subscription needs no object."""
        self.deliver_all: Callable[[list[Any]], None] | None = None
        """What can be called in place of `target` with several messages."""
        if isinstance(subscription, DeliversAll) and target == subscription.deliver:  # else something stands before it
            self.deliver_all = subscription.deliver_all
        self.unread = 0
        """How many have come since the last one that could not be decoded, and so have been counted as lost."""


class RemotePublisher:
    """A publisher of another process.

    What arrives is delivered to the matched subscriptions of this process, to each at most once and in order, and decoded at most once: not
    at all while all of them take it as it is (see `UndecodedTarget`). A gap in the numbers is counted as a loss, from the first message that
    a subscription has received, also over the time for which the publisher could not be reached: `known` are the numbers of the last messages
    that subscriptions had received before. Liveliness that is manual_by_topic is as `judged` says, or without it shows in arriving messages only. A
    lifespan is measured from the time of sending, so the clocks of the two machines have to agree.

    Invariants:

    * `kept` holds the newest messages by number: as many as a transient local publisher keeps, else one. A message that arrives twice is
      the same object.
    * `count` is the number of the newest message that has arrived, `carried_bytes` the size of all that has, and `missed` how many numbers
      were skipped since the first.
    * `_only` is the match of the only subscription, if messages need nothing but to be decoded for it. It has the number of the newest message.
    """

    def __init__(
        self,
        node: Participant,
        entry: TopicRegistry,
        type: ForeignType,
        qos: QoS,
        side: LocalSide,
        known: Mapping[SubscriptionPeer, int] | None = None,
        *,
        checks_qos: bool = True,
        judged: Callable[[], bool] | None = None,
    ) -> None:
        self.node = node
        self.entry = entry
        self.qos = qos
        self.checks_qos = checks_qos
        self._judged = judged
        self._numbers = SequenceNumbers()
        self._known = known or {}
        self.carried_bytes = 0
        self.missed = 0
        self._passing: LazyMessage | tuple[bytes, MessageType, int, float | None, Message] | None = None
        """What is being passed on: its object, or what it is made of."""
        self.kept: dict[int, LazyMessage] = {}
        self._order: list[int] = []
        """The numbers of `kept`, ascending."""
        self.type: Any = type
        self._wall_ns = side.wall_ns
        self._unreadable = side.unreadable
        self._time = asyncio.get_running_loop().time
        self._lifespan = nanoseconds(qos.lifespan)
        self._shows_itself = judged is None and qos.liveliness is Liveliness.MANUAL_BY_TOPIC
        self._keeps = min(qos.limit, _MOST_KEPT) if qos.transient_local else 1
        self._shown_ns = self._now_ns()
        self._matched: dict[SubscriptionPeer, _Match | None] = {}
        self._taps: tuple[Callable[[Message], None], ...] = ()
        self._only: _Match | None = None
        self._only_takers: tuple[SubscriptionPeer, ...] = ()
        self._plain = self._lifespan is None and not qos.transient_local

    def __repr__(self) -> str:
        return f"<publisher of {self.entry.name} [{self.type.__ros_type__}] in {self.node.fqn}, elsewhere: {self.count} arrived>"

    @property
    def here(self) -> bool:
        return False

    @property
    def count(self) -> int:
        return self._numbers.last or 0

    @property
    def received(self) -> dict[SubscriptionPeer, int]:
        """The number of the last message that each subscription has received."""
        return {
            each: match.numbers.last
            for each, match in self._matched.items()
            if match and match.numbers.last is not None
        }

    # -- what arrives -------------------------------------------------------------------------------------------------------

    def arrived(
        self,
        number: int,
        source_time: int,
        payload: bytes,
        subscriptions: tuple[SubscriptionPeer, ...],
        since: float | None = None,
    ) -> None:
        """Deliver a message to those of `subscriptions`, which have the same type, that are matched."""
        # Called for every message of other processes: what only some of them need is asked for first.
        self.carried_bytes += len(payload)
        if self._shows_itself:
            self._show_alive()
        only = self._only
        if only is not None and number - 1 == only.numbers.last and subscriptions is self._only_takers:
            try:
                decoded = self._decode(payload, len(payload))
            except UNUSUAL:
                pass
            else:
                only.numbers.last = self._numbers.last = number
                only.unread = 0
                self._passing = payload, only.subscription.type, source_time, since, decoded
                only.target(decoded)
                self._passing = None
                return
        takers = [
            (each, match)
            for each in subscriptions
            if (match := self._match_with(each)) is not None and match.numbers.is_new(number)
        ]
        if not takers:
            return
        arrival = self._arrival(number, payload, subscriptions[0].type, source_time, since)
        message: Any = None
        if self._taps or self.qos.transient_local or any(match.undecoded is None for _, match in takers):
            try:
                message = arrival.message
            except CdrError as error:
                if self.kept.pop(number, None) is not None:
                    self._order.remove(number)
                takers = self._not_decoded(takers, error)
                if not takers:
                    return
        wrapped = message if self._lifespan is None else self._expiring(message, source_time)
        self._passing = arrival
        for subscription, match in takers:
            if (lost := match.numbers.take(number)) > match.unread:
                subscription.count_lost(lost - match.unread)
            match.unread = 0
            if match.undecoded is None:
                match.target(wrapped)
            else:
                match.undecoded(arrival)
        self._passing = None
        if self._numbers.is_new(number):
            self.missed += self._numbers.take(number)
            if message is not None:
                for tap in self._taps:
                    tap(message)
        self._only = self._only_match(takers, number, subscriptions)

    def arrived_together(self, number: int, payloads: list[bytes], subscriptions: tuple[SubscriptionPeer, ...]) -> bool:
        """Deliver messages, numbered from `number` on, if they need nothing but to be decoded for an only subscription. Whether they did."""
        only = self._only
        if (
            only is None
            or only.deliver_all is None
            or number - 1 != only.numbers.last
            or subscriptions is not self._only_takers
            or self._shows_itself
        ):
            return False
        decode = self._decode
        try:
            messages = [decode(payload, len(payload)) for payload in payloads]
        except UNUSUAL:
            return False
        self.carried_bytes += sum(map(len, payloads))
        only.numbers.last = self._numbers.last = number + len(payloads) - 1
        only.unread = 0
        only.deliver_all(messages)
        return True

    def _only_match(
        self, takers: list[tuple[SubscriptionPeer, _Match]], number: int, subscriptions: tuple[SubscriptionPeer, ...]
    ) -> _Match | None:
        """The match whose subscription alone takes the next message, after one with this number, and takes it as an object."""
        _, match = takers[0]
        plain = (
            self._plain and not self._taps and len(self._matched) == len(subscriptions) == 1 and match.undecoded is None
        )
        if not plain or self._numbers.last != number:
            return None
        self._decode: Callable[[bytes, int], Message] = decoder(match.subscription.type)
        self._only_takers = subscriptions
        self.kept.clear()
        self._order.clear()
        return match

    @property
    def arrival(self) -> LazyMessage | None:
        passing = self._passing
        if isinstance(passing, tuple):
            payload, kind, sent_ns, since, message = passing
            passing = self._passing = LazyMessage.received(payload, kind, sent_ns, since)
            passing.decoded_as(message)
        return passing

    def _not_decoded(
        self, takers: list[tuple[SubscriptionPeer, _Match]], error: CdrError
    ) -> list[tuple[SubscriptionPeer, _Match]]:
        """Count a message as lost by those that need the object. Returns the others."""
        for subscription, match in takers:
            if match.undecoded is None:
                match.unread += (
                    1  # its number may be as wrong as the rest: as the last one it would hide what comes next
                )
                subscription.count_lost(1)
        node, topic = takers[0][0].node, self.entry.name
        self._unreadable.note("a message cannot be decoded", topic, error, warn=node.warn, topic=topic)
        return [(subscription, match) for subscription, match in takers if match.undecoded is not None]

    def _match_with(self, subscription: SubscriptionPeer) -> _Match | None:
        if subscription not in self._matched:
            return None
        match = self._matched[subscription]
        if match is None:
            target = self.entry.target(self, subscription)
            match = self._matched[subscription] = _Match(subscription, target, self._known.get(subscription))
        return match

    def _arrival(
        self, number: int, payload: bytes, kind: MessageType, sent_ns: int, since: float | None
    ) -> LazyMessage:
        arrival = self.kept.get(number)
        if arrival is None or arrival.cdr != payload:
            arrival = LazyMessage.received(payload, kind, sent_ns, since)
            if self._keeps == 1:
                self.kept.clear()
                self._order.clear()
            if number not in self.kept:  # a message of another content may claim the number of an earlier one
                insort(self._order, number)  # nearly always the newest, so at the end
            self.kept[number] = arrival
            if len(self.kept) > self._keeps:
                del self.kept[self._order.pop(0)]
        return arrival

    def _expiring(self, message: Message, sent_ns: int) -> ExpiringMessage[Message]:
        left = sent_ns + (self._lifespan or 0) - self._wall_ns()
        return ExpiringMessage(message, self._now_ns() + left, self._time)

    # -- liveliness ---------------------------------------------------------------------------------------------------------

    def _now_ns(self) -> int:
        return round(self._time() * 1e9)

    def _lease(self, lease_ns: int | None) -> int | None:
        if not self._shows_itself:
            return None
        return lease_ns or nanoseconds(self.qos.liveliness_lease)

    def alive(self, lease_ns: int | None) -> bool:
        if self._judged is not None:
            return self._judged()
        lease = self._lease(lease_ns)
        return lease is None or self._now_ns() - self._shown_ns <= lease

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        lease = self._lease(lease_ns)
        due = None if lease is None else self._shown_ns + lease + 1
        return due if due is not None and due > now else None

    def _show_alive(self) -> None:
        was_alive = self.alive(None)
        self._shown_ns = self._now_ns()
        if not was_alive:
            self.tell_matched()

    def tell_matched(self) -> None:
        """Let the matched subscriptions see whether it is alive."""
        for subscription in self._matched:
            subscription.notify()

    # -- its place in the graph ---------------------------------------------------------------------------------------------

    @property
    def latched(self) -> list[Message]:
        return [self.kept[number].message for number in self._order] if self.qos.transient_local else []

    def replay(self, target: Target, depth: int) -> None:
        """Do nothing: each transient local subscription asks the network for what is kept."""

    def notify(self) -> None:
        """Do nothing: its own process finds the subscription, too, and tells it."""

    def count_incompatible_qos(self, policy: str) -> None:
        """Do nothing, for the same reason."""

    def count_incompatible_type(self) -> None:
        """Do nothing, for the same reason."""

    def join(self, subscription: SubscriptionPeer) -> None:
        self._matched[subscription] = self._only = None

    def part(self, subscription: SubscriptionPeer) -> None:
        self._matched.pop(subscription, None)
        self._only = None

    def leave(self) -> tuple[SubscriptionPeer, ...]:
        subscriptions, self._matched = tuple(self._matched), {}
        self._only = None
        return subscriptions

    def add_tap(self, tap: Callable[[Message], None]) -> None:
        self._taps += (tap,)
        self._only = None


class RemoteSubscription:
    """A subscription of another process. What it has received and lost is known there only.

    Invariant: `_matched` holds the publishers of this process that it is matched with, each with what it had sent before that.
    """

    received = 0
    dropped = 0
    waiting = 0
    patience = 0.0
    missed = 0

    def __init__(
        self,
        node: Participant,
        entry: TopicRegistry,
        type: ForeignType,
        qos: QoS,
        target_of: Callable[[PublisherPeer], Target],
        sent_by: Callable[[PublisherPeer], int],
        drained: Callable[[PublisherPeer], Wait | None],
        *,
        checks_qos: bool = True,
    ) -> None:
        self.node = node
        self.entry = entry
        self.qos = qos
        self.checks_qos = checks_qos
        self.type: Any = type
        self._target_of = target_of
        self._sent_by = sent_by
        self._drained = drained
        self._matched: dict[PublisherPeer, int] = {}
        self._parted_bytes = 0

    def __repr__(self) -> str:
        return f"<subscription of {self.entry.name} [{self.type.__ros_type__}] in {self.node.fqn}, elsewhere>"

    @property
    def here(self) -> bool:
        return False

    @property
    def carried_bytes(self) -> int:
        """What the publishers of this process have sent while it was matched with them."""
        return self._parted_bytes + sum(self._sent_by(one) - before for one, before in self._matched.items())

    @property
    def full(self) -> bool:
        """Whether so much of a publisher waits to be sent that `Publisher.send` has to wait, too."""
        return any(self._drained(one) is not None for one in self._matched)

    async def room(self) -> None:
        """Wait until what waits has been sent."""
        for drained in filter(None, [self._drained(one) for one in self._matched]):
            await drained()

    def target(self, publisher: PublisherPeer) -> Target:
        """What sends the publisher's messages; it is the same for all subscriptions of other processes."""
        return self._target_of(publisher)

    def notify(self) -> None:
        """Do nothing: its own process finds the publisher, too, and tells it."""

    def count_incompatible_qos(self, policy: str) -> None:
        """Do nothing, for the same reason."""

    def count_incompatible_type(self) -> None:
        """Do nothing, for the same reason."""

    def count_lost(self, messages: int) -> None:
        """Do nothing: losses are counted where they are found, at the receiving end."""

    def join(self, publisher: PublisherPeer) -> None:
        self._matched[publisher] = self._sent_by(publisher)

    def part(self, publisher: PublisherPeer) -> None:
        self._parted_bytes += self._sent_by(publisher) - self._matched.pop(publisher)

    def leave(self) -> tuple[PublisherPeer, ...]:
        publishers, self._matched = tuple(self._matched), {}
        return publishers

    def catch_up(self, publisher: PublisherPeer) -> None:
        """Do nothing: its own process asks for what is kept."""
