"""rosapi's questions about parameters: a name is that of the node, a colon, and that of the parameter; a value is a text in JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cli.web.clients.conversion import read_json, write_json
from cli.web.clients.errors import BadRequest, Refused
from cli.web.clients.names import absolute
from cli.web.graph.parameters import plain_value

if TYPE_CHECKING:
    from cli.web.hub import Hub


class ParameterAnswers:
    """The answers of the nodes."""

    def __init__(self, hub: Hub) -> None:
        self._parameters = hub.parameters

    async def names(self) -> dict[str, Any]:
        return {"names": [f"{node}:{name}" for node, name in await self._parameters.all_names()]}

    async def get(self, name: str, default: str) -> dict[str, Any]:
        node, own = _split(name)
        found = (await self._parameters.values(node, [own])).get(own)
        if found is None:
            return {"value": default, "successful": False, "reason": f"{name} is not set"}
        return {"value": write_json(plain_value(found)), "successful": True, "reason": ""}

    async def has(self, name: str) -> dict[str, Any]:
        node, own = _split(name)
        return {"exists": own in await self._parameters.values(node, [own])}

    async def put(self, name: str, value: str) -> dict[str, Any]:
        node, own = _split(name)
        try:
            plain = read_json(value)
        except BadRequest:
            plain = value  # a text without its quotation marks
        reason = await self._parameters.put(node, own, plain)
        if reason is not None:
            raise Refused(f"{name} is not set: {reason}")
        return {"successful": True, "reason": ""}

    async def delete(self, name: str) -> dict[str, Any]:
        node, own = _split(name)
        reason = await self._parameters.put(node, own, None)
        if reason is not None:
            raise Refused(f"{name} is not deleted: {reason}")
        return {"successful": True, "reason": ""}


def _split(full: str) -> tuple[str, str]:
    """The node and the name of a parameter. Raises `Refused`."""
    node, colon, name = full.rpartition(":")
    if not colon or not name:
        raise Refused(f"{full!r:.80} is no parameter: write /node:name")
    return absolute(node), name
