"""`RecordingBoundary`: the boundary of a node, or of a subtree, of which a journal is written."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Container, Coroutine, Sequence
from contextvars import Context
from typing import TYPE_CHECKING, Any, TypeVar

from actors.inbox.boundary import BOUNDARY, outside
from actors.replay.boundary import CANCELED, JournalBoundary, nothing
from actors.replay.recording import APART, BACK, WITHIN, Entry, Start

if TYPE_CHECKING:
    from actors.graph.servers import ActionEntry, S, ServerEntry, ServiceEntry
    from actors.inbox.inbox import Inbox
    from actors.replay.journaled_loop import Callback, JournaledLoop, OwnedTask
    from actors.replay.parts import Spool
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.runtime import NodeRecord
    from actors.supervision.peers import Life
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

T = TypeVar("T")


class RecordingBoundary(JournalBoundary):
    """Writes down what passes the boundary of its members, and when their code runs, over all their lives.

    Invariants:

    - `_out` counts how deep the members' code has called into that of others, `_in` how deep their own code runs, or others call into it.
    - `_names` are the services and actions on whose server a member depends, each with the last state that was written down.
    - `_peers` are the ends of others on the members' topics that were written down and have not left.
    """

    def __init__(self, spool: Spool, loop: JournaledLoop) -> None:
        super().__init__()
        self.spool = spool
        self._own_time = loop.own_time
        self._entries = spool.entries
        self._put: Callable[[Entry], None] = spool.entries.append
        self._out = self._in = 0
        self._names: dict[ServiceEntry | ActionEntry, tuple[object, ...] | None] = {}
        self._peers: dict[PublisherPeer | SubscriptionPeer, int] = {}
        self._met = 0
        self._explained = -1
        """How many entries were in memory when a change of the graph was last written down; it explains what wakes until the next entry."""

    def flush(self) -> None:
        """Write what is in memory to the file of the journal."""
        self._explained -= self.spool.flush()

    def give_up(self, why: str) -> None:
        """Keep nothing any more: there will be no journal."""
        self.spool.failure = why
        self.spool.entries.clear()
        self._put = nothing

    def take(self) -> list[bytes]:
        """The parts of the journal that are new since the last call."""
        self.flush()
        return self.spool.take()

    # -- what passes ---------------------------------------------------------------------------------------------------------

    def begins(self, start: Start, inbox: Inbox) -> None:
        """Write down that a life of a member begins, with this inbox."""
        self.members[start.node] = inbox
        self._note("start", start)

    def dismissed(self, record: NodeRecord) -> None:
        """Write down that a member has ended for good, unless it is started by a request."""
        if record.identity.fqn in self.members:
            self._note("dismissed", record.identity.fqn)

    def enter(self, kind: str, details: tuple[object, ...], function: Callable[..., T], *arguments: object) -> T:
        if BOUNDARY.get() is self and kind != "deliver":
            return function(*arguments)  # a member does it to itself, or to another
        self._note(kind, *details)
        self._in += 1
        token = BOUNDARY.set(self)
        try:
            return function(*arguments)
        finally:
            BOUNDARY.reset(token)
            self._in -= 1

    def leave(
        self, kind: str, name: str, value: object, function: Callable[..., T], *arguments: object, inner: bool = False
    ) -> T:
        self.send(kind, name, value, inner=inner)
        self._out += 1
        token = BOUNDARY.set(None)
        try:
            answer = function(*arguments)
        finally:
            BOUNDARY.reset(token)
            self._out -= 1
        self.expect_if_future(answer)
        return answer

    def send(self, kind: str, name: str, value: object, *, inner: bool = False) -> None:
        self._put(("inner" if inner else "out", kind, name, value))

    def cancel(self, task: OwnedTask, cancel: Callable[[object], bool], message: object) -> bool:
        return self.enter("interrupt", (task.number, self._killing(task)), cancel, message)

    def _killing(self, task: OwnedTask) -> tuple[str, float] | None:
        """The member whose life runs in `task`, and after how many seconds of clean-up it is killed; None if it is only canceled."""
        life = self.lives.get(task)
        child = None if life is None else life.child
        if life is None or child is None or child.task is not task or child.killed is None:
            return None
        return life.fqn, child.killed

    def compute(self, function: Callable[..., T], arguments: tuple[object, ...]) -> T:
        result = function(*arguments)
        self._put(("result", result))
        return result

    def elsewhere(self, name: str, work: Callable[[], Coroutine[object, None, object]]) -> asyncio.Future[object]:
        with outside():
            task: asyncio.Future[object] = asyncio.ensure_future(work())
        return self.in_thread(lambda: task, name)

    def in_thread(self, start: Callable[[], asyncio.Future[T]], name: str) -> asyncio.Future[T]:
        self._put(("out", "offload", name, None))
        future = start()
        self.expect(future)
        return future

    def expected(self, future: asyncio.Future[T], number: int) -> None:
        if future.done():
            self._done(future, number)

    # -- the event loop ------------------------------------------------------------------------------------------------------

    def plan(
        self, plain: Callable[..., asyncio.Handle], when: float | None, number: int, callback: Callback, arguments: tuple[object, ...],
        context: Context | None,
    ) -> asyncio.Handle:  # fmt: skip
        if BOUNDARY.get() is not self:
            self._woken(callback, arguments)
        return plain(self._step, number, callback, *arguments, context=context)

    def _step(self, number: int, callback: Callback, *arguments: object) -> None:
        self._put(("step", self._own_time(), number))
        self._in += 1
        try:
            callback(*arguments)
        finally:
            self._in -= 1
            self._explained -= self.spool.settle()

    def read(self, clock: Callable[[], float]) -> float:
        now = clock()
        self._put(now)
        return now

    def _woken(self, callback: Callback, arguments: tuple[object, ...]) -> None:
        """Write down why code of others wakes the node."""
        first = arguments[0] if arguments else None
        future = first if asyncio.isfuture(first) else None
        number = None if future is None else self.futures.get(future)
        if number is None:
            self.look()
            if self._explained != len(self._entries):
                self._note("unknown", f"woken by {future or callback!r:.200}, which no journal carries")
        elif future is not None and number > 0:
            self._done(future, number)

    def _done(self, future: asyncio.Future[T], number: int) -> None:
        self.futures[future] = -number  # written down
        self._note("done", number, *outcome_of(future))

    def _note(self, kind: str, *details: object) -> None:
        within = (
            self._out or self._in or asyncio.current_task() in self.lives
        )  # whose first step no callback has counted
        place = BACK if within else APART
        if BOUNDARY.get() is self:
            place = WITHIN
        self._put((kind, self._own_time(), place, *details))

    # -- the graph -----------------------------------------------------------------------------------------------------------

    def delivering(self, publisher: PublisherPeer, subscription: SubscriptionPeer, target: Target) -> Target:
        if not self.owns(subscription):
            return target
        if self.owns(publisher):
            by_itself = self.to_itself(target)
            return lambda message: (by_itself if self._out else target)(
                message
            )  # other code can use its publisher, too
        number, peer = self.number_of(subscription), self._meet(publisher)

        def deliver(message: Any) -> None:
            expires = getattr(message, "expires", None)
            bare = message if expires is None else message.message
            self.enter("deliver", (number, peer, bare, expires), target, message)

        return deliver

    def _meet(self, peer: PublisherPeer | SubscriptionPeer) -> int:
        """The number of an end of others; it is written down when it is first met."""
        number = self._peers.get(peer)
        if number is None:
            number = self._peers[peer] = self._met = self._met + 1
            kind = "publisher" if hasattr(peer, "latched") else "subscription"
            self._note(kind, number, peer.entry.name, peer.node.fqn, peer.type, peer.qos)
        return number

    def publisher_joined(self, publisher: PublisherPeer) -> None:
        others = publisher.entry.subscriptions
        self._joined(publisher, others)

    def subscription_joined(self, subscription: SubscriptionPeer) -> None:
        super().subscription_joined(subscription)
        others = subscription.entry.publishers
        self._joined(subscription, others)

    def _joined(
        self, peer: PublisherPeer | SubscriptionPeer, others: Sequence[PublisherPeer | SubscriptionPeer]
    ) -> None:
        if self.owns(peer):
            for other in others:
                if not self.owns(other):
                    self._meet(other)
        elif any(map(self.owns, others)):
            self._meet(peer)

    def publisher_left(self, publisher: PublisherPeer) -> None:
        self._left(publisher)

    def subscription_left(self, subscription: SubscriptionPeer) -> None:
        self._left(subscription)

    def _left(self, peer: PublisherPeer | SubscriptionPeer) -> None:
        if (number := self._peers.pop(peer, None)) is not None:
            self._note("gone", number)

    def server_changed(self, entry: ServerEntry[S]) -> None:
        self.look()

    def uses(self, entry: ServiceEntry | ActionEntry) -> None:
        if entry not in self._names:
            self._names[entry] = None
            self.look()

    def look(self) -> None:
        """Write down what has changed of the servers on which the node depends."""
        for entry, before in self._names.items():
            state = state_of(entry, self.members)
            if state != before:
                self._names[entry] = state
                self._note("server", entry.kind, entry.name, state)
                self._explained = len(self._entries)


class RecordedLife:
    """One life of a member, for its supervisor."""

    __slots__ = ("_life", "_node", "_recording")

    def __init__(self, recording: RecordingBoundary, node: Incarnation, life: Life) -> None:
        self._recording = recording
        self._node = node
        self._life = life

    async def run(self, started: Callable[[], None], /) -> None:
        await self._recording.live(self._node, self._life, started)

    def stop(self, reason: str, /) -> None:
        details = (self._node.fqn, reason, self._node.runtime.stop_reason)
        self._recording.enter("stop", details, self._life.stop, reason)


def outcome_of(future: asyncio.Future[T]) -> tuple[str, object]:
    """How a future has ended, and its result or error."""
    if future.cancelled():
        return CANCELED, None
    if (error := future.exception()) is not None:
        return "error", error
    return "result", future.result()


def state_of(entry: ServiceEntry | ActionEntry, members: Container[str]) -> tuple[object, ...] | None:
    """Who serves a name, for a member that asks: the state of its entry, as far as a client can see it."""
    server = entry.server
    if server is not None:
        if server.host in members:
            return ("own",)
        return ("here", server.host, server.type, getattr(server, "concurrent", 0))
    if entry.restarting is not None:
        return ("restarting", *entry.restarting)
    return None if entry.stopped is None else ("stopped", entry.stopped)
