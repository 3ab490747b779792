"""`Cache`: the last messages of a filter, found by their time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from typing import TypeVar

from actors.message_filters.simple_filter import PassThrough, SimpleFilter
from actors.message_filters.stamps import Stamp, instant_of, stamp_of_message
from actors.time.clock import Clock
from actors.time.values import ClockType, Time

M = TypeVar("M")


class Cache(PassThrough[M]):
    """Keeps the last `cache_size` messages by their stamps, and lets every message through.

    Invariant: the messages are in the order of their stamps; of equal stamps, in the order in which they came.

    Messages without a header are refused with ``TypeError``, unless `allow_headerless` is a clock, such as ``self.clock``: then their time
    is that of their arrival.
    """

    def __init__(
        self, source: SimpleFilter[M] | None = None, cache_size: int = 1, *, allow_headerless: Clock | None = None
    ) -> None:
        if cache_size < 1:
            raise ValueError(f"Cache(cache_size={cache_size}): a cache keeps at least one message")
        super().__init__(source)
        self._size = cache_size
        self._clock = allow_headerless
        self._instants: list[int] = []
        self._messages: list[M] = []

    def __repr__(self) -> str:
        return f"<Cache of {len(self._messages)} of {self._size} messages>"

    def __len__(self) -> int:
        return len(self._messages)

    def add(self, message: M) -> None:
        """Take in a message; when the cache is full, the one of the earliest stamp leaves first."""
        instant = stamp_of_message(message, self._clock)
        if len(self._messages) >= self._size:
            del self._messages[0], self._instants[0]
        place = bisect_right(self._instants, instant)
        self._instants.insert(place, instant)
        self._messages.insert(place, message)
        self.signal_message(message)

    def get_interval(self, from_stamp: Stamp, to_stamp: Stamp) -> list[M]:
        """The messages from one time to another, both included."""
        first = bisect_left(self._instants, instant_of(from_stamp))
        return self._messages[first : bisect_right(self._instants, instant_of(to_stamp))]

    getInterval = get_interval
    """The name that rclpy's has."""

    def get_surrounding_interval(self, from_stamp: Stamp, to_stamp: Stamp) -> list[M]:
        """The messages of the interval, with the last one before and the first one after it where none is just on its border."""
        first = bisect_right(self._instants, instant_of(from_stamp)) - 1
        return self._messages[max(first, 0) : bisect_left(self._instants, instant_of(to_stamp)) + 1]

    def get_elem_after_time(self, stamp: Stamp) -> M | None:
        """The first message of this time or later; None without one."""
        place = bisect_left(self._instants, instant_of(stamp))
        return self._messages[place] if place < len(self._messages) else None

    getElemAfterTime = get_elem_after_time
    """The name that rclpy's has."""

    def get_elem_before_time(self, stamp: Stamp) -> M | None:
        """The last message of this time or earlier; None without one."""
        place = bisect_right(self._instants, instant_of(stamp))
        return self._messages[place - 1] if place else None

    getElemBeforeTime = get_elem_before_time
    """The name that rclpy's has."""

    def get_latest_time(self) -> Time | None:
        """The latest stamp; None without messages."""
        return _time(self._instants[-1]) if self._instants else None

    getLatestTime = get_latest_time
    """The name that rclpy's has."""

    def get_oldest_time(self) -> Time | None:
        """The earliest stamp; None without messages."""
        return _time(self._instants[0]) if self._instants else None

    getOldestTime = get_oldest_time
    """The name that rclpy's has."""

    def get_last(self) -> M | None:
        """The message of the latest stamp; None without messages."""
        return self._messages[-1] if self._messages else None

    getLast = get_last
    """The name that rclpy's has."""


def _time(instant: int) -> Time:
    return Time(nanoseconds=instant, clock_type=ClockType.ROS_TIME)
