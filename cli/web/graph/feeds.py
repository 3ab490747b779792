"""The topics that clients read: one subscription for all clients of a topic, whose messages are encoded once for all of them.

What has come from another process is passed on in CDR as it has come: it is decoded only for clients that read no CDR, and never encoded again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from actors.bag.capture import Capture, fitting
from actors.bag.ring import Channel
from actors.runtime.incarnation import incarnation_of
from actors.topics.lazy_message import LazyMessage
from actors.transport.protocol import PATIENCE

if TYPE_CHECKING:
    from actors import Node, QoS, System
    from actors.interfaces import Message
    from actors.topics.peers import PublisherPeer

T = TypeVar("T")


class Outgoing:
    """A message for clients. Each of its encodings is made once, when the first of them needs it."""

    __slots__ = ("_arrival", "_encodings", "at_ns")

    def __init__(self, arrival: LazyMessage, at_ns: int) -> None:
        self._arrival = arrival
        self.at_ns = at_ns
        """When it arrived, in nanoseconds since 1970 on the system's clock."""
        self._encodings: dict[Callable[[Any], Any], Any] | None = None

    def encoded(self, encoding: Callable[[Message], T]) -> T:
        """What `encoding` makes of the message. Raises `CdrError` if what another process has sent is none."""
        if self._encodings is None:
            self._encodings = {}
        made = self._encodings.get(encoding)
        if made is None:
            made = self._encodings[encoding] = encoding(self._arrival.message)
        found: T = made
        return found

    @property
    def cdr(self) -> bytes:
        """The message in CDR. Raises `CdrError` for one of this process that cannot be encoded."""
        return self._arrival.cdr


Taker: TypeAlias = "Callable[[Outgoing], None]"
"""Called with each message. It must not raise."""


class Feed:
    """One subscription of the server, whose quality of service fits all publishers that are there.

    Invariants: `takers` are called in the order in which they came, and with messages in theirs. A message of this process is passed on in
    the turn of the loop after that in which it was published, so that nothing that they do happens to its publisher. While there is a taker,
    `_capture` is a subscription that fits.
    """

    def __init__(self, node: Node, system: System, topic: str, kind: type[Message]) -> None:
        self._life = incarnation_of(node)
        self._clock = system.clock
        self._loop = system.loop
        self._entry = system.graph.topic(topic)
        self._channel = Channel(topic, kind)
        self._new: list[Outgoing] = []
        self._publishers: list[PublisherPeer] = []
        self.takers: dict[Taker, None] = {}
        self._qos = self._fitting()
        self._capture = self._subscribed()

    @property
    def key(self) -> tuple[str, str]:
        """Topic and type."""
        return self._channel.topic, self._channel.type.__ros_type__

    @property
    def latched(self) -> bool:
        """Whether a new subscription gets earlier messages."""
        return self._qos.transient_local

    @property
    def dropped(self) -> int:
        """The messages that were lost before they got here."""
        return self._capture.dropped

    def refit(self) -> None:
        """Resubscribe if the publishers have changed so that another quality of service fits them."""
        if self._publishers == self._entry.publishers:
            return
        qos = self._fitting()
        if qos != self._qos:
            self._qos = qos
            self._capture.close()
            self._capture = self._subscribed()

    def close(self) -> None:
        """Unsubscribe."""
        self._capture.close()

    def _fitting(self) -> QoS:
        name = self._channel.type.__ros_type__
        self._publishers = self._entry.publishers
        return fitting([one.qos for one in self._publishers if one.type.__ros_type__ == name])

    def _subscribed(self) -> Capture:
        return Capture(self._life, self._entry, self._channel, self._qos, self._take, patience=PATIENCE)

    def _take(self, channel: Channel, publisher: PublisherPeer, arrival: LazyMessage) -> None:
        # Called while the message is published, or when it has come from another process.
        clock, since = self._clock, arrival.since
        at_ns = clock.wall_ns() if since is None else clock.wall_ns_at(since - clock.origin)
        self._new.append(Outgoing(arrival, at_ns))
        if arrival.sent_ns is not None:
            self._pass_on()
        elif len(self._new) == 1:
            self._loop.call_soon(self._pass_on)

    def _pass_on(self) -> None:
        new, self._new = self._new, []
        for message in new:
            for take in tuple(self.takers):
                take(message)


class Feeds:
    """All topics that clients read.

    Invariant: each feed has a taker. Topics whose publishers keep messages for late subscriptions have a feed for each taker, so that the
    graph itself gives each of them what is kept; all others have one feed.
    """

    def __init__(self, node: Node, system: System) -> None:
        self._node = node
        self._system = system
        self._feeds: dict[tuple[str, str], list[Feed]] = {}

    @property
    def dropped(self) -> int:
        """The messages that were lost before they got here."""
        return sum(feed.dropped for feed in self._each())

    def open(self, topic: str, kind: type[Message], take: Taker) -> Callable[[], None]:
        """Call `take` with every message of a topic from now on. The returned function ends that; calling it twice is harmless."""
        feeds = self._feeds.setdefault((topic, kind.__ros_type__), [])
        feed = next((one for one in feeds if not one.latched), None)
        if feed is None:
            feed = Feed(self._node, self._system, topic, kind)
            feeds.append(feed)
        feed.takers[take] = None
        return lambda: self._close(feed, take)

    def refit(self) -> None:
        """Fit all subscriptions to the present publishers."""
        for feed in self._each():
            feed.refit()

    def _each(self) -> Iterable[Feed]:
        return [feed for feeds in self._feeds.values() for feed in feeds]

    def _close(self, feed: Feed, take: Taker) -> None:
        if take not in feed.takers:
            return
        del feed.takers[take]
        if not feed.takers:
            feed.close()
            self._feeds[feed.key].remove(feed)
            if not self._feeds[feed.key]:
                del self._feeds[feed.key]
