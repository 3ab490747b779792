"""rosapi's questions about types."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from actors.interfaces import Message, known_names, schema_text, to_plain
from cli.web.clients.errors import Refused
from cli.web.clients.names import interface

if TYPE_CHECKING:
    from cli.web.hub import Hub


class Definitions:
    """The definitions of types, each followed by those of the types in its fields."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub

    def interfaces(self) -> dict[str, Any]:
        return {"interfaces": known_names()}

    async def topics_and_raw_types(self) -> dict[str, Any]:
        await self._hub.catalog.update()
        channels = sorted(self._hub.catalog.channels.values(), key=lambda one: one.topic)
        return {
            "topics": [one.topic for one in channels],
            "types": [one.type.__ros_type__ for one in channels],
            "typedefs_full_text": [schema_text(one.type) for one in channels],
        }

    async def message(self, type: str) -> dict[str, Any]:
        name = interface(type, "msg")
        known = (one.type for one in self._hub.catalog.channels.values() if one.type.__ros_type__ == name)
        return {"typedefs": _definitions(next(known, None) or await self._hub.types.message(name))}

    async def service_request(self, type: str) -> dict[str, Any]:
        return {"typedefs": _definitions((await self._service(type)).Request)}

    async def service_response(self, type: str) -> dict[str, Any]:
        return {"typedefs": _definitions((await self._service(type)).Response)}

    async def action_goal(self, type: str) -> dict[str, Any]:
        return {"typedefs": _definitions((await self._action(type)).Goal)}

    async def action_result(self, type: str) -> dict[str, Any]:
        return {"typedefs": _definitions((await self._action(type)).Result)}

    async def action_feedback(self, type: str) -> dict[str, Any]:
        return {"typedefs": _definitions((await self._action(type)).Feedback)}

    async def _service(self, type: str) -> Any:
        name = interface(type, "srv")
        graph = self._hub.system.graph
        user = next((service for service, one in graph.services.items() if _serves(one, name)), "")
        return await self._hub.types.service(user, name)

    async def _action(self, type: str) -> Any:
        name = interface(type, "action")
        graph = self._hub.system.graph
        user = next((action for action, one in graph.actions.items() if _serves(one, name)), "")
        return await self._hub.types.action(user, name)


def _serves(entry: Any, name: str) -> bool:
    return entry.server is not None and entry.server.type.__ros_type__ == name


def _definitions(top: type[Message]) -> list[dict[str, Any]]:
    """The definition of a type, and of all types in it, each once."""
    found: dict[str, type[Message]] = {}
    waiting = [top]
    while waiting:
        kind = waiting.pop(0)
        if kind.__ros_type__ not in found:
            found[kind.__ros_type__] = kind
            waiting += [field.message for field in kind.__ros_fields__ if field.message is not None]
    return [_definition(kind) for kind in found.values()]


def _definition(kind: type[Message]) -> dict[str, Any]:
    fields, constants = kind.__ros_fields__, kind.__ros_constants__
    return {
        "type": kind.__ros_type__,
        "fieldnames": [field.name for field in fields],
        "fieldtypes": [
            field.message.__ros_type__ if field.message is not None else field.type.base for field in fields
        ],
        "fieldarraylen": [_length(field) for field in fields],
        "examples": list(_examples(kind)),
        "constnames": [constant.name for constant in constants],
        "constvalues": [str(constant.value) for constant in constants],
    }


def _length(field: Any) -> int:
    """-1 for what is no array, the length of a fixed one, 0 for all others."""
    if not field.type.is_array:
        return -1
    return field.type.size if field.type.array == "fixed" else 0


def _examples(kind: type[Message]) -> Iterator[str]:
    """A value of each field, as text: its default."""
    try:
        plain = to_plain(kind())
    except TypeError as error:
        raise Refused(f"{kind.__ros_type__}: {error}") from None
    for field in kind.__ros_fields__:
        value = plain[field.name]
        yield "{}" if isinstance(value, dict) else str(value)
