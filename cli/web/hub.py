"""What all sessions that look at one graph share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cli.web.foxglove.catalog import Catalog
from cli.web.guests import Guests
from cli.web.parameters import Parameters
from cli.web.types import Types

if TYPE_CHECKING:
    from actors import Node, System
    from cli.web.bags import Bags
    from cli.web.client import Client
    from cli.web.feeds import Feeds
    from cli.web.playback import Playback, RecordedFeeds

__all__ = ["Hub", "make_hub"]


@dataclass(frozen=True)
class Hub:
    """A node, the system that it is in, and what is made for all clients together that look at it."""

    node: Node
    system: System
    types: Types
    feeds: Feeds | RecordedFeeds
    catalog: Catalog
    guests: Guests
    parameters: Parameters
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
    playback: Playback | None = None,
) -> Hub:
    """What is made for the clients of this node's system."""
    types = Types(node, system)
    return Hub(
        node=node, system=system, types=types, feeds=feeds, catalog=Catalog(node, system, types), guests=Guests(system),
        parameters=Parameters(node, system), clients=clients, bags=bags, playback=playback,
    )  # fmt: skip
