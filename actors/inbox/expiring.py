"""What a queue holds instead of a bare message: one that is worth something for a limited time, or whose wait is measured."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Generic, TypeVar, cast

__all__ = ["ExpiringMessage", "TimedMessage"]

M = TypeVar("M")


class ExpiringMessage(Generic[M]):
    """A waiting message that is not delivered any more after `expires`, nanoseconds on the loop's clock."""

    __slots__ = ("_time", "expires", "message")

    def __init__(self, message: M, expires: float, time: Callable[[], float]) -> None:
        self.message = message
        self.expires = expires
        self._time = time

    def __repr__(self) -> str:
        return f"<{self.message!r} until {self.expires / 1e9:.6f}>"

    def holding(self, message: M) -> ExpiringMessage[M]:
        """Another message with the same end."""
        return ExpiringMessage(message, self.expires, self._time)

    @property
    def fresh(self) -> bool:
        """Whether it may still be delivered."""
        return round(self._time() * 1e9) <= self.expires


class TimedMessage(ExpiringMessage[M]):
    """A waiting message with the loop time at which it came; it keeps the end it may have had."""

    __slots__ = ("since",)

    def __init__(self, message: M | ExpiringMessage[M], time: Callable[[], float]) -> None:
        if isinstance(message, ExpiringMessage):
            aged = cast("ExpiringMessage[M]", message)
            super().__init__(aged.message, aged.expires, time)
        else:
            super().__init__(message, math.inf, time)
        self.since = time()
