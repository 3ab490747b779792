"""What a client or a server tells of each of its calls, if it is told to: service introspection, and spans."""

from __future__ import annotations

from enum import IntEnum
from hashlib import blake2b
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import asyncio

    from actors.interfaces.message import Message

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

    @property
    def future(self) -> asyncio.Future[Any]:
        """Completed with the response, or with the error that the caller is given."""
        ...


class CallEvents(Protocol):
    """Receives the steps of calls."""

    def tell(self, step: CallStep, call: IdentifiedCall, message: Message) -> None:
        """A call has taken a step, with this request or response. Never raises."""
        ...

    def handled(self, call: IdentifiedCall) -> None:
        """The handler of a received request has returned or raised. Called in the task in which `REQUEST_RECEIVED` was told. Never raises."""
        ...


class AllEvents:
    """Several receivers of the steps of the same calls, told in their order."""

    def __init__(self, receivers: tuple[CallEvents, ...]) -> None:
        self._receivers = receivers

    def tell(self, step: CallStep, call: IdentifiedCall, message: Message) -> None:
        for each in self._receivers:
            each.tell(step, call, message)

    def handled(self, call: IdentifiedCall) -> None:
        for each in reversed(self._receivers):
            each.handled(call)


def caller_id(node: str, service: str) -> bytes:
    """The identifier of the client of a service in a node of this process."""
    return blake2b(f"{node} {service}".encode(), digest_size=16).digest()
