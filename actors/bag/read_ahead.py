"""The messages of a bag in order, read some at a time and before they are needed."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Collection, Generator, Iterator
from itertools import islice
from typing import TYPE_CHECKING

from actors.bag.contents import BagError, BagMessage

if TYPE_CHECKING:
    from actors.bag.reader import BagReader


class ReadAhead:
    """A position in a bag.

    `offload(function)` runs the reading, in a thread.

    Invariants: `_ready` holds the messages that come next, and `_coming` reads those after them, or is None. Both belong to the pass
    `_messages`; what an earlier pass still reads is discarded. Where the bag is damaged its error comes in place of a message, so that what is
    before it is not lost.
    """

    def __init__(
        self,
        bag: BagReader,
        topics: Collection[str],
        count: int,
        offload: Callable[[Callable[[], list[BagMessage | BagError]]], Awaitable[list[BagMessage | BagError]]],
    ) -> None:
        self._bag = bag
        self._topics = frozenset(topics)
        self._count = count
        self._offload = offload
        self._ready: deque[BagMessage | BagError] = deque()
        self._messages = _with_error(iter(()))
        self._coming: asyncio.Future[list[BagMessage | BagError]] | None = None
        self._lock = asyncio.Lock()

    def limit(self, topics: Collection[str]) -> None:
        """Read only these topics, from the next `rewind` on."""
        self._topics = frozenset(topics)

    def rewind(self, start_ns: int) -> None:
        """Go on with the messages received from `start_ns` on."""
        self._ready.clear()
        self._messages = _with_error(self._bag.messages(self._topics, start_ns=start_ns))
        self._coming = None

    async def peek(self) -> BagMessage | None:
        """The next message, which stays the next one; None at the end. Raises `BagError` where the bag is damaged."""
        while not self._ready:
            if self._coming is None:
                self._coming = asyncio.ensure_future(self._read(self._messages))
            coming = self._coming
            read = await asyncio.shield(coming)
            if coming is not self._coming:
                continue  # it was rewound meanwhile, or another task has taken what came
            if not read:
                return None
            self._ready.extend(read)
            self._coming = asyncio.ensure_future(self._read(self._messages))
        first = self._ready[0]
        if isinstance(first, BagError):
            raise first
        return first

    def advance(self) -> BagMessage:
        """Take the next message. To be called after `peek`, without waiting in between."""
        message = self._ready.popleft()
        assert not isinstance(message, BagError)
        return message

    async def close(self) -> None:
        """Wait until nothing is read any more, and close the file."""
        coming, self._coming = self._coming, None
        if coming is not None:
            await asyncio.gather(coming, return_exceptions=True)
        self._messages.close()

    async def _read(self, messages: Iterator[BagMessage | BagError]) -> list[BagMessage | BagError]:
        async with self._lock:  # a pass that was given up may still be read
            read: list[BagMessage | BagError] = await self._offload(lambda: list(islice(messages, self._count)))
            return read


def _with_error(messages: Iterator[BagMessage]) -> Generator[BagMessage | BagError]:
    try:
        yield from messages
    except BagError as error:
        yield error
