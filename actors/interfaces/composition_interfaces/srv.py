"""composition_interfaces/srv. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.message import Message, ServiceType
from actors.interfaces.rcl_interfaces.msg import Parameter
from actors.interfaces.types import Many, default, string, string_array, uint8, uint64, uint64_array

__all__ = [
    "ListNodes",
    "ListNodes_Request",
    "ListNodes_Response",
    "LoadNode",
    "LoadNode_Request",
    "LoadNode_Response",
    "UnloadNode",
    "UnloadNode_Request",
    "UnloadNode_Response",
]


class ListNodes_Request(Message, frozen=True, kw_only=True):
    """composition_interfaces/srv/ListNodes_Request"""


class ListNodes_Response(Message, frozen=True, kw_only=True):
    """composition_interfaces/srv/ListNodes_Response"""

    full_node_names: string_array = default()
    unique_ids: uint64_array = default()


class ListNodes(ServiceType[ListNodes_Request, ListNodes_Response]):
    """composition_interfaces/srv/ListNodes"""

    Request: TypeAlias = ListNodes_Request
    Response: TypeAlias = ListNodes_Response


class LoadNode_Request(Message, frozen=True, kw_only=True):
    """composition_interfaces/srv/LoadNode_Request"""

    package_name: string = ""
    plugin_name: string = ""
    node_name: string = ""
    node_namespace: string = ""
    log_level: uint8 = 0
    remap_rules: string_array = default()
    parameters: Many[Parameter] = default()
    extra_arguments: Many[Parameter] = default()


class LoadNode_Response(Message, frozen=True, kw_only=True):
    """composition_interfaces/srv/LoadNode_Response"""

    success: bool = False
    error_message: string = ""
    full_node_name: string = ""
    unique_id: uint64 = 0


class LoadNode(ServiceType[LoadNode_Request, LoadNode_Response]):
    """composition_interfaces/srv/LoadNode"""

    Request: TypeAlias = LoadNode_Request
    Response: TypeAlias = LoadNode_Response


class UnloadNode_Request(Message, frozen=True, kw_only=True):
    """composition_interfaces/srv/UnloadNode_Request"""

    unique_id: uint64 = 0


class UnloadNode_Response(Message, frozen=True, kw_only=True):
    """composition_interfaces/srv/UnloadNode_Response"""

    success: bool = False
    error_message: string = ""


class UnloadNode(ServiceType[UnloadNode_Request, UnloadNode_Response]):
    """composition_interfaces/srv/UnloadNode"""

    Request: TypeAlias = UnloadNode_Request
    Response: TypeAlias = UnloadNode_Response
