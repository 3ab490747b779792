"""The nodes and endpoints of other processes, as their tokens tell of them. Pure: nothing here waits or sends.

The token of an endpoint contains that of its node, and may arrive before it. A node is known as long as one of its tokens is: its own, or that
of an endpoint.
"""

from __future__ import annotations

from collections import Counter

from actors.transport.format.gids import gid_of
from actors.transport.format.sessions import is_ours
from actors.transport.format.tokens import EndpointToken, parse_token
from actors.transport.protocol import RemoteEndpoint, RemoteNode


class Known:
    """All that is known from tokens.

    Invariants: a node is known exactly as long as at least one token that contains it; an endpoint exactly as long as its token.
    """

    def __init__(self, session: str) -> None:
        """`session` is that of this process."""
        self._marked = is_ours(session)
        self._nodes: dict[tuple[int, str, int], RemoteNode] = {}
        self._of: dict[str, tuple[RemoteNode, RemoteEndpoint | None]] = {}
        """Token -> the node that it contains, and its endpoint."""
        self._tokens: Counter[RemoteNode] = Counter()
        """How many tokens contain a node."""

    def appeared(self, text: str) -> tuple[RemoteNode, bool, RemoteEndpoint | None]:
        """Take in a token. Returns the node, whether it is new, and the endpoint unless the token is the node's own. Raises WireFormatError."""
        token = parse_token(text)
        of_node = token.node if isinstance(token, EndpointToken) else token
        identity = of_node.domain_id, of_node.session, of_node.node_id
        node = self._nodes.get(identity)
        is_new = node is None
        if node is None:
            # A transport that gives its sessions no mark has nobody of ROS 2 on it.
            checks = is_ours(of_node.session) or not self._marked
            fqn = f"{of_node.namespace.rstrip('/')}/{of_node.name}"
            node = RemoteNode(fqn, of_node.session, of_node.node_id, of_node.domain_id, checks_qos=checks)
            self._nodes[identity] = node
        endpoint: RemoteEndpoint | None = None
        if isinstance(token, EndpointToken):
            endpoint = RemoteEndpoint(
                node, token.kind, token.name, token.type, token.type_hash, token.qos, gid_of(text), token.endpoint_id
            )
        self._of[text] = node, endpoint
        self._tokens[node] += 1
        return node, is_new, endpoint

    def vanished(self, text: str) -> tuple[RemoteEndpoint | None, RemoteNode | None]:
        """Forget a token. Returns its endpoint, and the node if it was its last token; nothing for one that `appeared` has refused."""
        node, endpoint = self._of.pop(text, (None, None))
        if node is None:
            return None, None
        self._tokens[node] -= 1
        if self._tokens[node]:
            return endpoint, None
        del self._tokens[node], self._nodes[node.domain_id, *node.identity]
        return endpoint, node
