"""unitree_api/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.message import Message
from actors.interfaces.types import default, int32, int64, string, uint8_array

__all__ = [
    "Request",
    "RequestHeader",
    "RequestIdentity",
    "RequestLease",
    "RequestPolicy",
    "Response",
    "ResponseHeader",
    "ResponseStatus",
]


class RequestIdentity(Message, frozen=True, kw_only=True):
    """unitree_api/msg/RequestIdentity"""

    id: int64 = 0
    api_id: int64 = 0


class RequestLease(Message, frozen=True, kw_only=True):
    """unitree_api/msg/RequestLease"""

    id: int64 = 0


class RequestPolicy(Message, frozen=True, kw_only=True):
    """unitree_api/msg/RequestPolicy"""

    priority: int32 = 0
    noreply: bool = False


class RequestHeader(Message, frozen=True, kw_only=True):
    """unitree_api/msg/RequestHeader"""

    identity: RequestIdentity = default()
    lease: RequestLease = default()
    policy: RequestPolicy = default()


class Request(Message, frozen=True, kw_only=True):
    """unitree_api/msg/Request"""

    header: RequestHeader = default()
    parameter: string = ""
    binary: uint8_array = default()


class ResponseStatus(Message, frozen=True, kw_only=True):
    """unitree_api/msg/ResponseStatus"""

    code: int32 = 0


class ResponseHeader(Message, frozen=True, kw_only=True):
    """unitree_api/msg/ResponseHeader"""

    identity: RequestIdentity = default()
    status: ResponseStatus = default()


class Response(Message, frozen=True, kw_only=True):
    """unitree_api/msg/Response"""

    header: ResponseHeader = default()
    data: string = ""
    binary: uint8_array = default()
