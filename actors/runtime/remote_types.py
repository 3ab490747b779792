"""Types that only other processes know, fetched by the service `get_type_description` of the nodes that use them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from actors.contracts.contracts import Service
from actors.errors import ActorError
from actors.interfaces.errors import InterfaceError
from actors.interfaces.foreign import ForeignType

if TYPE_CHECKING:
    from actors.graph.graph import Graph
    from actors.interfaces.type_description_interfaces.srv import GetTypeDescription_Response
    from actors.runtime.node import Node

PATIENCE = 2.0
"""Seconds for the answer of one node."""


async def fetch(node: Node, name: str, parts: Iterable[tuple[str, str]], owners: Iterable[str]) -> bool:
    """Ask the nodes `owners`, one after the other, for a type, and define it here. Returns whether one of them knew it.

    `parts` are the types to ask for, with their hashes: the type itself, or for an action those of its services and feedback. What they say is
    read outside of the event loop. Raises `InterfaceError` if it was described, but each time by what is no description.
    """
    from actors.interfaces.learning import define, definitions_of

    wanted = list(parts)
    wrong: InterfaceError | None = None
    for owner in dict.fromkeys(owners):
        answers = [await _asked(node, owner, part, type_hash) for part, type_hash in wanted]
        given = [answer for answer in answers if answer is not None]
        if given and len(given) == len(wanted):
            try:
                define(await node.offload(definitions_of, name, given, thread=True))
            except InterfaceError as error:
                wrong = error
            else:
                return True
    if wrong is not None:
        raise wrong
    return False


async def _asked(node: Node, owner: str, type_name: str, type_hash: str) -> GetTypeDescription_Response | None:
    from actors.interfaces.type_description_interfaces.srv import GetTypeDescription

    service = Service(GetTypeDescription, f"{owner}/get_type_description")
    request = GetTypeDescription.Request(type_name=type_name, type_hash=type_hash, include_type_sources=True)
    try:
        answer = await node.call(service, request, timeout=PATIENCE)
    except ActorError:
        return None
    return answer if answer.successful else None


def action_parts(graph: Graph, action: str, kind: str) -> list[tuple[str, str]]:
    """The types of the services and the feedback of an action of this type with their hashes, which its server announces."""
    ends: list[Any] = []
    for part in ("send_goal", "get_result"):
        service = graph.services.get(f"{action}/_action/{part}")
        ends += () if service is None else service.remotes
    feedback = graph.topics.get(f"{action}/_action/feedback")
    ends += () if feedback is None else feedback.publishers
    parts = {end.type.__ros_type__: end.type for end in ends if end.type.__ros_type__.startswith(f"{kind}_")}
    return [(name, used.type_hash) for name, used in parts.items() if isinstance(used, ForeignType)]
