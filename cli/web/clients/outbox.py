"""What waits to be sent to one client: answers, which are never dropped, and messages of topics, of which the oldest are dropped."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Hashable
from typing import Final, TypeAlias

from actors.transport.protocol import next_look
from actors.waiting import wake

Frame: TypeAlias = "str | bytes"


class Spliced:
    """A binary frame in two pieces, of which the second is shared with the frames of other clients, as long as it waits."""

    __slots__ = ("head", "payload")

    def __init__(self, head: bytes, payload: bytes) -> None:
        self.head = head
        self.payload = payload

    def __len__(self) -> int:
        return len(self.head) + len(self.payload)


Packet: TypeAlias = "Frame | Spliced | tuple[Frame, ...]"
"""One message: a frame, or several that belong together, of which all are sent or none."""

MOST_ANSWERS: Final = 4096
MOST_ANSWER_BYTES: Final = 32 * 1024 * 1024
MOST_BYTES: Final = 16 * 1024 * 1024
MOST_ALTOGETHER: Final = 64 * 1024 * 1024
"""Bytes that wait for all clients, of which each has its share: many that do not read must not take the memory of a robot."""
LEAST: Final = 512 * 1024
"""Bytes that may wait for a client, however many there are."""
DEPTH: Final = 256
BATCH: Final = 64 * 1024
"""Bytes after which no further message is taken out at once: the loop has its turn between."""
BEHIND: Final = 0.002
"""Messages wait for others, to be sent together, until so many seconds after the next time at which messages of other processes are looked at.
Answers do not wait."""


class OutboxFull(Exception):
    """A client asks for more answers than it reads; it must be disconnected."""


def frames_of(packet: Packet) -> tuple[Frame | Spliced, ...]:
    """The frames of a message, in order."""
    return packet if isinstance(packet, tuple) else (packet,)


def size_of(packet: Packet) -> int:
    """The size of a message: bytes, or characters of a text."""
    return sum(len(frame) for frame in packet) if isinstance(packet, tuple) else len(packet)


class _Lane:
    """The messages of one subscription that wait, oldest first, each with its size."""

    __slots__ = ("bytes", "depth", "packets")

    def __init__(self, depth: int) -> None:
        self.packets: deque[tuple[int, Packet]] = deque()
        self.bytes = 0
        self.depth = depth

    def drop(self) -> int:
        """Drop the oldest message; returns its size."""
        size, _ = self.packets.popleft()
        self.bytes -= size
        return size


class Outbox:
    """The queue of one client. Nothing that is put here waits for the client.

    Invariants:

    * Answers leave in the order in which they came, before any message; messages of one subscription leave in their order, and the
      subscriptions take turns, so that a large topic does not hold up a small one.
    * A subscription keeps at most the newest `depth` messages, all of them together at most `MOST_BYTES` and one message, and less where there
      are many clients. What is dropped for that is counted in `dropped`, but for what `replace` replaces.
    * While a task waits in `batch` and there are messages but no answers, `_timer` is going to wake it.
    """

    def __init__(self, clients: Callable[[], int] = lambda: 1) -> None:
        """`clients` tells how many there are."""
        self._clients = clients
        self._answers: deque[tuple[int, Packet]] = deque()
        self._answer_bytes = 0
        self._lanes: dict[Hashable, _Lane] = {}
        """Each subscription with messages that wait, that whose turn it is first."""
        self._bytes = 0
        self._reader: asyncio.Future[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self.dropped = 0
        self.sent = 0
        self.sent_bytes = 0

    @property
    def waiting(self) -> int:
        """The number of messages that wait."""
        return len(self._answers) + sum(len(lane.packets) for lane in self._lanes.values())

    @property
    def waiting_bytes(self) -> int:
        """Their size in bytes; that of texts in characters."""
        return self._answer_bytes + self._bytes

    def answer(self, packet: Packet) -> None:
        """Send what must not be lost. Raises `OutboxFull` if too many of them wait."""
        size = size_of(packet)
        if len(self._answers) >= MOST_ANSWERS or self._answer_bytes + size > MOST_ANSWER_BYTES:
            raise OutboxFull(f"{len(self._answers)} answers wait to be read")
        self._answers.append((size, packet))
        self._answer_bytes += size
        self._wake()

    def offer(self, lane: Hashable, packet: Packet, depth: int = DEPTH) -> None:
        """Send a message of the subscription `lane`, of which at most `depth` messages wait."""
        size = size_of(packet)
        queue = self._lanes.get(lane)
        if queue is None:
            queue = self._lanes[lane] = _Lane(depth)
        while len(queue.packets) >= depth:
            self._bytes -= queue.drop()
            self.dropped += 1
        queue.packets.append((size, packet))
        queue.bytes += size
        self._bytes += size
        self._keep_in_bounds()
        if self._reader is not None and self._timer is None:
            loop = asyncio.get_running_loop()
            self._timer = loop.call_at(next_look(loop.time() - BEHIND) + BEHIND, self._wake)

    def replace(self, lane: Hashable, packet: Packet) -> None:
        """Send the newest message of the subscription `lane`, for a client that wants no other: what still waits there is not sent."""
        queue = self._lanes.get(lane)
        if queue is None or len(queue.packets) != 1:
            self.forget(lane)
            self.offer(lane, packet, 1)
            return
        size = size_of(packet)
        self._bytes += size - queue.bytes
        queue.packets[0], queue.bytes = (size, packet), size
        self._keep_in_bounds()

    def forget(self, lane: Hashable) -> None:
        """Drop what waits for a subscription that has ended."""
        queue = self._lanes.pop(lane, None)
        if queue is not None:
            self._bytes -= queue.bytes

    def clear(self) -> None:
        """Drop all that waits: the client has gone."""
        self._answers.clear()
        self._lanes.clear()
        self._answer_bytes = self._bytes = 0

    async def batch(self, most: int = BATCH) -> list[Packet]:
        """Take the next messages out, until they have `most` bytes, waiting until there is one. One task may wait."""
        while not self._answers and not self._lanes:
            self._reader = asyncio.get_running_loop().create_future()
            try:
                await self._reader
            finally:
                self._reader = None
                if self._timer is not None:
                    self._timer.cancel()
                    self._timer = None
        taken: list[Packet] = []
        size = 0
        while size < most and (self._answers or self._lanes):
            more, packet = self._take()
            taken.append(packet)
            size += more
        self.sent += len(taken)
        self.sent_bytes += size
        return taken

    def _take(self) -> tuple[int, Packet]:
        if self._answers:
            size, packet = self._answers.popleft()
            self._answer_bytes -= size
            return size, packet
        lane = next(iter(self._lanes))
        queue = self._lanes.pop(lane)
        size, packet = queue.packets.popleft()
        queue.bytes -= size
        self._bytes -= size
        if queue.packets:
            self._lanes[lane] = queue  # behind the others
        return size, packet

    def _keep_in_bounds(self) -> None:
        if self._bytes > LEAST:
            most = max(LEAST, min(MOST_BYTES, MOST_ALTOGETHER // max(1, self._clients())))
            while self._bytes > most and self.waiting > 1:
                self._drop_from_largest()

    def _drop_from_largest(self) -> None:
        lane, queue = max(self._lanes.items(), key=lambda item: item[1].bytes)
        self._bytes -= queue.drop()
        self.dropped += 1
        if not queue.packets:
            del self._lanes[lane]

    def _wake(self) -> None:
        if self._reader is not None:
            wake(self._reader, None)
