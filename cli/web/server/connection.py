"""A connection whose bytes are parsed piece by piece: a client that floods it holds up nobody else.

`websockets` parses all that a read of the operating system gives at once, up to 256 KiB, which may be 40,000 frames, and counts messages only
when they are whole.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from websockets.asyncio.server import ServerConnection
from websockets.frames import CTRL_OPCODES, CloseCode, Opcode

if TYPE_CHECKING:
    from websockets.frames import Frame
    from websockets.http11 import Request

PIECE: Final = 4096
"""Bytes that are parsed in one turn of the event loop: at most some 700 frames."""
CONTROLS_A_SECOND: Final = 100.0
CONTROLS: Final = 200.0
"""Pings, pongs and other control frames that may come at once."""
FRAGMENTS: Final = 1024
"""The most frames of one message."""


class Connection(ServerConnection):
    """Takes no more bytes from the network than it parses, and parses no more than its reader takes.

    Invariants: while bytes wait in `_unparsed`, or the queue of frames is full, nothing is read from the network. While bytes wait and the queue
    is not full, `_turn` is going to parse a piece.
    """

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._unparsed = bytearray()
        self._full = False
        self._turn: asyncio.Handle | None = None
        self._fragments = 0
        self._controls = CONTROLS
        self._counted_at = self.loop.time()
        self.recv_messages.pause, self.recv_messages.resume = self._queue_full, self._queue_free

    def data_received(self, data: bytes) -> None:
        self._unparsed += data
        if self._turn is None and not self._full:
            self._parse()
        self._flow()

    def eof_received(self) -> None:
        self._drop()
        super().eof_received()

    def connection_lost(self, exc: Exception | None) -> None:
        self._drop()
        super().connection_lost(exc)

    def process_event(self, event: Frame | Request) -> None:  # type: ignore[override]
        opcode = getattr(event, "opcode", None)
        if opcode is Opcode.CONT:
            self._fragments += 1
            if self._fragments >= FRAGMENTS:
                self._fail(CloseCode.MESSAGE_TOO_BIG, f"a message in more than {FRAGMENTS} frames")
                return
        elif opcode in CTRL_OPCODES:
            self._count_control()
        else:
            self._fragments = 0
        super().process_event(event)  # pyright: ignore[reportArgumentType]

    def _count_control(self) -> None:
        now = self.loop.time()
        self._controls = min(CONTROLS, self._controls + (now - self._counted_at) * CONTROLS_A_SECOND) - 1.0
        self._counted_at = now
        if self._controls < 0.0:
            self._fail(CloseCode.POLICY_VIOLATION, f"more than {CONTROLS_A_SECOND:g} pings and pongs a second")

    def _fail(self, code: CloseCode, why: str) -> None:
        self._drop()
        self.protocol.fail(code, why)
        self.send_data()

    def _parse(self) -> None:
        """Parse a piece; the next one comes in the next turn of the loop, after those of others."""
        self._turn = None
        piece = bytes(self._unparsed[:PIECE])
        del self._unparsed[:PIECE]
        super().data_received(piece)
        if self._unparsed and not self._full:
            self._turn = self.loop.call_soon(self._again)

    def _again(self) -> None:
        self._parse()
        self._flow()

    def _queue_full(self) -> None:
        self._full = True
        self._flow()

    def _queue_free(self) -> None:
        self._full = False
        if self._unparsed and self._turn is None:
            self._turn = self.loop.call_soon(self._again)
        self._flow()

    def _flow(self) -> None:
        if self._unparsed or self._full:
            self.transport.pause_reading()
        else:
            self.transport.resume_reading()

    def _drop(self) -> None:
        self._unparsed.clear()
        if self._turn is not None:
            self._turn.cancel()
            self._turn = None
