"""How busy a node is: how long its handlers take, and how long what comes waits for its turn.

Measured by samples, so that it costs next to nothing: a handler's time for one item of up to 64, all of the first few; the wait in the
inbox for one item at a time, at most every half second, whenever something has to wait. All in seconds on the system's clock.
"""

from __future__ import annotations

import msgspec

__all__ = ["HandlerLoad", "Load", "Meter"]


class HandlerLoad(msgspec.Struct, frozen=True):
    """The measured cost of one handler: number of samples, their mean and the longest one, in seconds from its call to its end."""

    handler: str
    samples: int
    mean: float
    longest: float


class Load(msgspec.Struct, frozen=True):
    """The load of one node over all its incarnations until now."""

    handled: int
    """Messages, requests and ticks that its inbox has worked off."""
    waiting: int
    """Those that wait now."""
    age: float
    """For how long the oldest one that is measured waits already, seconds; 0 when none is."""
    longest_wait: float
    """The longest measured wait for a turn, seconds."""
    handlers: tuple[HandlerLoad, ...]
    """By name. Handlers with tasks of their own (`concurrent`) are measured for topics only, and always."""

    @property
    def slowest(self) -> HandlerLoad | None:
        """The handler with the longest measured time; None before the first."""
        return max(self.handlers, key=lambda handler: handler.longest, default=None)


class Meter:
    """Collects the samples of one inbox."""

    __slots__ = ("_handlers", "longest_wait")

    INTERVAL = 64
    """At least one item of so many is measured."""

    def __init__(self) -> None:
        self._handlers: dict[str, tuple[int, float, float]] = {}
        self.longest_wait = 0.0

    def took(self, handler: str, seconds: float) -> None:
        """One item of `handler` took so long."""
        samples, total, longest = self._handlers.get(handler, (0, 0.0, 0.0))
        self._handlers[handler] = (samples + 1, total + seconds, max(longest, seconds))

    def waited(self, seconds: float) -> None:
        """One item waited so long for its turn."""
        self.longest_wait = max(self.longest_wait, seconds)

    @classmethod
    def interval(cls, handled: int) -> int:
        """How many items on to measure the next one, after so many: rare handlers get samples, too, and periods do not lock in."""
        return min(1 + handled // 16, cls.INTERVAL - handled % 7)

    def handlers(self) -> tuple[HandlerLoad, ...]:
        """The samples so far, by handler."""
        return tuple(
            HandlerLoad(handler, samples, total / samples, longest)
            for handler, (samples, total, longest) in sorted(self._handlers.items())
        )
