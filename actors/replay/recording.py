"""`Recording`: the border of a node of which a journal is written."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextvars import Context
from typing import TYPE_CHECKING, Any, TypeVar

from actors.errors import described
from actors.inbox.border import INSIDE, outside
from actors.replay.edge import CANCELED, Edge
from actors.replay.loop_seam import OwnedTask
from actors.replay.parts import PART
from actors.replay.tape import APART, BACK, WITHIN

if TYPE_CHECKING:
    from actors.graph.servers import ServerEntry
    from actors.replay.loop_seam import Callback, LoopSeam
    from actors.replay.parts import Spool
    from actors.replay.tape import Entry, Start
    from actors.runtime.incarnation import Incarnation
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

__all__ = ["RecordedLife", "Recording", "started_outside"]

T = TypeVar("T")


class Recording(Edge):
    """Writes down what passes the border of one node, and when its code runs, over all its lives.

    `killed(task)` says after how many seconds of clean-up a task is being killed; None for one that is only canceled.

    Invariants:

    - `_out` counts how deep the node's code has called into that of others, `_in` how deep its own code runs, or others call into it.
    - `_names` are the services and actions on whose server the node depends, each with the last state that was written down.
    - `_peers` are the ends of others on the node's topics that were written down and have not left.
    """

    def __init__(
        self, node: str, spool: Spool, seam: LoopSeam, killed: Callable[[asyncio.Task[Any]], float | None]
    ) -> None:
        super().__init__(node)
        self._killed = killed
        self.spool = spool
        self._seam = seam
        self._entries = spool.entries
        self._put: Callable[[Entry], None] = spool.entries.append
        self._out = self._in = 0
        self._main: asyncio.Task[Any] | None = None
        """The task of the present or last life."""
        self._names: dict[ServerEntry[Any], Any] = {}
        self._peers: dict[PublisherPeer | SubscriptionPeer, int] = {}
        self._met = 0
        self._explained = -1
        """How many entries were in memory when a change of the graph was last written down; it explains what wakes until the next entry."""

    def flush(self) -> None:
        """Write what is in memory to the file of the journal."""
        self._explained -= self.spool.flush()

    def take(self) -> list[bytes]:
        """The parts of the journal that are new since the last call."""
        self.flush()
        return self.spool.take()

    # -- what passes ---------------------------------------------------------------------------------------------------------

    def begins(self, start: Start) -> None:
        """Write down that a life begins."""
        self._note("start", start)

    def runs(self, task: OwnedTask) -> None:
        """Note the task in which the life that has begun runs."""
        self._main = task
        self.begin(task)

    def enter(self, kind: str, details: tuple[Any, ...], function: Callable[..., T], *arguments: Any) -> T:
        if INSIDE.get() is self and kind != "deliver":
            return function(*arguments)  # the node does it to itself
        self._note(kind, *details)
        self._in += 1
        token = INSIDE.set(self)
        try:
            return function(*arguments)
        finally:
            INSIDE.reset(token)
            self._in -= 1

    def leave(self, kind: str, name: str, value: Any, function: Callable[..., T], *arguments: Any) -> T:
        self._put(("out", kind, name, value))
        self._out += 1
        token = INSIDE.set(None)
        try:
            answer = function(*arguments)
        finally:
            INSIDE.reset(token)
            self._out -= 1
        self.expect_if_future(answer)
        return answer

    def send(self, kind: str, name: str, value: Any) -> None:
        self._put(("out", kind, name, value))

    def cancel(self, task: OwnedTask, cancel: Callable[[Any], bool], message: Any) -> bool:
        return self.enter("interrupt", (task.number, self._killed(task)), cancel, message)

    def compute(self, function: Callable[..., T], arguments: tuple[Any, ...]) -> T:
        result = function(*arguments)
        self._put(("result", result))
        return result

    def elsewhere(self, name: str, work: Callable[[], Coroutine[Any, Any, Any]]) -> asyncio.Future[Any]:
        with outside():
            task: asyncio.Future[Any] = asyncio.ensure_future(work())
        return self.in_thread(lambda: task, name)

    def in_thread(self, start: Callable[[], asyncio.Future[Any]], name: str) -> asyncio.Future[Any]:
        self._put(("out", "offload", name, None))
        future = start()
        self.expect(future)
        return future

    def expected(self, future: asyncio.Future[Any], number: int) -> None:
        if future.done():
            self._done(future, number)

    # -- the event loop ------------------------------------------------------------------------------------------------------

    def plan(
        self, plain: Callable[..., asyncio.Handle], when: float | None, number: int, callback: Callback, arguments: tuple[Any, ...],
        context: Context | None,
    ) -> asyncio.Handle:  # fmt: skip
        if INSIDE.get() is not self:
            self._woken(callback, arguments)
        return plain(self._step, number, callback, *arguments, context=context)

    def _step(self, number: int, callback: Callback, *arguments: Any) -> None:
        self._put(("step", self._seam.time(), number))
        self._in += 1
        try:
            callback(*arguments)
        finally:
            self._in -= 1
            if len(self._entries) >= PART:
                self.flush()

    def read(self, clock: Callable[[], float]) -> float:
        now = clock()
        self._put(now)
        return now

    def _woken(self, callback: Callback, arguments: tuple[Any, ...]) -> None:
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

    def _done(self, future: asyncio.Future[Any], number: int) -> None:
        self.futures[future] = -number  # written down
        self._note("done", number, *outcome_of(future))

    def _note(self, kind: str, *details: Any) -> None:
        within = (
            self._out or self._in or asyncio.current_task() is self._main
        )  # whose first step no callback has counted
        place = BACK if within else APART
        if INSIDE.get() is self:
            place = WITHIN
        self._put((kind, self._seam.time(), place, *details))

    # -- the graph -----------------------------------------------------------------------------------------------------------

    def inward(self, publisher: PublisherPeer, subscription: SubscriptionPeer, target: Target) -> Target:
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
        others: list[Any] = publisher.entry.subscriptions
        self._joined(publisher, others)
        if self.owns(publisher):
            mine: Any = publisher
            mine.attach(_nothing)  # so that `outward` is asked, even if nobody listens

    def subscription_joined(self, subscription: SubscriptionPeer) -> None:
        others: list[Any] = subscription.entry.publishers
        if self.owns(subscription):
            self.number_of(subscription)
        self._joined(subscription, others)

    def _joined(self, peer: Any, others: list[Any]) -> None:
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

    def server_changed(self, entry: ServerEntry[Any]) -> None:
        self.look()

    def uses(self, entry: ServerEntry[Any]) -> None:
        if entry not in self._names:
            self._names[entry] = None
            self.look()

    def look(self) -> None:
        """Write down what has changed of the servers on which the node depends."""
        for entry, before in self._names.items():
            state = state_of(entry, self.node)
            if state != before:
                self._names[entry] = state
                self._note("server", entry.kind, entry.name, state)
                self._explained = len(self._entries)


class RecordedLife:
    """One life of a journaled node, for its supervisor."""

    __slots__ = ("_life", "_recording")

    def __init__(self, recording: Recording, life: Incarnation) -> None:
        self._recording = recording
        self._life = life

    async def run(self, started: Callable[[], None], /) -> None:
        recording = self._recording
        task = asyncio.current_task()
        assert isinstance(task, OwnedTask)
        recording.runs(task)
        token = INSIDE.set(recording)
        try:
            await self._life.run(started_outside(started))
        except BaseException as error:
            recording.send("end", type(error).__name__, described(error))
            raise
        else:
            recording.send("end", "", "")
        finally:
            INSIDE.reset(token)

    def stop(self, reason: str, /) -> None:
        self._recording.enter("stop", (reason, self._life.runtime.stop_reason), self._life.stop, reason)


def started_outside(started: Callable[[], None]) -> Callable[[], None]:
    """`started`, called as code of the supervisor, which then starts other nodes."""

    def call() -> None:
        with outside():
            started()

    return call


def outcome_of(future: asyncio.Future[Any]) -> tuple[str, Any]:
    """How a future has ended, and its result or error."""
    if future.cancelled():
        return CANCELED, None
    if (error := future.exception()) is not None:
        return "error", error
    return "result", future.result()


def state_of(entry: ServerEntry[Any], node: str) -> tuple[Any, ...] | None:
    """Who serves a name, for a node that asks: the state of its entry, as far as a client can see it."""
    server = entry.server
    if server is not None:
        if server.host == node:
            return ("own",)
        return ("here", server.host, server.type, getattr(server, "concurrent", 0))
    if entry.restarting is not None:
        return ("restarting", *entry.restarting)
    return None if entry.stopped is None else ("stopped", entry.stopped)


def _nothing(_: object) -> None:
    """Do nothing."""
