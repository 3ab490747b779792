"""Servers of this process on the network, and the requests that come from other processes."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from actors.errors import CallCycle, NodeRestarting, NotRunning, ServiceFailed
from actors.interfaces.cdr import decode, encode
from actors.interfaces.errors import CdrError
from actors.interfaces.foreign import ForeignType
from actors.qos import SERVICES
from actors.transport.chains import RemoteCaller
from actors.transport.format.attachments import Attachment, parse_attachment, write_attachment
from actors.transport.format.errors import WireFormatError
from actors.transport.format.extensions import Extension, parse_extension, write_extension
from actors.transport.format.gids import gid_of
from actors.transport.format.keys import write_key
from actors.transport.format.replies import write_reply_error
from actors.transport.format.tokens import EndpointKind
from actors.transport.remote_services import RemoteServer
from actors.transport.types_here import described_type

if TYPE_CHECKING:
    from actors.graph.servers import ServerEntry
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS
    from actors.services.server import Server
    from actors.transport.format.tokens import EndpointToken
    from actors.transport.local_clients import Clients
    from actors.transport.local_side import Endpoint, LocalSide
    from actors.transport.protocol import Handle, Query
    from actors.transport.remote_graph import RemoteNode

__all__ = ["Asked", "Services", "Shown"]


class Asked:
    """A request that has come from another process.

    It is answered once. An error reaches only a client that can read it; a client of ROS 2 gets no answer, as from a server of ROS 2.
    """

    def __init__(self, side: LocalSide, query: Query, sent: Attachment, extension: Extension | None) -> None:
        self._side = side
        self._query = query
        self._sent = sent
        self._reads_errors = extension is not None
        self.gid = sent.gid
        self.number = sent.sequence_number
        self.extension = extension or Extension()
        self.payload = query.payload

    def reply(self, server: str, response: Message, reason: str = "") -> None:
        """Answer it, as the node `server`."""
        try:
            payload = encode(response)
        except CdrError as error:
            self.fail(server, error)
            return
        extension = write_extension(Extension(reason=reason)) if reason else b""
        sent = Attachment(self._sent.sequence_number, self._side.wall_ns(), self._sent.gid, extension)
        self._query.reply(payload, write_attachment(sent))

    def fail(self, server: str, error: BaseException) -> None:
        """Answer it with an error, as the node `server`."""
        if not self._reads_errors:
            self._query.drop()
            return
        if not isinstance(error, (CallCycle, NodeRestarting, NotRunning, ServiceFailed)):
            error = ServiceFailed(server, type(error).__name__, str(error))
        self._query.fail(write_reply_error(error))


class Shown(NamedTuple):
    """A server of this process, as it is shown."""

    node: str
    type: Any
    endpoint: Endpoint
    handle: Handle

    def close(self) -> None:
        self.endpoint.close()
        self.handle.close()


class Services:
    """The services of one system on the network.

    Invariants:

    * A service that a node declares is shown from its first start until its node has ended for good: in between, who calls it is told that
      the node is being restarted. Standard services are shown by `promise`, and opened by the first request.
    * Each server of another process stands in the graph as long as its token is known.
    """

    def __init__(self, side: LocalSide, clients: Clients) -> None:
        self._side = side
        self._clients = clients
        self._graph = side.runtime.graph
        self._shown: dict[str, Shown] = {}
        self._promised: dict[str, Shown] = {}
        self._remote: dict[str, RemoteServer] = {}
        self._callers: dict[bytes, str] = {}
        """GID of a client of another process -> its node."""

    # -- servers of this process --------------------------------------------------------------------------------------------

    def server_changed(self, entry: ServerEntry[Any]) -> None:
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
        self, node: str, name: str, type: Any, qos: QoS, take: Callable[[Shown, str, Asked], None] | None = None
    ) -> None:
        """Show a standard service of a node, until `forget`. Requests go to `take`, or open the service."""
        if name not in self._promised:
            self._promised[name] = self.show(node, name, type, qos, take or self.answer)

    def forget(self, node: str) -> None:
        """Withdraw the standard services of a node that has ended for good."""
        for name in [name for name, shown in self._promised.items() if shown.node == node]:
            self._promised.pop(name).close()

    def show(self, node: str, name: str, type: Any, qos: QoS, take: Callable[[Shown, str, Asked], None]) -> Shown:
        endpoint = self._side.endpoint(node, EndpointKind.SERVER, name, described_type(type), qos)

        def arrived(query: Query) -> None:
            try:
                sent = parse_attachment(query.attachment)
                extension = parse_extension(sent.extension)
            except WireFormatError as error:
                self._side.unreadable.note("a request has no attachment that can be read", name, error, service=name)
                query.drop()  # as in ROS 2
            else:
                take(shown, name, Asked(self._side, query, sent, extension))

        shown = Shown(node, type, endpoint, self._side.transport.serve(write_key(endpoint.token.key), arrived))
        endpoint.show()
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
        caller = RemoteCaller(self.caller_of(asked.gid), self._side.runtime.deadlines, chain, (asked.gid, asked.number))
        request = server.submit(message, caller, math.inf)

        def respond(future: asyncio.Future[Any]) -> None:
            error = future.exception()
            if error is None:
                asked.reply(shown.node, future.result())
            else:
                asked.fail(shown.node, error)

        request.future.add_done_callback(respond)

    def caller_of(self, gid: bytes) -> str:
        """The name of the node of a client of another process."""
        return self._callers.get(gid, "a node elsewhere")

    def absent(self, node: str, name: str) -> Exception:
        """The error for a request to a server that is not there now."""
        for record in self._side.runtime.directory.records.values():
            if record.identity.fqn == node and record.state != "stopped":
                return NodeRestarting(node, record.incarnation)
        return NotRunning(f"{node}, which served {name}, has stopped: start it again, or ask another service")

    def beside(self, entry: ServerEntry[Any]) -> None:
        """Log it if a name is served in this process and in another one."""
        if entry.local is None:
            return
        for remote in entry.remotes:
            self._side.runtime.log.warning(
                f"two servers of one {entry.kind}", name=entry.name, here=entry.local.host, elsewhere=remote.host,
                remedy="give one of them another name or namespace; calls of this process go to the one that is here",
            )  # fmt: skip

    # -- servers and clients of other processes -----------------------------------------------------------------------------

    def appeared(self, node: RemoteNode, token: EndpointToken, text: str) -> None:
        """Add a server or a client of another process to the graph."""
        entry = self._graph.service(token.name)
        if token.kind is EndpointKind.CLIENT:
            self._callers[gid_of(text)] = node.fqn
            entry.clients.setdefault(node.fqn, 0)
            self._graph.changed()
            return
        server = RemoteServer(node, token, ForeignType(token.type, token.type_hash), self._clients)
        self._remote[text] = server
        entry.add_remote(server)
        self.beside(entry)

    def vanished(self, token: EndpointToken, text: str) -> None:
        """Undo `appeared`."""
        entry = self._graph.service(token.name)
        server = self._remote.pop(text, None)
        if server is not None:
            server.gone = True
            entry.remove_remote(server, server.host)
            entry.forget(server.host)
        else:
            entry.forget(self._callers.pop(gid_of(text)))
            self._graph.changed()
