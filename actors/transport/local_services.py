"""Servers of this process on the network, and the requests that come from other processes."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import Callable
from typing import Any, Final, NamedTuple, cast

from actors.errors import CallCycle, NodeRestarting, NotRunning, ServiceFailed
from actors.graph.servers import S, ServerEntry
from actors.interfaces.cdr import decode, encode
from actors.interfaces.errors import CdrError
from actors.interfaces.foreign import ForeignType
from actors.interfaces.message import Message
from actors.qos import SERVICES
from actors.qos.policies import QoS
from actors.services.server import Server
from actors.transport.chains import RemoteCaller
from actors.transport.format.errors import WireFormatError
from actors.transport.format.extensions import Extension, parse_extension, write_extension
from actors.transport.format.replies import encode_failure, write_reply_error
from actors.transport.format.tokens import EndpointKind
from actors.transport.local_clients import Clients
from actors.transport.local_side import LocalSide, type_info
from actors.transport.protocol import EndpointHere, RemoteEndpoint, Request
from actors.transport.remote_services import RemoteServer

_NOTHING: Final = Extension()
_MOST_OPEN: Final = 10_000
"""So many requests of other processes to one service wait for an answer at most."""


class Asked:
    """A request that has come from another process.

    It is answered once. Clients of this library read errors. A client of ROS 2 gets a response that says that it failed, if the type can
    say that; otherwise the text of the error, which it logs over Zenoh and never sees over DDS, and goes on waiting.
    """

    def __init__(self, side: LocalSide, request: Request, extension: Extension | None, type: Any) -> None:
        self._side = side
        self._request = request
        self._type = type
        self._reads_errors = extension is not None
        self.gid = request.gid
        self.number = request.number
        self.extension = extension or _NOTHING
        self.payload = request.payload

    def reply(self, server: str, response: Message, reason: str = "") -> None:
        """Answer it, as the node `server`."""
        try:
            payload = encode(response)
        except CdrError as error:
            self.fail(server, error)
            return
        extension = write_extension(Extension(reason=reason)) if reason else b""
        self._request.reply(payload, self._side.wall_ns(), extension)

    def fail(self, server: str, error: BaseException) -> None:
        """Answer it with an error, as the node `server`."""
        if not isinstance(error, (CallCycle, NodeRestarting, NotRunning, ServiceFailed)):
            error = ServiceFailed(server, type(error).__name__, str(error))
        if self._reads_errors:
            self._request.fail(write_reply_error(error))
            return
        text = str(error).encode(errors="backslashreplace")
        payload = encode_failure(self._type.Response, text.decode())
        if payload is None:
            self._request.fail(text)
        else:
            self._request.reply(payload, self._side.wall_ns(), b"")


class Shown(NamedTuple):
    """A server of this process, as it is shown."""

    node: str
    type: Any
    endpoint: EndpointHere

    def close(self) -> None:
        self.endpoint.close()


class Services:
    """The services of one system on the network.

    Invariants:

    * A service that a node declares is shown from its first start until its node has ended for good: in between, its callers get
      `NodeRestarting`. Standard services are shown by `promise`, and opened by the first request.
    * Each server of another process stands in the graph as long as it is known.
    """

    def __init__(self, side: LocalSide, clients: Clients) -> None:
        self._side = side
        self._clients = clients
        self._graph = side.runtime.graph
        self._shown: dict[str, Shown] = {}
        self._promised: dict[str, Shown] = {}
        self._remote: dict[bytes, RemoteServer] = {}
        """By GID."""
        self._callers: dict[bytes, str] = {}
        """GID of a client of another process -> its node."""
        self._asking: Counter[tuple[str, str]] = Counter()
        """(service, node of another process) -> how many clients of the service the node has."""
        self._open: Counter[str] = Counter()
        """How many requests of other processes each service has not answered."""

    # -- servers of this process --------------------------------------------------------------------------------------------

    def server_changed(self, entry: ServerEntry[S]) -> None:
        """Show a server, or withdraw it. Raises WireFormatError."""
        name, server, shown = entry.name, entry.local, self._shown.get(entry.name)
        if server is not None and name not in self._promised:
            if shown is None or (shown.node, shown.type) != (server.host, server.type):
                self._shown[name] = self.show(server.host, name, server.type, SERVICES, self.answer)
                self.beside(entry)
                if shown is not None:
                    shown.close()
        elif server is None and entry.restarting is None and shown is not None:
            self._shown.pop(name).close()

    def promise(
        self, node: str, name: str, type: object, qos: QoS, take: Callable[[Shown, str, Asked], None] | None = None
    ) -> None:
        """Show a standard service of a node, until `forget`. Requests go to `take`, or open the service."""
        if name not in self._promised:
            self._promised[name] = self.show(node, name, type, qos, take or self.answer)

    def forget(self, node: str) -> None:
        """Withdraw the standard services of a node that has ended for good."""
        for name in [name for name, shown in self._promised.items() if shown.node == node]:
            self._promised.pop(name).close()

    def show(self, node: str, name: str, type: object, qos: QoS, take: Callable[[Shown, str, Asked], None]) -> Shown:
        def arrived(request: Request) -> None:
            try:
                extension = parse_extension(request.extension)
            except WireFormatError as error:
                self._side.unreadable.note("a request has no attachment that can be read", name, error, service=name)
                request.drop()
            else:
                take(shown, name, Asked(self._side, request, extension, type))

        side = self._side
        shown = Shown(node, type, side.participant.server(side.node(node), name, type_info(type), qos, arrived))
        return shown

    def answer(self, shown: Shown, name: str, asked: Asked) -> None:
        """Hand a request to the server of this process, and its answer back."""
        entry = self._graph.service(name)
        if entry.local is None:
            self._graph.open_standard_service(entry)
        server = cast("Server | None", entry.local)
        if server is None:
            asked.fail(shown.node, self.absent(shown.node, name))
            return
        if self.refused(shown, name, asked, self._open[name]):
            return
        try:
            message = decode(shown.type.Request, asked.payload)
        except CdrError as error:
            self._side.unreadable.note("a request cannot be decoded", name, error, service=name)
            asked.fail(shown.node, error)
            return
        chain = tuple(asked.extension.chain)
        cycle = None if server.concurrent else self._clients.cycles.refusal(server.node, chain)
        if cycle is not None:
            asked.fail(shown.node, cycle)
            return
        gid = asked.gid
        caller = RemoteCaller(self.caller_of(gid), self._side.runtime.deadlines, chain, (gid, asked.number))
        request = server.submit(message, caller, math.inf)
        self._open[name] += 1

        def respond(future: asyncio.Future[Any]) -> None:
            self._open[name] -= 1
            error = future.exception()
            if error is None:
                asked.reply(shown.node, future.result())
            else:
                asked.fail(shown.node, error)

        request.future.add_done_callback(respond)

    def refused(self, shown: Shown, name: str, asked: Asked, open: int) -> bool:
        """Whether this request is answered with an error, because so many are open: without a limit they could fill the memory."""
        if open < _MOST_OPEN:
            return False
        why = f"{open:,} requests of other processes to {name} wait for an answer: send fewer at once"
        asked.fail(shown.node, ServiceFailed(shown.node, "request dropped", why))
        return True

    def caller_of(self, gid: bytes) -> str:
        """The name of the node of a client of another process."""
        return self._callers.get(gid, "a node elsewhere")

    def absent(self, node: str, name: str) -> Exception:
        """The error for a request to a server that is not there now."""
        for record in self._side.runtime.directory.records.values():
            if record.identity.fqn == node and record.state != "stopped":
                return NodeRestarting(node, record.incarnation)
        return NotRunning(f"{node}, which served {name}, has stopped: start it again, or ask another service")

    def beside(self, entry: ServerEntry[S]) -> None:
        """Log it if a name is served in this process and in another one."""
        if entry.local is None:
            return
        for remote in entry.remotes:
            self._side.runtime.log.warning(
                f"two servers of one {entry.kind}", name=entry.name, here=entry.local.host, elsewhere=remote.host,
                remedy="give one of them another name or namespace; calls of this process go to the one that is here",
            )  # fmt: skip

    # -- servers and clients of other processes -----------------------------------------------------------------------------

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        """Add a server or a client of another process to the graph."""
        entry = self._graph.service(endpoint.name)
        if endpoint.kind is EndpointKind.CLIENT:
            self._callers[endpoint.gid] = endpoint.node.fqn
            self._asking[endpoint.name, endpoint.node.fqn] += 1
            entry.clients.setdefault(endpoint.node.fqn, 0)
            self._graph.changed()
            return
        server = RemoteServer(endpoint, ForeignType(endpoint.type, endpoint.type_hash), self._clients)
        self._remote[endpoint.gid] = server
        entry.add_remote(server)
        self.beside(entry)

    def vanished(self, endpoint: RemoteEndpoint) -> None:
        """Undo `appeared`."""
        entry, node = self._graph.service(endpoint.name), endpoint.node.fqn
        server = self._remote.pop(endpoint.gid, None)
        if server is not None:
            server.gone = True
            entry.remove_remote(server, node)
        else:
            del self._callers[endpoint.gid]
            self._asking[endpoint.name, node] -= 1
            self._graph.changed()
        if not self._asking[endpoint.name, node]:
            del self._asking[endpoint.name, node]
            entry.forget(node)
