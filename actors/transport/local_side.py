"""What this process shows of itself on the network: its nodes and endpoints, as tokens."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.transport.format.gids import gid_of
from actors.transport.format.tokens import EndpointKind, EndpointToken, NodeToken, write_token
from actors.transport.unreadable import Unreadable

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.runtime.runtime import Runtime
    from actors.transport.format.buffers import Backend
    from actors.transport.protocol import Handle, Transport

__all__ = ["Endpoint", "LocalSide"]


class Endpoint:
    """An endpoint of this process, as it is shown on the network.

    Invariant: it is shown once, from `show` to `close`.
    """

    def __init__(self, transport: Transport, token: EndpointToken) -> None:
        self.token = token
        self._text = write_token(token)
        self.gid = gid_of(self._text)
        """Its identifier, which is sent with each of its messages."""
        self._transport = transport
        self._handle: Handle | None = None

    def show(self) -> None:
        """Announce it. To be called after it has been declared to the transport; calling it twice is harmless."""
        if self._handle is None:
            self._handle = self._transport.announce(self._text)

    def close(self) -> None:
        """Withdraw it."""
        assert self._handle is not None
        self._handle.close()


class LocalSide:
    """One system on the network: its transport, its domain, and the numbers of its nodes and endpoints.

    Invariants: nodes and endpoints are numbered together, from 0. A node keeps its number until it has ended for good; each new endpoint has
    a new one. A node is shown from its first endpoint, or its first start, until it has ended for good.
    """

    def __init__(self, transport: Transport, domain_id: int, runtime: Runtime) -> None:
        self.transport = transport
        self.domain_id = domain_id
        self.runtime = runtime
        self.wall_ns = runtime.clock.wall_ns
        """The time of day, in nanoseconds since 1970."""
        self.unreadable = Unreadable(runtime.log.warning)
        self._nodes: dict[str, tuple[NodeToken, Handle]] = {}
        self._numbers = 0

    def node(self, fqn: str) -> NodeToken:
        """The token of a node of this process, which is shown from now on. Raises WireFormatError."""
        known = self._nodes.get(fqn)
        if known is None:
            namespace, _, name = fqn.rpartition("/")
            token = NodeToken(self.domain_id, self.transport.session, self._numbers, name, namespace or "/")
            text = write_token(token)
            self._numbers += 1
            known = self._nodes[fqn] = token, self.transport.announce(text)
        return known[0]

    def named(self, number: int) -> str | None:
        """The name of the node with this number; None if there is none."""
        return next((fqn for fqn, (token, _) in self._nodes.items() if token.node_id == number), None)

    def endpoint(
        self,
        node: str,
        kind: EndpointKind,
        name: str,
        type: tuple[str, str],
        qos: QoS,
        backends: tuple[Backend, ...] = (),
    ) -> Endpoint:
        """A new endpoint, of a type that is given by name and hash. It is not shown yet. Raises WireFormatError."""
        of_node = self.node(node)
        token = EndpointToken(of_node, self._numbers, kind, name, *type, qos, backends)
        endpoint = Endpoint(self.transport, token)
        self._numbers += 1
        return endpoint

    def forget(self, fqn: str) -> None:
        """Withdraw a node that has ended for good. Its endpoints have been closed before."""
        known = self._nodes.pop(fqn, None)
        if known is not None:
            known[1].close()
