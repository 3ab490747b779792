"""Liveliness tokens: key expressions that exist as long as a node or endpoint, and from which every peer builds its view of the graph.

::

    @ros2_lv/<domain>/<session>/<node id>/<node id>/NN/<enclave>/<namespace>/<node name>
    @ros2_lv/<domain>/<session>/<node id>/<id>/<MP|MS|SS|SC>/<enclave>/<namespace>/<node name>/<name>/<type>/<type hash>/<qos>[/<backends>]

A session numbers its nodes and endpoints together, from 0. An endpoint is declared before its token, and the token is withdrawn first.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Final, NamedTuple

from actors.qos.policies import QoS
from actors.transport.format.buffers import Backend, parse_backends, write_backends
from actors.transport.format.errors import refuse
from actors.transport.format.keys import DataKey
from actors.transport.format.names import (
    check_chunk,
    check_number,
    check_session,
    parse_name,
    parse_namespace,
    parse_number,
    parse_type,
    write_name,
    write_type,
)
from actors.transport.format.qos import parse_qos, write_qos

_SPACE: Final = "@ros2_lv"
ALL_GRAPHS: Final = f"{_SPACE}/**"
"""The key expression that matches all tokens of all domains."""
_NODE: Final = "NN"
_NODE_PARTS: Final = 9
_ENDPOINT_PARTS: Final = 13


class EndpointKind(StrEnum):
    """The kind of an endpoint."""

    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVER = "SS"
    CLIENT = "SC"


class NodeToken(NamedTuple):
    """The content of a node's token. Two tokens are of the same node if domain, session and id are equal."""

    domain_id: int
    session: str
    """The Zenoh id of its process, in hex as printed by Zenoh."""
    node_id: int
    name: str
    namespace: str = "/"
    enclave: str = "/"
    """The security enclave of the node; ``/`` if it has none."""


class EndpointToken(NamedTuple):
    """The content of an endpoint's token. It includes that of its node, whose own token may arrive later."""

    node: NodeToken
    endpoint_id: int
    kind: EndpointKind
    name: str
    """The full name of its topic or service."""
    type: str
    type_hash: str
    qos: QoS
    backends: tuple[Backend, ...] = ()
    """The memories that a subscription reads, if its type and its distribution of ROS 2 support them (see `buffers`)."""

    @property
    def key(self) -> DataKey:
        """The key of its messages, or of its requests and replies."""
        return DataKey(self.node.domain_id, self.name, self.type, self.type_hash)


def graph_of(domain_id: int) -> str:
    """The key expression that matches all tokens of a domain. Raises WireFormatError."""
    return f"{_SPACE}/{check_number(domain_id, 'a domain id')}/**"


def write_token(token: NodeToken | EndpointToken) -> str:
    """Write a token as a key expression. Raises WireFormatError."""
    if isinstance(token, NodeToken):
        return _write_node(token, token.node_id, _NODE)
    parts = [
        _write_node(token.node, token.endpoint_id, token.kind),
        write_name(token.name),
        write_type(token.type),
        check_chunk(token.type_hash, "a type hash"),
        write_qos(token.qos),
    ]
    if token.name == "/":
        raise refuse(token.name, "the name of a topic or service", "it is the root")
    if token.backends:
        parts.append(write_backends(token.backends))
    return "/".join(parts)


def _write_node(node: NodeToken, entity_id: int, kind: str) -> str:
    domain = check_number(node.domain_id, "a domain id")
    session = check_session(node.session)
    ids = f"{check_number(node.node_id, 'a node id')}/{check_number(entity_id, 'an endpoint id')}"
    place = f"{write_name(node.enclave)}/{write_name(node.namespace)}/{check_chunk(node.name, 'the name of a node')}"
    return f"{_SPACE}/{domain}/{session}/{ids}/{kind}/{place}"


def parse_token(text: str) -> NodeToken | EndpointToken:
    """Parse a token. Raises WireFormatError.

    Additional parts are ignored, and so is the second number of a node, which ROS 2 writes equal to the first.
    """
    parts = text.split("/")
    if len(parts) < _NODE_PARTS or parts[0] != _SPACE:
        raise refuse(
            text, "a token of ROS 2", f"it does not begin with {_SPACE}, or has fewer than {_NODE_PARTS} parts"
        )
    domain, session, node_id, entity_id, kind, enclave, namespace, name = parts[1:_NODE_PARTS]
    node = NodeToken(
        parse_number(domain, "a domain id"),
        check_session(session),
        parse_number(node_id, "a node id"),
        check_chunk(name, "the name of a node"),
        parse_namespace(namespace),
        parse_namespace(enclave),
    )
    if kind == _NODE:
        return node
    if kind not in tuple(EndpointKind) or len(parts) < _ENDPOINT_PARTS:
        raise refuse(
            text, "a token of ROS 2", f"{kind!r:.30} is no kind, or an endpoint has fewer than {_ENDPOINT_PARTS} parts"
        )
    endpoint, type_name, type_hash, qos = parts[_NODE_PARTS:_ENDPOINT_PARTS]
    return EndpointToken(
        node,
        parse_number(entity_id, "an endpoint id"),
        EndpointKind(kind),
        parse_name(endpoint),
        parse_type(type_name),
        check_chunk(type_hash, "a type hash"),
        parse_qos(qos),
        parse_backends(parts[_ENDPOINT_PARTS]) if len(parts) > _ENDPOINT_PARTS else (),
    )
