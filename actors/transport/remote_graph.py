"""The nodes and endpoints of other processes, as their tokens tell of them. Pure: nothing here waits or sends.

The token of an endpoint contains that of its node, and may arrive before it. A node is known as long as one of its tokens is: its own, or that
of an endpoint.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from actors.transport.format.tokens import EndpointToken, NodeToken, parse_token

__all__ = ["RemoteGraph", "RemoteNode"]


class RemoteNode:
    """A node of another process. For the graph it is the node of its endpoints."""

    def __init__(self, token: NodeToken) -> None:
        self.token = token
        self.fqn = f"{token.namespace.rstrip('/')}/{token.name}"

    @property
    def session(self) -> str:
        """The identity of its process on the network."""
        return self.token.session

    @property
    def identity(self) -> tuple[str, int]:
        """What distinguishes it from all other nodes, also from those of its name."""
        return self.token.session, self.token.node_id

    def warn(self, event: str, **fields: object) -> None:
        """Do nothing: its own process logs the same."""


class RemoteGraph:
    """All that is known from tokens.

    Invariants: a node is known exactly as long as at least one token that contains it; an endpoint exactly as long as its token.
    """

    def __init__(self) -> None:
        self._nodes: dict[tuple[str, int], RemoteNode] = {}
        self._of: dict[str, RemoteNode] = {}
        """Token -> the node that it contains."""
        self._tokens: Counter[tuple[str, int]] = Counter()
        """How many tokens contain a node."""

    def __iter__(self) -> Iterator[RemoteNode]:
        return iter(list(self._nodes.values()))

    def appeared(self, text: str) -> tuple[RemoteNode, EndpointToken | None]:
        """Take in a token. Returns the node, and the endpoint unless the token is the node's own. Raises WireFormatError."""
        token = parse_token(text)
        of_node = token.node if isinstance(token, EndpointToken) else token
        identity = of_node.session, of_node.node_id
        node = self._nodes.get(identity)
        if node is None:
            node = self._nodes[identity] = RemoteNode(of_node)
        self._of[text] = node
        self._tokens[identity] += 1
        return node, token if isinstance(token, EndpointToken) else None

    def vanished(self, text: str) -> bool:
        """Forget a token. Returns whether it was the last one of its node; False for a token that `appeared` has refused."""
        node = self._of.pop(text, None)
        if node is None:
            return False
        self._tokens[node.identity] -= 1
        if self._tokens[node.identity]:
            return False
        del self._nodes[node.identity], self._tokens[node.identity]
        return True
