"""diagnostic_msgs/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.types import Many, byte, default, string

from .msg import DiagnosticStatus

__all__ = [
    "AddDiagnostics",
    "AddDiagnostics_Request",
    "AddDiagnostics_Response",
    "SelfTest",
    "SelfTest_Request",
    "SelfTest_Response",
]


class AddDiagnostics_Request(Message, frozen=True, kw_only=True):
    """diagnostic_msgs/srv/AddDiagnostics_Request"""

    load_namespace: string = ""


class AddDiagnostics_Response(Message, frozen=True, kw_only=True):
    """diagnostic_msgs/srv/AddDiagnostics_Response"""

    success: bool = False
    message: string = ""


class AddDiagnostics(ServiceType[AddDiagnostics_Request, AddDiagnostics_Response]):
    """diagnostic_msgs/srv/AddDiagnostics"""

    Request: TypeAlias = AddDiagnostics_Request
    Response: TypeAlias = AddDiagnostics_Response


class SelfTest_Request(Message, frozen=True, kw_only=True):
    """diagnostic_msgs/srv/SelfTest_Request"""


class SelfTest_Response(Message, frozen=True, kw_only=True):
    """diagnostic_msgs/srv/SelfTest_Response"""

    id: string = ""
    passed: byte = 0
    status: Many[DiagnosticStatus] = default()


class SelfTest(ServiceType[SelfTest_Request, SelfTest_Response]):
    """diagnostic_msgs/srv/SelfTest"""

    Request: TypeAlias = SelfTest_Request
    Response: TypeAlias = SelfTest_Response
