"""Subscriptions that feed handlers: through the node's inbox, or into tasks of their own."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, cast

from actors.inbox.control import blame
from actors.inbox.expiring import ExpiringMessage, TimedMessage
from actors.inbox.inbox import Inbox
from actors.topics.channel import Subscription

if TYPE_CHECKING:
    from collections import deque

    from actors.graph.graph import Participant, TopicEntry
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS

__all__ = ["ConcurrentSubscription", "HandlerSubscription"]

M = TypeVar("M", bound="Message")


class HandlerSubscription(Subscription[M]):
    """A subscription that feeds a handler through its node's inbox. As an inbox item it stands for one waiting message.

    It has no public constructor: `Node.subscription` gives one.
    """

    __slots__ = ("ages", "handler", "inbox", "label", "stamps")

    def __init__(self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS, inbox: Inbox, label: str) -> None:
        super().__init__(node, entry, type, qos)
        self.inbox = inbox
        self.label = label
        self.handler: Callable[[M], Awaitable[None] | None] | None = None
        self.ages = False
        """Whether messages with a lifespan come."""
        self.stamps = 0
        """How many of the waiting messages are `TimedMessage`."""

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

    def renew(self) -> None:
        """A new incarnation takes over: like any late joiner it gets what is latched, before what has waited for it meanwhile."""
        held = cast("deque[M | ExpiringMessage[M]]", self.messages)
        waiting = {id(one.message if isinstance(one, ExpiringMessage) else one) for one in held}
        latched = [one for publisher in self.publishers for one in publisher.latched[-self.depth :]]
        missing = [one for one in latched if id(one) not in waiting]
        room = self.depth - len(self.messages)
        missing = missing[-room:] if room > 0 else []
        self.received += len(missing)
        self.messages.extendleft(reversed(missing))
        self._announce(len(missing))

    def _announce(self, count: int) -> None:
        """So many messages more wait, and nobody serves yet."""
        self.inbox.items.extend([self] * count)

    def aging(self, aged: ExpiringMessage[M]) -> M:
        self.attended = self.ages = True
        return cast("M", aged)

    def stamp(self) -> TimedMessage[M]:
        """Measure how long the newest message waits. It may be one that is dropped: then it is not measured."""
        stamped = TimedMessage(self.messages[-1], self.inbox.loop.time)
        self.messages[-1] = cast("M", stamped)
        self.stamps += 1
        self.attended = True
        return stamped

    def taken(self, message: M | ExpiringMessage[M]) -> M | None:
        fresh = super().taken(message)
        if isinstance(message, TimedMessage):
            self.stamps -= 1
            self.inbox.waited(message)
        self.attended = self.ages or self.stamps > 0
        return fresh

    def _overflow(self, message: M) -> None:
        oldest = self.messages[0]
        super()._overflow(message)
        if isinstance(oldest, TimedMessage) and oldest is not self.messages[0]:
            self.stamps -= 1
            self.inbox.lost(oldest)

    def run(self) -> Awaitable[None] | None:
        message = self.messages.popleft()
        if self.attended:
            fresh = self.taken(message)
            if fresh is None:
                return None
            message = fresh
        return cast("Callable[[M], Awaitable[None] | None]", self.handler)(message)


class Spawn(Protocol):
    """Runs work in a task of the node, which is called by this name."""

    def __call__(self, work: Coroutine[Any, Any, None], /, *, name: str) -> object: ...


class ConcurrentSubscription(HandlerSubscription[M]):
    """A feed whose handler has its own tasks, at most `concurrent` at once. Messages beyond that wait in the queue."""

    __slots__ = ("active", "concurrent", "spawn")

    def __init__(
        self, node: Participant, entry: TopicEntry, type: type[M], qos: QoS, inbox: Inbox, label: str, concurrent: int
    ) -> None:
        super().__init__(node, entry, type, qos, inbox, label)
        self.concurrent = concurrent
        self.active = 0
        self.spawn: Spawn | None = None

    def deliver(self, message: M) -> None:
        self.received += 1
        if len(self.messages) >= self.depth:
            self._overflow(message)
        else:
            self.messages.append(message)
        self.work()

    def _announce(self, count: int) -> None:
        """The node sees to them itself when it has started."""

    def work(self) -> None:
        """Begin another task if one is free and a message waits. Between two lives of the node nothing is begun."""
        if self.messages and self.active < self.concurrent and self.spawn is not None:
            self.active += 1
            self.spawn(self._work(self.spawn), name=self.label)

    def begin(self) -> None:
        """Begin as many tasks as are free and messages wait."""
        for _ in range(min(self.concurrent - self.active, len(self.messages))):
            self.work()

    async def _work(self, spawn: object) -> None:
        """One task's work, for as long as the incarnation lasts to which `spawn` belongs. After an error it ends; see `Core.on_error`."""
        try:
            while self.messages and self.spawn is spawn:
                begun = self.inbox.loop.time()
                pending = self.run()
                if pending is not None:
                    await pending
                self.inbox.took(self.label, self.inbox.loop.time() - begun)
        except BaseException as error:
            failure = blame(error, self.label)
            if failure is None or failure is error:
                raise
            raise failure from error
        finally:
            if self.spawn is spawn:
                self.active -= 1
