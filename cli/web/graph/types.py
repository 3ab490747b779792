"""Types by name: known here, or fetched from the nodes of other processes that use them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from math import inf
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

from actors.interfaces import InterfaceError, UnknownInterface, get_action, get_message, get_service
from cli.graph.types import fetched, foreign_uses
from cli.web.clients.errors import Refused

if TYPE_CHECKING:
    from actors import Node, System

T = TypeVar("T")

AGAIN: Final = 30.0
"""Seconds after which nodes that have not described a type are asked again: they may have stood still."""
MOST_FAILURES: Final = 1024

_NAME = re.compile(r"[A-Za-z]\w{0,80}/(msg|srv|action)/[A-Za-z]\w{0,120}", re.ASCII)
"""What may be looked for in the folders of definitions."""


class _Failure(NamedTuple):
    """Why a type could not be had."""

    why: str
    until: float
    """Nobody is asked for it before this time of the system's clock."""


class Types:
    """The types of one graph.

    Invariant: `_failures` holds the newest `MOST_FAILURES` types that could not be had, by name and hash, so that a node is not asked
    again for what it has described wrongly, nor soon for what it has not described.
    """

    def __init__(self, node: Node, system: System) -> None:
        self._node = node
        self._system = system
        self._failures: dict[tuple[str, str], _Failure] = {}

    async def message(self, name: str, users: Iterable[tuple[str, Any]] = ()) -> Any:
        """The message class of this name. `users` are the nodes that use it, each with the type as it knows it. Raises `Refused`."""
        return await self._get(get_message, name, users, "")

    async def topic(self, topic: str, name: str = "") -> Any:
        """The message class of a topic of the graph, or the one of this name. Raises `Refused` if there is neither, or the topic has another."""
        entry = self._system.graph.topics.get(topic)
        ends: list[Any] = [] if entry is None else [*entry.publishers, *entry.subscriptions]
        used = list(dict.fromkeys(end.type.__ros_type__ for end in ends))
        if not used and not name:
            raise Refused(f"nobody uses {topic} yet: name its type")
        if used and name and name not in used:
            raise Refused(f"{topic} has the type {' and '.join(used)}, not {name}")
        return await self.message(name or used[0], [(end.node.fqn, end.type) for end in ends])

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
        now = self._system.clock.now()
        for _, kind in foreign:
            failure = self._failures.get((name, kind.type_hash))
            if failure is not None and now < failure.until:
                raise Refused(failure.why)
        try:
            return await fetched(self._node, self._system, get, name, foreign, served)
        except UnknownInterface as error:
            raise self._failed(name, foreign, str(error), now + AGAIN) from None
        except Exception as error:  # bytes of a peer: no error of theirs is one of this node
            if foreign and not isinstance(error, InterfaceError):
                nodes = ", ".join(dict.fromkeys(node for node, _ in foreign))
                self._node.log.warning("a type was described wrongly", type=name, by=nodes, error=repr(error)[:200])
            raise self._failed(name, foreign, f"{name} cannot be read: {error}", inf) from None

    def _failed(self, name: str, foreign: list[tuple[str, Any]], why: str, until: float) -> Refused:
        for _, kind in foreign:
            self._failures.pop((name, kind.type_hash), None)
            self._failures[name, kind.type_hash] = _Failure(why, until)
        while len(self._failures) > MOST_FAILURES:
            del self._failures[next(iter(self._failures))]
        return Refused(why)


def _servers(entry: Any) -> list[tuple[str, Any]]:
    """The nodes that serve a name, each with the type that it serves."""
    return [] if entry is None else [(one.host, one.type) for one in (entry.local, *entry.remotes) if one is not None]
