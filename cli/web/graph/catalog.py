"""The topics and services of the graph as Foxglove's channels and services: numbered, with their definitions."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.bag.offers import known_type, offers
from actors.errors import ActorError
from actors.interfaces import InterfaceError, Message, schema_text
from actors.names.names import is_hidden
from actors.runtime.incarnation import incarnation_of
from actors.runtime.standard import PARAMETER_SERVICES, TYPE_DESCRIPTION
from actors.transport.standard_names import standard_services
from cli.web.clients.errors import Refused

if TYPE_CHECKING:
    from actors import Node, System
    from cli.web.graph.types import Types

Get = Callable[[], Awaitable[Any]]

PATIENCE: Final = 5.0
AT_ONCE: Final = 64
"""Nodes that are asked for a type at the same time."""
UNLISTED = (*PARAMETER_SERVICES, TYPE_DESCRIPTION)
"""Services of every node that are not listed: the protocol has parameters and definitions of its own."""


class Channel(NamedTuple):
    """A topic of one type."""

    id: int
    topic: str
    type: type[Message]

    @property
    def advertised(self) -> dict[str, Any]:
        """As it is shown to clients."""
        return {
            "id": self.id, "topic": self.topic, "encoding": "cdr", "schemaName": self.type.__ros_type__,
            "schema": schema_text(self.type), "schemaEncoding": "ros2msg",
        }  # fmt: skip


class ServedService(NamedTuple):
    """A service."""

    id: int
    name: str
    type: Any

    @property
    def advertised(self) -> dict[str, Any]:
        """As it is shown to clients."""
        parts = {
            word: {
                "encoding": "cdr", "schemaName": part.__ros_type__, "schemaEncoding": "ros2msg", "schema": schema_text(part),
            }
            for word, part in (("request", self.type.Request), ("response", self.type.Response))
        }  # fmt: skip
        return {"id": self.id, "name": self.name, "type": self.type.__ros_type__, **parts}


class Changes(NamedTuple):
    """What has come and gone since the last look."""

    channels: list[Channel]
    gone_channels: list[int]
    services: list[ServedService]
    gone_services: list[int]


class Catalog:
    """The channels and services, by number.

    Invariants: a number is never used again. A topic or service whose type nobody can describe is not listed.
    """

    def __init__(self, node: Node, system: System, types: Types) -> None:
        self._node = node
        self._system = system
        self._types = types
        self._ids = count(1)
        self._lock = asyncio.Lock()
        self.channels: dict[int, Channel] = {}
        self.services: dict[int, ServedService] = {}

    async def update(self) -> Changes:
        """Look at the graph. Waits up to `PATIENCE` seconds for the definitions of types that this process does not know."""
        async with self._lock:
            topics, services = await self._topics(), await self._services()
            listed = {(one.topic, one.type.__ros_type__): one for one in self.channels.values()}
            served = {(one.name, one.type.__ros_type__): one for one in self.services.values()}
            changes = Changes(
                [
                    Channel(next(self._ids), name, topics[name, type])
                    for name, type in topics
                    if (name, type) not in listed
                ],
                [one.id for key, one in listed.items() if key not in topics],
                [
                    ServedService(next(self._ids), name, services[name, type])
                    for name, type in services
                    if (name, type) not in served
                ],
                [one.id for key, one in served.items() if key not in services],
            )
            for gone in changes.gone_channels:
                del self.channels[gone]
            for gone in changes.gone_services:
                del self.services[gone]
            self.channels.update({one.id: one for one in changes.channels})
            self.services.update({one.id: one for one in changes.services})
            return changes

    async def _topics(self) -> dict[tuple[str, str], Any]:
        found: dict[tuple[str, str], Any] = {}
        wanted: dict[tuple[str, str], Get] = {}
        for offer in list(offers(self._system.graph, incarnation_of(self._node), unpublished=True)):
            name = offer.entry.name
            if is_hidden(name) and "/_action/" not in name:
                continue
            ends: list[Any] = [*offer.entry.publishers, *offer.entry.subscriptions]
            kind = offer.type or next(
                (known_type(end.type) for end in ends if end.type.__ros_type__ == offer.type_name), None
            )
            if kind is None:
                users = [(end.node.fqn, end.type) for end in ends if end.type.__ros_type__ == offer.type_name]
                wanted[name, offer.type_name] = partial(self._types.message, offer.type_name, users)
            else:
                found[name, kind.__ros_type__] = kind
        return found | await _described(wanted)

    def all_services(self) -> list[tuple[str, str]]:
        """The names and types of all services but hidden ones and those of actions, also of those that are opened when they are called."""
        found: dict[str, str] = {}
        for record in list(self._system.nodes.values()):
            if record.life is not None and not is_hidden(record.identity.fqn):
                found |= {one.name: one.type.__ros_type__ for one in standard_services(record.life)}
        for name, entry in list(self._system.graph.services.items()):
            if entry.server is not None and not is_hidden(name):
                found[name] = entry.server.type.__ros_type__
        return list(found.items())

    async def _services(self) -> dict[tuple[str, str], Any]:
        wanted: dict[tuple[str, str], Get] = {}
        for name, type_name in self.all_services():
            if name.rpartition("/")[2] not in UNLISTED:
                wanted[name, type_name] = partial(self._types.service, name, type_name)
        return await _described(wanted)


async def _described(wanted: dict[tuple[str, str], Get]) -> dict[tuple[str, str], Any]:
    """Those of the types that can be described as a schema, each asked for beside the others: a node that does not answer delays no other."""
    found: dict[tuple[str, str], Any] = {}
    turn = asyncio.Semaphore(AT_ONCE)

    async def describe(key: tuple[str, str], get: Get) -> None:
        async with turn:
            with suppress(Refused, InterfaceError, ActorError, RecursionError):
                kind: Any = await get()
                schema_text(getattr(kind, "Request", kind))
                found[key[0], kind.__ros_type__] = kind

    with suppress(TimeoutError):
        async with asyncio.timeout(PATIENCE):
            await asyncio.gather(*(describe(key, get) for key, get in wanted.items()))
    return {key: found[key] for key in wanted if key in found}
