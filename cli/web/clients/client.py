"""One connection: its reader, its writer, and what it may cost."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Final, Protocol

from cli.web.clients.errors import BadRequest, Refused
from cli.web.clients.outbox import Frame, Outbox, OutboxFull, Packet, frames_of
from cli.web.clients.writing import written

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

    from actors.interfaces import CdrError
    from actors.logs import NodeLog

MOST_MISTAKES: Final = 100
"""Malformed frames after which a connection is closed."""
MOST_TASKS: Final = 256
"""Requests of one client that are worked on at the same time."""
FRAMES_A_SECOND: Final = 2000.0
BURST: Final = 2000
"""Frames that may come at once."""
MOST_NAMED: Final = 100
"""Topics of which the log tells that a client has lost messages."""
POLICY, OVERLOADED, INTERNAL = 1008, 1013, 1011


class Session(Protocol):
    """What one protocol makes of the frames of a client."""

    def opened(self) -> None:
        """Say hello."""
        ...

    async def received(self, frame: Frame) -> None:
        """Handle a frame. Raises `Refused` for what is to be told to the client, `BadRequest` if it does not speak the protocol."""
        ...

    def refuse(self, error: Refused) -> None:
        """Tell the client."""
        ...

    async def closed(self) -> None:
        """Give back all that this client holds."""
        ...


def farewell(why: str) -> str:
    """A reason as the frame that closes a connection can have it: at most 123 bytes of UTF-8."""
    return why.encode("utf-8", "replace")[:123].decode("utf-8", "ignore")


class Client:
    """One client. Its frames are handled in order, at most `FRAMES_A_SECOND` of them; a faster client is not read meanwhile.

    Invariant: a task that `spawn` has started ends no later than `run`.
    """

    def __init__(
        self, socket: ServerConnection, protocol: str, number: int, log: NodeLog, clients: Callable[[], int]
    ) -> None:
        """`clients` tells how many there are."""
        self._socket = socket
        self._log = log
        self._tasks: set[asyncio.Task[None]] = set()
        self._end: tuple[int, str] | None = None
        self._reader: asyncio.Task[None] | None = None
        self._mistakes = 0
        self._lost: set[str] = set()
        self._since = asyncio.get_running_loop().time()
        self.protocol = protocol
        self.number = number
        self.outbox = Outbox(clients)
        self.received = 0

    @property
    def address(self) -> str:
        """Where it connects from."""
        address: Any = self._socket.remote_address
        return f"{address[0]}:{address[1]}" if isinstance(address, tuple) and len(address) >= 2 else str(address)  # pyright: ignore[reportUnknownArgumentType]

    @property
    def connected_for(self) -> float:
        """Seconds since it came."""
        return asyncio.get_running_loop().time() - self._since

    @property
    def ending(self) -> bool:
        """Whether the server is disconnecting it."""
        return self._end is not None

    @property
    def subprotocol(self) -> str | None:
        """What the client has asked to speak; None for rosbridge."""
        return self._socket.subprotocol

    def answer(self, packet: Packet) -> None:
        """Send what must not be lost. A client that does not read its answers is disconnected."""
        try:
            self.outbox.answer(packet)
        except OutboxFull as error:
            self.end(OVERLOADED, str(error))

    def lose(self, topic: str, error: CdrError) -> None:
        """Count a message that cannot be read or encoded as dropped, and log the first one of a topic."""
        self.outbox.dropped += 1
        if topic not in self._lost and len(self._lost) < MOST_NAMED:
            self._lost.add(topic)
            self._log.warning(
                "a message cannot be passed on to a web client", topic=topic, client=self.address, because=str(error),
                next="further ones are counted only",
            )  # fmt: skip

    def spawn(self, work: Coroutine[Any, Any, None], session: Session) -> None:
        """Work on a request beside the next frames. What it raises is sent to the client."""
        if len(self._tasks) >= MOST_TASKS:
            work.close()
            raise Refused(f"{MOST_TASKS} requests of this client are being worked on: wait for some of the answers")
        task = asyncio.ensure_future(self._guarded(work, session))
        self._tasks.add(task)
        task.add_done_callback(self._worked)
        task.add_done_callback(lambda _: work.close())  # in case it was canceled before its first step

    def _worked(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            self._note(task.exception())

    def end(self, code: int, why: str) -> None:
        """Close the connection. The first reason counts."""
        if self._end is None:
            self._end = (code, why)
            if self._reader is not None:
                self._reader.cancel()

    async def run(self, session: Session) -> None:
        """Serve the client until it leaves, or has to."""
        writer = asyncio.ensure_future(self._write())
        self._reader = asyncio.ensure_future(self._read(session))
        try:
            session.opened()
            await asyncio.wait([self._reader, writer], return_when=asyncio.FIRST_COMPLETED)
        finally:
            tasks = [self._reader, writer, *self._tasks]
            for task in tasks:
                task.cancel()
            for outcome in await asyncio.gather(*tasks, return_exceptions=True):
                self._note(outcome)
            await session.closed()
            self.outbox.clear()
        if self._end is not None:
            code, why = self._end
            self._log.warning("web client disconnected", client=self.address, protocol=self.protocol, because=why)
            # its frames are read to the end, or the farewell of the client would never be seen behind them
            rest = asyncio.ensure_future(self._discard())
            await self._socket.close(code, farewell(why))
            await asyncio.gather(rest, return_exceptions=True)

    def _note(self, outcome: BaseException | None) -> None:
        from websockets.exceptions import ConnectionClosed

        if isinstance(outcome, Exception) and not isinstance(outcome, ConnectionClosed):
            self.end(INTERNAL, "the server failed")
            self._log.error("web client failed", client=self.address, protocol=self.protocol, error=repr(outcome))

    async def _write(self) -> None:
        """Until the connection is closed. What has gathered is one write, and while the client reads more slowly, it waits in the outbox."""
        from websockets.protocol import State

        while True:
            packets = await self.outbox.batch()
            if self._socket.state is not State.OPEN:
                await self._socket.wait_closed()
                return
            self._socket.transport.write(written(frame for packet in packets for frame in frames_of(packet)))
            try:
                await self._socket.drain()
            except OSError:  # it was lost meanwhile
                return
            if self.outbox.waiting:
                await asyncio.sleep(0)  # what others wait for comes before a long backlog

    async def _read(self, session: Session) -> None:
        loop = asyncio.get_running_loop()
        free_at = loop.time() - BURST / FRAMES_A_SECOND
        async for frame in self._socket:
            self.received += 1
            try:
                await session.received(frame)
            except Refused as error:
                self._refuse(error, session)
            free_at = max(free_at, loop.time() - BURST / FRAMES_A_SECOND) + 1 / FRAMES_A_SECOND
            await asyncio.sleep(max(0.0, free_at - loop.time()))

    async def _discard(self) -> None:
        async for _ in self._socket:
            pass

    async def _guarded(self, work: Coroutine[Any, Any, None], session: Session) -> None:
        try:
            await work
        except Refused as error:
            self._refuse(error, session)

    def _refuse(self, error: Refused, session: Session) -> None:
        session.refuse(error)
        if isinstance(error, BadRequest):
            self._mistakes += 1
            if self._mistakes >= MOST_MISTAKES:
                self.end(POLICY, f"{self._mistakes} frames were none of the protocol, the last one: {error}")
