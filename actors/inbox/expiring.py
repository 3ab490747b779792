"""Wrappers of queued messages: a message with an expiry time, and a message whose waiting time is measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Generic, TypeVar, cast

M = TypeVar("M")


class ExpiringMessage(Generic[M]):
    """A queued message that is not delivered after `expires`, nanoseconds on the clock `time`, which shows seconds."""

    __slots__ = ("_time", "expires", "message")

    def __init__(self, message: M, expires: float, time: Callable[[], float]) -> None:
        self.message = message
        self.expires = expires
        self._time = time

    def __repr__(self) -> str:
        return f"<{self.message!r} until {self.expires / 1e9:.6f}>"

    def holding(self, message: M) -> ExpiringMessage[M]:
        """Another message with the same expiry time."""
        return ExpiringMessage(message, self.expires, self._time)

    @property
    def fresh(self) -> bool:
        """Whether the message may still be delivered."""
        return round(self._time() * 1e9) <= self.expires


class TimedMessage(ExpiringMessage[M]):
    """A queued message with the time at which it came: `since`, seconds on the clock `time`. An expiry time of `message` is kept."""

    __slots__ = ("since",)

    def __init__(self, message: M | ExpiringMessage[M], time: Callable[[], float]) -> None:
        if isinstance(message, ExpiringMessage):
            aged = cast("ExpiringMessage[M]", message)
            super().__init__(aged.message, aged.expires, time)
        else:
            super().__init__(message, math.inf, time)
        self.since = time()
