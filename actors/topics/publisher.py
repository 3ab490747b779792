"""Publishers: they hand messages to the subscriptions they are matched with, at once and in order.

`Publisher.publish` is synchronous: it calls the target of every matched subscription, in the order in which they subscribed, and returns. It
never waits and never fails because a reader is slow: see `actors.topics.subscription`. A message is a value, so it is passed by reference.

What a publisher promises about time is kept by `actors.topics.timed_publisher`; publishers without such promises pay nothing for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.errors import Ended, WrongThread, WrongType, described
from actors.topics.endpoint import Endpoint
from actors.topics.events import EventStream

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.qos.events import PublisherEvent, PublisherStatus
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, SubscriptionPeer, Target, TopicRegistry

__all__ = ["Publisher"]

M = TypeVar("M", bound="Message")


class _Closed:
    """Stands in for the message type of a publisher that has ended, so that the hot path needs no second check."""


class Publisher(Endpoint, Generic[M]):
    """One node's right to publish on one topic. Call it, or `publish`.

    `count` is the number of messages published so far, `status` what else has happened, `events()` tells it as it happens.

    It has no public constructor: `publishes` and `Node.publisher` give one.
    """

    # Invariants:
    # * `targets` holds the targets of the matched subscriptions, each once and in the order of matching, and then the taps; or, after a change,
    #   only `_publish_anew`, which brings it up to date at the next message. So n changes cost n, and not n times the subscriptions.
    # * `_expects` is the message type while the publisher delivers, and `_Closed` while it is suspended or after its end: then every message
    #   takes the slow way of `_refuse`.
    # * `history` is None exactly for a volatile publisher.

    __slots__ = (
        "_expects", "_outdated", "_thread", "count", "gated", "history", "matched", "suspended", "taps", "targets", "type",
    )  # fmt: skip

    def __init__(self, node: Participant, entry: TopicRegistry, type: type[M], qos: QoS) -> None:
        super().__init__(node, entry, qos)
        self.type = type
        self.count = 0
        self.suspended = False
        self.gated = True
        """Whether a lifecycle node's state counts for this publisher."""
        self.matched: dict[SubscriptionPeer, None] = {}
        """The matched subscriptions, in the order of matching."""
        self.taps: tuple[Callable[[Any], None], ...] = ()
        """Wire taps: see `actors.graph.graph.Graph.tap`."""
        self.targets: tuple[Target, ...] = ()
        """What `publish` calls."""
        self._outdated = False
        self.history: deque[Any] | None = deque(maxlen=qos.limit) if qos.transient_local else None
        """What late joiners get: the last `depth` messages; with KEEP_ALL as many as its limit."""
        self._expects: Any = type
        self._thread = get_ident()

    def __repr__(self) -> str:
        return f"<publisher of {self.entry.name} [{self.type.__name__}] in {self.node.fqn}: {self.count} sent>"

    def publish(self, message: M) -> None:
        """Hand `message` to every matched subscription, in the order in which they subscribed. Never waits.

        Raises `WrongType` for a message of another type, `WrongThread` outside the node's event loop, `Ended` after the
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
                for subscription in self.peers:
                    if subscription.full:
                        await subscription.room()
                        waited = True
                        break
        self.publish(message)

    def assert_liveliness(self) -> None:
        """Say "I am alive" without a message. It counts for liveliness manual_by_topic; publishing says the same.

        Raises `WrongThread` outside the node's event loop, `Ended` after the node's end.
        """
        if get_ident() != self._thread or (self._expects is _Closed and not self.suspended):
            self._refuse(None)

    def alive(self, lease_ns: int | None) -> bool:
        """Whether the publisher has shown within a lease that it lives. One without a lease lives as long as its node."""
        return True

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        """When, in nanoseconds and after `now`, silence ends that; None for never."""
        return None

    @property
    def peers(self) -> tuple[SubscriptionPeer, ...]:
        """The matched subscriptions as they are now, in the order of matching."""
        return tuple(self.matched)

    @property
    def subscription_count(self) -> int:
        """How many subscriptions receive what is published here."""
        return len(self.matched)

    @property
    def status(self) -> PublisherStatus:
        """What this publisher has met so far, in totals: see `actors.qos.events`."""
        from actors.qos.events import PublisherStatus

        kept = self.kept_events
        if kept is None:
            return PublisherStatus(matched=len(self.matched), matched_total=self.matched_total)
        return PublisherStatus(
            matched=len(self.matched),
            matched_total=self.matched_total,
            deadline_missed=kept.missed(),
            liveliness_lost=kept.lost(),
            incompatible_qos=kept.incompatible_qos,
            last_policy_kind=kept.last_policy,
            incompatible_type=kept.incompatible_type,
        )

    def events(self) -> EventStream[PublisherEvent]:
        """The QoS events of this publisher from now on: ``async for event in publisher.events()``."""
        return EventStream(self)

    def due(self, now: int) -> int | None:
        return None

    # -- the publisher's place in the graph ---------------------------------------------------------------------------------

    def join(self, subscription: SubscriptionPeer) -> None:
        """Begin to deliver to a matched subscription."""
        self.matched[subscription] = None
        self.matched_total += 1
        self._outdate()
        self.notify()

    def part(self, subscription: SubscriptionPeer) -> None:
        """Deliver no more to a subscription that leaves, if it was matched."""
        if subscription in self.matched:
            del self.matched[subscription]
            self._outdate()
            self.notify()

    def leave(self) -> tuple[SubscriptionPeer, ...]:
        """Deliver to nobody any more. Returns the subscriptions that were matched until now."""
        peers, self.matched, self.targets, self._outdated = self.peers, {}, (), False
        return peers

    def add_tap(self, tap: Callable[[Any], None]) -> None:
        """Hand every message to `tap` as well, for good."""
        self.taps += (tap,)
        self._outdate()

    def _outdate(self) -> None:
        if not self._outdated:
            self._outdated = True
            self.targets = (self._publish_anew,)

    def _publish_anew(self, message: M) -> None:
        """Stands for the targets while they are out of date: bring them up to date and call them."""
        self._outdated = False
        targets = dict.fromkeys(self.entry.target(self, peer) for peer in self.peers)  # peers may share a target
        self.targets = both = (*targets, *self.taps)
        for deliver in both:
            deliver(message)

    @property
    def latched(self) -> list[M]:
        """What late joiners would get now, oldest first; empty for a volatile publisher."""
        return list(self.history or ())

    def replay(self, target: Target, depth: int) -> None:
        """Hand what is latched to `target`, oldest first and at most the newest `depth`."""
        for message in self.latched[-depth:]:
            target(message)

    # -- the publisher's life -----------------------------------------------------------------------------------------------

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
            raise Ended(f"{self.node.fqn} has ended: it can no longer publish on {self.entry.name}")
