"""The asking side of services: a call finds its server, submits the request, and waits for one answer or one error."""

from __future__ import annotations

import asyncio
from asyncio import current_task
from threading import get_ident
from typing import TYPE_CHECKING, Generic, TypeVar

from actors.errors import WrongType
from actors.services.peers import Caller, ServiceName, ServicePeer, refuse_cycle, refuse_other_type

if TYPE_CHECKING:
    from actors.contracts.contracts import Service
    from actors.interfaces.message import Message

__all__ = ["Client"]

Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")


class Client(Generic[Req, Resp]):
    """One node's way to one service, made at its first call.

    Invariants:

    * It holds no call: each one lives in the coroutine of its caller and at the server.
    * While a handler of the node waits for an answer in the node's own task, the node's `waits_for` is that call, and None otherwise.
    """

    __slots__ = ("entry", "inbox", "node", "request", "thread", "type")

    def __init__(self, node: Caller, entry: ServiceName, service: Service[Req, Resp]) -> None:
        self.node = node
        self.inbox = node.inbox
        self.entry = entry
        self.type = service.type
        self.request = service.request
        self.thread = node.thread

    def __repr__(self) -> str:
        return f"<client of {self.entry.name} in {self.node.fqn}>"

    async def call(self, message: Req, timeout: float) -> Resp:
        """Ask, and wait for the answer for at most `timeout` seconds in all.

        Raises `WrongType`, `WrongThread`, `ServiceUnavailable`, `CallTimeout`, `NodeRestarting`, `NotRunning`, `ServiceFailed` or `CallCycle`.
        """
        # One coroutine and one future for a call, and the common case without a call for each check: it is made thousands of times a
        # second. The deadline is the server's business, which shares one timer among all calls with the same timeout; `asyncio.timeout`
        # would cost more than the call.
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
            refuse_other_type(self.entry.name, server.host, server.type, self.node, self.type)
        node = self.node
        # A node that sleeps is in no handler; in one that waits, a call back to its node would wait for itself.
        exclusive = inbox.waiter is None and inbox.task is current_task(inbox.loop) and not server.concurrent
        if exclusive:
            refuse_cycle(node, server.node)
        call = server.submit(message, node, timeout)
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
        """The server, when there is one, within `timeout` seconds; at once an error if it has ended."""
        entry = self.entry.current
        if entry is not self.entry:  # the name had left the graph, and has come back
            self.entry = entry
            entry.clients.setdefault(self.node.fqn, 0)
        try:
            async with asyncio.timeout(timeout):
                return await entry.require()
        except TimeoutError:
            raise entry.unavailable(timeout, self.type.__name__) from None
