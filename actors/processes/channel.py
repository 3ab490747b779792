"""`Channel`: values between a process and its parent, over a socket pair, in both directions."""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

from msgspec import MsgspecError

from actors.processes.messages import Opaque
from actors.processes.pickling import pack, unpack

T = TypeVar("T")

HEAD: Final = struct.Struct("!I")
"""The length of a frame stands before it."""
MOST_BYTES: Final = (1 << 32) - 1


def framed(value: T, write: Callable[[T], bytes] = pack) -> bytes:
    """The value as a frame. Raises what `write` raises."""
    data = value.data if isinstance(value, Opaque) else write(value)
    return HEAD.pack(len(data)) + data


def read_frame(channel: socket.socket) -> Any:
    """The next value of the channel. Raises EOFError if the parent is gone."""
    return unpack(read_exactly(channel, HEAD.unpack(read_exactly(channel, HEAD.size))[0]))


def read_exactly(channel: socket.socket, size: int) -> bytes:
    """The next bytes of the channel. Raises EOFError if the parent is gone."""
    data = bytearray()
    while len(data) < size:
        if not (more := channel.recv(min(size - len(data), 1 << 20))):
            raise EOFError("the parent is gone")
        data += more
    return bytes(data)


class Channel(asyncio.Protocol):
    """One end of the connection. `take` is called with each value that arrives, in order, as `read` makes it from its bytes, and `lost` once,
    when nothing more will arrive. `made` is called before with the connection, and says whether the other end is to be heard: if not, nothing that
    it sends is read, also if it is there already. What `read` refuses as no value (`msgspec.MsgspecError`), and a frame of more than `most` bytes,
    ends the connection.

    Invariant: `_waiting` holds less than one frame between two calls of `data_received`.
    """

    def __init__(
        self,
        take: Callable[[Any], None],
        lost: Callable[[], None],
        read: Callable[[bytes], object] = unpack,
        made: Callable[[asyncio.Transport], bool] = lambda transport: True,
        write: Callable[[Any], bytes] = pack,
        most: int = MOST_BYTES,
    ) -> None:
        self._take = take
        self._lost = lost
        self._read = read
        self._made = made
        self._write = write
        self._most = most
        self._refused = False
        self._waiting = bytearray()
        self._transport: asyncio.Transport | None = None

    @property
    def unsent(self) -> int:
        """How many bytes wait because the other end does not read them."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def send(self, value: object) -> None:
        """Send a value; it is lost if the other end has gone. Raises what `write` raises."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(framed(value, self._write))

    def close(self) -> None:
        """Close this end once everything has been sent."""
        if self._transport is not None:
            self._transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        if not self._made(self._transport):
            self._refuse()

    def data_received(self, data: bytes) -> None:
        if self._refused:
            return
        waiting = self._waiting
        waiting += data
        while len(waiting) >= HEAD.size:
            end = HEAD.size + (size := HEAD.unpack_from(waiting)[0])
            if size > self._most:
                return self._refuse()
            if len(waiting) < end:
                return
            try:
                value = self._read(bytes(waiting[HEAD.size : end]))
            except (MsgspecError, UnicodeDecodeError, RecursionError):
                return self._refuse()
            del waiting[:end]
            self._take(value)

    def _refuse(self) -> None:
        self._refused = True
        self._waiting.clear()
        if self._transport is not None:
            self._transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._lost()
