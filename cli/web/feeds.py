"""The topics that clients read: one subscription for all clients of a topic, whose messages are encoded once for all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from actors import Topic
from actors.bag.capture import fitting
from actors.interfaces import encode

if TYPE_CHECKING:
    from actors import Node, QoS, Stream, System
    from actors.interfaces import Message

__all__ = ["Arrival", "Feed", "Feeds", "Taker"]

T = TypeVar("T")


class Arrival:
    """A message that has arrived. Each of its encodings is made once."""

    __slots__ = ("_encodings", "at_ns", "message")

    def __init__(self, message: Message, at_ns: int) -> None:
        self.message = message
        self.at_ns = at_ns
        """When it arrived, in nanoseconds since 1970 on the system's clock."""
        self._encodings: dict[Callable[[Any], Any], Any] = {}

    def encoded(self, encoding: Callable[[Message], T]) -> T:
        """What `encoding` makes of the message."""
        made = self._encodings.get(encoding)
        if made is None:
            made = self._encodings[encoding] = encoding(self.message)
        found: T = made
        return found

    @property
    def cdr(self) -> bytes:
        """The message in CDR."""
        return self.encoded(encode)


Taker: TypeAlias = "Callable[[Arrival], None]"
"""Called with each message. It must not raise."""


class Feed:
    """One subscription of the server, whose quality of service fits all publishers that are there.

    Invariants: `takers` are called in the order in which they came. While there is one, `_stream` is a subscription that fits.
    """

    def __init__(self, node: Node, system: System, topic: str, kind: type[Message]) -> None:
        self._node = node
        self._clock = system.clock
        self._graph = system.graph
        self.topic = topic
        self.kind = kind
        self.takers: dict[Taker, None] = {}
        self._qos = self._fitting()
        self._stream = self._subscribed()

    @property
    def latched(self) -> bool:
        """Whether a new subscription gets earlier messages."""
        return self._qos.transient_local

    @property
    def dropped(self) -> int:
        """The messages that were lost before they got here."""
        return self._stream.dropped

    def refit(self) -> None:
        """Subscribe anew if the publishers have changed so that another quality of service fits them."""
        qos = self._fitting()
        if qos != self._qos:
            self._qos = qos
            self._stream.close()
            self._stream = self._subscribed()

    def close(self) -> None:
        """Unsubscribe."""
        self._stream.close()

    def _fitting(self) -> QoS:
        entry = self._graph.topics.get(self.topic)
        names = self.kind.__ros_type__
        return fitting(
            [one.qos for one in entry.publishers if one.type.__ros_type__ == names] if entry is not None else []
        )

    def _subscribed(self) -> Stream[Any]:
        stream = self._node.subscribe(Topic(self.kind, self.topic), qos=self._qos)
        self._node.spawn(self._pass_on(stream), name=f"web feed of {self.topic}")
        return stream

    async def _pass_on(self, stream: Stream[Any]) -> None:
        async for message in stream:
            arrival = Arrival(message, self._clock.wall_ns())
            for take in tuple(self.takers):
                take(arrival)


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
            key = (feed.topic, feed.kind.__ros_type__)
            self._feeds[key].remove(feed)
            if not self._feeds[key]:
                del self._feeds[key]
