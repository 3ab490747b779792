"""What a tree and the agent of another machine tell each other, and the wire between them."""

from __future__ import annotations

from typing import Protocol, TypeAlias

import msgspec

__all__ = [
    "Asked",
    "Ended",
    "FromAgent",
    "Granted",
    "Hello",
    "Launch",
    "Launched",
    "Leaving",
    "Renew",
    "Said",
    "Signaled",
    "ToAgent",
    "Watched",
    "Wire",
]


class Wire(Protocol):
    """One end of the connection between a tree and an agent. What is sent arrives in its order; at the end of the connection the rest is lost."""

    @property
    def unsent(self) -> int:
        """How many bytes wait because they cannot be sent."""
        ...

    def send(self, value: object, /) -> None:
        """Send a value; it is lost if the connection has ended. Raises what `pack` raises."""
        ...

    def close(self) -> None:
        """End the connection once everything has been sent."""
        ...


class Hello(msgspec.Struct, frozen=True):
    """The first word of a tree: the length of the lease in seconds."""

    lease: float


class Granted(msgspec.Struct, frozen=True):
    """The lease that was asked for with this number."""

    number: int


class Launch(msgspec.Struct, frozen=True):
    """Launch process `number` of this tree for an order, which is packed. `path` and `hang` are in it, too: an agent does not read orders."""

    number: int
    path: tuple[str, ...]
    hang: float
    order: bytes


class Asked(msgspec.Struct, frozen=True):
    """Pass a request on to a process; it is packed."""

    number: int
    request: bytes


class Signaled(msgspec.Struct, frozen=True):
    """Terminate a process (`life.Process`), or kill it."""

    number: int
    kill: bool


class Watched(msgspec.Struct, frozen=True):
    """From now on kill a process when its event loop hangs, or no more."""

    number: int
    on: bool


class Renew(msgspec.Struct, frozen=True):
    """The agent asks for the lease; `at` is the time on its clock, and `left` what it has left of the last lease, seconds."""

    number: int
    at: float
    left: float


class Launched(msgspec.Struct, frozen=True):
    """A process runs, and has this id on its machine."""

    number: int
    process: int


class Said(msgspec.Struct, frozen=True):
    """An event of a process; it is packed."""

    number: int
    event: bytes


class Ended(msgspec.Struct, frozen=True):
    """A process has ended, or could not be launched."""

    number: int
    how: Exception


class Leaving(msgspec.Struct, frozen=True):
    """The agent ends: it takes nothing more, and what it runs is about to stop."""


ToAgent: TypeAlias = Hello | Granted | Launch | Asked | Signaled | Watched
FromAgent: TypeAlias = Renew | Launched | Said | Ended | Leaving
