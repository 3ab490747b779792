"""`InputAligner`: messages of several inputs, each passed on by itself, in the order of the stamps of all of them."""

from __future__ import annotations

from bisect import insort
from collections.abc import Iterable, Mapping
from itertools import count
from math import inf
from typing import Any, NamedTuple

from actors.message_filters.simple_filter import SimpleFilter
from actors.message_filters.stamps import stamp_of_message
from actors.runtime.node import Node


class QueueStatus(NamedTuple):
    """The state of one input."""

    active: bool
    """Whether it is waited for."""
    queue_size: int
    """Messages that wait."""
    msgs_processed: int
    msgs_dropped: int
    """Messages that came too late."""


class _Queue:
    """The messages of one input that wait, and the time from which its next one may be.

    Invariant: the messages are in the order of their stamps; of equal stamps, in the order in which they came.
    """

    __slots__ = ("active", "dropped", "expected", "period", "processed", "waiting")

    def __init__(self, period: int) -> None:
        self.waiting: list[tuple[int, int, object]] = []
        self.period = period
        self.expected: float = inf
        self.active = False
        self.processed = self.dropped = 0

    def first(self) -> float:
        """The stamp of the first message; without one, the earliest of the next one; infinite if none is waited for."""
        if self.waiting:
            self.expected = self.waiting[0][0] + self.period
            self.active = True
            return self.waiting[0][0]
        return self.expected if self.active else inf


class InputAligner:
    """Passes on the messages of several inputs, each to the output of the same number, in the order of the stamps of all of them.

    A message waits until none of an earlier stamp can come. An input has none to come before its last stamp plus its period, seconds, which
    `periods` gives by the numbers of inputs, and is best chosen a little short. An input that is `timeout` seconds behind the newest stamp of
    all is not waited for until it has a message again. A message older than one that was passed on is dropped.

    `dispatch_messages` does it; with a `node`, that happens every `update_rate` seconds.
    """

    def __init__(
        self,
        sources: Iterable[SimpleFilter[Any]],
        timeout: float,
        *,
        periods: Mapping[int, float] | None = None,
        node: Node | None = None,
        update_rate: float = 0.01,
    ) -> None:
        if not (timeout >= 0 and update_rate > 0):
            raise ValueError(
                f"InputAligner(timeout={timeout}, update_rate={update_rate}): the timeout is not negative, the rate a time above 0, in seconds"
            )
        given = periods or {}
        self.outputs: list[SimpleFilter[Any]] = []
        """A filter for each input: ``aligner.outputs[0].register_callback(...)``."""
        self._queues: list[_Queue] = []
        for index, source in enumerate(sources):
            output = SimpleFilter[Any]()
            self.outputs.append(output)
            self._queues.append(_Queue(round(given.get(index, 0.0) * 1e9)))
            source.register_callback(self.add, index)
            source.on_close(output.close)
        self._timeout = round(timeout * 1e9)
        self._arrivals = count()
        self._newest = 0
        self._last_out = 0
        if node is not None:
            node.create_task(self._watch(node, update_rate), name="input aligner")

    def __repr__(self) -> str:
        return f"<InputAligner of {len(self._queues)} inputs: {', '.join(str(len(one.waiting)) for one in self._queues)} wait>"

    def add(self, message: object, index: int) -> None:
        """Take in a message of the input of this number, from 0; it must have a header."""
        stamp = stamp_of_message(message)
        queue = self._queues[index]
        if stamp < self._last_out:
            queue.dropped += 1
            return
        self._newest = max(self._newest, stamp)
        insort(queue.waiting, (stamp, next(self._arrivals), message))

    def get_queue_status(self, index: int) -> QueueStatus:
        """The state of the input of this number, from 0."""
        queue = self._queues[index]
        return QueueStatus(queue.active, len(queue.waiting), queue.processed, queue.dropped)

    def dispatch_messages(self) -> None:
        """Pass on all messages whose turn it is."""
        if any(queue.waiting for queue in self._queues):
            while self._dispatch_first():
                pass

    def _dispatch_first(self) -> bool:
        """Pass on the first message of all, or wait no longer for an input that is late; False if there is nothing to do."""
        firsts = [queue.first() for queue in self._queues]
        index = firsts.index(min(firsts))
        queue = self._queues[index]
        if queue.waiting:
            self._last_out, _, message = queue.waiting.pop(0)
            queue.processed += 1
            self.outputs[index].signal_message(message)
            return True
        if self._newest - firsts[index] >= self._timeout:
            queue.active = False
            return True
        return False

    async def _watch(self, node: Node, update_rate: float) -> None:
        while True:
            await node.clock.sleep(update_rate)
            self.dispatch_messages()
