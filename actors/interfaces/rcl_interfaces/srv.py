"""rcl_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import ClassVar, TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import Many, default, string_array, uint8_array, uint64

from .msg import (
    ListParametersResult,
    LoggerLevel,
    Parameter,
    ParameterDescriptor,
    ParameterValue,
    SetLoggerLevelsResult,
    SetParametersResult,
)

__all__ = [
    "DescribeParameters",
    "DescribeParameters_Request",
    "DescribeParameters_Response",
    "GetLoggerLevels",
    "GetLoggerLevels_Request",
    "GetLoggerLevels_Response",
    "GetParameterTypes",
    "GetParameterTypes_Request",
    "GetParameterTypes_Response",
    "GetParameters",
    "GetParameters_Request",
    "GetParameters_Response",
    "ListParameters",
    "ListParameters_Request",
    "ListParameters_Response",
    "SetLoggerLevels",
    "SetLoggerLevels_Request",
    "SetLoggerLevels_Response",
    "SetParameters",
    "SetParametersAtomically",
    "SetParametersAtomically_Request",
    "SetParametersAtomically_Response",
    "SetParameters_Request",
    "SetParameters_Response",
]


class DescribeParameters_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/DescribeParameters_Request"""

    names: string_array = default()


class DescribeParameters_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/DescribeParameters_Response"""

    descriptors: Many[ParameterDescriptor] = default()


class DescribeParameters(ServiceType[DescribeParameters_Request, DescribeParameters_Response]):
    """rcl_interfaces/srv/DescribeParameters"""

    Request: TypeAlias = DescribeParameters_Request
    Response: TypeAlias = DescribeParameters_Response


class GetLoggerLevels_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/GetLoggerLevels_Request"""

    names: string_array = default()


class GetLoggerLevels_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/GetLoggerLevels_Response"""

    levels: Many[LoggerLevel] = default()


class GetLoggerLevels(ServiceType[GetLoggerLevels_Request, GetLoggerLevels_Response]):
    """rcl_interfaces/srv/GetLoggerLevels"""

    Request: TypeAlias = GetLoggerLevels_Request
    Response: TypeAlias = GetLoggerLevels_Response


class GetParameterTypes_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/GetParameterTypes_Request"""

    names: string_array = default()


class GetParameterTypes_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/GetParameterTypes_Response"""

    types: uint8_array = default()


class GetParameterTypes(ServiceType[GetParameterTypes_Request, GetParameterTypes_Response]):
    """rcl_interfaces/srv/GetParameterTypes"""

    Request: TypeAlias = GetParameterTypes_Request
    Response: TypeAlias = GetParameterTypes_Response


class GetParameters_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/GetParameters_Request"""

    names: string_array = default()


class GetParameters_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/GetParameters_Response"""

    values: Many[ParameterValue] = default()


class GetParameters(ServiceType[GetParameters_Request, GetParameters_Response]):
    """rcl_interfaces/srv/GetParameters"""

    Request: TypeAlias = GetParameters_Request
    Response: TypeAlias = GetParameters_Response


class ListParameters_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/ListParameters_Request"""

    DEPTH_RECURSIVE: ClassVar[uint64] = 0

    prefixes: string_array = default()
    depth: uint64 = 0


class ListParameters_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/ListParameters_Response"""

    result: ListParametersResult = default()


class ListParameters(ServiceType[ListParameters_Request, ListParameters_Response]):
    """rcl_interfaces/srv/ListParameters"""

    Request: TypeAlias = ListParameters_Request
    Response: TypeAlias = ListParameters_Response


class SetLoggerLevels_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/SetLoggerLevels_Request"""

    levels: Many[LoggerLevel] = default()


class SetLoggerLevels_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/SetLoggerLevels_Response"""

    results: Many[SetLoggerLevelsResult] = default()


class SetLoggerLevels(ServiceType[SetLoggerLevels_Request, SetLoggerLevels_Response]):
    """rcl_interfaces/srv/SetLoggerLevels"""

    Request: TypeAlias = SetLoggerLevels_Request
    Response: TypeAlias = SetLoggerLevels_Response


class SetParameters_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/SetParameters_Request"""

    parameters: Many[Parameter] = default()


class SetParameters_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/SetParameters_Response"""

    results: Many[SetParametersResult] = default()


class SetParameters(ServiceType[SetParameters_Request, SetParameters_Response]):
    """rcl_interfaces/srv/SetParameters"""

    Request: TypeAlias = SetParameters_Request
    Response: TypeAlias = SetParameters_Response


class SetParametersAtomically_Request(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/SetParametersAtomically_Request"""

    parameters: Many[Parameter] = default()


class SetParametersAtomically_Response(Message, frozen=True, kw_only=True):
    """rcl_interfaces/srv/SetParametersAtomically_Response"""

    result: SetParametersResult = default()


class SetParametersAtomically(ServiceType[SetParametersAtomically_Request, SetParametersAtomically_Response]):
    """rcl_interfaces/srv/SetParametersAtomically"""

    Request: TypeAlias = SetParametersAtomically_Request
    Response: TypeAlias = SetParametersAtomically_Response
