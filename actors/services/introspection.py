"""What a client or a server tells of each of its calls, if it is told to: service introspection."""

from __future__ import annotations

from enum import IntEnum
from hashlib import blake2b
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from actors.interfaces.message import Message

__all__ = ["CallEvents", "CallId", "CallStep", "IdentifiedCall", "caller_id"]

CallId = tuple[bytes, int]
"""The identifier of a client, 16 bytes, and the number of one of its calls. Both ends of a call give the same."""


class CallStep(IntEnum):
    """A step of a call, by the numbers of `service_msgs/msg/ServiceEventInfo`."""

    REQUEST_SENT = 0
    REQUEST_RECEIVED = 1
    RESPONSE_SENT = 2
    RESPONSE_RECEIVED = 3


class IdentifiedCall(Protocol):
    """A call in progress."""

    @property
    def call_id(self) -> CallId: ...


class CallEvents(Protocol):
    """Receives the steps of calls."""

    def tell(self, step: CallStep, call: IdentifiedCall, message: Message) -> None:
        """A call has taken a step, with this request or response. Never raises."""
        ...


def caller_id(node: str, service: str) -> bytes:
    """The identifier of the client of a service in a node of this process."""
    return blake2b(f"{node} {service}".encode(), digest_size=16).digest()
