"""Services at work: a request waits in the server's inbox, the answer completes the caller's future.

The caller gets the response or one error, never silence: `ServiceUnavailable`, `CallTimeout`, `NodeRestarting`, `NotRunning`,
`ServiceFailed`, `CallCycle`. Whoever gives up waiting is forgotten; a late answer is dropped, never given to a later call.
"""

from __future__ import annotations

import asyncio
import math
from asyncio import current_task
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar, cast

import msgspec

from actors.errors import CallCycle, CallTimeout, ServiceFailed, WrongType
from actors.inbox.control import blame
from actors.inbox.inbox import Inbox
from actors.time.deadlines import FEW

if TYPE_CHECKING:
    from actors.contracts.contracts import Service
    from actors.graph.graph import ServiceEntry
    from actors.interfaces.message import Message, ServiceType
    from actors.time.deadlines import Deadlines

__all__ = ["Caller", "Client", "Request", "Server", "refuse_cycle", "refuse_other_type"]

Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")


class Awaited(Protocol):
    """What a handler waits for that holds its node's inbox: the answer to a call, or the word on a goal."""

    @property
    def server(self) -> Answering: ...

    @property
    def answered(self) -> bool: ...


class Answering(Protocol):
    """A server, of a service or an action."""

    @property
    def node(self) -> Caller: ...


class Caller(Protocol):
    """What a call asks of the node that makes it, and of the node that serves it."""

    incarnation: int
    serving: bool
    waits_for: Awaited | None

    @property
    def fqn(self) -> str: ...

    @property
    def inbox(self) -> Inbox: ...

    @property
    def thread(self) -> int: ...

    @property
    def deadlines(self) -> Deadlines: ...

    def spawn(self, work: Coroutine[Any, Any, None], *, name: str = "") -> asyncio.Task[None]: ...

    def check_thread(self) -> None: ...

    def service_failed(self, service: str, error: Exception) -> None: ...


class Server:
    """One node's service: requests go through the node's inbox, or, `concurrent`, into tasks of their own."""

    __slots__ = (
        "active",
        "calls",
        "concurrent",
        "entry",
        "handler",
        "inbox",
        "label",
        "node",
        "response",
        "type",
        "waiting",
    )

    def __init__(
        self, node: Caller, entry: ServiceEntry, kind: type[ServiceType[Any, Any]], label: str, concurrent: int
    ) -> None:
        self.node = node
        self.inbox = node.inbox
        self.entry = entry
        self.type = kind
        self.response: type[Message] = cast("Any", kind).Response
        self.label = label
        self.concurrent = concurrent
        self.handler: Callable[[Any], Awaitable[Message]]
        self.active: dict[Request, None] | None = {} if concurrent else None
        """What is not in the inbox and has no answer: all of a concurrent service, else what was broken off."""
        self.waiting: deque[Request] | None = deque() if concurrent else None
        self.calls = 0

    def __repr__(self) -> str:
        return f"<server of {self.entry.name} in {self.node.fqn}: {self.calls} calls, {len(self.open())} open>"

    def open(self) -> list[Request]:
        """The requests that have no answer yet."""
        inbox = self.inbox
        queued = [one for one in (inbox.current, *inbox.items) if isinstance(one, Request) and one.server is self]
        return [*(self.active or ()), *queued]

    def submit(self, request: Request) -> None:
        """Queue a request; its future is completed whatever happens."""
        self.calls += 1
        if not self.concurrent:
            inbox = self.inbox
            inbox.items.append(request)
            if inbox.waiter is not None or inbox.watch is None:  # `Inbox.put`, written out, with the common case first
                inbox.wake()
            return
        assert self.active is not None
        assert self.waiting is not None
        self.active[request] = None
        if self.node.serving and len(self.active) - len(self.waiting) <= self.concurrent:
            self.node.spawn(self._work(request), name=self.label)
        else:
            self.waiting.append(request)

    def begin(self) -> None:
        """The node has started: work off what has come meanwhile."""
        if self.waiting:
            for _ in range(min(self.concurrent, len(self.waiting))):
                self.node.spawn(self._work(self.waiting.popleft()), name=self.label)

    def fail_all(self, error: Callable[[], Exception]) -> None:
        """The node has ended: nobody waits on a corpse."""
        if self.waiting:
            self.waiting.clear()
        for request in self.open():
            request.fail(error())
        if self.active is not None:
            self.active.clear()

    async def _work(self, request: Request) -> None:
        assert self.active is not None
        while True:
            await request.run()
            self.active.pop(request, None)
            if not self.waiting:
                return
            request = self.waiting.popleft()


class Request(msgspec.Struct, eq=False):
    """One call under way; as an inbox item it is answered in its turn."""

    server: Server
    message: Message
    future: asyncio.Future[Any]
    caller: Caller
    due: float = math.inf

    def __repr__(self) -> str:
        return f"<request of {self.caller.fqn} to {self.server.entry.name}: {self.message!r:.60}>"

    @property
    def label(self) -> str:
        return self.server.label

    @property
    def answered(self) -> bool:
        return self.future.done()

    def fail(self, error: BaseException) -> None:
        """Let the caller have `error`, if it still waits."""
        if not self.future.done():
            self.future.set_exception(error)

    def late(self) -> CallTimeout:
        """What the caller gets that has waited long enough."""
        from actors.services.cycles import cycle_of

        server = self.server
        # Other calls matter only to one that is being answered; and thousands that are late together must not hold the loop.
        begun = len(server.waiting) < FEW if server.waiting is not None else server.inbox.current is self
        others = self.caller.deadlines.waiting() if begun else ()
        cycle = cycle_of(self, (one for one in others if isinstance(one, Request)))
        why = "give the call more time, or make it an action"
        if cycle is not None:
            why = f"{cycle}; declare one of the handlers concurrent=n, or do not call back into a caller"
        return CallTimeout(f"{server.node.fqn} did not answer {server.entry.name} in time: {why}")

    async def run(self) -> None:
        """Run the handler and complete the caller's future; when the node itself is ended, that is left to `Server.fail_all`.

        An error that is no `Exception` is the caller's answer, too, and ends the node.
        """
        server, future = self.server, self.future
        if future.done():  # the caller has given up: do not work for nobody
            return
        try:
            reply = await server.handler(self.message)
            if reply.__class__ is not server.response:
                raise WrongType(f"{server.label} answered {type(reply).__name__}, not {server.response.__name__}")
        except BaseException as error:
            failure = blame(error, server.label)
            if failure is None:
                server.active = {**(server.active or {}), self: None}
                raise
            answer = ServiceFailed(server.node.fqn, type(failure).__name__, str(failure))
            answer.__cause__ = failure
            self.fail(answer)
            if not isinstance(failure, Exception):  # a panic of a native library, for instance
                raise
            server.node.service_failed(server.label, failure)
        else:
            if not future.done():
                future.set_result(reply)


def refuse_cycle(node: Caller, other: Caller | None) -> None:
    """Raise `CallCycle` if `node`, whose handler holds its inbox, is about to wait for `other`, which waits for `node`.

    Whose answer has come waits no more, also before its task has run again.
    """
    chain: list[str] = [node.fqn]
    while other is not None:
        if other is node:
            raise CallCycle(tuple(chain))
        chain.append(other.fqn)
        awaited = other.waits_for
        other = awaited.server.node if awaited is not None and not awaited.answered else None


def refuse_other_type(name: str, server: Caller, served: type[Any], client: Caller, asked: type[Any]) -> None:
    """Raise `WrongType` if a service or action is served as one ROS type and asked as another."""
    if served.__ros_type__ != asked.__ros_type__:
        raise WrongType(
            f"{name} is served by {server.fqn} as {served.__ros_type__}, and asked by {client.fqn} as {asked.__ros_type__}: "
            "give one of the two another name, or both sides the same type"
        )


class Client(Generic[Req, Resp]):
    """One node's way to one service, made at its first call."""

    __slots__ = ("deadlines", "entry", "inbox", "node", "request", "thread", "type")

    def __init__(self, node: Caller, entry: ServiceEntry, service: Service[Req, Resp]) -> None:
        self.node = node
        self.inbox = node.inbox
        self.deadlines = node.deadlines
        self.entry = entry
        self.type = service.type
        self.request = service.request
        self.thread = node.thread

    def __repr__(self) -> str:
        return f"<client of {self.entry.name} in {self.node.fqn}>"

    async def call(self, message: Req, timeout: float) -> Resp:
        """Ask, and wait for the answer for at most `timeout` seconds in all."""
        if message.__class__ is not self.request:
            raise WrongType(
                f"{self.entry.name} takes {self.request.__name__}, not {type(message).__name__} {message!r:.60}"
            )
        if get_ident() != self.thread:
            self.node.check_thread()
        inbox, server = self.inbox, self.entry.server
        if server is None:
            started = inbox.loop.time()
            server = await self._found(timeout)
            timeout = max(1e-9, timeout - (inbox.loop.time() - started))
        if server.type is not self.type:
            refuse_other_type(self.entry.name, server.node, server.type, self.node, self.type)
        node = self.node
        # A node that sleeps is in no handler; in one that waits, a call back to its node would wait for itself.
        exclusive = inbox.waiter is None and inbox.task is current_task(inbox.loop) and not server.concurrent
        if exclusive:
            refuse_cycle(node, server.node)
        future: asyncio.Future[Resp] = inbox.loop.create_future()
        request = Request(server, message, future, node)
        self.deadlines.watch(request, timeout)
        server.submit(request)
        if not exclusive:
            return await future
        node.waits_for = request
        try:
            return await future
        finally:
            node.waits_for = None

    async def _found(self, timeout: float) -> Server:
        entry = self.entry.current
        if entry is not self.entry:  # the name had left the graph, and has come back
            self.entry = entry
            entry.clients.setdefault(self.node.fqn, 0)
        try:
            async with asyncio.timeout(timeout):
                return await entry.require()
        except TimeoutError:
            raise entry.unavailable(timeout, self.type.__name__) from None
