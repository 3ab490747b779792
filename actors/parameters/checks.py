"""The checks of declarations and values that need no callback. Pure functions; `node` is only used in errors."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Final, cast

import msgspec

from actors.parameters.descriptor import ParameterDescriptor, declared_type
from actors.parameters.errors import InvalidParameterName, InvalidParameterType, InvalidParameterValue
from actors.parameters.values import Parameter, ParameterType, widened

UNDESCRIBED: Final = ParameterDescriptor()
DYNAMIC: Final = ParameterDescriptor(dynamic_typing=True)


def planned(
    node: str, name: str, value: object, descriptor: ParameterDescriptor | None, overrides: Mapping[str, object]
) -> tuple[Parameter, ParameterDescriptor]:
    """Return the parameter and the descriptor that a declaration would store. An override of that name replaces `value`.

    Raises InvalidParameterName, ValueError and TypeError as `ParameterStore.declare` does. A name without value and descriptor is
    deprecated; the warning refers to the code two calls up.
    """
    if not isinstance(cast("object", name), str) or not name:
        raise InvalidParameterName(f"a parameter name is a non-empty string, not {name!r} (node {node}).")
    if descriptor is None:
        descriptor = UNDESCRIBED
        if value is None:
            warnings.warn(
                f"declaring parameter {name!r} of node {node} by its name only is deprecated: give a default "
                "value, a ParameterType, or a descriptor with dynamic_typing=True.",
                DeprecationWarning,
                stacklevel=3,
            )
            descriptor = DYNAMIC
    kind = declared_type(name, value, descriptor)
    if name in overrides:
        parameter = widened(name, overrides[name], kind)
    elif isinstance(value, ParameterType):
        parameter = Parameter(name)
    else:
        parameter = Parameter(name, value)
    return parameter, msgspec.structs.replace(descriptor, name=name, type=kind)


def unpacked(item: tuple[Any, ...]) -> tuple[str, object, ParameterDescriptor | None]:
    """The name, value and descriptor of one of several declarations. Raises TypeError for a tuple of another length."""
    if not 1 <= len(item) <= 3:
        raise TypeError(f"a parameter to declare is (name), (name, value) or (name, value, descriptor), not {item!r}.")
    if len(item) == 1:
        return item[0], None, None
    return item[0], item[1], item[2] if len(item) == 3 else UNDESCRIBED


def checked(node: str, parameter: Parameter, described: ParameterDescriptor) -> Parameter:
    """Return `parameter`. Raises the error that describes how it violates `described`, if it does."""
    reason = described.type_objection(parameter)
    if reason is not None:
        raise InvalidParameterType(f"node {node}: {reason}", node=node, names=[parameter.name])
    reason = described.value_objection(parameter)
    if reason is not None:
        raise invalid(node, parameter, reason)
    return parameter


def invalid(node: str, parameter: Parameter, reason: str) -> InvalidParameterValue:
    """Create the error for a refused value."""
    return InvalidParameterValue(
        f"node {node} cannot have {parameter.name!r} = {parameter.value!r}: {reason}",
        node=node,
        names=[parameter.name],
        reason=reason,
    )


def refused(node: str, given: Sequence[Parameter], reason: str) -> InvalidParameterValue:
    """Create the error for a node whose own callbacks refuse the values with which it is started."""
    told = ", ".join(f"{one.name} = {one.value!r}" for one in given)
    return InvalidParameterValue(
        f"node {node} cannot start with {told}: {reason}", node=node, names=[one.name for one in given], reason=reason
    )


def objection(parameter: Parameter, described: ParameterDescriptor | None) -> str | None:
    """Why a descriptor does not allow `parameter` to be set; None if it does. Without a descriptor, only the name is checked."""
    if described is None:
        return None if parameter.name else "a parameter name must not be empty."
    if described.read_only:
        return f"Trying to set a read-only parameter: {parameter.name}. Give it as an override when starting the node."
    return described.type_objection(parameter) or described.value_objection(parameter)
