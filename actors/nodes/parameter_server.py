"""Global parameters: one node holds them, and any node can set and read them.

ROS 2 has no such server: there every parameter belongs to a node (ROS 1 had one, which tutorials still mention). `ParameterServer` is an
ordinary node with the six parameter services of every node, so the tools of ROS 2 can read and set its parameters, too::

    tree = Supervisor("robot", children=[Child(ParameterServer, parameters={"max_speed": 1.5}), ...])

    await set_global(self, "max_speed", 0.8)
    speed = await get_global(self, "max_speed")

Put it first in the tree, so that it is ready when the other nodes start. A parameter that only one node reads belongs to that node.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, Final

from actors.contracts.contracts import Service
from actors.interfaces.rcl_interfaces import srv
from actors.parameters import ParameterDescriptor, ParameterNotDeclared, Value
from actors.parameters.values import Parameter, SetResult
from actors.runtime.incarnation import incarnation_of
from actors.runtime.node import CALL_TIMEOUT, Node

SERVER: Final = "/parameter_server"
"""The full name of the server that `get_global` and `set_global` use by default."""

_NOT_GIVEN: Final = object()


class ParameterServer(Node):
    """Holds parameters without declarations: setting one creates it, with a type that may change, and setting None deletes it.

    The `parameters` of its child declaration are set from the start. Values survive a restart of the node.
    """

    node_name = "parameter_server"
    allow_undeclared_parameters = True
    _kept: Mapping[str, Value] | None = None

    def resume(self, state: Mapping[str, Value]) -> None:
        self._kept = state

    async def on_start(self) -> None:
        store = incarnation_of(self).parameters
        initial: Mapping[str, Any] = store.overrides if self._kept is None else self._kept
        for name, value in initial.items():
            if not store.has(name):
                store.declare(name, value, ParameterDescriptor(dynamic_typing=True), ignore_override=True)
        store.add_post_set_callback(self._keep)

    @property
    def values(self) -> dict[str, Value]:
        """The global parameters by name, without those that every node has."""
        own = self.declarations.table.values
        return {name: value for name, value in incarnation_of(self).parameters.values.items() if name not in own}

    def _keep(self, _: Sequence[Parameter]) -> None:
        self.checkpoint(self.values)


async def get_global(
    node: Node, name: str, alternative: object = _NOT_GIVEN, *, server: str = SERVER, timeout: float = CALL_TIMEOUT
) -> object:
    """The value of a global parameter; if it has not been set, `alternative`, if given. `timeout` is in seconds.

    Raises `ParameterNotDeclared` if it has not been set and there is no `alternative`, and what `Node.call` raises if the server does not
    answer.
    """
    from actors.interfaces.rcl_interfaces import srv
    from actors.parameters.messages import from_value

    reply = await node.call(_reading(server), srv.GetParameters.Request(names=[name]), timeout=timeout)
    value = from_value(name, reply.values[0]).value if reply.values else None
    if value is not None:
        return value
    if alternative is _NOT_GIVEN:
        raise ParameterNotDeclared(
            f"nobody has set the global parameter {name!r} at {server}: set it first, or give an alternative",
            node=server,
            names=[name],
        )
    return alternative


async def set_global(
    node: Node, name: str, value: object, *, server: str = SERVER, timeout: float = CALL_TIMEOUT
) -> SetResult:
    """Set a global parameter, or delete it by None. A refusal is a result that says why. `timeout` is in seconds.

    Raises `TypeError` or `ValueError` for a value that no parameter can hold, and what `Node.call` raises if the server does not answer.
    """
    from actors.interfaces.rcl_interfaces import srv
    from actors.parameters.messages import from_result, to_parameter

    request = srv.SetParametersAtomically.Request(parameters=[to_parameter(Parameter(name, value))])
    return from_result((await node.call(_setting(server), request, timeout=timeout)).result)


@lru_cache  # one contract for each server, because a node keeps one client for each contract
def _reading(server: str) -> Service[srv.GetParameters_Request, srv.GetParameters_Response]:
    from actors.interfaces.rcl_interfaces import srv

    return Service(srv.GetParameters, f"{server}/get_parameters")


@lru_cache
def _setting(server: str) -> Service[srv.SetParametersAtomically_Request, srv.SetParametersAtomically_Response]:
    from actors.interfaces.rcl_interfaces import srv

    return Service(srv.SetParametersAtomically, f"{server}/set_parameters_atomically")
