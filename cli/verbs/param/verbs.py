"""What the verbs of `param` do and print."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from typing import Any, Final, cast

from actors import Service
from actors.interfaces.rcl_interfaces import msg, srv
from actors.parameters.files import InvalidParams, ParameterOverrides
from actors.parameters.messages import from_value, to_parameter
from actors.parameters.text import parse_parameter
from actors.parameters.values import Parameter, ParameterType
from actors.suggest import did_you_mean
from cli.command import CommandFailed, Exit
from cli.graph.asking import ask, found_node, node_names
from cli.graph.seen import Seen, seen
from cli.output import print_json
from cli.parsing import complain

_LABELS: Final = {
    ParameterType.BOOL: "Boolean value is:",
    ParameterType.INTEGER: "Integer value is:",
    ParameterType.DOUBLE: "Double value is:",
    ParameterType.STRING: "String value is:",
    ParameterType.BYTE_ARRAY: "Byte values are:",
    ParameterType.BOOL_ARRAY: "Boolean values are:",
    ParameterType.INTEGER_ARRAY: "Integer values are:",
    ParameterType.DOUBLE_ARRAY: "Double values are:",
    ParameterType.STRING_ARRAY: "String values are:",
}


def type_word(kind: int) -> str:
    """The word for a type, such as ``boolean`` or ``integer array``."""
    name = ParameterType(kind).name.lower().replace("_", " ")
    return re.sub(r"\bbool\b", "boolean", name)


async def list_parameters(options: argparse.Namespace) -> Exit:
    """The names of the parameters of one node, or of all."""
    try:
        wanted = re.compile(options.filter or "")
    except re.error as error:
        raise CommandFailed(f"--filter {options.filter!r} is no regular expression: {error}") from None
    found: dict[str, dict[str, str]] = {}
    async with seen(options) as graph:
        nodes = node_names(graph, options.include_hidden_nodes)
        if options.node_name is not None:
            nodes = [await found_node(graph, options.node_name)]
        for node in nodes:
            try:
                names = [name for name in await _names(graph, node, options) if wanted.match(name)]
                found[node] = await _types(graph, node, names, options)
            except CommandFailed as failed:
                if options.node_name is not None:
                    raise
                complain(str(failed))
    if options.json:
        print_json(found)
        return Exit.DONE
    for node, parameters in found.items():
        if options.node_name is None and parameters:
            print(f"{node}:")
        for name, kind in parameters.items():
            print(f"  {name} (type: {kind})" if options.param_type else f"  {name}")
    return Exit.DONE


async def _names(graph: Seen, node: str, options: argparse.Namespace) -> list[str]:
    service = Service(srv.ListParameters, f"{node}/list_parameters")
    request = srv.ListParameters.Request(prefixes=tuple(getattr(options, "param_prefixes", ())))
    answer = await ask(graph, node, service, request, options)
    return sorted(answer.result.names)


async def _types(graph: Seen, node: str, names: list[str], options: argparse.Namespace) -> dict[str, str]:
    if not (options.param_type or options.json) or not names:
        return dict.fromkeys(names, "")
    return {each.name: type_word(each.type) for each in await _descriptors(graph, node, names, options)}


async def _descriptors(
    graph: Seen, node: str, names: Sequence[str], options: argparse.Namespace
) -> Sequence[msg.ParameterDescriptor]:
    service = Service(srv.DescribeParameters, f"{node}/describe_parameters")
    answer = await ask(graph, node, service, srv.DescribeParameters.Request(names=tuple(names)), options)
    described: Sequence[msg.ParameterDescriptor] = answer.descriptors
    return described


async def _values(graph: Seen, node: str, names: Sequence[str], options: argparse.Namespace) -> list[Parameter]:
    """The parameters; none if the node has not declared one of them."""
    service = Service(srv.GetParameters, f"{node}/get_parameters")
    answer = await ask(graph, node, service, srv.GetParameters.Request(names=tuple(names)), options)
    return [from_value(name, value) for name, value in zip(names, answer.values, strict=False)]


async def _unknown(graph: Seen, node: str, names: Sequence[str], options: argparse.Namespace) -> str:
    """The nearest names of parameters that the node has, for the first that it has not."""
    known = await _names(graph, node, options)
    missing = next((name for name in names if name not in known), "")
    return did_you_mean(missing, known)


async def get(options: argparse.Namespace) -> Exit:
    """The values of parameters of a node, or of one parameter in all nodes."""
    async with seen(options) as graph:
        if not options.parameter_name:
            return await _get_everywhere(graph, options.node_name, options)
        node = await found_node(graph, options.node_name, options.timeout)
        names = options.parameter_name
        values = await _values(graph, node, names, options)
        if len(values) < len(names):
            shown = ", ".join(f"'{name}'" for name in names)
            hint = await _unknown(graph, node, names, options)
            raise CommandFailed(f"Parameter(s) {shown} not available on node{hint}")
    if options.json:
        print_json({parameter.name: _json(parameter) for parameter in values})
        return Exit.DONE
    for parameter in values:
        if options.hide_type:
            print(f"{parameter.name}: {_value(parameter)}" if len(values) > 1 else _value(parameter))
        else:
            print((f"{parameter.name}:\n  " if len(values) > 1 else "") + _labelled(parameter))
    return Exit.DONE


async def _get_everywhere(graph: Seen, name: str, options: argparse.Namespace) -> Exit:
    found: dict[str, Parameter] = {}
    for node in node_names(graph, options.include_hidden_nodes):
        try:
            values = await _values(graph, node, [name], options)
        except CommandFailed as failed:
            complain(f"{node}: Error: {failed}")
            continue
        if values and (values[0].type is not ParameterType.NOT_SET or name in await _names(graph, node, options)):
            found[node] = values[0]
    if options.json:
        print_json({node: _json(parameter) for node, parameter in found.items()})
    elif not found:
        print(f"Parameter '{name}' not set on any node")
    for node, parameter in () if options.json else found.items():
        print(f"{node}: {_value(parameter)}" if options.hide_type else f"{node}:\n  {_labelled(parameter)}")
    return Exit.DONE


def _labelled(parameter: Parameter) -> str:
    if parameter.type is ParameterType.NOT_SET:
        return "Parameter not set."
    return f"{_LABELS[parameter.type]} {_value(parameter)}"


def _value(parameter: Parameter) -> Any:
    value: Any = parameter.value
    return list(cast(Any, value)) if isinstance(value, tuple) else value


def _json(parameter: Parameter) -> Any:
    value = _value(parameter)
    return [each[0] for each in value] if parameter.type is ParameterType.BYTE_ARRAY else value


async def put(options: argparse.Namespace) -> Exit:
    """Set parameters: each by itself, or all at once."""
    words = options.params_and_values
    if len(words) % 2:
        raise CommandFailed(
            f"Parameters must be provided as name/value pairs: name value [name value ...]. Got {len(words)} argument(s)."
        )
    parameters = _parsed(list(zip(words[::2], words[1::2], strict=True)))
    async with seen(options) as graph:
        node = await found_node(graph, options.node_name, options.timeout)
        parameters = await _as_declared(graph, node, parameters, options)
        if options.atomic:
            answer = await _set_atomically(graph, node, parameters, options)
            return _told(
                "Set parameters atomically successful", "Setting parameters atomically failed", answer, options
            )
        results = await _set(graph, node, parameters, options)
    if options.json:
        _print_results(parameters, results)
    else:
        for parameter, result in zip(parameters, results, strict=True):
            ahead = f"{parameter.name}: " if len(parameters) > 1 else ""
            _tell(f"{ahead}Set parameter successful", f"{ahead}Setting parameter failed", result)
    return Exit.DONE if all(result.successful for result in results) else Exit.REFUSED


def _parsed(pairs: Sequence[tuple[str, str]]) -> list[Parameter]:
    parameters: list[Parameter] = []
    for name, text in pairs:
        try:
            parameters.append(parse_parameter(name, text))
        except (TypeError, ValueError) as error:
            raise CommandFailed(f"parameter {name}: {error}") from None
    return parameters


async def _as_declared(
    graph: Seen, node: str, parameters: list[Parameter], options: argparse.Namespace
) -> list[Parameter]:
    """The same, with empty lists of the types that the node has declared: nothing in `[]` tells its type."""
    empty = [
        each.name
        for each in parameters
        if isinstance(cast("object", each.value), list | tuple | bytes) and not each.value
    ]
    described = await _descriptors(graph, node, empty, options) if empty else ()
    kinds = {each.name: ParameterType(each.type) for each in described if each.type >= ParameterType.BYTE_ARRAY}
    return [Parameter(each.name, [], kinds[each.name]) if each.name in kinds else each for each in parameters]


async def _set(
    graph: Seen, node: str, parameters: Sequence[Parameter], options: argparse.Namespace
) -> Sequence[msg.SetParametersResult]:
    service = Service(srv.SetParameters, f"{node}/set_parameters")
    request = srv.SetParameters.Request(parameters=tuple(map(to_parameter, parameters)))
    answer = await ask(graph, node, service, request, options)
    results: Sequence[msg.SetParametersResult] = answer.results
    return results


async def _set_atomically(
    graph: Seen, node: str, parameters: Sequence[Parameter], options: argparse.Namespace
) -> msg.SetParametersResult:
    service = Service(srv.SetParametersAtomically, f"{node}/set_parameters_atomically")
    request = srv.SetParametersAtomically.Request(parameters=tuple(map(to_parameter, parameters)))
    answer = await ask(graph, node, service, request, options)
    result: msg.SetParametersResult = answer.result
    return result


def _tell(done: str, failed: str, result: msg.SetParametersResult) -> None:
    reason = f": {result.reason}" if result.reason else ""
    print((done + reason).replace("\n", "\n    ")) if result.successful else complain(failed + reason)


def _told(done: str, failed: str, result: msg.SetParametersResult, options: argparse.Namespace) -> Exit:
    if options.json:
        print_json({"successful": result.successful, "reason": result.reason})
    else:
        _tell(done, failed, result)
    return Exit.DONE if result.successful else Exit.REFUSED


def _print_results(parameters: Sequence[Parameter], results: Sequence[msg.SetParametersResult]) -> None:
    print_json(
        {
            parameter.name: {"successful": result.successful, "reason": result.reason}
            for parameter, result in zip(parameters, results, strict=True)
        }
    )


async def delete(options: argparse.Namespace) -> Exit:
    """Delete a parameter that was declared without a fixed type."""
    async with seen(options) as graph:
        node = await found_node(graph, options.node_name, options.timeout)
        (result,) = await _set(graph, node, [Parameter(options.parameter_name)], options)
    return _told("Deleted parameter successfully", "Deleting parameter failed", result, options)


async def describe(options: argparse.Namespace) -> Exit:
    """Types, descriptions and ranges of parameters."""
    from actors.interfaces import to_plain

    async with seen(options) as graph:
        node = await found_node(graph, options.node_name, options.timeout)
        described = await _descriptors(graph, node, options.parameter_names, options)
        if not described:
            hint = await _unknown(graph, node, options.parameter_names, options)
            complain(f"{node} has not declared all of {', '.join(options.parameter_names)}{hint}")
    if options.json:
        print_json([{**to_plain(each), "type": type_word(each.type)} for each in described])
        return Exit.DONE if described else Exit.FAILED
    for each in described:
        _print_descriptor(each)
    return Exit.DONE if described else Exit.FAILED


def _print_descriptor(each: msg.ParameterDescriptor) -> None:
    print(f"Parameter name: {each.name}\n  Type: {type_word(each.type)}")
    if each.description:
        print(f"  Description: {each.description}")
    print("  Constraints:")
    if each.read_only:
        print("    Read only: true")
    spans: tuple[Any, ...] = (*each.floating_point_range, *each.integer_range)
    for span in spans[:1]:
        print(f"    Min value: {span.from_value}\n    Max value: {span.to_value}")
        if span.step:
            print(f"    Step: {span.step}")
    if each.additional_constraints:
        print(f"    Additional constraints: {each.additional_constraints}")


async def dump(options: argparse.Namespace) -> Exit:
    """The parameters of a node as a parameter file."""
    from actors.parameters.ros_yaml import dump_yaml

    async with seen(options) as graph:
        node = await found_node(graph, options.node_name, options.timeout)
        values = await _values(graph, node, await _names(graph, node, options), options)
    tree: dict[str, Any] = {}
    for parameter in values:
        *groups, last = parameter.name.split(".")
        inner = tree
        for group in groups:
            inner = inner.setdefault(group, {})
        inner[last] = _json(parameter)
    if options.json:
        print_json({node: {"ros__parameters": tree}})
    else:
        print(dump_yaml({node: {"ros__parameters": tree}}))
    return Exit.DONE


async def load(options: argparse.Namespace) -> Exit:
    """Set those parameters of a file that are meant for a node."""
    try:
        overrides = ParameterOverrides().with_file(options.parameter_file)
    except (InvalidParams, OSError) as error:
        raise CommandFailed(str(error)) from None
    async with seen(options) as graph:
        node = await found_node(graph, options.node_name, options.timeout)
        parameters = _of_node(overrides, node, wildcard=not options.no_use_wildcard)
        if not parameters:
            raise CommandFailed(f"{options.parameter_file} has no parameters for {node}")
        parameters = await _as_declared(graph, node, parameters, options)
        results = await _set(graph, node, parameters, options)
    if options.json:
        _print_results(parameters, results)
    else:
        for parameter, result in zip(parameters, results, strict=True):
            _tell(f"Set parameter {parameter.name} successful", f"Set parameter {parameter.name} failed", result)
    return Exit.DONE if all(result.successful for result in results) else Exit.REFUSED


def _of_node(overrides: ParameterOverrides, node: str, *, wildcard: bool) -> list[Parameter]:
    values = dict(overrides.for_node(node))
    if not wildcard:
        own = {name for pattern, given in overrides.entries if "*" not in pattern for name in given}
        values = {name: value for name, value in values.items() if name in own}
    return [Parameter(name, value) for name, value in values.items()]
