"""Time: values of whole nanoseconds, the clocks and tickers that nodes live on, and the event loops, real and virtual.

Public are the values, and the jumps of simulated time that `Node.on_jump` tells of.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.time.values import (
    ClockType,
    Duration,
    SecNanosec,
    Time,
    nanoseconds_of,
    stamp_of,
)

if TYPE_CHECKING:
    from actors.time.ros_clock import ClockChange, JumpHandle, JumpThreshold, TimeJump

__all__ = [
    "ClockChange",
    "ClockType",
    "Duration",
    "JumpHandle",
    "JumpThreshold",
    "SecNanosec",
    "Time",
    "TimeJump",
    "nanoseconds_of",
    "stamp_of",
]


def __getattr__(name: str) -> Any:
    """Imports the names of simulated time when one is first used: most systems never do."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from actors.time import ros_clock

    return getattr(ros_clock, name)
