"""Types by name: known here, or fetched from the nodes of other processes that use them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

from actors.interfaces import InterfaceError, UnknownInterface, get_action, get_message, get_service
from actors.interfaces.foreign import ForeignType
from actors.interfaces.registry import find
from actors.node.remote_types import action_parts, fetch
from cli.web.errors import Refused

if TYPE_CHECKING:
    from actors import Node, System

__all__ = ["Types"]

T = TypeVar("T")

_NAME = re.compile(r"[A-Za-z]\w{0,80}/(msg|srv|action)/[A-Za-z]\w{0,120}", re.ASCII)
"""What may be looked for in the folders of definitions."""


class Types:
    """The types of one graph.

    Invariant: `_unknown` holds the names that nobody could describe, with the hash for which that was tried, and what is said of them, so that
    nobody is asked twice.
    """

    def __init__(self, node: Node, system: System) -> None:
        self._node = node
        self._system = system
        self._unknown: dict[tuple[str, str], str] = {}

    async def message(self, name: str, users: Iterable[tuple[str, Any]] = ()) -> Any:
        """The message class of this name. `users` are the nodes that use it, each with the type as it knows it. Raises `Refused`."""
        return await self._get(get_message, name, users, lambda kind: [(name, kind.type_hash)])

    async def service(self, service: str, name: str = "") -> Any:
        """The type of a service of the graph, or the one of this name. Raises `Refused` if there is neither."""
        entry = self._system.graph.services.get(service)
        users = (
            [] if entry is None else [(one.host, one.type) for one in (entry.local, *entry.remotes) if one is not None]
        )
        if not name and not users:
            raise Refused(f"nobody serves {service}")
        name = name or users[0][1].__ros_type__
        return await self._get(get_service, name, users, lambda kind: [(name, kind.type_hash)])

    async def action(self, action: str, name: str = "") -> Any:
        """The type of an action of the graph, or the one of this name. Raises `Refused` if there is neither."""
        entry = self._system.graph.actions.get(action)
        users = (
            [] if entry is None else [(one.host, one.type) for one in (entry.local, *entry.remotes) if one is not None]
        )
        if not name and not users:
            raise Refused(f"nobody serves the action {action}")
        name = name or users[0][1].__ros_type__
        return await self._get(get_action, name, users, lambda _: action_parts(self._system.graph, action, name))

    async def _get(
        self,
        get: Callable[[str], T],
        name: str,
        users: Iterable[tuple[str, Any]],
        parts: Callable[[Any], list[tuple[str, str]]],
    ) -> T:
        if not _NAME.fullmatch(name):
            raise Refused(f"{name!r:.80} is not the name of a type")
        foreign = [(node, kind) for node, kind in users if isinstance(kind, ForeignType)]
        for _, kind in foreign:
            if (why := self._unknown.get((name, kind.type_hash))) is not None:
                raise Refused(why)
        try:
            if foreign and find(name) is None:
                await fetch(self._node, name, parts(foreign[0][1]), (node for node, _ in foreign))
            return get(name)
        except UnknownInterface as error:
            self._unknown.update({(name, kind.type_hash): str(error) for _, kind in foreign})
            raise Refused(str(error)) from None
        except (InterfaceError, ValueError) as error:
            raise Refused(f"{name} cannot be read: {error}") from None
