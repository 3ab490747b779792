"""example_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import int64, string

__all__ = [
    "AddTwoInts",
    "AddTwoInts_Request",
    "AddTwoInts_Response",
    "SetBool",
    "SetBool_Request",
    "SetBool_Response",
    "Trigger",
    "Trigger_Request",
    "Trigger_Response",
]


class AddTwoInts_Request(Message, frozen=True, kw_only=True):
    """example_interfaces/srv/AddTwoInts_Request"""

    a: int64 = 0
    b: int64 = 0


class AddTwoInts_Response(Message, frozen=True, kw_only=True):
    """example_interfaces/srv/AddTwoInts_Response"""

    sum: int64 = 0


class AddTwoInts(ServiceType[AddTwoInts_Request, AddTwoInts_Response]):
    """example_interfaces/srv/AddTwoInts"""

    Request: TypeAlias = AddTwoInts_Request
    Response: TypeAlias = AddTwoInts_Response


class SetBool_Request(Message, frozen=True, kw_only=True):
    """example_interfaces/srv/SetBool_Request"""

    data: bool = False


class SetBool_Response(Message, frozen=True, kw_only=True):
    """example_interfaces/srv/SetBool_Response"""

    success: bool = False
    message: string = ""


class SetBool(ServiceType[SetBool_Request, SetBool_Response]):
    """example_interfaces/srv/SetBool"""

    Request: TypeAlias = SetBool_Request
    Response: TypeAlias = SetBool_Response


class Trigger_Request(Message, frozen=True, kw_only=True):
    """example_interfaces/srv/Trigger_Request"""


class Trigger_Response(Message, frozen=True, kw_only=True):
    """example_interfaces/srv/Trigger_Response"""

    success: bool = False
    message: string = ""


class Trigger(ServiceType[Trigger_Request, Trigger_Response]):
    """example_interfaces/srv/Trigger"""

    Request: TypeAlias = Trigger_Request
    Response: TypeAlias = Trigger_Response
