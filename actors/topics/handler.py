"""Subscriptions whose messages are handled by a method of the node, either in the node's inbox or in tasks of their own."""

from __future__ import annotations

from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from typing import TYPE_CHECKING, Protocol, TypeAlias, cast

from actors.inbox.control import blame
from actors.inbox.expiring import ExpiringMessage, TimedMessage
from actors.inbox.inbox import Inbox
from actors.interfaces.message import M
from actors.topics.subscription import Subscription

if TYPE_CHECKING:
    from actors.contracts.content_filter import ContentFilter
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, TopicRegistry


Handler: TypeAlias = Callable[[M], Awaitable[None] | None]
"""A message handler. It either handles the message before it returns, or returns an awaitable that does."""


class HandlerSubscription(Subscription[M]):
    """A subscription that passes its messages to a handler through the node's inbox. Each occurrence in the inbox stands for one message.

    It has no public constructor: `Node.subscription` gives one.
    """

    # Invariants:
    # * While the node runs, the inbox holds this item exactly once for each waiting message. `deliver` and `take_over` put it there.
    # * It outlives an incarnation of its node. Messages that wait when the node ends are handled by the next incarnation, after
    #   `take_over`.
    # * `limit` is 0 until the first message, and from then on `depth`: the first one finds the subscription full, and `_overflow` makes the
    #   queues. So `deliver` need not ask for them.
    # * `timed` is the number of waiting messages that are a `TimedMessage`.
    # * `must_unwrap` stays true once a message with a lifespan has arrived. Otherwise it becomes false when the last timed message is taken
    #   out.

    __slots__ = ("concurrent", "expiring", "handler", "inbox", "label", "limit", "timed")

    late_queue = True

    def __init__(
        self,
        node: Participant,
        entry: TopicRegistry,
        type: type[M],
        qos: QoS,
        inbox: Inbox,
        label: str,
        handler: Handler[M],
        concurrent: int = 0,
        patience: float = 0.0,
        filter: ContentFilter | None = None,
    ) -> None:
        super().__init__(node, entry, type, qos, patience, filter)
        self.concurrent = concurrent
        """How many runs of the handler there may be at once; 0 for one after another, with the node's other handlers."""
        self.inbox = inbox
        self.label = label
        self.handler = handler
        self.limit = 0
        self.expiring = False
        """Whether a message with a lifespan has ever arrived."""
        self.timed = 0

    def __repr__(self) -> str:
        return f"<{self.label} on {self.entry.name}: {len(self.messages)} waiting, {self.dropped} dropped>"

    def deliver(self, message: M) -> None:
        # Called once per message and subscription, so it makes no call in the common case: `Inbox.put` and `Inbox.wake` are inlined.
        # `Inbox.wake` is called only for a busy node whose handler is not being watched yet.
        self.received += 1
        if len(self.messages) >= self.limit:
            self._overflow(message)
            return
        self.messages.append(message)
        inbox = self.inbox
        inbox.items.append(self)
        waiter = inbox.waiter
        if waiter is not None:
            inbox.waiter = None
            if not waiter.done():
                waiter.set_result(None)
        elif inbox.watch is None and inbox.current is not None:
            inbox.wake()

    def deliver_all(self, messages: list[M]) -> None:
        """Receive messages that have come together."""
        if len(self.messages) + len(messages) > self.limit:
            for message in messages:
                self.deliver(message)
            return
        self.received += len(messages)
        self.messages.extend(messages)
        self.inbox.items.extend([self] * len(messages))
        self.inbox.wake()

    def take_over(self, node: Participant, handler: Handler[M], filter: ContentFilter | None = None) -> None:
        """Deliver to a new incarnation of the node from now on, including the messages that wait already.

        A transient local subscription also receives the messages kept by its publishers, as a late joiner does. They come before those that
        wait; none is delivered twice. A subscription has a filter in all lives, or in none.
        """
        self.node = node
        self.handler = handler
        self.filter = filter
        if self.qos.transient_local:
            self._renew()

    def _renew(self) -> None:
        held = cast("deque[M | ExpiringMessage[M]]", self.messages)
        waiting = {id(one.message if isinstance(one, ExpiringMessage) else one) for one in held}
        latched = [one for publisher in self.publishers for one in publisher.latched[-self.depth :]]
        missing = [one for one in latched if id(one) not in waiting and self._takes(one)]
        self._open()
        room = self.depth - len(self.messages)
        missing = missing[-room:] if room > 0 else []
        self.received += len(missing)
        self.messages.extendleft(reversed(missing))
        self._announce(len(missing))

    def _open(self) -> None:
        """Make the queues, its own and that of the inbox, unless they are there."""
        if not self.limit:
            self.messages, self.limit = deque(), self.depth
            self.inbox.queue()

    def _announce(self, count: int) -> None:
        """Put this item into the inbox `count` times. No task serves the inbox yet, so none is woken."""
        self.inbox.items.extend([self] * count)

    def wrapped(self, expiring: ExpiringMessage[M]) -> M:
        self.must_unwrap = self.expiring = True
        return cast("M", expiring)

    def stamp(self) -> TimedMessage[M]:
        """Start to measure how long the newest message waits. The measurement is abandoned if that message is dropped."""
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
        if not self.limit:
            self._open()
            self.received -= 1  # `deliver` counts it
            self.deliver(message)
            return
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


class CreateTask(Protocol):
    """Starts a named task of the node."""

    def __call__(self, work: Coroutine[object, None, None], /, *, name: str) -> object: ...


class ConcurrentSubscription(HandlerSubscription[M]):
    """A subscription whose handler runs in tasks of its own, at most `concurrent` at once. Further messages wait."""

    # Invariants:
    # * Tasks are started only between `start` and `pause`: never before the node has started or after it has ended.
    # * Between `start` and `pause`, `active` is the number of tasks of the current incarnation that have not ended; it is at most
    #   `concurrent`.
    # * It is never an item of the inbox.

    __slots__ = ("_create_task", "active")

    active: int
    _create_task: CreateTask | None

    if not TYPE_CHECKING:  # for type checkers, it takes what `HandlerSubscription` takes

        def __init__(self, *arguments):
            super().__init__(*arguments)
            self._open()
            self.active = 0
            self._create_task = None

    def deliver(self, message: M) -> None:
        self.received += 1
        if len(self.messages) >= self.depth:
            self._overflow(message)
        else:
            self.messages.append(message)
        self._begin_one()

    def deliver_all(self, messages: list[M]) -> None:
        for message in messages:
            self.deliver(message)

    def _announce(self, count: int) -> None:
        """Do nothing: `start` handles the messages that wait."""

    def start(self, create_task: CreateTask) -> None:
        """Start tasks with `create_task` from now on, because the node has started. Messages that wait already are handled first."""
        self._create_task = create_task
        self.active = 0
        self.work()

    def pause(self) -> None:
        """Start no more tasks until the next `start`, because the node has ended."""
        self._create_task = None

    def work(self) -> None:
        """Start a task for each waiting message, up to the limit of `concurrent`."""
        for _ in range(min(self.concurrent - self.active, len(self.messages))):
            self._begin_one()

    def _begin_one(self) -> None:
        create_task = self._create_task
        if self.messages and self.active < self.concurrent and create_task is not None:
            self.active += 1
            create_task(self._work(create_task), name=self.label)

    async def _work(self, create_task: CreateTask) -> None:
        """Handle messages in one task until none waits or the incarnation that `create_task` belongs to has ended. An error ends the task."""
        try:
            while self.messages and self._create_task is create_task:
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
            if self._create_task is create_task:
                self.active -= 1
