"""Filters of messages by their stamps: put together what belongs together, keep the last, bring into order.

::

    class Colored(Node):
        async def on_start(self) -> None:
            image, scan = Subscriber(self, IMAGE), Subscriber(self, SCAN)
            self.pairs = ApproximateTimeSynchronizer([image, scan], queue_size=10, slop=0.05)

        @background
        async def color(self) -> None:
            async for image, scan in self.pairs:
                ...
"""

from __future__ import annotations

from actors.message_filters.approximate_time import ApproximateTime
from actors.message_filters.cache import Cache
from actors.message_filters.input_aligner import InputAligner, QueueStatus
from actors.message_filters.signal import Connection, FilterStream
from actors.message_filters.simple_filter import Chain, DeltaFilter, PassThrough, SimpleFilter, Subscriber
from actors.message_filters.stamps import Stamp
from actors.message_filters.synchronizer import ApproximateTimeSynchronizer, Synchronizer, TimeSynchronizer
from actors.message_filters.time_sequencer import TimeSequencer

__all__ = [
    "ApproximateTime",
    "ApproximateTimeSynchronizer",
    "Cache",
    "Chain",
    "Connection",
    "DeltaFilter",
    "FilterStream",
    "InputAligner",
    "PassThrough",
    "QueueStatus",
    "SimpleFilter",
    "Stamp",
    "Subscriber",
    "Synchronizer",
    "TimeSequencer",
    "TimeSynchronizer",
]
