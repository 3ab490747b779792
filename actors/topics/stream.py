"""Subscriptions to iterate: ``async for message in node.subscribe(TOPIC)``."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import get_ident
from typing import TYPE_CHECKING, Generic, TypeVar, cast

from actors.errors import CallTimeout, NotStarted
from actors.inbox.expiring import ExpiringMessage
from actors.time.deadlines import check_timeout
from actors.topics.channel import Subscription
from actors.topics.endpoint import EventStream, close_forgotten

if TYPE_CHECKING:
    from actors.graph.graph import Participant, TopicEntry
    from actors.interfaces.message import Message
    from actors.qos.events import SubscriptionEvent, SubscriptionStatus
    from actors.qos.policies import QoS

__all__ = ["Stream", "StreamSubscription"]

M = TypeVar("M", bound="Message")


class StreamSubscription(Subscription[M]):
    """The queue behind a `Stream`."""

    __slots__ = ("closed", "latest", "on_close", "waiter")

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> None:
        super().__init__(node, entry, type, qos)
        self.latest: M | None = None
        self.waiter: asyncio.Future[None] | None = None
        self.on_close: Callable[[StreamSubscription[M]], None] | None = None
        self.closed = False

    def deliver(self, message: M) -> None:
        self.received += 1
        self.latest = message
        if len(self.messages) >= self.depth:
            self._overflow(message)
            return
        self.messages.append(message)
        waiter = self.waiter
        if waiter is not None and not waiter.done():
            waiter.set_result(None)

    def aging(self, aged: ExpiringMessage[M]) -> M:
        self.attended = True
        return cast("M", aged)

    def close(self) -> None:
        if self.closed:
            return
        self.closed = True
        super().close()
        if self.on_close is not None:
            self.on_close(self)
        if self.waiter is not None and not self.waiter.done():
            self.waiter.set_result(None)


class Stream(Generic[M]):
    """A subscription to iterate: ``async for message in node.subscribe(TOPIC)``.

    Listening starts when the stream is made. It ends (and the subscription leaves the topic) with `close()`, with the end of an
    ``async with`` block, when nobody refers to the stream any more, and with its node; then iteration stops. At most one task may wait on it.

    It has no public constructor: `subscribes` and `Node.subscribe` give one.
    """

    __slots__ = ("_loop", "_queue", "_thread")

    def __init__(self, queue: StreamSubscription[M], loop: asyncio.AbstractEventLoop | None = None) -> None:
        self._loop = loop or asyncio.get_running_loop()
        self._thread = get_ident()
        self._queue = queue

    def __repr__(self) -> str:
        queue = self._queue
        state = "closed" if queue.closed else f"{len(queue.messages)} waiting, {queue.dropped} dropped"
        return f"<stream of {queue.entry.name} [{queue.type.__name__}]: {state}>"

    @property
    def latest(self) -> M | None:
        """The newest message that arrived, taken out or not; None before the first, and when its lifespan is over."""
        latest = self._queue.latest
        if isinstance(latest, ExpiringMessage):
            return cast("ExpiringMessage[M]", latest).message if latest.fresh else None
        return latest

    @property
    def received(self) -> int:
        """How many messages arrived so far."""
        return self._queue.received

    @property
    def dropped(self) -> int:
        """How many messages were lost because this reader was slower than its depth allows."""
        return self._queue.dropped

    @property
    def publisher_count(self) -> int:
        """How many publishers this stream receives from."""
        return self._queue.publisher_count

    @property
    def status(self) -> SubscriptionStatus:
        """What this subscription has met so far, in totals: see `actors.qos.events`."""
        return self._queue.status

    def events(self) -> EventStream[SubscriptionEvent]:
        """The QoS events of this subscription from now on: ``async for event in stream.events()``."""
        return EventStream(self._queue, kept=self)

    def __aiter__(self) -> Stream[M]:
        return self

    async def __anext__(self) -> M:
        queue = self._queue
        while True:
            while not queue.messages:
                if queue.closed:
                    raise StopAsyncIteration
                await self._arrival(queue)
            message = queue.messages.popleft()
            if not queue.attended:
                return message
            if (fresh := queue.taken(message)) is not None:
                return fresh

    async def next(self, timeout: float | None = None) -> M:
        """The next message. Raises `CallTimeout` after `timeout` seconds without one, `NotStarted` once the stream has ended."""
        if timeout is not None:
            check_timeout(f"the stream of {self._queue.entry.name}", timeout)
        try:
            async with asyncio.timeout(timeout):
                return await self.__anext__()
        except StopAsyncIteration:
            raise NotStarted(f"the stream of {self._queue.entry.name} has ended: subscribe again") from None
        except TimeoutError:
            raise CallTimeout(
                f"no message on {self._queue.entry.name} within {timeout} s "
                f"({self.publisher_count} matching publishers in this system)"
            ) from None

    def close(self) -> None:
        """Stop listening. Messages that wait can still be taken out."""
        self._queue.close()

    async def __aenter__(self) -> Stream[M]:
        return self

    async def __aexit__(self, *exc: object) -> None:
        self.close()

    def __del__(self) -> None:
        queue = getattr(self, "_queue", None)
        if queue is not None and not queue.closed:
            close_forgotten(self._loop, self._thread, queue.close)

    async def _arrival(self, queue: StreamSubscription[M]) -> None:
        if queue.waiter is not None:
            raise RuntimeError(f"two tasks wait on one stream of {queue.entry.name}: give each its own subscribe()")
        queue.waiter = asyncio.get_running_loop().create_future()
        try:
            await queue.waiter
        finally:
            queue.waiter = None
