"""`TimeSequencer`: messages in the order of their stamps, a fixed delay later."""

from __future__ import annotations

from bisect import insort
from itertools import count
from typing import TypeAlias, TypeVar

from actors.message_filters.simple_filter import PassThrough, SimpleFilter
from actors.message_filters.stamps import stamp_of_message
from actors.runtime.node import Node

M = TypeVar("M")
Entry: TypeAlias = tuple[int, int, M]
"""A stamp, the number of the arrival, and the message."""


class TimeSequencer(PassThrough[M]):
    """Lets messages through in the order of their stamps, when their stamps are `delay` seconds ago by the node's clock.

    It looks every `update_rate` seconds. A message older than one that was let through is dropped, and so is the oldest of more than
    `queue_size` (0: no bound).

    Invariant: the messages that wait are in the order of their stamps, and none is older than the last one that was let through.
    """

    def __init__(
        self,
        node: Node,
        source: SimpleFilter[M] | None = None,
        *,
        delay: float,
        update_rate: float = 0.01,
        queue_size: int = 10,
    ) -> None:
        if not (delay >= 0 and update_rate > 0 and queue_size >= 0):
            raise ValueError(
                f"TimeSequencer(delay={delay}, update_rate={update_rate}, queue_size={queue_size}): update_rate is a time above 0, "
                "in seconds, and the others are not negative"
            )
        super().__init__(source)
        self._node = node
        self._delay = round(delay * 1e9)
        self._update_rate = update_rate
        self._queue_size = queue_size
        self._waiting: list[Entry[M]] = []
        self._arrivals = count()
        self._last = 0
        self.dropped = 0
        """The number of messages that came too late, or left the full queue."""
        node.create_task(self._watch(), name="time sequencer")

    def __repr__(self) -> str:
        return f"<TimeSequencer of {self._node.fqn}: {len(self._waiting)} wait>"

    def add(self, message: M) -> None:
        """Take in a message, which must have a header."""
        stamp = stamp_of_message(message)
        if stamp < self._last:
            self.dropped += 1
            return
        insort(self._waiting, (stamp, next(self._arrivals), message))
        if self._queue_size and len(self._waiting) > self._queue_size:
            del self._waiting[0]
            self.dropped += 1

    async def _watch(self) -> None:
        try:
            while True:
                await self._node.clock.sleep(self._update_rate)
                self._dispatch(self._node.clock.wall_ns() - self._delay)
        finally:
            self.close()

    def _dispatch(self, until: int) -> None:
        while self._waiting and self._waiting[0][0] <= until:
            self._last, _, message = self._waiting.pop(0)
            self.signal_message(message)
