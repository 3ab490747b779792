"""Streams: subscriptions that a task iterates over, as in ``async for message in node.subscribe(TOPIC)``."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable
from threading import get_ident
from typing import TYPE_CHECKING, Generic, cast

from actors.checks import NoPublicConstructor, create
from actors.errors import CallTimeout, Ended
from actors.inbox.expiring import ExpiringMessage
from actors.interfaces.message import M
from actors.time.deadlines import check_timeout
from actors.topics.endpoint import EventStream, close_forgotten
from actors.topics.subscription import Subscription
from actors.waiting import wake

if TYPE_CHECKING:
    from actors.contracts.content_filter import ContentFilter
    from actors.qos.events import SubscriptionEvent, SubscriptionStatus
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, TopicRegistry


class StreamSubscription(Subscription[M]):
    """The subscription behind a `Stream`. It calls `on_close` once, when it is closed."""

    # Invariants:
    # * `reader` is the future that the iterating task waits for; None while it does not wait.
    # * Once `closed`, it has left the topic and is matched with no publisher. Messages that wait can still be taken out.

    __slots__ = ("_on_close", "closed", "latest", "reader")

    def __init__(
        self,
        node: Participant,
        entry: TopicRegistry,
        type: type[M],
        qos: QoS,
        on_close: Callable[[StreamSubscription[M]], None] | None = None,
        filter: ContentFilter | None = None,
        patience: float = 0.0,
    ) -> None:
        super().__init__(node, entry, type, qos, patience, filter)
        self.latest: M | None = None
        self.reader: asyncio.Future[None] | None = None
        self.closed = False
        self._on_close = on_close

    def deliver(self, message: M) -> None:
        self.received += 1
        self.latest = message
        if len(self.messages) >= self.depth:
            self._overflow(message)
            return
        self.messages.append(message)
        reader = self.reader
        # `actors.waiting.wake`, inlined: this runs for every message.
        if reader is not None and not reader.done():
            reader.set_result(None)

    def wrapped(self, expiring: ExpiringMessage[M]) -> M:
        self.must_unwrap = True
        return cast("M", expiring)

    def close(self) -> None:
        if self.closed:
            return
        self.closed = True
        super().close()
        if self._on_close is not None:
            self._on_close(self)
        if self.reader is not None:
            wake(self.reader, None)


class Stream(Generic[M], metaclass=NoPublicConstructor):
    """A subscription as an async iterator: ``async for message in node.subscribe(TOPIC)``.

    It receives messages from the moment it is created. Iteration stops, and the subscription leaves the topic, with `close()`, at the end
    of an ``async with`` block, when the node ends, or when the stream is no longer referenced. At most one task may wait on it.

    It has no public constructor: `subscribes` and `Node.subscribe` give one.
    """

    __slots__ = ("_loop", "_subscription", "_thread")

    def __init__(self, subscription: StreamSubscription[M], loop: asyncio.AbstractEventLoop | None = None) -> None:
        self._loop = loop or asyncio.get_running_loop()
        self._thread = get_ident()
        self._subscription = subscription

    def __repr__(self) -> str:
        behind = self._subscription
        state = "closed" if behind.closed else f"{len(behind.messages)} waiting, {behind.dropped} dropped"
        return f"<stream of {behind.entry.name} [{behind.type.__name__}]: {state}>"

    @property
    def latest(self) -> M | None:
        """The newest message received, even if it has been taken out; None before the first message and after its lifespan has passed."""
        latest = self._subscription.latest
        if isinstance(latest, ExpiringMessage):
            return cast("ExpiringMessage[M]", latest).message if latest.fresh else None
        return latest

    @property
    def received(self) -> int:
        """The number of messages received so far."""
        return self._subscription.received

    @property
    def dropped(self) -> int:
        """The number of messages lost because the reader was slower than the depth allows."""
        return self._subscription.dropped

    @property
    def publisher_count(self) -> int:
        """The number of publishers matched with this stream."""
        return self._subscription.publisher_count

    @property
    def status(self) -> SubscriptionStatus:
        """The running totals of this subscription's QoS events; see `actors.qos.events`."""
        return self._subscription.status

    def events(self) -> EventStream[SubscriptionEvent]:
        """The QoS events of this subscription from now on: ``async for event in stream.events()``."""
        return create(EventStream, self._subscription, kept=self)  # pyright: ignore[reportUnknownVariableType]

    def __aiter__(self) -> Stream[M]:
        return self

    async def __anext__(self) -> M:
        subscription = self._subscription
        while True:
            while not subscription.messages:
                if subscription.closed:
                    raise StopAsyncIteration
                await self._arrival(subscription)
            message = subscription.messages.popleft()
            if not subscription.must_unwrap:
                return message
            if (fresh := subscription.unwrap(message)) is not None:
                return fresh

    async def next(self, timeout: float | None = None) -> M:
        """The next message. Raises `CallTimeout` after `timeout` seconds without one, `Ended` once the stream has ended."""
        if timeout is not None:
            check_timeout(f"the stream of {self._subscription.entry.name}", timeout)
        try:
            async with asyncio.timeout(timeout):
                return await self.__anext__()
        except StopAsyncIteration:
            raise Ended(f"the stream of {self._subscription.entry.name} has ended: subscribe again") from None
        except TimeoutError:
            raise CallTimeout(
                f"no message on {self._subscription.entry.name} within {timeout} s "
                f"({self.publisher_count} matching publishers in this system){self._subscription.entry.meant()}"
            ) from None

    async def serialized(self) -> AsyncGenerator[bytes, None]:
        """The messages from now on as `encode` writes them, in CDR: ``async for data in stream.serialized()``."""
        from actors.interfaces.cdr import encode

        async for message in self:
            yield encode(message)

    def close(self) -> None:
        """Leave the topic. Messages that wait can still be taken out. Closing twice is harmless."""
        self._subscription.close()

    async def __aenter__(self) -> Stream[M]:
        return self

    async def __aexit__(self, *exc: object) -> None:
        self.close()

    def __del__(self) -> None:
        subscription = getattr(self, "_subscription", None)
        if subscription is not None and not subscription.closed:
            close_forgotten(self._loop, self._thread, subscription.close)

    async def _arrival(self, subscription: StreamSubscription[M]) -> None:
        if subscription.reader is not None:
            raise RuntimeError(
                f"two tasks wait on one stream of {subscription.entry.name}: give each its own subscribe()"
            )
        subscription.reader = asyncio.get_running_loop().create_future()
        try:
            await subscription.reader
        finally:
            subscription.reader = None
