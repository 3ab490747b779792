"""Clients of this process on the network."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from actors.qos import SERVICES
from actors.transport.format.extensions import NOTHING, Extension, write_extension
from actors.transport.protocol import Answer, Handle, RemoteEndpoint, TypeInfo

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.transport import protocol
    from actors.transport.cycles import Cycles
    from actors.transport.local_side import LocalSide


class Client:
    """One client of one node: its requests are numbered from 1."""

    def __init__(self, side: LocalSide, endpoint: protocol.ClientHere) -> None:
        self._side = side
        self._endpoint = endpoint
        self._sent = 0

    @property
    def next(self) -> tuple[bytes, int]:
        """What identifies its next request: its GID, and the number of the request."""
        return self._endpoint.gid, self._sent + 1

    def ask(
        self,
        payload: bytes,
        done: Callable[[Answer], None],
        extension: Extension | None = None,
        timeout: float | None = None,
    ) -> Handle:
        """Send the next request; see `protocol.ClientHere.ask`. It always has an extension, which says that errors can be read."""
        self._sent += 1
        written = NOTHING if extension is None else write_extension(extension)
        return self._endpoint.ask(payload, self._sent, self._side.wall_ns(), written, timeout, done)

    def close(self) -> None:
        self._endpoint.close()


class Clients:
    """The clients of one system for servers of other processes. A client is made at its first request, and closed when its node has ended
    for good.

    Invariant: a node that has ended for good is in `_ended`, and is shown with its clients, as long as it is in `_held`.
    """

    def __init__(self, side: LocalSide, cycles: Cycles) -> None:
        self.cycles = cycles
        self._side = side
        self._clients: dict[tuple[str, str, str, str], Client] = {}
        self._held: Counter[str] = Counter()
        """How many requests of a node may have to be followed by another one after its end."""
        self._ended: set[str] = set()

    def of(self, node: str, server: RemoteEndpoint) -> Client:
        """The client of a node of this process for a server."""
        key = node, server.name, server.type, server.type_hash
        client = self._clients.get(key)
        if client is None:
            type, side = TypeInfo(server.type, server.type_hash), self._side
            endpoint = side.participant.client(side.node(node), server.name, type, SERVICES)
            client = self._clients[key] = Client(side, endpoint)
        return client

    def hold(self, node: str) -> None:
        """Keep the clients of a node until `release`, also if it ends."""
        self._held[node] += 1

    def release(self, node: str) -> None:
        """Undo `hold`."""
        self._held[node] -= 1
        if not self._held[node]:
            del self._held[node]
            if node in self._ended:
                self.forget(node)

    def started(self, node: str) -> None:
        """A node of this name has started, perhaps after another one that has ended."""
        self._ended.discard(node)

    def forget(self, node: str) -> None:
        """Close the clients of a node that has ended for good, and withdraw the node. Its other endpoints have been closed before."""
        if node in self._held:
            self._ended.add(node)
            return
        self._ended.discard(node)
        for key in [key for key in self._clients if key[0] == node]:
            self._clients.pop(key).close()
        self._side.forget(node)
