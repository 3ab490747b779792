"""Time: values of whole nanoseconds, the clocks and tickers that nodes live on, and the event loops, real and virtual.

The values are exported here; the rest is the framework's own.
"""

from __future__ import annotations

from actors.time.values import (
    ClockType,
    Duration,
    SecNanosec,
    Time,
)

__all__ = [
    "ClockType",
    "Duration",
    "SecNanosec",
    "Time",
]
