"""The parameters of all nodes as one ROS 2 parameter file: written, and set again. Asks each node by its parameter services."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from actors import Node, Parameter, Service, system_of
from actors.interfaces.rcl_interfaces import srv
from actors.parameters.files import ParameterOverrides
from actors.parameters.messages import from_result, from_value, to_parameter
from actors.runtime.incarnation import incarnation_of


class _Services(NamedTuple):
    names: Service[srv.ListParameters_Request, srv.ListParameters_Response]
    values: Service[srv.GetParameters_Request, srv.GetParameters_Response]
    setting: Service[srv.SetParameters_Request, srv.SetParameters_Response]


@lru_cache  # one contract for each node: a node keeps one client for each contract
def _services(node: str) -> _Services:
    return _Services(
        Service(srv.ListParameters, f"{node}/list_parameters"),
        Service(srv.GetParameters, f"{node}/get_parameters"),
        Service(srv.SetParameters, f"{node}/set_parameters"),
    )


async def save(asker: Node, file: Path) -> int:
    """Write the parameters of every node of `asker`'s system to `file`; returns how many.

    Raises `OSError`, and what `Node.call` raises for a node that is away: then nothing is written.
    """
    found = {name: await _values(asker, name) for name in _nodes(asker)}
    _write(file, {name: {"ros__parameters": values} for name, values in found.items() if values})
    return sum(len(values) for values in found.values())


async def load(asker: Node, file: Path) -> tuple[int, list[str]]:
    """Set the parameters whose values differ from those in `file`; returns how many were set, and the reasons of those that were refused.

    Raises `OSError` and `ValueError` (`InvalidParams`, with file and line) for a file that cannot be read.
    """
    wanted = ParameterOverrides().with_file(file)
    done, refused = 0, list[str]()
    for name in _nodes(asker):
        values = await _values(asker, name)
        for parameter, value in wanted.for_node(name).items():
            if parameter not in values or _plain(value) == values[parameter]:
                continue
            problem = await _set(asker, name, parameter, value)
            done += not problem
            refused += [f"{name} {parameter}: {problem}"] if problem else []
    return done, refused


def _write(file: Path, content: Mapping[str, object]) -> None:
    import yaml

    writer: Any = yaml
    file.write_text(writer.safe_dump(content, sort_keys=True), encoding="utf-8")


def _nodes(asker: Node) -> list[str]:
    """All nodes but those that only look on."""
    system = system_of(asker)
    tree = () if system.supervisor is None else system.supervisor.path
    return sorted(
        record.identity.fqn
        for path, record in system.nodes.items()
        if record.node is not None and path[: len(tree)] == tree
    )


async def _values(asker: Node, name: str) -> dict[str, Any]:
    if name == asker.fqn:
        return {key: _plain(value) for key, value in incarnation_of(asker).parameters.values.items()}
    services = _services(name)
    listed = await asker.call(services.names, srv.ListParameters.Request())
    names = list(listed.result.names)
    reply = await asker.call(services.values, srv.GetParameters.Request(names=names))
    pairs = zip(names, reply.values, strict=False)  # no values at all if one of them has none yet
    return {key: _plain(from_value(key, value).value) for key, value in pairs}


async def _set(asker: Node, name: str, parameter: str, value: object) -> str:
    """Set one parameter; the reason of a refusal, or nothing."""
    if name == asker.fqn:
        return asker.set_parameter(parameter, value).reason
    request = srv.SetParameters.Request(parameters=[to_parameter(Parameter(parameter, value))])
    (result,) = (await asker.call(_services(name).setting, request)).results
    return from_result(result).reason


def _plain(value: Any) -> Any:
    """A value as YAML writes and reads it."""
    if isinstance(value, str | bool | int | float):
        return value
    return [_plain(one) for one in value] if value is not None else None
