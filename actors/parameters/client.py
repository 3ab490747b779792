"""The parameters of other nodes: read, set, described and watched by the services and the topic that every node has.

::

    driver = ParameterClient(self, "/driver")
    speed = await driver.get("speed")
    result = await driver.set("speed", 1.5)

Import this module late, because it needs the message types.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterator, Coroutine, Iterable, Mapping, Sequence
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any, Final, Protocol

from actors.contracts.contracts import Service, Topic
from actors.interfaces.message import M, Req, Resp, ServiceType
from actors.interfaces.rcl_interfaces import msg, srv
from actors.names import names
from actors.parameters.descriptor import ParameterDescriptor
from actors.parameters.errors import ParameterNotDeclared, ParameterUninitialized
from actors.parameters.files import InvalidParams, ParameterOverrides
from actors.parameters.messages import from_descriptor, from_event, from_result, from_value, to_parameter
from actors.parameters.text import parameter_file
from actors.parameters.values import (
    Parameter,
    ParameterChange,
    ParameterNames,
    ParameterType,
    SetResult,
    Value,
    widened,
)
from actors.qos import PARAMETER_EVENTS
from actors.time.deadlines import check_timeout

__all__ = ["Asking", "ParameterClient"]


EVENTS: Final = Topic(msg.ParameterEvent, "/parameter_events", PARAMETER_EVENTS)


class Asking(Protocol):
    """A node, as a `ParameterClient` uses it."""

    @property
    def name(self) -> str: ...
    @property
    def namespace(self) -> str: ...
    def call(
        self, service: Service[Req, Resp], request: Req, *, timeout: float = ...
    ) -> Coroutine[object, None, Resp]: ...
    def wait_for(
        self, *contracts: Service[Any, Any], timeout: float | None = None
    ) -> Coroutine[object, None, None]: ...
    def subscribe(self, topic: Topic[M]) -> AsyncIterator[M]: ...


class ParameterClient:
    """The parameters of the node `remote`, as `node` reads and sets them. A name without a slash is in the node's own namespace.

    Each method is one call or a few, each bounded by `timeout` seconds, and raises what `Node.call` raises. A refusal is a `SetResult`,
    as everywhere. Values are given as to `Node.set_parameter`: an int for a float parameter is widened.
    """

    def __init__(self, node: Asking, remote: str, *, timeout: float = 1.0) -> None:
        self.remote: Final = names.expand(remote, node.name, node.namespace)
        """The full name of the other node."""
        check_timeout(f"{self!r}", timeout)
        self._node = node
        self._timeout = timeout

    def __repr__(self) -> str:
        return f"ParameterClient({self.remote!r})"

    async def wait(self, timeout: float | None = None) -> None:
        """Wait until the node serves its parameters. Raises `ServiceUnavailable` after `timeout` seconds; without one there is no limit."""
        await self._node.wait_for(self._service(srv.SetParameters, "set_parameters"), timeout=timeout)

    # -- reading ------------------------------------------------------------------------------------------------------------

    async def get(self, name: str) -> Value | None:
        """The plain value of a parameter; None if it is not declared and the node allows that.

        Raises `ParameterNotDeclared`, and `ParameterUninitialized` for a parameter without a value.
        """
        (parameter,) = await self.get_parameters([name])
        value: Value | None = parameter.value
        return value

    async def get_parameters(self, names: Iterable[str]) -> tuple[Parameter, ...]:
        """Several parameters, all at one instant. Raises as `get` does."""
        wanted = tuple(names)
        found = await self._values(wanted)
        if len(found) != len(wanted):
            known = (await self.list()).names
            missing = [name for name in wanted if name not in known]
            if missing:
                raise ParameterNotDeclared.among(self.remote, missing, known)
            raise ParameterUninitialized.of(self.remote, ", ".join(wanted), "their type")
        return found

    async def get_present(self, names: Iterable[str]) -> tuple[Parameter, ...]:
        """Those of several parameters that are declared and have a value: all at one instant if they are all of them."""
        wanted = tuple(names)
        found = await self._values(wanted)
        if len(found) == len(wanted):
            return found
        alone = [await self._values([name]) for name in wanted]  # one without a value empties the whole answer
        return tuple(chain.from_iterable(alone))

    async def list(self, prefixes: Sequence[str] = (), depth: int = 0) -> ParameterNames:
        """The names of the parameters and of their groups, as `ParameterStore.list` gives them."""
        request = srv.ListParameters.Request(prefixes=tuple(prefixes), depth=depth)
        answer = await self._call(self._service(srv.ListParameters, "list_parameters"), request)
        return ParameterNames(tuple(answer.result.names), tuple(answer.result.prefixes))

    async def describe(self, name: str) -> ParameterDescriptor:
        """Type, range and description of a parameter. Raises `ParameterNotDeclared`."""
        request = srv.DescribeParameters.Request(names=(name,))
        answer = await self._call(self._service(srv.DescribeParameters, "describe_parameters"), request)
        if not answer.descriptors:
            raise ParameterNotDeclared.among(self.remote, [name], (await self.list()).names)
        return from_descriptor(answer.descriptors[0])

    async def dump(self) -> str:
        """All parameters that have a value, as the text of a parameter file that `load` and every node of ROS 2 reads."""
        known = (await self.list()).names
        return parameter_file(self.remote, await self.get_present(known))

    # -- setting ------------------------------------------------------------------------------------------------------------

    async def set(self, name: str, value: object) -> SetResult:
        """Set one parameter; None deletes one that has no fixed type."""
        return (await self.set_parameters({name: value}))[name]

    async def set_parameters(self, values: Mapping[str, object]) -> dict[str, SetResult]:
        """Set each parameter by itself, in order."""
        parameters = await self._typed(values)
        request = srv.SetParameters.Request(parameters=tuple(map(to_parameter, parameters)))
        answer = await self._call(self._service(srv.SetParameters, "set_parameters"), request)
        return {one.name: from_result(result) for one, result in zip(parameters, answer.results, strict=True)}

    async def set_atomically(self, values: Mapping[str, object]) -> SetResult:
        """Set all parameters or none."""
        request = srv.SetParametersAtomically.Request(parameters=tuple(map(to_parameter, await self._typed(values))))
        answer = await self._call(self._service(srv.SetParametersAtomically, "set_parameters_atomically"), request)
        return from_result(answer.result)

    async def load(self, path: str | PathLike[str], *, wildcard: bool = True) -> dict[str, SetResult]:
        """Set what a parameter file says for this node, each parameter by itself; without `wildcard` what it says by the node's name only.

        Raises `InvalidParams` if the file cannot be read or has nothing for the node.
        """
        return await self.set_parameters(self._said_in(path, wildcard))

    async def load_atomically(self, path: str | PathLike[str], *, wildcard: bool = True) -> SetResult:
        """As `load`, all parameters or none."""
        return await self.set_atomically(self._said_in(path, wildcard))

    # -- watching -----------------------------------------------------------------------------------------------------------

    def changes(self) -> AsyncGenerator[ParameterChange, None]:
        """The changes of the node's parameters from now on: ``async for change in driver.changes()``."""
        return self._changes(self._node.subscribe(EVENTS))

    async def _changes(self, events: AsyncIterator[msg.ParameterEvent]) -> AsyncGenerator[ParameterChange, None]:
        async for event in events:
            if event.node == self.remote:
                yield from_event(event)

    # -- inside -------------------------------------------------------------------------------------------------------------

    def _service(self, type: type[ServiceType[Req, Resp]], name: str) -> Service[Req, Resp]:
        return Service(type, f"{self.remote}/{name}")

    def _call(self, service: Service[Req, Resp], request: Req) -> Coroutine[object, None, Resp]:
        return self._node.call(service, request, timeout=self._timeout)

    async def _values(self, wanted: Sequence[str]) -> tuple[Parameter, ...]:
        """The parameters; none if one of them is not declared, or has no value."""
        request = srv.GetParameters.Request(names=tuple(wanted))
        answer = await self._call(self._service(srv.GetParameters, "get_parameters"), request)
        return tuple(from_value(name, value) for name, value in zip(wanted, answer.values, strict=False))

    async def _typed(self, values: Mapping[str, object]) -> Sequence[Parameter]:
        """The values as parameters. The node is asked for the types of those for which Python's type is not enough."""
        given = [Parameter(name, value) for name, value in values.items() if value != () and value != []]
        sure = {one.name: one for one in given if one.type not in _VAGUE}
        vague = [name for name in values if name not in sure]
        kinds: dict[str, ParameterType] = {}
        if vague:
            request = srv.GetParameterTypes.Request(names=tuple(vague))
            answer = await self._call(self._service(srv.GetParameterTypes, "get_parameter_types"), request)
            kinds = {name: ParameterType(kind) for name, kind in zip(vague, answer.types.tolist(), strict=False)}
        unknown = ParameterType.NOT_SET
        return [sure.get(name) or widened(name, value, kinds.get(name, unknown)) for name, value in values.items()]

    def _said_in(self, path: str | PathLike[str], wildcard: bool) -> dict[str, Any]:
        overrides = ParameterOverrides().with_file(path)
        said = overrides.for_node(self.remote)
        if not wildcard:
            named = overrides.named(self.remote)
            said = {name: value for name, value in said.items() if name in named}
        if not said:
            raise InvalidParams(f"it has no parameters for {self.remote}", source=str(Path(path)))
        return said


_VAGUE: Final = frozenset({ParameterType.INTEGER, ParameterType.INTEGER_ARRAY})
"""The types of Python values that may be meant as floats."""
