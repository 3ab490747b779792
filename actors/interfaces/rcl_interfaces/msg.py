"""rcl_interfaces/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated, ClassVar

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import (
    AtMost,
    Many,
    bool_array,
    byte_array,
    default,
    float64,
    float64_array,
    int64,
    int64_array,
    string,
    string_array,
    uint8,
    uint32,
    uint64,
)

__all__ = [
    "FloatingPointRange",
    "IntegerRange",
    "ListParametersResult",
    "Log",
    "LoggerLevel",
    "Parameter",
    "ParameterDescriptor",
    "ParameterEvent",
    "ParameterEventDescriptors",
    "ParameterType",
    "ParameterValue",
    "SetLoggerLevelsResult",
    "SetParametersResult",
]


class FloatingPointRange(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/FloatingPointRange"""

    from_value: float64 = 0.0
    to_value: float64 = 0.0
    step: float64 = 0.0


class IntegerRange(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/IntegerRange"""

    from_value: int64 = 0
    to_value: int64 = 0
    step: uint64 = 0


class ListParametersResult(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/ListParametersResult"""

    names: string_array = default()
    prefixes: string_array = default()


class Log(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/Log"""

    DEBUG: ClassVar[uint8] = 10
    INFO: ClassVar[uint8] = 20
    WARN: ClassVar[uint8] = 30
    ERROR: ClassVar[uint8] = 40
    FATAL: ClassVar[uint8] = 50

    stamp: Time = default()
    level: uint8 = 0
    name: string = ""
    msg: string = ""
    file: string = ""
    function: string = ""
    line: uint32 = 0


class LoggerLevel(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/LoggerLevel"""

    LOG_LEVEL_UNKNOWN: ClassVar[uint8] = 0
    LOG_LEVEL_DEBUG: ClassVar[uint8] = 10
    LOG_LEVEL_INFO: ClassVar[uint8] = 20
    LOG_LEVEL_WARN: ClassVar[uint8] = 30
    LOG_LEVEL_ERROR: ClassVar[uint8] = 40
    LOG_LEVEL_FATAL: ClassVar[uint8] = 50

    name: string = ""
    level: uint32 = 0


class ParameterValue(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/ParameterValue"""

    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: string = ""
    byte_array_value: byte_array = default()
    bool_array_value: bool_array = default()
    integer_array_value: int64_array = default()
    double_array_value: float64_array = default()
    string_array_value: string_array = default()


class Parameter(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/Parameter"""

    name: string = ""
    value: ParameterValue = default()


class ParameterDescriptor(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/ParameterDescriptor"""

    name: string = ""
    type: uint8 = 0
    description: string = ""
    additional_constraints: string = ""
    read_only: bool = False
    dynamic_typing: bool = False
    floating_point_range: Annotated[Many[FloatingPointRange], AtMost(1)] = default()
    integer_range: Annotated[Many[IntegerRange], AtMost(1)] = default()


class ParameterEvent(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/ParameterEvent"""

    stamp: Time = default()
    node: string = ""
    new_parameters: Many[Parameter] = default()
    changed_parameters: Many[Parameter] = default()
    deleted_parameters: Many[Parameter] = default()


class ParameterEventDescriptors(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/ParameterEventDescriptors"""

    new_parameters: Many[ParameterDescriptor] = default()
    changed_parameters: Many[ParameterDescriptor] = default()
    deleted_parameters: Many[ParameterDescriptor] = default()


class ParameterType(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/ParameterType"""

    PARAMETER_NOT_SET: ClassVar[uint8] = 0
    PARAMETER_BOOL: ClassVar[uint8] = 1
    PARAMETER_INTEGER: ClassVar[uint8] = 2
    PARAMETER_DOUBLE: ClassVar[uint8] = 3
    PARAMETER_STRING: ClassVar[uint8] = 4
    PARAMETER_BYTE_ARRAY: ClassVar[uint8] = 5
    PARAMETER_BOOL_ARRAY: ClassVar[uint8] = 6
    PARAMETER_INTEGER_ARRAY: ClassVar[uint8] = 7
    PARAMETER_DOUBLE_ARRAY: ClassVar[uint8] = 8
    PARAMETER_STRING_ARRAY: ClassVar[uint8] = 9


class SetLoggerLevelsResult(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/SetLoggerLevelsResult"""

    successful: bool = False
    reason: string = ""


class SetParametersResult(Message, frozen=True, kw_only=True):
    """rcl_interfaces/msg/SetParametersResult"""

    successful: bool = False
    reason: string = ""
