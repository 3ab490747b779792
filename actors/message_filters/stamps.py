"""The time of a message, by which all filters order messages and put them together."""

from __future__ import annotations

from typing import TypeAlias

from actors.time.clock import Clock
from actors.time.values import SecNanosec, Time, nanoseconds_of

Stamp: TypeAlias = Time | SecNanosec
"""A `Time`, or the stamp of a message."""


def instant_of(stamp: Stamp) -> int:
    """The stamp in nanoseconds. Raises ``TypeError`` for what is none, such as a number of seconds."""
    if isinstance(stamp, Time):
        return stamp.nanoseconds
    try:
        return nanoseconds_of(stamp)
    except AttributeError:
        raise TypeError(
            f"{stamp!r:.40} is no time: give the stamp of a message, self.clock.stamp() for now, or Time(seconds=...) of actors.time"
        ) from None


def stamp_of_message(message: object, clock: Clock | None = None) -> int:
    """``message.header.stamp`` in nanoseconds; for a message without a header now, by `clock`. Raises ``TypeError`` without a clock."""
    header = getattr(message, "header", None)
    if header is not None:
        return instant_of(header.stamp)
    if clock is None:
        raise TypeError(
            f"{type(message).__name__} has no header, so it has no stamp; where the time of its arrival will do, "
            "give the filter allow_headerless=self.clock"
        )
    return clock.wall_ns()
