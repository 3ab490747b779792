"""Stand-ins for peers in another process, in the tests' own: whatever passes between the two sides is encoded to CDR and decoded again.

They keep to what the messages of ROS 2 can say. What gets lost on the way, as over a real wire: the reason of a rejection, of a cancellation
and of an outcome; whether a goal had a result at all; that a caller has given up. What they know besides is what the graph of a transport
would tell: who serves a name, and that a server is being restarted or has stopped. An error of a handler comes as an error reply.

Messages of one server to one client arrive in the order in which they were sent, each in a turn of the loop of its own.
"""

from __future__ import annotations

from typing import TypeVar

from actors.interfaces.cdr import decode, encode
from actors.interfaces.message import Message

__all__ = ["carried"]

M = TypeVar("M", bound=Message)


def carried(message: M) -> M:
    """The message as the other side gets it: another object, made from its bytes."""
    return decode(type(message), encode(message))
