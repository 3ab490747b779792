"""Parameters of a node, by the rules of ROS 2: declaration, types, ranges, callbacks, events.

Pure values and one state machine (`ParameterStore`), without messages, transport or waiting. The conversion to and from `rcl_interfaces`
and the six services are in `actors.parameters.messages`, and the parsing of text from a command line in `actors.parameters.text`; both are
imported only where they are used.
"""

from actors.parameters.callbacks import CallbackHandle, OnSetCallback, PostSetCallback, PreSetCallback
from actors.parameters.declare import NO_PARAMETERS, ParameterDeclaration, ParameterTable
from actors.parameters.descriptor import FloatingPointRange, IntegerRange, ParameterDescriptor
from actors.parameters.errors import (
    InvalidParameterName,
    InvalidParameterType,
    InvalidParameterValue,
    ParameterAlreadyDeclared,
    ParameterBusy,
    ParameterError,
    ParameterImmutable,
    ParameterNotDeclared,
    ParameterUninitialized,
)
from actors.parameters.hooks import on_set, post_set, pre_set
from actors.parameters.store import ParameterStore
from actors.parameters.values import ParameterChange, ParameterNames, ParameterType, SetResult, Value

SetParametersResult = SetResult
"""The name of `SetResult` in ROS 2."""

__all__ = [
    "NO_PARAMETERS",
    "CallbackHandle",
    "FloatingPointRange",
    "IntegerRange",
    "InvalidParameterName",
    "InvalidParameterType",
    "InvalidParameterValue",
    "OnSetCallback",
    "ParameterAlreadyDeclared",
    "ParameterBusy",
    "ParameterChange",
    "ParameterDeclaration",
    "ParameterDescriptor",
    "ParameterError",
    "ParameterImmutable",
    "ParameterNames",
    "ParameterNotDeclared",
    "ParameterStore",
    "ParameterTable",
    "ParameterType",
    "ParameterUninitialized",
    "PostSetCallback",
    "PreSetCallback",
    "SetParametersResult",
    "Value",
    "on_set",
    "post_set",
    "pre_set",
]
