"""What one rosbridge client reads."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.interfaces import CdrError, Message
from cli.web.clients.conversion import to_json, write_json
from cli.web.clients.errors import Refused
from cli.web.clients.fields import optional_number, text
from cli.web.clients.names import absolute, interface
from cli.web.clients.outbox import DEPTH, Packet
from cli.web.rosbridge.cbor import cbor, cbor_joined, cbor_message
from cli.web.rosbridge.fragments import fragments_of
from cli.web.rosbridge.png import png_text

if TYPE_CHECKING:
    from cli.web.clients.client import Client, Session
    from cli.web.graph.feeds import Outgoing
    from cli.web.hub import Hub

COMPRESSIONS: Final = ("none", "png", "cbor", "cbor-raw")
MOST: Final = 1024
"""Subscriptions of one client."""
NANOSECONDS: Final = 10**9


class _Wish(NamedTuple):
    """How a client wants the messages of a topic."""

    throttle: float
    """The least seconds between two messages."""
    queue: int
    """How many messages wait for their time, and for the client; 0: the last that fit."""
    fragment: int | None
    compression: str

    @classmethod
    def all_of(cls, wishes: list[_Wish]) -> _Wish:
        """What serves several wishes for one topic: the shortest pause and the smallest queue and fragments; the densest form."""
        return cls(
            min(wish.throttle for wish in wishes),
            min(wish.queue for wish in wishes),
            min((wish.fragment for wish in wishes if wish.fragment is not None), default=None),
            max((wish.compression for wish in wishes), key=COMPRESSIONS.index),
        )


class _Reading:
    """One topic that a client reads, for one or several of its ids.

    Invariants: messages leave at least `throttle` seconds apart; while `timer` is set or a picture is made, messages wait in `waiting` for
    that, the newest `queue` of them. Without a queue, those that come too early are dropped.
    """

    def __init__(self, client: Client, session: Session, topic: str, wish: _Wish) -> None:
        self._client = client
        self._session = session
        self._topic = topic
        self._last = -math.inf
        """When the last message was sent, on the loop's clock."""
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[Outgoing] = deque()
        self._timer: asyncio.TimerHandle | None = None
        self._drawing = False
        """Whether a thread makes the picture of a message."""
        self.ids: dict[Any, _Wish] = {}
        self.wish = wish
        self.end: Callable[[], None] | None = None

    def take(self, message: Outgoing) -> None:
        """Send a message now, later, or not at all."""
        now = self._loop.time()
        if self._timer is None and not self._drawing and now >= self._next:
            self._send(message, now)
            return
        if self.wish.queue == 0:
            self._client.outbox.dropped += 1
            return
        while len(self._waiting) >= self.wish.queue:
            self._waiting.popleft()
            self._client.outbox.dropped += 1
        self._waiting.append(message)
        self._wait()

    def close(self) -> None:
        """Send nothing any more."""
        if self.end is not None:
            self.end()
            self.end = None
        self._waiting.clear()
        if self._timer is not None:
            self._timer.cancel()
        self._client.outbox.forget(self._topic)

    @property
    def _next(self) -> float:
        return self._last + self.wish.throttle

    def _due(self) -> None:
        self._timer = None
        self._send(self._waiting.popleft(), self._loop.time())
        self._wait()

    def _wait(self) -> None:
        if self._waiting and self._timer is None and not self._drawing:
            self._timer = self._loop.call_at(self._next, self._due)

    def _send(self, message: Outgoing, now: float) -> None:
        self._last = now
        try:
            if self.wish.compression == "png":
                self._draw(_json(self._topic, message))
            else:
                self._offer(_packet(self._topic, message, self.wish))
        except CdrError as error:
            self._client.lose(self._topic, error)
        except Refused:  # the client has too many requests under way
            self._client.outbox.dropped += 1

    def _offer(self, packet: Packet) -> None:
        self._client.outbox.offer(self._topic, packet, min(self.wish.queue or DEPTH, DEPTH))

    def _draw(self, whole: str) -> None:
        """Send a text as a picture. It is made in a thread: that of a camera's picture takes 0.1 s."""

        async def drawn() -> None:
            try:
                picture = await asyncio.to_thread(_picture, whole)
                if self.end is not None:
                    self._offer(_cut(picture, self.wish.fragment))
            finally:
                self._drawing = False
                self._wait()

        self._client.spawn(drawn(), self._session)
        self._drawing = True


class Subscriptions:
    """The topics that one client reads.

    Invariant: a topic is read once, however many ids the client has for it, as all of their wishes together have it.
    """

    def __init__(self, hub: Hub, client: Client, session: Session) -> None:
        self._hub = hub
        self._client = client
        self._session = session
        self._readings: dict[str, _Reading] = {}

    async def subscribe(self, request: dict[str, Any]) -> None:
        """Read a topic, for one id of the client. Raises `Refused`."""
        topic, wish = absolute(text(request, "topic")), _wish_of(request)
        reading = self._readings.get(topic)
        if reading is None:
            if len(self._readings) >= MOST:
                raise Refused(f"a client reads at most {MOST} topics")
            kind = await self._type(topic, request)
            reading = self._readings[topic] = _Reading(self._client, self._session, topic, wish)
            reading.ids[_id_of(request)] = wish
            reading.end = self._hub.feeds.open(topic, kind, reading.take)
            return
        if len(reading.ids) >= MOST:
            raise Refused(f"a client has at most {MOST} ids for a topic")
        reading.ids[_id_of(request)] = wish
        reading.wish = _Wish.all_of(list(reading.ids.values()))

    def unsubscribe(self, request: dict[str, Any]) -> None:
        """Read a topic no more for one id, or for all of them if none is named."""
        topic = absolute(text(request, "topic"))
        reading = self._readings.get(topic)
        if reading is None:
            raise Refused(f"{topic} is not subscribed")
        if request.get("id") is not None:
            reading.ids.pop(_id_of(request), None)
        else:
            reading.ids.clear()
        if reading.ids:
            reading.wish = _Wish.all_of(list(reading.ids.values()))
        else:
            del self._readings[topic]
            reading.close()

    def close(self) -> None:
        """Read nothing any more."""
        for reading in self._readings.values():
            reading.close()
        self._readings.clear()

    async def _type(self, topic: str, request: dict[str, Any]) -> Any:
        named = text(request, "type", "")
        return await self._hub.types.topic(topic, interface(named, "msg") if named else "")


def _wish_of(request: dict[str, Any]) -> _Wish:
    compression = text(request, "compression", "none") if request.get("compression") is not None else "none"
    if compression not in COMPRESSIONS:
        raise Refused(f"compression {compression!r:.40}: there are {', '.join(COMPRESSIONS)}")
    size = optional_number(request, "fragment_size")
    return _Wish(
        min(optional_number(request, "throttle_rate"), 1e9) / 1000,
        int(min(optional_number(request, "queue_length"), DEPTH)),
        int(min(size, 1e9)) if size else None,
        compression,
    )


def _id_of(request: dict[str, Any]) -> Any:
    id = request.get("id")
    return id if isinstance(id, (str, int, float, type(None))) else str(id)


def _packet(topic: str, message: Outgoing, wish: _Wish) -> Packet:
    if wish.compression == "cbor":
        return cbor_joined({"op": cbor("publish"), "topic": cbor(topic), "msg": message.encoded(_cbor_part)})
    if wish.compression == "cbor-raw":
        seconds, nanoseconds = divmod(message.at_ns, NANOSECONDS)
        raw = {"secs": seconds, "nsecs": nanoseconds, "bytes": message.cdr}
        return cbor({"op": "publish", "topic": topic, "msg": raw})
    return _cut(_json(topic, message), wish.fragment)


def _json(topic: str, message: Outgoing) -> str:
    return f'{{"op":"publish","topic":{write_json(topic)},"msg":{message.encoded(_json_part)}}}'


def _picture(whole: str) -> str:
    return write_json({"op": "png", "data": png_text(whole)})


def _cut(whole: str, size: int | None) -> Packet:
    return whole if size is None else fragments_of(whole, size)


def _json_part(message: Message) -> str:
    return to_json(message).decode()


def _cbor_part(message: Message) -> bytes:
    return cbor(cbor_message(message))
