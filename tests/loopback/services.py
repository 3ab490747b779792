"""Services by way of bytes: a client talks to a stand-in for its server, and a server never sees its client.

What gets lost on the way, as over a real wire: that a caller has given up. What a stand-in knows besides the messages is what the graph of a
transport would tell: who serves a name, and that a server is being restarted or has stopped. An error of a handler is an error reply.
"""

from __future__ import annotations

import asyncio
import math
from typing import Any, Generic, TypeVar

import pytest

from actors.errors import CallTimeout, ServiceFailed
from actors.interfaces.std_msgs.msg import String
from actors.services.client import Client
from actors.services.peers import Caller, OpenCall, ServedName, ServiceName, ServicePeer
from tests.loopback import carried

P = TypeVar("P")


class RemoteName(Generic[P]):
    """A name of the graph, as far as a transport would know it."""

    def __init__(self, entry: ServedName[P]) -> None:
        self.entry = entry

    @property
    def name(self) -> str:
        return self.entry.name

    def meant(self) -> str:
        return self.entry.meant()

    def forget(self, node: str) -> None:
        self.entry.forget(node)


class RemoteService(RemoteName[ServicePeer]):
    """A service whose server is always elsewhere."""

    def __init__(self, entry: ServiceName) -> None:
        super().__init__(entry)
        self.service = entry

    @property
    def server(self) -> RemoteServer | None:
        server = self.entry.server
        return None if server is None else RemoteServer(self.name, server)

    async def require(self) -> RemoteServer:
        return RemoteServer(self.name, await self.entry.require())

    @property
    def current(self) -> RemoteService:
        current = self.service.current
        return self if current is self.service else RemoteService(current)

    @property
    def clients(self) -> dict[str, int]:
        return self.service.clients

    def unavailable(self, seconds: float, type: str) -> Exception:
        return self.service.unavailable(seconds, type)


class RemoteServer:
    """Stands for a server elsewhere."""

    node = None
    concurrent = 0

    def __init__(self, name: str, server: ServicePeer) -> None:
        self.name = name
        self.server = server

    @property
    def host(self) -> str:
        return self.server.host

    @property
    def type(self) -> type[Any]:
        return self.server.type

    def submit(self, message: Any, caller: Caller, timeout: float) -> RemoteCall:
        call = RemoteCall(self, asyncio.get_running_loop().create_future())
        caller.deadlines.watch(call, timeout)
        asyncio.get_running_loop().call_soon(call.arrive, carried(message), caller)
        return call


class RemoteCall:
    """A call to a server elsewhere, which knows nothing of its deadline, nor that the caller may give up."""

    def __init__(self, server: RemoteServer, future: asyncio.Future[Any]) -> None:
        self.server = server
        self.future = future
        self.due = math.inf
        self.far: OpenCall | None = None

    @property
    def answered(self) -> bool:
        return self.future.done()

    def late(self) -> CallTimeout:
        return CallTimeout(f"{self.server.host} did not answer {self.server.name} in time: give the call more time")

    def arrive(self, request: Any, caller: Caller) -> None:
        """At the server: hand in the request."""
        self.far = self.server.server.submit(request, caller, math.inf)
        self.far.future.add_done_callback(self.answer)

    def answer(self, answer: asyncio.Future[Any]) -> None:
        """Back at the client: the response, an error reply, or what the graph knows of the server's end."""
        failure = answer.exception()
        if self.future.done():
            return
        if failure is None:
            self.future.set_result(carried(answer.result()))
        elif isinstance(failure, ServiceFailed):
            parts = (carried(String(data=part)).data for part in (failure.node, failure.type, failure.text))
            self.future.set_exception(ServiceFailed(*parts))
        else:
            self.future.set_exception(failure)


def install(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on every client reaches its server by way of a stand-in."""
    plain: Any = Client.__init__

    def linked(self: Client[Any, Any], node: Caller, entry: ServiceName, service: Any) -> None:
        plain(self, node, RemoteService(entry), service)

    monkeypatch.setattr(Client, "__init__", linked)
