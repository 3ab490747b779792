"""What a tree and the agent of another machine tell each other, and the wire between them.

It is written in MessagePack and read as these types and no others: no bytes of the other side are executed. Orders, requests, events and what
nodes leave for their next lives are bytes here, which agents do not read.
"""

from __future__ import annotations

from typing import Final, Protocol, TypeAlias

import msgspec

from actors.errors import ProcessDied, ProcessHung, described


class Wire(Protocol):
    """One end of the connection between a tree and an agent. What is sent arrives in its order; at the end of the connection the rest is lost."""

    @property
    def unsent(self) -> int:
        """How many bytes wait because they cannot be sent."""
        ...

    def send(self, value: object, /) -> None:
        """Send a message; it is lost if the connection has ended."""
        ...

    def close(self) -> None:
        """End the connection once everything has been sent."""
        ...


class Hello(msgspec.Struct, frozen=True, tag=True):
    """The first word of a tree: the length of the lease in seconds."""

    lease: float


class LeaseGrant(msgspec.Struct, frozen=True, tag=True):
    """The lease that was asked for with this number."""

    number: int


class Launch(msgspec.Struct, frozen=True, tag=True):
    """Launch process `number` of this tree for an order, which is packed. `path` and `hang` are in it, too: an agent does not read orders."""

    number: int
    path: tuple[str, ...]
    hang: float
    order: bytes


class ProcessRequest(msgspec.Struct, frozen=True, tag=True):
    """Pass a request on to a process; it is packed."""

    number: int
    request: bytes


class Signaled(msgspec.Struct, frozen=True, tag=True):
    """Terminate a process (`life.Process`), or kill it."""

    number: int
    kill: bool


class Watched(msgspec.Struct, frozen=True, tag=True):
    """From now on kill a process when its event loop hangs, or no more."""

    number: int
    on: bool


class LeaseRequest(msgspec.Struct, frozen=True, tag=True):
    """The agent asks for the lease; `at` is the time on its clock, and `left` what it has left of the last lease, seconds."""

    number: int
    at: float
    left: float


class Launched(msgspec.Struct, frozen=True, tag=True):
    """A process runs, and has this id on its machine."""

    number: int
    process: int


class ProcessEvent(msgspec.Struct, frozen=True, tag=True):
    """An event of a process; it is packed."""

    number: int
    event: bytes


class ProcessEnded(msgspec.Struct, frozen=True, tag=True):
    """A process has ended, or could not be launched."""

    number: int
    how: Exception


class Leaving(msgspec.Struct, frozen=True, tag=True):
    """The agent ends: it takes nothing more, and what it runs is about to stop."""


ToAgent: TypeAlias = Hello | LeaseGrant | Launch | ProcessRequest | Signaled | Watched
FromAgent: TypeAlias = LeaseRequest | Launched | ProcessEvent | ProcessEnded | Leaving


def written(message: ToAgent | FromAgent) -> bytes:
    """A message as bytes."""
    return msgspec.msgpack.encode(message, enc_hook=_told)


def for_agent(data: bytes) -> ToAgent:
    """What a tree has written. Raises `msgspec.MsgspecError`."""
    message: ToAgent = _FOR_AGENT.decode(data)
    return message


def from_agent(data: bytes) -> FromAgent:
    """What an agent has written. Raises `msgspec.MsgspecError`."""
    message: FromAgent = _FROM_AGENT.decode(data)
    return message


def _told(error: object) -> tuple[str, int, float, str]:
    """How a process has ended."""
    if isinstance(error, ProcessDied):
        return "died", error.process, 0.0, error.how
    if isinstance(error, ProcessHung):
        return "hung", error.process, error.seconds, error.where
    return "failed", 0, 0.0, described(error)


def _understood(kind: type, told: object) -> Exception:
    how, process, seconds, text = msgspec.convert(told, tuple[str, int, float, str])
    if how == "died":
        return ProcessDied(process, text)
    return ProcessHung(process, seconds, text) if how == "hung" else OSError(text)


_FOR_AGENT: Final = msgspec.msgpack.Decoder(Hello | LeaseGrant | Launch | ProcessRequest | Signaled | Watched)
_FROM_AGENT: Final = msgspec.msgpack.Decoder(
    LeaseRequest | Launched | ProcessEvent | ProcessEnded | Leaving, dec_hook=_understood
)
