"""`Channel`: values between a process and its parent, over a socket pair, in both directions."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from typing import Any, Final, cast

from actors.processes.messages import Opaque
from actors.processes.pickling import pack, unpack

__all__ = ["HEAD", "Channel", "framed"]

HEAD: Final = struct.Struct("!I")
"""The length of a frame stands before it."""


def framed(value: object) -> bytes:
    """The value as a frame. Raises what `pack` raises."""
    data = value.data if isinstance(value, Opaque) else pack(value)
    return HEAD.pack(len(data)) + data


class Channel(asyncio.Protocol):
    """One end of the connection. `take` is called with each value that arrives, in order, as `read` makes it from its bytes, and `lost` once,
    when nothing more will arrive. `made` is called before with the connection.

    Invariant: `_waiting` holds less than one frame between two calls of `data_received`.
    """

    def __init__(
        self,
        take: Callable[[Any], None],
        lost: Callable[[], None],
        read: Callable[[bytes], Any] = unpack,
        made: Callable[[asyncio.Transport], None] = lambda transport: None,
    ) -> None:
        self._take = take
        self._lost = lost
        self._read = read
        self._made = made
        self._waiting = bytearray()
        self._transport: asyncio.Transport | None = None

    @property
    def unsent(self) -> int:
        """How many bytes wait because the other end does not read them."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def send(self, value: object) -> None:
        """Send a value; it is lost if the other end has gone. Raises what `pack` raises."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(framed(value))

    def close(self) -> None:
        """Close this end once everything has been sent."""
        if self._transport is not None:
            self._transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._made(self._transport)

    def data_received(self, data: bytes) -> None:
        waiting = self._waiting
        waiting += data
        while len(waiting) >= HEAD.size:
            end = HEAD.size + HEAD.unpack_from(waiting)[0]
            if len(waiting) < end:
                return
            value = self._read(bytes(waiting[HEAD.size : end]))
            del waiting[:end]
            self._take(value)

    def connection_lost(self, exc: Exception | None) -> None:
        self._lost()
