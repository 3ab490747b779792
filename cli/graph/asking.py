"""Asking a node for one of the services that every node has, such as those of its parameters."""

from __future__ import annotations

import argparse
import asyncio
from typing import Any

from actors import ActorError, Service
from actors.names.names import is_hidden
from actors.suggest import did_you_mean
from cli.command import CommandFailed
from cli.graph import looking
from cli.graph.seen import Seen
from cli.graph.view import absolute

LOOK = 0.05
"""Seconds between two looks for a node."""


def node_names(graph: Seen, hidden: bool = False) -> list[str]:
    """The full names of the nodes of other processes, sorted."""
    names = {node.fqn for node in graph.system.graph.elsewhere()}
    return sorted(name for name in names if hidden or not is_hidden(name))


async def found_node(graph: Seen, name: str, timeout: float | None = None) -> str:
    """The full name of a node that is there, or appears within `timeout` seconds. Raises `CommandFailed`: Node not found."""
    full = absolute(name)
    end = asyncio.get_running_loop().time() + (looking.LATE if timeout is None else timeout)
    while full not in node_names(graph, hidden=True):
        if asyncio.get_running_loop().time() >= end:
            raise CommandFailed(f"Node not found{did_you_mean(full, node_names(graph))}")
        await asyncio.sleep(LOOK)
    return full


async def ask(graph: Seen, node: str, service: Service[Any, Any], request: Any, options: argparse.Namespace) -> Any:
    """The answer of a node to a request. Raises `CommandFailed` if it does not serve it, or does not answer in time."""
    seconds = getattr(options, "service_timeout", None) or 5.0
    try:
        return await graph.node.call(service, request, timeout=seconds)
    except ActorError as error:
        raise CommandFailed(f"Exception while calling service of node '{node}': {error}") from None
