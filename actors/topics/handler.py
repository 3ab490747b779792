"""Subscriptions that feed handlers: through the node's inbox, or into tasks of their own."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar, cast

from actors.inbox.control import blame
from actors.inbox.expiring import ExpiringMessage, TimedMessage
from actors.inbox.inbox import Inbox
from actors.topics.subscription import Subscription

if TYPE_CHECKING:
    from collections import deque

    from actors.interfaces.message import Message
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, TopicRegistry

__all__ = ["ConcurrentSubscription", "Handler", "HandlerSubscription", "Spawn"]

M = TypeVar("M", bound="Message")

Handler: TypeAlias = Callable[[M], Awaitable[None] | None]
"""Takes one message: at once, or by what it returns to be awaited."""


class HandlerSubscription(Subscription[M]):
    """A subscription that feeds a handler through its node's inbox. As an inbox item it stands for one waiting message.

    It has no public constructor: `Node.subscription` gives one.
    """

    # Invariants:
    # * While the node lives, the inbox holds this item exactly as often as messages wait: once for each, put there by `deliver`.
    # * It outlives an incarnation of its node: what waits when the node ends waits for the next one, which calls `take_over`.
    # * `timed` is the number of waiting messages that are a `TimedMessage`. `must_unwrap` is false again once no wrapped message waits.

    __slots__ = ("expiring", "handler", "inbox", "label", "timed")

    def __init__(
        self,
        node: Participant,
        entry: TopicRegistry,
        type: type[M],
        qos: QoS,
        inbox: Inbox,
        label: str,
        handler: Handler[M],
    ) -> None:
        super().__init__(node, entry, type, qos)
        self.inbox = inbox
        self.label = label
        self.handler = handler
        self.expiring = False
        """Whether messages with a lifespan have come."""
        self.timed = 0

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

    def take_over(self, node: Participant, handler: Handler[M]) -> None:
        """A new incarnation takes the messages from now on, those that wait included.

        Like any late joiner it gets what is latched, before what has waited for it; what waits already does not come twice.
        """
        self.node = node
        self.handler = handler
        if self.qos.transient_local:
            self._renew()

    def _renew(self) -> None:
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
        """So many messages more wait, and no task serves the inbox yet."""
        self.inbox.items.extend([self] * count)

    def wrapped(self, expiring: ExpiringMessage[M]) -> M:
        self.must_unwrap = self.expiring = True
        return cast("M", expiring)

    def stamp(self) -> TimedMessage[M]:
        """Measure how long the newest message waits. It may be one that is dropped: then it is not measured."""
        timed = TimedMessage(self.messages[-1], self.inbox.loop.time)
        self.messages[-1] = cast("M", timed)
        self.timed += 1
        self.must_unwrap = True
        return timed

    def unwrap(self, message: M | ExpiringMessage[M]) -> M | None:
        fresh = super().unwrap(message)
        if isinstance(message, TimedMessage):
            self.timed -= 1
            self.inbox.waited(message)
        self.must_unwrap = self.expiring or self.timed > 0
        return fresh

    def _overflow(self, message: M) -> None:
        oldest = self.messages[0]
        super()._overflow(message)
        if isinstance(oldest, TimedMessage) and oldest is not self.messages[0]:
            self.timed -= 1
            self.inbox.lost(oldest)

    def run(self) -> Awaitable[None] | None:
        message = self.messages.popleft()
        if self.must_unwrap:
            fresh = self.unwrap(message)
            if fresh is None:
                return None
            message = fresh
        return self.handler(message)


class Spawn(Protocol):
    """Runs work in a task of the node, which is called by this name."""

    def __call__(self, work: Coroutine[Any, Any, None], /, *, name: str) -> object: ...


class ConcurrentSubscription(HandlerSubscription[M]):
    """A subscription whose handler has its own tasks, at most `concurrent` at once. Messages beyond that wait."""

    # Invariants:
    # * Tasks are begun only between `start` and `pause`; an incarnation that has not started yet, or has ended, begins none.
    # * `active` is the number of tasks that the present incarnation has begun and that have not ended; never more than `concurrent`.
    # * It is never an item of the inbox.

    __slots__ = ("_spawn", "active", "concurrent")

    def __init__(
        self,
        node: Participant,
        entry: TopicRegistry,
        type: type[M],
        qos: QoS,
        inbox: Inbox,
        label: str,
        handler: Handler[M],
        concurrent: int,
    ) -> None:
        super().__init__(node, entry, type, qos, inbox, label, handler)
        self.concurrent = concurrent
        self.active = 0
        self._spawn: Spawn | None = None

    def deliver(self, message: M) -> None:
        self.received += 1
        if len(self.messages) >= self.depth:
            self._overflow(message)
        else:
            self.messages.append(message)
        self._begin_one()

    def _announce(self, count: int) -> None:
        """`start` sees to them."""

    def start(self, spawn: Spawn) -> None:
        """The node has started: from now on tasks are begun by `spawn`, for the messages that wait already, too."""
        self._spawn = spawn
        self.active = 0
        self.work()

    def pause(self) -> None:
        """The node has ended: begin no task until the next `start`."""
        self._spawn = None

    def work(self) -> None:
        """Begin as many tasks as are free and messages wait."""
        for _ in range(min(self.concurrent - self.active, len(self.messages))):
            self._begin_one()

    def _begin_one(self) -> None:
        spawn = self._spawn
        if self.messages and self.active < self.concurrent and spawn is not None:
            self.active += 1
            spawn(self._work(spawn), name=self.label)

    async def _work(self, spawn: Spawn) -> None:
        """One task's work, as long as the incarnation lasts to which `spawn` belongs. After an error it ends; see `Core.on_error`."""
        try:
            while self.messages and self._spawn is spawn:
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
            if self._spawn is spawn:
                self.active -= 1
