"""The load of a node: how long its handlers take, and how long items wait for their turn. All times are seconds on the system's clock.

Both are sampled, so that measuring costs little. Handler times: the first few items, and then at least one item of 64. Waiting times: one
item at a time, at most one every half second, whenever an item has to wait.
"""

from __future__ import annotations

import msgspec


class HandlerLoad(msgspec.Struct, frozen=True):
    """The measured time of one handler, from its call to its end: the number of samples, their mean and the longest, in seconds."""

    handler: str
    samples: int
    mean: float
    longest: float


class Load(msgspec.Struct, frozen=True):
    """The load of one node, over all its incarnations until now."""

    handled: int
    """How many items its inbox has run: messages, requests, ticks and requested lifecycle transitions."""
    waiting: int
    """How many items wait now."""
    age: float
    """How long the item that is being measured has waited so far, seconds; 0 when none is measured."""
    longest_wait: float
    """The longest measured wait for a turn, seconds."""
    handlers: tuple[HandlerLoad, ...]
    """The handlers in order of their names. Of concurrent handlers, those of topics are measured, at every run; others are not."""

    @property
    def slowest(self) -> HandlerLoad | None:
        """The handler with the longest measured time; None before the first."""
        return max(self.handlers, key=lambda handler: handler.longest, default=None)


class Meter:
    """Collects the samples of one inbox.

    Invariants:

    - `_handlers` holds, for each measured handler, the number of its samples, their sum and the longest one, in seconds.
    - `longest_wait` never falls, seconds.
    """

    __slots__ = ("_handlers", "longest_wait")

    INTERVAL = 64
    """At least one of this many items is measured."""

    def __init__(self) -> None:
        self._handlers: dict[str, tuple[int, float, float]] = {}
        self.longest_wait = 0.0

    def took(self, handler: str, seconds: float) -> None:
        """Record that one item of `handler` took `seconds`."""
        samples, total, longest = self._handlers.get(handler, (0, 0.0, 0.0))
        self._handlers[handler] = (samples + 1, total + seconds, max(longest, seconds))

    def waited(self, seconds: float) -> None:
        """Record that one item waited for its turn for `seconds`."""
        self.longest_wait = max(self.longest_wait, seconds)

    @classmethod
    def interval(cls, handled: int) -> int:
        """The number of items from one measurement to the next, when `handled` items have run.

        It grows from 1, so that a young node has samples soon, and it varies, so that periodic items are not always or never measured.
        """
        return min(1 + handled // 16, cls.INTERVAL - handled % 7)

    def handlers(self) -> tuple[HandlerLoad, ...]:
        """The measurements so far, in order of the handlers' names."""
        return tuple(
            HandlerLoad(handler, samples, total / samples, longest)
            for handler, (samples, total, longest) in sorted(self._handlers.items())
        )
