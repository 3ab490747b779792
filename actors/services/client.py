"""Service clients: a call finds the server, submits a request, and waits for one response or one error."""

from __future__ import annotations

import asyncio
from asyncio import current_task
from threading import get_ident
from typing import Generic

from actors.contracts.contracts import Service
from actors.errors import WrongType
from actors.interfaces.message import Message, Req, Resp
from actors.services.peers import Caller, ServiceCall, ServiceName, ServicePeer, Submit, refuse_cycle, refuse_other_type
from actors.time.deadlines import check_timeout


class Client(Generic[Req, Resp]):
    """Calls one service for one node. Created at the node's first call of that service.

    Invariants:

    * It stores no calls. Each call belongs to the coroutine of its caller and to the server.
    * While a handler in the node's own task waits for a response from a server that is not concurrent, `waits_for` of the node is that
      call. Otherwise it is None.
    """

    __slots__ = ("agreed", "entry", "inbox", "node", "request", "submit", "thread", "type")

    def __init__(self, node: Caller, entry: ServiceName, service: Service[Req, Resp]) -> None:
        self.node = node
        self.inbox = node.inbox
        self.entry = entry
        self.type = service.type
        self.agreed: type[object] = service.type
        """The type of the last server that was found to be the same as `type`."""
        self.request = service.request
        self.thread = node.thread
        self.submit: Submit | None = None
        """Sends the requests through the node's interceptors; None if none of them intercepts calls."""

    def __repr__(self) -> str:
        return f"<client of {self.entry.name} in {self.node.fqn}>"

    async def call(self, message: Req, timeout: float) -> Resp:
        """Send a request and return the response, waiting for at most `timeout` seconds in all, the search for a server included.

        Raises what `Node.call` raises, and `WrongThread`.
        """
        # This code runs thousands of times a second. A call therefore costs one coroutine and one future, and each check compares
        # attributes without calling a function unless it fails. The server enforces the timeout, because its `Deadlines` share one timer
        # among all calls with the same timeout; `asyncio.timeout` would cost more than the rest of the call.
        if message.__class__ is not self.request:
            raise WrongType(
                f"{self.entry.name} takes {self.request.__name__}, not {type(message).__name__} {message!r:.60}"
            )
        if get_ident() != self.thread:
            self.node.check_thread()
        if timeout.__class__ is not float or timeout != timeout:  # before anything depends on whether there is a server
            check_timeout(f"{self.node.fqn}.call({self.entry.name})", timeout)
        inbox, server = self.inbox, self.entry.server
        if server is None:
            started = inbox.loop.time()
            server = await self._found(timeout)
            timeout = max(1e-9, timeout - (inbox.loop.time() - started))
        if server.type is not self.agreed:
            refuse_other_type(self.entry.name, server.host, server.type, self.node, self.type)
            self.agreed = server.type
        node = self.node
        # Only a handler that runs in the node's own task holds the inbox; a node whose inbox has a waiter runs no handler. A call that
        # leads back to such a node would wait for itself.
        exclusive = inbox.waiter is None and inbox.task is current_task(inbox.loop) and not server.concurrent
        if exclusive:
            refuse_cycle(node, server.node)
        call = (
            server.submit(message, node, timeout)
            if self.submit is None
            else self.submit(server, message, node, timeout)
        )
        if not exclusive:
            answer: Resp = await call.future
            return answer
        node.waits_for = call
        try:
            answer = await call.future
            return answer
        finally:
            node.waits_for = None

    async def _found(self, timeout: float) -> ServicePeer:
        """Return the server, waiting for it for at most `timeout` seconds. Raises at once if it has ended."""
        entry = self.entry.current
        if entry is not self.entry:  # the name has left the graph and been added again
            self.entry = entry
            entry.clients.setdefault(self.node.fqn, 0)
        try:
            async with asyncio.timeout(timeout):
                return await entry.require()
        except TimeoutError:
            raise entry.unavailable(timeout, self.type.__name__) from None


def submit(server: ServicePeer, message: Message, caller: Caller, timeout: float) -> ServiceCall:
    """Send a request without interceptors."""
    return server.submit(message, caller, timeout)
