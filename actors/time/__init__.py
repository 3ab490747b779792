"""Time: values of whole nanoseconds, the clocks and tickers that nodes live on, and the event loops, real and virtual.

Public are the values, and the jumps of simulated time that `Node.on_jump` tells of.
"""

from __future__ import annotations

from actors.time.ros_clock import ClockChange, JumpHandle, JumpThreshold, TimeJump
from actors.time.values import (
    ClockType,
    Duration,
    SecNanosec,
    Time,
)

__all__ = [
    "ClockChange",
    "ClockType",
    "Duration",
    "JumpHandle",
    "JumpThreshold",
    "SecNanosec",
    "Time",
    "TimeJump",
]
