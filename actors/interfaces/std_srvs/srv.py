"""std_srvs/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import string

__all__ = [
    "Empty",
    "Empty_Request",
    "Empty_Response",
    "SetBool",
    "SetBool_Request",
    "SetBool_Response",
    "Trigger",
    "Trigger_Request",
    "Trigger_Response",
]


class Empty_Request(Message, frozen=True, kw_only=True):
    """std_srvs/srv/Empty_Request"""


class Empty_Response(Message, frozen=True, kw_only=True):
    """std_srvs/srv/Empty_Response"""


class Empty(ServiceType[Empty_Request, Empty_Response]):
    """std_srvs/srv/Empty"""

    Request: TypeAlias = Empty_Request
    Response: TypeAlias = Empty_Response


class SetBool_Request(Message, frozen=True, kw_only=True):
    """std_srvs/srv/SetBool_Request"""

    data: bool = False


class SetBool_Response(Message, frozen=True, kw_only=True):
    """std_srvs/srv/SetBool_Response"""

    success: bool = False
    message: string = ""


class SetBool(ServiceType[SetBool_Request, SetBool_Response]):
    """std_srvs/srv/SetBool"""

    Request: TypeAlias = SetBool_Request
    Response: TypeAlias = SetBool_Response


class Trigger_Request(Message, frozen=True, kw_only=True):
    """std_srvs/srv/Trigger_Request"""


class Trigger_Response(Message, frozen=True, kw_only=True):
    """std_srvs/srv/Trigger_Response"""

    success: bool = False
    message: string = ""


class Trigger(ServiceType[Trigger_Request, Trigger_Response]):
    """std_srvs/srv/Trigger"""

    Request: TypeAlias = Trigger_Request
    Response: TypeAlias = Trigger_Response
