"""Publishers: they deliver each message to their matched subscriptions immediately and in order.

`Publisher.publish` is synchronous. It calls the target of every matched subscription, in the order in which they were matched, and returns.
It never waits, and a slow reader never makes it fail: see `actors.topics.subscription`. Messages are immutable values and are passed by
reference.

Time limits on messages are the subject of `actors.topics.timed_publisher`; a publisher without them does not read the clock.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, Protocol

from actors.checks import NoPublicConstructor, create
from actors.errors import Ended, WrongThread, WrongType, described
from actors.interfaces.message import M
from actors.topics.endpoint import Endpoint, EventStream

if TYPE_CHECKING:
    from actors.interfaces.cdr import Bytes
    from actors.qos.events import PublisherEvent, PublisherStatus
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, SubscriptionPeer, Target, TopicRegistry


class PublisherOwner(Protocol):
    """Keeps publishers until they are closed."""

    def publisher_closed(self, publisher: Publisher[Any], /) -> None:
        """Forget a publisher that has been closed."""
        ...


class _Closed:
    """Takes the place of the message type in a publisher that must not publish, so that `publish` needs no separate check."""


class Publisher(Endpoint, Generic[M], metaclass=NoPublicConstructor):
    """Publishes messages of one type on one topic for one node. Call it directly, or call `publish`.

    `count` is the number of messages published so far. `status` holds the totals of its QoS events, and `events()` reports them as they
    occur.

    It has no public constructor: `publishes` and `Node.publisher` give one.
    """

    # Invariants:
    # * `targets` holds each target of the matched subscriptions once, in the order of matching, then the other ones of `attached`, then
    #   the taps. After a change it holds only `_publish_anew`, which rebuilds it at the next message: n changes in a row cost n, not n
    #   times the number of subscriptions. After `leave` it is empty.
    # * `_expects` is the message type while messages are delivered, and `_Closed` while the publisher is suspended and after it has ended.
    #   Then no message passes the check in `publish`, and `_refuse` handles all of them.
    # * `history` is None exactly if the publisher is volatile.

    __slots__ = (
        "_expects", "_outdated", "_thread", "attached", "count", "gated", "history", "matched", "on_assert", "owner", "suspended", "taps", "targets",
        "type",
    )  # fmt: skip

    def __init__(self, node: Participant, entry: TopicRegistry, type: type[M], qos: QoS) -> None:
        super().__init__(node, entry, qos)
        self.type = type
        self.count = 0
        self.suspended = False
        self.gated = True
        """Whether the state of a lifecycle node suspends this publisher."""
        self.owner: PublisherOwner | None = None
        """Is told once, when the publisher is closed; None from then on."""
        self.on_assert: Callable[[], object] | None = None
        """Is called with each `assert_liveliness`."""
        self.matched: dict[SubscriptionPeer, None] = {}
        """The matched subscriptions, in the order in which they were matched."""
        self.attached: tuple[Target, ...] = ()
        """The targets without a subscription; see `attach`."""
        self.taps: tuple[Target, ...] = ()
        """The wire taps; see `actors.graph.graph.Graph.tap`."""
        self.targets: tuple[Target, ...] = ()
        """The functions that `publish` calls with each message."""
        self._outdated = False
        self.history: deque[Any] | None = deque(maxlen=qos.limit) if qos.transient_local else None
        """The messages kept for late joiners: the last `depth`, or with KEEP_ALL as many as its limit."""
        self._expects: Any = type
        self._thread = get_ident()

    def __repr__(self) -> str:
        return f"<publisher of {self.entry.name} [{self.type.__name__}] in {self.node.fqn}: {self.count} sent>"

    def publish(self, message: M) -> None:
        """Deliver `message` to every matched subscription, in the order in which they were matched. Never waits.

        Raises `WrongType` for a message of another type, `WrongThread` outside the node's event loop, and `Ended` after the node has ended.
        While a lifecycle node is inactive, its messages are discarded silently.
        """
        # Called for every message of the system, so it does the least possible: one identity check covers the message type, a suspended and
        # an ended publisher; a subscription's queue, deadline and wrapping are hidden behind its target; no object is allocated.
        if message.__class__ is not self._expects or get_ident() != self._thread:
            self._refuse(message)
            return
        self.count += 1
        if self.history is not None:
            self.history.append(message)
        for deliver in self.targets:
            deliver(message)

    __call__ = publish

    def publish_serialized(self, data: Bytes) -> None:
        """Publish the message that these bytes hold in CDR. Raises `CdrError` if they hold none of the type, and what `publish` raises."""
        from actors.interfaces.cdr import decode

        self.publish(decode(self.type, data))

    async def send(self, message: M) -> None:
        """Publish after every reliable KEEP_ALL subscription has room: back-pressure instead of loss.

        A best-effort publisher or subscription never causes a wait. Raises what `publish` raises, before any wait.
        """
        if message.__class__ is not self._expects or get_ident() != self._thread:
            self._refuse(message)
            return
        if self.qos.reliable:
            waited = True
            while waited:  # another subscription may have filled up during the wait
                waited = False
                for subscription in self.peers:
                    if subscription.full:
                        await subscription.room()
                        waited = True
                        break
        self.publish(message)

    def assert_liveliness(self) -> None:
        """Show that the publisher is alive without publishing a message. It renews a manual_by_topic lease, as publishing does.

        Raises `WrongThread` outside the node's event loop and `Ended` after the node has ended.
        """
        if get_ident() != self._thread or (self._expects is _Closed and not self.suspended):
            self._refuse(None)
        if self.on_assert is not None:
            self.on_assert()

    def alive(self, lease_ns: int | None) -> bool:
        """Whether the publisher has shown a sign of life within the lease. Without a lease it is alive as long as its node."""
        return True

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        """The time, in nanoseconds and later than `now`, at which `alive` becomes false without a sign of life; None for never."""
        return None

    @property
    def peers(self) -> tuple[SubscriptionPeer, ...]:
        """The subscriptions matched now, in the order in which they were matched."""
        return tuple(self.matched)

    @property
    def subscription_count(self) -> int:
        """The number of subscriptions matched with this publisher."""
        return len(self.matched)

    @property
    def status(self) -> PublisherStatus:
        """The running totals of this publisher's QoS events; see `actors.qos.events`."""
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
        return create(EventStream, self)  # pyright: ignore[reportUnknownVariableType]

    def due(self, now: int) -> int | None:
        return None

    # -- the publisher's place in the graph ---------------------------------------------------------------------------------

    def join(self, subscription: SubscriptionPeer) -> None:
        """Match `subscription`: deliver to it from the next message on."""
        self.matched[subscription] = None
        self.matched_total += 1
        self._outdate()
        self.notify()

    def part(self, subscription: SubscriptionPeer) -> None:
        """Undo `join`. Does nothing if `subscription` is not matched."""
        if subscription in self.matched:
            del self.matched[subscription]
            self._outdate()
            self.notify()

    def leave(self) -> tuple[SubscriptionPeer, ...]:
        """Part with all matched subscriptions and return them. Their own side of each match is left to the caller."""
        peers, self.matched, self.attached, self.targets, self._outdated = self.peers, {}, (), (), False
        return peers

    def add_tap(self, tap: Target) -> None:
        """Call `tap` with every message from now on, for as long as the publisher lives."""
        self.taps += (tap,)
        self._outdate()

    def attach(self, target: Target) -> None:
        """Call `target` with every message from now on, until `detach`, also without a subscription that has this target."""
        self.attached = (*self.attached, target)
        self._outdate()

    def detach(self, target: Target) -> None:
        """Undo `attach`. Does nothing if `target` is not attached."""
        self.attached = tuple(other for other in self.attached if other != target)
        self._outdate()

    def _outdate(self) -> None:
        if not self._outdated:
            self._outdated = True
            self.targets = (self._publish_anew,)

    def _publish_anew(self, message: M) -> None:
        """Rebuild `targets`, which is out of date, and call them. It takes their place until the next message."""
        self._outdated = False
        targets = dict.fromkeys(self.entry.target(self, peer) for peer in self.peers)  # peers may share a target
        targets.update(dict.fromkeys(self.attached))
        self.targets = both = self.entry.outward(self, (*targets, *self.taps))
        for deliver in both:
            deliver(message)

    @property
    def arrival(self) -> None:
        """None: what this publisher delivers comes from this process."""
        return None

    @property
    def latched(self) -> list[M]:
        """The messages kept for late joiners, oldest first; empty for a volatile publisher."""
        return list(self.history or ())

    def replay(self, target: Target, depth: int) -> None:
        """Call `target` with the messages kept for late joiners, oldest first and at most the newest `depth`."""
        for message in self.latched[-depth:]:
            target(message)

    # -- the publisher's life -----------------------------------------------------------------------------------------------

    def suspend(self) -> None:
        """Discard what is published from now on, because a lifecycle node is inactive."""
        self.suspended = True
        self._expects = _Closed

    def resume(self) -> None:
        """Publish again after `suspend`. A closed publisher stays closed."""
        if self.suspended:
            self.suspended = False
            self._expects = self.type

    def close(self) -> None:
        """Leave the topic and discard the messages kept for late joiners. Closing twice is harmless."""
        self.suspended = False
        self._expects = _Closed
        self.end_events()
        self.entry.remove_publisher(self)
        owner, self.owner = self.owner, None
        if owner is not None:
            owner.publisher_closed(self)

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
            raise Ended(
                f"{self.node.fqn} can no longer publish on {self.entry.name}: this publisher was closed, or its node has ended"
            )
