"""Parameters as messages: conversion to and from `rcl_interfaces`, and the six parameter services of every node.

The services are functions from a store and a request to a response; they never raise to the client. A value in a message has an exact type
and is not widened. Import this module late, because it needs the message types.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, NamedTuple

from actors.errors import described
from actors.interfaces import Message, ServiceType
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rcl_interfaces import msg, srv
from actors.parameters.descriptor import FloatingPointRange, IntegerRange, ParameterDescriptor
from actors.parameters.errors import ParameterNotDeclared, ParameterUninitialized
from actors.parameters.store import ParameterStore
from actors.parameters.values import Parameter, ParameterChange, ParameterType, SetResult

__all__ = [
    "from_descriptor",
    "from_event",
    "from_parameter",
    "from_result",
    "from_value",
    "to_descriptor",
    "to_event",
    "to_parameter",
    "to_result",
    "to_value",
]

_FIELD: Final[Mapping[ParameterType, str]] = {
    kind: f"{kind.name.lower()}_value" for kind in ParameterType if kind is not ParameterType.NOT_SET
}


def to_value(parameter: Parameter) -> msg.ParameterValue:
    """The type and value of a parameter as a message."""
    kind, value = parameter.type, parameter.value
    if kind is ParameterType.NOT_SET:
        return msg.ParameterValue()
    if kind is ParameterType.BYTE_ARRAY:
        value = b"".join(value)
    filled: dict[str, Any] = {_FIELD[kind]: value}
    return msg.ParameterValue(type=kind.value, **filled)


def from_value(name: str, message: msg.ParameterValue) -> Parameter:
    """The parameter `name` with the type and value of a message. Raises ValueError for an unknown type."""
    try:
        kind = ParameterType(message.type)
    except ValueError:
        raise ValueError(f"parameter {name!r} has type {message.type}, but types go from 0 to 9.") from None
    if kind is ParameterType.NOT_SET:
        return Parameter(name)
    value: Any = getattr(message, _FIELD[kind])
    if kind is ParameterType.BYTE_ARRAY:
        value = tuple(bytes([byte]) for byte in value.tolist())
    elif kind.is_array and kind is not ParameterType.STRING_ARRAY:
        value = value.tolist()
    return Parameter(name, value, kind)


def to_parameter(parameter: Parameter) -> msg.Parameter:
    """A parameter as a message."""
    return msg.Parameter(name=parameter.name, value=to_value(parameter))


def from_parameter(message: msg.Parameter) -> Parameter:
    """The parameter in a message. Raises ValueError for an unknown type."""
    return from_value(message.name, message.value)


def to_descriptor(descriptor: ParameterDescriptor) -> msg.ParameterDescriptor:
    """A descriptor as a message. Choices, for which it has no field, are added to `additional_constraints` as text."""
    constraints = [descriptor.additional_constraints] if descriptor.additional_constraints else []
    if descriptor.choices:
        constraints.append(f"one of: {', '.join(repr(choice) for choice in descriptor.choices)}")
    floats, integers = descriptor.floating_point_range, descriptor.integer_range
    return msg.ParameterDescriptor(
        name=descriptor.name,
        type=descriptor.type.value,
        description=descriptor.description,
        additional_constraints="; ".join(constraints),
        read_only=descriptor.read_only,
        dynamic_typing=descriptor.dynamic_typing,
        floating_point_range=(
            ()
            if floats is None
            else (msg.FloatingPointRange(from_value=floats.from_value, to_value=floats.to_value, step=floats.step),)
        ),
        integer_range=(
            ()
            if integers is None
            else (msg.IntegerRange(from_value=integers.from_value, to_value=integers.to_value, step=integers.step),)
        ),
    )


def from_descriptor(message: msg.ParameterDescriptor) -> ParameterDescriptor:
    """The descriptor in a message. Raises ValueError for an unknown type and for an invalid range."""
    floats, integers = message.floating_point_range, message.integer_range
    return ParameterDescriptor(
        name=message.name,
        type=ParameterType(message.type),
        description=message.description,
        additional_constraints=message.additional_constraints,
        read_only=message.read_only,
        dynamic_typing=message.dynamic_typing,
        floating_point_range=(
            FloatingPointRange(floats[0].from_value, floats[0].to_value, floats[0].step) if floats else None
        ),
        integer_range=IntegerRange(integers[0].from_value, integers[0].to_value, integers[0].step)
        if integers
        else None,
    )


def to_result(result: SetResult) -> msg.SetParametersResult:
    """The result of a set as a message."""
    return msg.SetParametersResult(successful=result.successful, reason=result.reason)


def from_result(message: msg.SetParametersResult) -> SetResult:
    """The result of a set in a message."""
    return SetResult(message.successful, message.reason)


def to_event(change: ParameterChange, node: str, stamp: Time) -> msg.ParameterEvent:
    """A change as a message for /parameter_events. `node` is the fully qualified name."""
    return msg.ParameterEvent(
        stamp=stamp,
        node=node,
        new_parameters=tuple(to_parameter(parameter) for parameter in change.new),
        changed_parameters=tuple(to_parameter(parameter) for parameter in change.changed),
        deleted_parameters=tuple(to_parameter(parameter) for parameter in change.deleted),
    )


def from_event(message: msg.ParameterEvent) -> ParameterChange:
    """The change in a message of /parameter_events. Raises ValueError for an unknown type."""
    return ParameterChange(
        new=tuple(from_parameter(parameter) for parameter in message.new_parameters),
        changed=tuple(from_parameter(parameter) for parameter in message.changed_parameters),
        deleted=tuple(from_parameter(parameter) for parameter in message.deleted_parameters),
    )


OnError = Callable[[Exception], None]


def describe_parameters(
    store: ParameterStore, request: srv.DescribeParameters_Request
) -> srv.DescribeParameters_Response:
    """Return the requested descriptors; none at all if a name is undeclared and the node does not allow that."""
    try:
        return srv.DescribeParameters_Response(
            descriptors=tuple(to_descriptor(store.describe(name)) for name in request.names)
        )
    except ParameterNotDeclared:
        return srv.DescribeParameters_Response()


def get_parameter_types(
    store: ParameterStore, request: srv.GetParameterTypes_Request
) -> srv.GetParameterTypes_Response:
    """Return the types of the requested values; none at all if a name is undeclared and the node does not allow that."""
    try:
        return srv.GetParameterTypes_Response(types=[store.type_of(name).value for name in request.names])
    except ParameterNotDeclared:
        return srv.GetParameterTypes_Response()


def get_parameters(store: ParameterStore, request: srv.GetParameters_Request) -> srv.GetParameters_Response:
    """Return the requested values; none at all if a name has no value, or is undeclared and the node does not allow that."""
    try:
        return srv.GetParameters_Response(values=tuple(to_value(store.get(name)) for name in request.names))
    except (ParameterNotDeclared, ParameterUninitialized):
        return srv.GetParameters_Response()


def list_parameters(store: ParameterStore, request: srv.ListParameters_Request) -> srv.ListParameters_Response:
    """Return names and groups as `ParameterStore.list` does."""
    found = store.list(request.prefixes, request.depth)
    return srv.ListParameters_Response(result=msg.ListParametersResult(names=found.names, prefixes=found.prefixes))


def set_parameters(
    store: ParameterStore, request: srv.SetParameters_Request, on_error: OnError | None = None
) -> srv.SetParameters_Response:
    """Set each parameter by itself. An undeclared name gives a failed result and the others are set, unlike in `ParameterStore.set`."""
    return srv.SetParameters_Response(
        results=tuple(to_result(_set(store, [parameter], on_error)) for parameter in request.parameters)
    )


def set_parameters_atomically(
    store: ParameterStore, request: srv.SetParametersAtomically_Request, on_error: OnError | None = None
) -> srv.SetParametersAtomically_Response:
    """Set all parameters or none."""
    return srv.SetParametersAtomically_Response(result=to_result(_set(store, request.parameters, on_error)))


def _set(store: ParameterStore, parameters: Iterable[msg.Parameter], on_error: OnError | None) -> SetResult:
    try:
        wanted = [from_parameter(parameter) for parameter in parameters]
    except ValueError as error:
        return SetResult(False, str(error))
    try:
        return store.set_atomically(wanted)
    except ParameterNotDeclared as error:
        return SetResult(False, str(error))
    except Exception as error:  # a callback of the node failed: both the client and the node are informed
        if on_error is not None:
            on_error(error)
        return SetResult(False, f"a parameter callback of node {store.node} failed: {described(error)}")


class ParameterService(NamedTuple):
    """One of the six services: its name below that of the node, its type, and the function that answers.

    The function takes the store and the request. The two that set parameters also take `on_error`, which is called if a callback of the
    node has raised; the client then receives a failed result.
    """

    name: str
    type: type[ServiceType[Any, Any]]
    answer: Callable[..., Message]


PARAMETER_SERVICES: Final = (
    ParameterService("describe_parameters", srv.DescribeParameters, describe_parameters),
    ParameterService("get_parameter_types", srv.GetParameterTypes, get_parameter_types),
    ParameterService("get_parameters", srv.GetParameters, get_parameters),
    ParameterService("list_parameters", srv.ListParameters, list_parameters),
    ParameterService("set_parameters", srv.SetParameters, set_parameters),
    ParameterService("set_parameters_atomically", srv.SetParametersAtomically, set_parameters_atomically),
)
"""The services of every node, with the QoS profile `parameters`."""
