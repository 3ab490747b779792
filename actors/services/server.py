"""Service servers: a request is handled in the node's inbox or in a task of its own, and its answer completes the caller's future.

The caller always receives a response or one error. A request whose caller has given up is not handled; an answer that comes too late is
dropped and never given to a later call.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any, ClassVar, TypeAlias

import msgspec

from actors.errors import CallTimeout, ServiceFailed, WrongType
from actors.inbox.control import blame
from actors.inbox.inbox import NOTHING
from actors.interfaces.message import Message, Req, Resp, ServiceType
from actors.services.cycles import cycle_of
from actors.services.peers import Caller, CallId, Registration, Requester
from actors.time.deadlines import FEW

LONG = 1.0
"""A request that takes more seconds than this should be a goal of an action."""


class Server:
    """Serves one service for one node. Requests go through the node's inbox or, with `concurrent`, into tasks of their own.

    Invariants:

    * An unanswered request is in the inbox or in `active` until it is answered or `fail_all` fails it.
    * In a concurrent server all unanswered requests are in `active`, and those without a task are in `waiting` too. At most `concurrent`
      requests have a task, and none before the node has started.
    * In a server that is not concurrent, `active` holds only requests whose handler was interrupted by the end of the node.
    """

    __slots__ = (
        "active",
        "calls",
        "concurrent",
        "deadlines",
        "entry",
        "handler",
        "inbox",
        "label",
        "node",
        "response",
        "took_long",
        "type",
        "waiting",
    )

    request: ClassVar[type[Request]]
    """The class of what `submit` makes."""

    def __init__(
        self,
        node: Caller,
        entry: Registration,
        kind: type[ServiceType[Req, Resp]],
        handler: Callable[[Any], Awaitable[Message]],
        label: str,
        concurrent: int = 0,
    ) -> None:
        self.node = node
        self.inbox = node.inbox
        self.deadlines = node.deadlines
        self.entry = entry
        self.type = kind
        named: Any = kind
        self.response: type[Message] = named.Response
        self.handler = handler
        self.label = label
        self.concurrent = concurrent
        self.active: dict[Request, None] | None = {} if concurrent else None
        self.waiting: deque[Request] | None = deque() if concurrent else None
        self.calls = 0
        self.took_long = False
        """Whether a concurrent request has taken `LONG`, which is told once."""

    def __repr__(self) -> str:
        return f"<server of {self.entry.name} in {self.node.fqn}: {self.calls} calls, {len(self.open())} open>"

    @property
    def host(self) -> str:
        return self.node.fqn

    def open(self) -> list[Request]:
        """The requests that have not been answered."""
        inbox = self.inbox
        queued = [one for one in (inbox.current, *inbox.items) if isinstance(one, Request) and one.server is self]
        return [*(self.active or ()), *queued]

    def submit(self, message: Message, caller: Requester, timeout: float) -> Request:
        """Queue a request. Its future is completed within `timeout` seconds in every case."""
        inbox = self.inbox
        self.calls += 1
        request = self.request(self, message, inbox.loop.create_future(), caller, self.calls)
        self.deadlines.watch(request, timeout)
        if not self.concurrent:
            (inbox.queue() if inbox.items is NOTHING else inbox.items).append(request)
            # `Inbox.put`, inlined to save a call per request. An idle node has a waiter to wake. A busy one is told only of the first
            # request that waits, which starts the watch over the handler that delays it.
            if inbox.waiter is not None or inbox.watch is None:
                inbox.wake()
            return request
        assert self.active is not None
        assert self.waiting is not None
        self.active[request] = None
        if self.node.serving and len(self.active) - len(self.waiting) <= self.concurrent:
            self.node.create_task(self._work(request), name=self.label)
        else:
            self.waiting.append(request)
        return request

    def begin(self) -> None:
        """Start to handle the requests that wait, because the node has started."""
        if self.waiting:
            for _ in range(min(self.concurrent, len(self.waiting))):
                self.node.create_task(self._work(self.waiting.popleft()), name=self.label)

    def fail_all(self, error: Callable[[], Exception]) -> None:
        """Fail every unanswered request with `error()`, because the node has ended."""
        if self.waiting:
            self.waiting.clear()
        for request in self.open():
            request.fail(error())
        if self.active is not None:
            self.active.clear()

    async def _work(self, request: Request) -> None:
        """Handle one request after another in a task of a concurrent server, until none waits."""
        assert self.active is not None
        now = self.inbox.loop.time
        while True:
            begun = now()
            await request.run()
            self.active.pop(request, None)
            if now() - begun > LONG and not self.took_long:
                self.took_long = True
                self.node.service_took_long(self.entry.name, now() - begun)
            if not self.waiting:
                return
            request = self.waiting.popleft()


class Request(msgspec.Struct, eq=False):
    """A call in progress. As an inbox item, it runs its handler.

    Invariants:

    * `future` is completed once: by `run`, by `fail`, by the deadline (`late`), or by the caller, which cancels it when it gives up.
    * The handler does not run if `future` is already completed when the request's turn comes.
    """

    server: Server
    message: Message
    future: asyncio.Future[Any]
    caller: Requester
    number: int
    """The place of this call among all that the server has been given."""
    due: float = math.inf

    def __repr__(self) -> str:
        return f"<request of {self.caller.fqn} to {self.server.entry.name}: {self.message!r:.60}>"

    @property
    def label(self) -> str:
        return self.server.label

    @property
    def answered(self) -> bool:
        return self.future.done()

    @property
    def call_id(self) -> CallId:
        return self.caller.call_id(self.server.entry.name, self.number)

    def fail(self, error: BaseException) -> None:
        """Give the caller `error`, unless `future` is already completed."""
        if not self.future.done():
            self.future.set_exception(error)

    def late(self) -> CallTimeout:
        """Build the error for a call that has timed out. It names the cycle of calls if the call is part of one."""
        server = self.server
        # Only a call whose handling has begun is searched for a cycle: thousands of calls that time out together must not block the loop.
        begun = len(server.waiting) < FEW if server.waiting is not None else server.inbox.current is self
        others = self.caller.deadlines.waiting() if begun else ()
        cycle = cycle_of(self, (one for one in others if isinstance(one, Request)))
        why = "give the call more time, or make it an action"
        if cycle is not None:
            why = f"{cycle}; declare one of the handlers concurrent=n, or do not call back into a caller"
        return CallTimeout(f"{server.node.fqn} did not answer {server.entry.name} in time: {why}")

    async def run(self) -> None:
        """Run the handler and complete the caller's future. If the node itself is being ended, `Server.fail_all` completes it instead.

        An error that is not an `Exception` also becomes the caller's answer, and then ends the node.
        """
        server, future = self.server, self.future
        if future.done():  # the caller has given up
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
            if not isinstance(failure, Exception):  # for instance a panic in a native library
                raise
            server.node.service_failed(server.label, failure)
        else:
            if not future.done():
                future.set_result(reply)

    handle = run
    """`run`, also in a derived class: the frame of a handler."""


Server.request = Request  # it can be named only here


Take: TypeAlias = "Callable[[Message, Requester, float], Request]"
"""Takes in a request, as `Server.submit` does."""
Handle: TypeAlias = Callable[[Request], Awaitable[None]]
"""Handles a request and completes its future, as `Request.run` does."""


class InterceptedRequest(Request, eq=False):
    """A request to an `InterceptedServer`."""

    async def run(self) -> None:
        if not self.answered:
            server: Any = self.server
            await server.handling(self)


class InterceptedServer(Server):
    """A server whose requests pass interceptors: on their way in, by `taking`, and when they are handled, by `handling`."""

    __slots__ = ("handling", "taking")

    request = InterceptedRequest
    taking: Take
    """`Server.submit`, behind the interceptors."""
    handling: Handle
    """`Request.handle`, behind the interceptors."""

    def submit(self, message: Message, caller: Requester, timeout: float) -> Request:
        return self.taking(message, caller, timeout)
