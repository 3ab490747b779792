"""type_description_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import Many, default, string

from .msg import KeyValue, TypeDescription, TypeSource

__all__ = [
    "GetTypeDescription",
    "GetTypeDescription_Request",
    "GetTypeDescription_Response",
]


class GetTypeDescription_Request(Message, frozen=True, kw_only=True):
    """type_description_interfaces/srv/GetTypeDescription_Request"""

    type_name: string = ""
    type_hash: string = ""
    include_type_sources: bool = True


class GetTypeDescription_Response(Message, frozen=True, kw_only=True):
    """type_description_interfaces/srv/GetTypeDescription_Response"""

    successful: bool = False
    failure_reason: string = ""
    type_description: TypeDescription = default()
    type_sources: Many[TypeSource] = default()
    extra_information: Many[KeyValue] = default()


class GetTypeDescription(ServiceType[GetTypeDescription_Request, GetTypeDescription_Response]):
    """type_description_interfaces/srv/GetTypeDescription"""

    Request: TypeAlias = GetTypeDescription_Request
    Response: TypeAlias = GetTypeDescription_Response
