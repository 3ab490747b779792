"""What all sessions that look at one graph share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cli.web.clients.conversion import Conversions
from cli.web.graph.catalog import Catalog
from cli.web.graph.client_nodes import ClientNodes
from cli.web.graph.parameters import Parameters
from cli.web.graph.types import Types

if TYPE_CHECKING:
    from actors import Node, System
    from cli.web.clients.client import Client
    from cli.web.graph.feeds import Feeds
    from cli.web.graph.overview import Overview
    from cli.web.recordings.bags import Bags
    from cli.web.recordings.playback import Playback, RecordedFeeds


@dataclass(frozen=True)
class Hub:
    """A node, the system that it is in, what it knows of the one that it shows, and what is made for all clients together that look at it."""

    node: Node
    system: System
    overview: Overview
    types: Types
    feeds: Feeds | RecordedFeeds
    catalog: Catalog
    client_nodes: ClientNodes
    parameters: Parameters
    conversions: Conversions
    clients: dict[int, Client]
    """The clients that are connected to the server, by number."""
    bags: Bags
    playback: Playback | None
    """How the graph is played, if it is that of a recording."""


def make_hub(
    node: Node,
    system: System,
    feeds: Feeds | RecordedFeeds,
    clients: dict[int, Client],
    bags: Bags,
    overview: Overview,
    playback: Playback | None = None,
) -> Hub:
    """What is made for the clients of this node's system."""
    types = Types(node, system)
    return Hub(
        node=node, system=system, overview=overview, types=types, feeds=feeds, catalog=Catalog(node, system, types),
        client_nodes=ClientNodes(system), parameters=Parameters(node, system), conversions=Conversions(), clients=clients,
        bags=bags, playback=playback,
    )  # fmt: skip
