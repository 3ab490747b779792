"""The transport: the connection of this process's graph with those of other processes and machines."""

from actors.transport.environment import transport_from_environment
from actors.transport.protocol import (
    Answer,
    Delivery,
    Events,
    Failed,
    Handle,
    Link,
    NoAnswer,
    Outlet,
    Query,
    Replied,
    Sample,
    Transport,
    WireUnavailable,
)

__all__ = [
    "Answer",
    "Delivery",
    "Events",
    "Failed",
    "Handle",
    "Link",
    "NoAnswer",
    "Outlet",
    "Query",
    "Replied",
    "Sample",
    "Transport",
    "WireUnavailable",
    "transport_from_environment",
]
