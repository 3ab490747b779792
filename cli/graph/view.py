"""The graph of a domain as its processes announce it: nodes and endpoints, without taking part in it.

A command that only lists needs no node of its own: it reads what the others announce. That is quick, and it leaves no trace in what it lists.
"""

from __future__ import annotations

import argparse
import asyncio
import os
from collections.abc import AsyncGenerator, Callable, Iterable
from contextlib import asynccontextmanager
from typing import NamedTuple

from actors.names.names import InvalidName, is_hidden, validate_full_name
from actors.transport import WireUnavailable, transport_from_environment
from actors.transport.domain_id import domain_from_environment
from actors.transport.format.tokens import EndpointKind
from actors.transport.protocol import Participant, PublisherHere, RemoteEndpoint, RemoteNode, Transport
from cli.command import CommandFailed
from cli.graph.looking import late, settle

PUBLISHER, SUBSCRIPTION, SERVER, CLIENT = EndpointKind

_FEEDBACK = "/_action/feedback"


class Endpoint(NamedTuple):
    """An endpoint of another process."""

    about: RemoteEndpoint

    @property
    def node(self) -> str:
        """The full name of its node."""
        return self.about.node.fqn


class GraphView:
    """The nodes and endpoints that the processes of a domain announce. A transport calls it, as its `Events`.

    Invariant: it holds what has appeared and not vanished.
    """

    def __init__(self) -> None:
        self._nodes: dict[RemoteNode, None] = {}
        self._endpoints: dict[bytes, Endpoint] = {}
        self._news = asyncio.Event()
        self.complete: Callable[[], bool] = lambda: True
        """Whether the transport has found all that the others have told of; see `Participant.complete`."""

    # -- what the transport tells -------------------------------------------------------------------------------------------

    def node(self, node: RemoteNode, there: bool) -> None:
        if there:
            self._nodes[node] = None
        else:
            self._nodes.pop(node, None)
        self._news.set()

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        self._endpoints[endpoint.gid] = Endpoint(endpoint)
        self._news.set()

    def vanished(self, endpoint: RemoteEndpoint) -> None:
        self._endpoints.pop(endpoint.gid, None)
        self._news.set()

    def wanted(self, publisher: PublisherHere) -> None:
        """Do nothing: a view publishes nothing."""

    def liveliness(self, gid: bytes) -> None:
        """Do nothing: a view subscribes to nothing."""

    def link(self, session: str, up: bool) -> None:
        self._news.set()

    def told(self, data: bytes) -> None:
        """Do nothing: nobody of this process waits."""

    def lost(self, taker: object, messages: int) -> None:
        """Do nothing: subscribers count what arrives."""

    def unreadable(self, what: str, place: str, error: Exception, **fields: object) -> None:
        """Do nothing: it is not shown."""

    # -- what commands ask --------------------------------------------------------------------------------------------------

    async def settle(self, most: float) -> None:
        """See `cli.graph.looking.settle`."""
        await settle(self._news, lambda: bool(self._nodes), self.complete, most)

    async def late(self, wanted: Callable[[], bool], most: float) -> bool:
        """Wait for something that is asked for by its name. See `cli.graph.looking.late`."""
        return await late(self._news, wanted, most)

    async def changed(self) -> None:
        """Wait until something appears or vanishes."""
        self._news.clear()
        await self._news.wait()

    def nodes(self, hidden: bool = True) -> list[str]:
        """The full names of all nodes, sorted; one that several nodes share is there several times."""
        return sorted(node.fqn for node in self._nodes if hidden or not is_hidden(node.fqn))

    def endpoints(self, *kinds: EndpointKind, name: str | None = None, node: str | None = None) -> list[Endpoint]:
        """The endpoints of these kinds, of one topic or service, or of one node, by the number that their process gave them."""
        found = [
            end
            for end in self._endpoints.values()
            if end.about.kind in kinds and name in (None, end.about.name) and node in (None, end.node)
        ]
        return sorted(found, key=lambda end: (end.node, end.about.node.session, end.about.number))

    def topics(self, hidden: bool = True) -> dict[str, list[str]]:
        """Each topic with its types, sorted."""
        return _typed(self.endpoints(PUBLISHER, SUBSCRIPTION), hidden)

    def services(self, hidden: bool = True) -> dict[str, list[str]]:
        """Each service with its types, sorted."""
        return _typed(self.endpoints(SERVER, CLIENT), hidden)

    def actions(self) -> dict[str, list[str]]:
        """Each action with its types, sorted."""
        return _actions(self.endpoints(PUBLISHER, SUBSCRIPTION))

    def action_nodes(self, action: str) -> tuple[list[Endpoint], list[Endpoint]]:
        """The clients and the servers of an action, each by the endpoint of its feedback."""
        name = action + _FEEDBACK
        return self.endpoints(SUBSCRIPTION, name=name), self.endpoints(PUBLISHER, name=name)

    def of_node(self, node: str, kind: EndpointKind, hidden: bool) -> dict[str, list[str]]:
        """What a node publishes, subscribes to, serves or calls, with types."""
        return _typed(self.endpoints(kind, node=node), hidden)

    def actions_of_node(self, node: str, kind: EndpointKind) -> dict[str, list[str]]:
        """The actions that a node serves (`PUBLISHER`, of feedback) or uses (`SUBSCRIPTION`)."""
        return _actions(self.endpoints(kind, node=node))


def _typed(ends: Iterable[Endpoint], hidden: bool) -> dict[str, list[str]]:
    found: dict[str, set[str]] = {}
    for end in ends:
        if hidden or not is_hidden(end.about.name):
            found.setdefault(end.about.name, set()).add(end.about.type)
    return {name: sorted(types) for name, types in sorted(found.items())}


def _actions(ends: Iterable[Endpoint]) -> dict[str, list[str]]:
    return {
        name.removesuffix(_FEEDBACK): [type.removesuffix("_FeedbackMessage") for type in types]
        for name, types in _typed(ends, hidden=True).items()
        if name.endswith(_FEEDBACK)
    }


def absolute(name: str) -> str:
    """A name as commands take it: from the root, with or without the leading slash. Raises `CommandFailed` if it cannot be one."""
    full = name if name.startswith("/") else f"/{name}"
    try:
        validate_full_name(full)
    except InvalidName as error:
        raise CommandFailed(str(error)) from None
    return full


def transport_of(options: argparse.Namespace) -> Transport:
    """The transport that the environment and the options ask for. Raises `CommandFailed` if there is none."""
    try:
        transport = transport_from_environment(
            os.environ, listen=tuple(options.listen), connect=tuple(options.connect), security=options.security
        )
    except WireUnavailable as error:
        raise CommandFailed(str(error)) from error
    if transport is None:
        raise CommandFailed("RMW_IMPLEMENTATION is in_process, so no other process is reached: unset it")
    return transport


@asynccontextmanager
async def look(
    options: argparse.Namespace, wanted: Callable[[GraphView], bool] = lambda view: True
) -> AsyncGenerator[GraphView]:
    """The graph of ROS_DOMAIN_ID, as soon as it seems complete, and what is `wanted` of it is there or has been waited for.

    Raises `CommandFailed` if it cannot be reached.
    """
    async with watching(options) as (view, _):
        await view.settle(options.spin_time)
        await view.late(lambda: wanted(view), options.spin_time)
        yield view


@asynccontextmanager
async def watching(options: argparse.Namespace) -> AsyncGenerator[tuple[GraphView, Participant]]:
    """A view of the graph from its beginning, and what this process may have in it. Raises `CommandFailed` if it cannot be reached."""
    transport = transport_of(options)
    view = GraphView()
    try:
        participant = await transport.join(domain_from_environment(os.environ), view)
        view.complete = lambda: participant.complete
    except (WireUnavailable, ValueError) as error:
        raise CommandFailed(str(error)) from error
    try:
        yield view, participant
    finally:
        await transport.close()
