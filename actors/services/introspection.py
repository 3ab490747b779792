"""What identifies a call at both of its ends, and the steps that it takes, for service introspection and spans."""

from __future__ import annotations

from enum import IntEnum
from hashlib import blake2b

CallId = tuple[bytes, int]
"""The identifier of a client, 16 bytes, and the number of one of its calls. Both ends of a call give the same."""


class CallStep(IntEnum):
    """A step of a call, by the numbers of `service_msgs/msg/ServiceEventInfo`."""

    REQUEST_SENT = 0
    REQUEST_RECEIVED = 1
    RESPONSE_SENT = 2
    RESPONSE_RECEIVED = 3


def caller_id(node: str, service: str) -> bytes:
    """The identifier of the client of a service in a node of this process."""
    return blake2b(f"{node} {service}".encode(), digest_size=16).digest()
