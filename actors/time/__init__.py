"""Time: values in whole nanoseconds, the clocks and tickers of nodes, and the real and virtual event loops.

Public are the values, and the jumps of simulated time reported by `Node.on_jump`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.time.values import ClockType, Duration, SecNanosec, Time, nanoseconds_of, stamp_of

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
    """Import the names of simulated time when one is first used; most systems never use them."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from actors.time import ros_clock

    return getattr(ros_clock, name)
