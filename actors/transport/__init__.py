"""The transport: the connection of this process's graph with those of other processes and machines."""

from actors.transport.environment import transport_from_environment
from actors.transport.format.tokens import EndpointKind
from actors.transport.protocol import (
    Answer,
    ClientHere,
    EndpointHere,
    Events,
    Failed,
    Handle,
    Link,
    NoAnswer,
    NodeHere,
    Participant,
    PublisherHere,
    RemoteEndpoint,
    RemoteNode,
    Replied,
    Request,
    Take,
    Transport,
    TypeInfo,
    WireUnavailable,
)

__all__ = [
    "Answer",
    "ClientHere",
    "EndpointHere",
    "EndpointKind",
    "Events",
    "Failed",
    "Handle",
    "Link",
    "NoAnswer",
    "NodeHere",
    "Participant",
    "PublisherHere",
    "RemoteEndpoint",
    "RemoteNode",
    "Replied",
    "Request",
    "Take",
    "Transport",
    "TypeInfo",
    "WireUnavailable",
    "transport_from_environment",
]
