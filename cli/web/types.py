"""Types by name: known here, or fetched from the nodes of other processes that use them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

from actors.interfaces import InterfaceError, UnknownInterface, get_action, get_message, get_service
from cli.types import fetched, foreign_uses
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
        return await self._get(get_message, name, users, "")

    async def service(self, service: str, name: str = "") -> Any:
        """The type of a service of the graph, or the one of this name. Raises `Refused` if there is neither."""
        users = _servers(self._system.graph.services.get(service))
        if not name and not users:
            raise Refused(f"nobody serves {service}")
        return await self._get(get_service, name or users[0][1].__ros_type__, users, service)

    async def action(self, action: str, name: str = "") -> Any:
        """The type of an action of the graph, or the one of this name. Raises `Refused` if there is neither."""
        users = _servers(self._system.graph.actions.get(action))
        if not name and not users:
            raise Refused(f"nobody serves the action {action}")
        return await self._get(get_action, name or users[0][1].__ros_type__, users, action)

    async def _get(self, get: Callable[[str], T], name: str, users: Iterable[tuple[str, Any]], served: str) -> T:
        if not _NAME.fullmatch(name):
            raise Refused(f"{name!r:.80} is not the name of a type")
        foreign = foreign_uses(name, users)
        for _, kind in foreign:
            if (why := self._unknown.get((name, kind.type_hash))) is not None:
                raise Refused(why)
        try:
            return await fetched(self._node, self._system, get, name, foreign, served)
        except UnknownInterface as error:
            self._unknown.update({(name, kind.type_hash): str(error) for _, kind in foreign})
            raise Refused(str(error)) from None
        except (InterfaceError, ValueError) as error:
            raise Refused(f"{name} cannot be read: {error}") from None


def _servers(entry: Any) -> list[tuple[str, Any]]:
    """The nodes that serve a name, each with the type that it serves."""
    return [] if entry is None else [(one.host, one.type) for one in (entry.local, *entry.remotes) if one is not None]
