"""What all sessions of a server share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors import Node, System
    from cli.web.client import Client
    from cli.web.feeds import Feeds
    from cli.web.foxglove.catalog import Catalog
    from cli.web.guests import Guests
    from cli.web.overview import Overview
    from cli.web.parameters import Parameters
    from cli.web.types import Types

__all__ = ["Hub"]


@dataclass(frozen=True)
class Hub:
    """The node of the server, the system that it is in, what it knows of the one that it shows, and what is made for all clients together."""

    node: Node
    system: System
    overview: Overview
    types: Types
    feeds: Feeds
    catalog: Catalog
    guests: Guests
    parameters: Parameters
    clients: dict[int, Client] = field(default_factory=dict["int", "Client"])
    """The clients that are connected, by number."""
