"""Parameters of all nodes, by their services: a name is that of the node, a dot, and that of the parameter."""

from __future__ import annotations

import asyncio
import base64
import binascii
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from actors import ActorError, Node, Parameter, System
from actors.interfaces import InterfaceError
from actors.names.names import is_hidden, validate_full_name
from actors.parameters.client import ParameterClient
from actors.parameters.messages import from_value
from actors.parameters.values import ParameterType
from cli.web.clients.errors import Refused

if TYPE_CHECKING:
    from actors.interfaces.rcl_interfaces.msg import ParameterEvent

PATIENCE = 2.0
"""Seconds for the answer of one node."""


def node_names(system: System, hidden: bool = False) -> list[str]:
    """The full names of the nodes that run, here and in other processes."""
    names = {record.identity.fqn for record in system.nodes.values() if record.state == "running"}
    names |= {node.fqn for node in system.graph.elsewhere()}
    return sorted(name for name in names if hidden or not is_hidden(name))


class Parameters:
    """The parameters of the nodes of a graph."""

    def __init__(self, node: Node, system: System) -> None:
        self._node = node
        self._system = system

    async def names(self, node: str) -> list[str]:
        """The names of a node's parameters; none if it does not answer."""
        try:
            return list((await self._of(node).list()).names)
        except ActorError:
            return []

    async def all_names(self) -> list[tuple[str, str]]:
        """Every parameter with its node."""
        nodes = node_names(self._system)
        listed = await asyncio.gather(*(self.names(node) for node in nodes))
        return [(node, name) for node, names in zip(nodes, listed, strict=True) for name in names]

    async def values(self, node: str, names: Iterable[str]) -> dict[str, Parameter]:
        """The parameters of a node that are set, of these; none if it does not answer."""
        try:
            return {one.name: one for one in await self._of(node).get_present(names)}
        except (ActorError, InterfaceError, ValueError):
            return {}

    async def put(self, node: str, name: str, value: Any) -> str | None:
        """Set a parameter to plain data; returns why the node refuses, or None. Raises `Refused` for a node that does not answer."""
        present = (await self.values(node, [name])).get(name)
        try:
            result = await self._of(node).set(name, meant(value, present))
        except (ActorError, InterfaceError, TypeError, ValueError, OverflowError) as error:
            raise Refused(f"{node}.{name}: {error}") from None
        return None if result.successful else result.reason or "the node refuses it"

    def _of(self, node: str) -> ParameterClient:
        return ParameterClient(self._node, node, timeout=PATIENCE)

    async def described(self, wanted: Iterable[str]) -> list[dict[str, Any]]:
        """Parameters as the protocol shows them, by their full names; all there are if none is named."""
        pairs = [split(name) for name in wanted] or await self.all_names()
        by_node: dict[str, list[str]] = {}
        for node, name in pairs:
            by_node.setdefault(node, []).append(name)
        found = await asyncio.gather(*(self.values(node, names) for node, names in by_node.items()))
        return [shown(node, one) for node, values in zip(by_node, found, strict=True) for one in values.values()]


def split(full: object) -> tuple[str, str]:
    """The node and the name of a parameter. Raises `Refused`."""
    node, dot, name = full.partition(".") if isinstance(full, str) else ("", "", "")
    try:
        validate_full_name(node)
    except ValueError:
        dot = ""
    if not dot or not name:
        raise Refused(f"{full!r:.80} is no parameter: write /node.name")
    return node, name


def meant(value: Any, present: Parameter | None) -> Any:
    """Data of JSON as a value of the parameter's present type, where JSON does not tell the difference. Raises TypeError or ValueError."""
    kind = None if present is None else present.type
    if isinstance(value, Mapping):
        raise TypeError("a parameter has no fields")
    if kind is ParameterType.INTEGER and type(value) is float and value.is_integer():
        return int(value)
    if kind is ParameterType.BYTE_ARRAY and isinstance(value, str):
        try:
            return tuple(bytes([byte]) for byte in base64.b64decode(value, validate=True))
        except binascii.Error as error:
            raise ValueError(f"an array of bytes is written in base64: {error}") from None
    return value


def plain_value(parameter: Parameter) -> Any:
    """The value of a parameter as data for JSON; bytes in base64."""
    value: Any = parameter.value
    if parameter.type is ParameterType.BYTE_ARRAY:
        return base64.b64encode(b"".join(value)).decode()
    return value


def shown(node: str, parameter: Parameter) -> dict[str, Any]:
    """A parameter as the protocol shows it."""
    kinds = {
        ParameterType.DOUBLE: "float64",
        ParameterType.DOUBLE_ARRAY: "float64_array",
        ParameterType.BYTE_ARRAY: "byte_array",
    }
    kind = kinds.get(parameter.type)
    return {"name": f"{node}.{parameter.name}", "value": plain_value(parameter)} | ({"type": kind} if kind else {})


def event_values(event: ParameterEvent) -> list[dict[str, Any]]:
    """What an event of `/parameter_events` says, as the protocol shows it. A deleted parameter has no value; one of no known type is left out."""
    values: list[dict[str, Any]] = []
    for one in (*event.new_parameters, *event.changed_parameters):
        with suppress(ValueError):  # a type that does not exist
            values.append(shown(event.node, from_value(one.name, one.value)))
    return values + [{"name": f"{event.node}.{one.name}"} for one in event.deleted_parameters]
