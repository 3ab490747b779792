"""Filters that put messages of several inputs together: of equal stamps, and of stamps within a slop, as rclpy's do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from itertools import product
from typing import TYPE_CHECKING, Any

from actors.message_filters.signal import Signal
from actors.message_filters.stamps import stamp_of_message

if TYPE_CHECKING:
    from actors.message_filters.simple_filter import SimpleFilter
    from actors.time.clock import Clock


class Synchronizer(Signal[tuple[Any, ...]], ABC):
    """Lets sets of messages through, one of each input, in the order of the inputs: ``callback(a, b)``, ``async for a, b in sync``.

    `queue_size` bounds how many messages of each input wait for their set.
    """

    def __init__(self, sources: Iterable[SimpleFilter[Any]], queue_size: int) -> None:
        super().__init__()
        self._queue_size = queue_size
        count = 0
        for index, source in enumerate(sources):
            source.register_callback(self.add, index)
            source.on_close(self.close)
            count += 1
        if count < 2 or queue_size < 1:
            raise ValueError(
                f"{type(self).__name__} of {count} inputs with queue_size={queue_size}: "
                "it takes a list of two inputs or more, and at least one message of each must be able to wait"
            )
        self.inputs = count
        """The number of inputs."""

    @abstractmethod
    def add(self, message: object, index: int) -> None:
        """Take in a message of the input of this number, from 0."""
        ...

    def signal_message(self, *messages: object) -> None:
        """Let a set through."""
        self._emit(messages, messages)


class _ByStamp(Synchronizer):
    """Keeps the messages of each input that wait for their set by their stamps, of which the earliest leave a full queue.

    Invariant: no queue is longer than `queue_size` when `_match` is called.
    """

    def __init__(
        self, sources: Iterable[SimpleFilter[Any]], queue_size: int, *, allow_headerless: Clock | None = None
    ) -> None:
        super().__init__(sources, queue_size)
        self._clock = allow_headerless
        self._queues: list[dict[int, object]] = [{} for _ in range(self.inputs)]
        self.dropped = 0
        """The number of messages that left a queue without a set: because it was full, or a newer set was let through."""

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__} of {self.inputs} inputs: {', '.join(str(len(one)) for one in self._queues)} wait>"
        )

    def add(self, message: object, index: int) -> None:
        """Take in a message of the input of this number, from 0; one of the same stamp is replaced."""
        instant = stamp_of_message(message, self._clock)
        queue = self._queues[index]
        queue[instant] = message
        while len(queue) > self._queue_size:
            del queue[min(queue)]
            self.dropped += 1
        self._match(instant, index)

    @abstractmethod
    def _match(self, instant: int, index: int) -> None:
        """Let sets through, after a message of this stamp has come from this input."""
        ...

    def _take(self, instants: Iterable[int]) -> None:
        """Let the set through that has these stamps."""
        self.signal_message(*[queue.pop(instant) for queue, instant in zip(self._queues, instants, strict=True)])


class TimeSynchronizer(_ByStamp):
    """Lets sets of messages of exactly equal stamps through.

    A set drops what is older and still waits, as in ROS 2: its set would come after a newer one.

    Messages without a header are refused with ``TypeError``, unless `allow_headerless` is a clock, such as ``self.clock``: then their time
    is that of their arrival.
    """

    def _match(self, instant: int, index: int) -> None:
        if all(instant in queue for queue in self._queues):  # a set can be completed by the new message only
            for queue in self._queues:
                for older in [each for each in queue if each < instant]:
                    del queue[older]
                    self.dropped += 1
            self._take([instant] * self.inputs)


class ApproximateTimeSynchronizer(_ByStamp):
    """Lets sets of messages through whose stamps lie within less than `slop` seconds: rclpy's algorithm.

    Each new message is put together at once with messages of the other inputs, each at most `slop` away: with the nearest ones, or else
    the next nearest. Nothing is known of messages to come, so a set may not be the best one; `ApproximateTime` waits for that.

    Messages without a header are refused with ``TypeError``, unless `allow_headerless` is a clock, such as ``self.clock``: then their time
    is that of their arrival.
    """

    def __init__(
        self,
        sources: Iterable[SimpleFilter[Any]],
        queue_size: int,
        slop: float,
        *,
        allow_headerless: Clock | None = None,
    ) -> None:
        super().__init__(sources, queue_size, allow_headerless=allow_headerless)
        if not slop > 0:
            raise ValueError(
                f"ApproximateTimeSynchronizer(slop={slop}): no set lies within less than that; give a time above 0, in seconds"
            )
        self._slop = round(slop * 1e9)

    def _match(self, instant: int, index: int) -> None:
        near: list[list[int]] = []
        for number, queue in enumerate(self._queues):
            if number == index:
                near.append([instant] if instant in queue else [])
            else:
                within = [each for each in queue if abs(each - instant) <= self._slop]
                near.append(sorted(within, key=lambda each: abs(each - instant)))
        for instants in product(*near):
            if max(instants) - min(instants) < self._slop:
                self._take(instants)
                return
