"""Topics at work: publishers hand messages to subscription queues, at once and in order.

`Publisher.publish` is synchronous: it puts the message into the queue of every matched subscription, in the order in which they
subscribed, and returns. It never waits and never fails because a reader is slow: KEEP_LAST queues drop their oldest and count it.
A message is a value, so it is passed by reference.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from actors.errors import CallTimeout, NotStarted, WrongThread, WrongType, described
from actors.inbox import Inbox

if TYPE_CHECKING:
    from actors.graph import Participant, TopicEntry
    from actors.interfaces.message import Message
    from actors.qos import QoS

__all__ = ["ConcurrentFeed", "Feed", "Publisher", "Queue", "Stream", "Subscription"]

M = TypeVar("M", bound="Message")


class _Closed:
    """Stands in for the message type of a publisher that has ended, so that the hot path needs no second check."""


class Publisher(Generic[M]):
    """One node's right to publish on one topic. Call it, or `publish`.

    `count` is the number of messages published so far.
    """

    __slots__ = (
        "_expects",
        "_thread",
        "count",
        "entry",
        "gated",
        "history",
        "node",
        "qos",
        "suspended",
        "targets",
        "type",
    )

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> None:
        self.node = node
        self.entry = entry
        self.type = type
        self.qos = qos
        self.count = 0
        self.suspended = False
        self.gated = True
        """Whether a lifecycle node's state counts for this publisher."""
        self.targets: tuple[Callable[[M], None], ...] = ()
        self.history: deque[M] | None = (
            deque(maxlen=None if qos.keep_all else qos.depth) if qos.transient_local else None
        )
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
        """Publish, but first wait until every KEEP_ALL subscription has room: back-pressure instead of loss.

        Raises what `publish` raises, and what is wrong with the message before it waits.
        """
        if message.__class__ is not self._expects:
            self._refuse(message)
            return
        while True:
            for queue in self.entry.matched(self):
                if queue.keep_all and len(queue.messages) >= queue.depth:
                    await queue.room()
                    break
            else:
                break
        self.publish(message)

    @property
    def subscription_count(self) -> int:
        """How many subscriptions receive what is published here."""
        return len(self.targets)

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
        self.entry.remove_publisher(self)

    def _refuse(self, message: object) -> None:
        if get_ident() != self._thread:
            raise WrongThread(
                f"{self.node.fqn} published on {self.entry.name} from a foreign thread: "
                "use node.threadsafe(publisher.publish, message)"
            )
        if message.__class__ is not self.type:
            raise WrongType(
                f"{self.node.fqn} publishes {self.type.__name__} on {self.entry.name}, not {described(message)}"
            )
        if not self.suspended:
            raise NotStarted(f"{self.node.fqn} has ended: it can no longer publish on {self.entry.name}")


class Queue(Generic[M]):
    """The waiting messages of one subscription, bounded by its depth.

    `received` counts what was delivered into it, `dropped` what was lost because the reader was slower than the depth allows.
    """

    __slots__ = ("depth", "dropped", "entry", "keep_all", "messages", "node", "qos", "received", "rooms", "type")

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> None:
        self.node = node
        self.entry = entry
        self.type = type
        self.qos = qos
        self.depth = qos.limit if qos.keep_all else qos.depth
        self.keep_all = qos.keep_all
        self.messages: deque[M] = deque()
        self.received: int = 0
        self.dropped = 0
        self.rooms: list[asyncio.Future[None]] | None = None

    def __repr__(self) -> str:
        waiting = f"{len(self.messages)} waiting, {self.dropped} dropped"
        return (
            f"<{type(self).__name__.lower()} of {self.entry.name} [{self.type.__name__}] in {self.node.fqn}: {waiting}>"
        )

    def deliver(self, message: M) -> None:
        """Take a message from a publisher. Never blocks, never raises."""
        raise NotImplementedError

    def close(self) -> None:
        """Leave the topic. Closing twice is fine."""
        self.entry.remove_subscription(self)
        self.made_room()

    async def room(self) -> None:
        """Wait until a message has been taken out."""
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        if self.rooms is None:
            self.rooms = []
        self.rooms.append(future)
        try:
            await future
        finally:
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

    def _overflow(self, message: M) -> None:
        """The queue is full: KEEP_LAST loses its oldest message, KEEP_ALL (which never overwrites) the new one."""
        self.dropped += 1
        if not self.keep_all:
            self.messages.popleft()
            self.messages.append(message)


class Feed(Queue[M]):
    """A subscription that feeds a handler through its node's inbox. As an inbox item it stands for one waiting message."""

    __slots__ = ("handler", "inbox", "label")

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS, inbox: Inbox, label: str) -> None:
        super().__init__(node, entry, type, qos)
        self.inbox = inbox
        self.label = label
        self.handler: Callable[[M], Awaitable[None] | None] | None = None

    def __repr__(self) -> str:
        return f"<{self.label} on {self.entry.name}: {len(self.messages)} waiting, {self.dropped} dropped>"

    def deliver(self, message: M) -> None:
        self.received += 1
        if len(self.messages) >= self.depth:
            self._overflow(message)
            return
        self.messages.append(message)
        inbox = self.inbox
        inbox.items.append(self)
        waiter = inbox.waiter
        if waiter is not None:  # Inbox.wake, written out: this is the hot path of the whole framework
            inbox.waiter = None
            if not waiter.done():
                waiter.set_result(None)
        elif inbox.watch is None:
            inbox.wake()

    def run(self) -> Awaitable[None] | None:
        message = self.messages.popleft()
        if self.rooms is not None:
            self.made_room()
        return cast("Callable[[M], Awaitable[None] | None]", self.handler)(message)


class ConcurrentFeed(Feed[M]):
    """A feed whose handler has its own tasks, at most `concurrent` at once. Messages beyond that wait in the queue."""

    __slots__ = ("active", "concurrent", "spawn")

    def __init__(
        self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS, inbox: Inbox, label: str, concurrent: int
    ) -> None:
        super().__init__(node, entry, type, qos, inbox, label)
        self.concurrent = concurrent
        self.active = 0
        self.spawn: Callable[[Coroutine[Any, Any, None]], object] | None = None

    def deliver(self, message: M) -> None:
        self.received += 1
        if len(self.messages) >= self.depth:
            self._overflow(message)
        else:
            self.messages.append(message)
        self.work()

    def work(self) -> None:
        """Begin another task if one is free and a message waits. Between two lives of the node nothing is begun."""
        if self.messages and self.active < self.concurrent and self.spawn is not None:
            self.active += 1
            self.spawn(self._work(self.spawn))

    async def _work(self, spawn: object) -> None:
        """One task's work, for as long as the incarnation lasts to which `spawn` belongs."""
        try:
            while self.messages and self.spawn is spawn:
                pending = self.run()
                if pending is not None:
                    await pending
        finally:
            if self.spawn is spawn:
                self.active -= 1


class Subscription(Queue[M]):
    """The queue behind a `Stream`."""

    __slots__ = ("closed", "latest", "on_close", "waiter")

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS) -> None:
        super().__init__(node, entry, type, qos)
        self.latest: M | None = None
        self.waiter: asyncio.Future[None] | None = None
        self.on_close: Callable[[Subscription[M]], None] | None = None
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

    def close(self) -> None:
        if self.closed:
            return
        super().close()
        self.closed = True
        if self.on_close is not None:
            self.on_close(self)
        if self.waiter is not None and not self.waiter.done():
            self.waiter.set_result(None)


class Stream(Generic[M]):
    """A subscription to iterate: ``async for message in node.subscribe(TOPIC)``.

    Listening starts when the stream is made. It ends (and the subscription leaves the topic) with `close()`, with the end of an
    ``async with`` block, when nobody refers to the stream any more, and with its node; then iteration stops. At most one task may wait on it.
    """

    __slots__ = ("_queue",)

    def __init__(self, queue: Subscription[M]) -> None:
        self._queue = queue

    def __repr__(self) -> str:
        queue = self._queue
        state = "closed" if queue.closed else f"{len(queue.messages)} waiting, {queue.dropped} dropped"
        return f"<stream of {queue.entry.name} [{queue.type.__name__}]: {state}>"

    @property
    def latest(self) -> M | None:
        """The newest message that arrived, taken out or not; None before the first."""
        return self._queue.latest

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
        return self._queue.entry.publishers_matched(self._queue)

    def __aiter__(self) -> Stream[M]:
        return self

    async def __anext__(self) -> M:
        queue = self._queue
        while not queue.messages:
            if queue.closed:
                raise StopAsyncIteration
            await self._arrival(queue)
        message = queue.messages.popleft()
        if queue.rooms is not None:
            queue.made_room()
        return message

    async def next(self, timeout: float | None = None) -> M:
        """The next message. Raises `CallTimeout` after `timeout` seconds without one, `NotStarted` once the stream has ended."""
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
            queue.close()

    async def _arrival(self, queue: Subscription[M]) -> None:
        if queue.waiter is not None:
            raise RuntimeError(f"two tasks wait on one stream of {queue.entry.name}: give each its own subscribe()")
        queue.waiter = asyncio.get_running_loop().create_future()
        try:
            await queue.waiter
        finally:
            queue.waiter = None
