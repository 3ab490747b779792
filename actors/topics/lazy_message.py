"""Messages as they reach those that may pass them on without reading them."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from actors.interfaces.cdr import decode, encode
from actors.interfaces.message import Message


class LazyMessage:
    """A message, as an object or in CDR: whichever there was first. The other is made when it is asked for, once for all who ask.

    `LazyMessage(message)` is a message of this process, `LazyMessage.received` one of another process.
    """

    __slots__ = ("_cdr", "_kind", "_message", "sent_ns", "since")

    def __init__(self, message: Message) -> None:
        self._message: Any = message
        self._kind: type[Message] = type(message)
        self._cdr: bytes | None = None
        self.sent_ns: int | None = None
        """When another process sent it, in nanoseconds since 1970 on its clock; None for a message of this process."""
        self.since: float | None = None
        """When it arrived, in seconds on the loop's clock, if it has waited since then for a patient subscription; None: now."""

    @classmethod
    def received(cls, cdr: bytes, kind: type[Message], sent_ns: int, since: float | None = None) -> LazyMessage:
        """A message of another process, which may hold anything: it is not decoded yet."""
        arrival = cls.__new__(cls)
        arrival._message, arrival._kind, arrival._cdr, arrival.sent_ns, arrival.since = None, kind, cdr, sent_ns, since
        return arrival

    def decoded_as(self, message: Message) -> None:
        """Take note of the object that somebody has made of it."""
        self._message = message

    @property
    def message(self) -> Any:
        """The message as an object, always the same one. Raises `CdrError` if what was received is none."""
        if self._message is None:
            assert self._cdr is not None
            self._message = decode(self._kind, self._cdr)
        return self._message

    @property
    def cdr(self) -> bytes:
        """The message in CDR, as it was received. Raises `CdrError` for one of this process that cannot be encoded."""
        if self._cdr is None:
            self._cdr = encode(self._message)
        return self._cdr

    @property
    def size(self) -> int | None:
        """The size of `cdr` in bytes, if that is there; None if it has not been made."""
        return None if self._cdr is None else len(self._cdr)


@runtime_checkable
class UndecodedTarget(Protocol):
    """A target that does without the object: a publisher of another process calls `undecoded` in place of the target itself.

    What stands between the two, such as a journal or a simulated fault, calls the target with the object as it calls any other.
    """

    def __call__(self, message: object, /) -> None: ...

    def undecoded(self, arrival: LazyMessage, /) -> None:
        """Receive a message. It never blocks and never raises."""
        ...
