"""The types that a command needs: known here, given in a folder, or fetched from the nodes that use them."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

from actors.interfaces import InterfaceError, UnknownInterface, add_folder, get_action, get_message, get_service
from actors.interfaces.foreign import ForeignType, difference
from actors.interfaces.naming import full_name
from cli.command import CommandFailed, added
from cli.parsing import complain

if TYPE_CHECKING:
    from actors import Node, System
    from cli.graph.seen import Seen

T = TypeVar("T")
Uses = Callable[[], Iterable[tuple[str, Any]]]
"""Gives the nodes that use a name now, each with the type that it has there. An action's is known better once its type is known here."""

ENTRY_POINTS = "robactor.interfaces"
"""The group of the entry points by which packages name a module whose import makes their types known."""

INVALID = "The passed {} type is invalid"


def learn_folders(options: argparse.Namespace) -> None:
    """Make known: the types of installed packages, those of an installed ROS 2, and those of ``--interfaces``."""
    for entry in added(ENTRY_POINTS):
        entry.load()
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if prefix:
            add_folder(os.path.join(prefix, "share"))
    for folder in getattr(options, "interfaces", ()):
        from actors.interfaces import load_folder

        try:
            load_folder(folder)
        except InterfaceError as error:  # of one type, such as another version of one that ships
            complain(f"--interfaces {folder}: {error}; the other types are read when they are needed")
            add_folder(folder)
        except OSError as error:
            raise CommandFailed(f"--interfaces {folder}: {error}") from error


async def message_type(graph: Seen, wanted: str | None, uses: Uses, name: str) -> Any:
    """The message class of a topic: the one that is wanted, or that of its endpoints."""
    return await resolved(graph, get_message, "message", wanted, uses, name)


async def service_type(graph: Seen, wanted: str | None, uses: Uses, name: str) -> Any:
    """The service type that is wanted, or that of the servers and clients."""
    return await resolved(graph, get_service, "service", wanted, uses, name)


async def action_type(graph: Seen, wanted: str | None, uses: Uses, name: str) -> Any:
    """The action type that is wanted, or that of the servers and clients."""
    return await resolved(graph, get_action, "action", wanted, uses, name)


async def resolved(graph: Seen, get: Callable[[str], T], word: str, wanted: str | None, uses: Uses, name: str) -> T:
    """The type of this name, fetched from the nodes that use it if it is not known here.

    Raises `CommandFailed` if nobody knows it, or if the nodes mean another type by its name.
    """
    known_uses = list(uses())
    kind = {"message": "msg", "service": "srv", "action": "action"}[word]
    try:
        asked = known_uses[0][1].__ros_type__ if wanted is None else full_name(wanted, kind)  # type: ignore[arg-type]
        found = await _found(graph, get, name, asked, known_uses)
    except UnknownInterface as error:
        raise CommandFailed(f"{INVALID.format(word)}: {error}") from None
    except InterfaceError as error:
        raise CommandFailed(f"{name}: its type cannot be read: {error}") from error
    _warn(name, found, list(uses()))
    return found


async def _found(graph: Seen, get: Callable[[str], T], name: str, asked: str, uses: list[tuple[str, Any]]) -> T:
    try:
        return await fetched(graph.node, graph.system, get, asked, uses, name)
    except UnknownInterface as error:
        nodes = ", ".join(dict.fromkeys(node for node, _ in foreign_uses(asked, uses)))
        if not nodes:
            raise
        raise CommandFailed(
            f"{error} {nodes} did not describe it either: give the folder of its definition with --interfaces DIR"
        ) from None


def foreign_uses(asked: str, uses: Iterable[tuple[str, Any]]) -> list[tuple[str, ForeignType]]:
    """Those of the nodes that use a name with the type `asked`, of which this process has only the name and the hash."""
    return [(node, kind) for node, kind in uses if isinstance(kind, ForeignType) and kind.__ros_type__ == asked]


async def fetched(
    node: Node, system: System, get: Callable[[str], T], asked: str, uses: Iterable[tuple[str, Any]], name: str
) -> T:
    """The type `asked` as it is known here, or described by those who use the topic, service or action `name` with it.

    Raises `UnknownInterface` if nobody describes it, and `InterfaceError` if the description cannot be read.
    """
    try:
        return get(asked)
    except UnknownInterface:
        foreign = foreign_uses(asked, uses)
        if not foreign:
            raise
    from actors.runtime.remote_types import action_parts, fetch

    parts = action_parts(system.graph, name, asked) if get is get_action else [(asked, foreign[0][1].type_hash)]
    await fetch(node, asked, parts, (user for user, _ in foreign))
    return get(asked)


def _warn(name: str, kind: Any, uses: list[tuple[str, Any]]) -> None:
    from cli.parsing import complain

    for node, used in uses:
        unlike = difference(used, kind)
        if unlike is not None:
            complain(f"{node} uses {name} as {unlike[0]}, not as {unlike[1]}: the two do not understand each other")
            return
