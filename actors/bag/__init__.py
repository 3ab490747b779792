"""Recording: what happened in a system, as a file that ROS 2's tools read, or as one hash that two runs have in common.

`FlightRecorder` keeps the last seconds of everything and writes them to an MCAP file when asked; `Trace` hashes everything. Both are
attached to a `System`, best before its tree starts: ``run(tree, observers=(recorder, trace))``.
"""

from __future__ import annotations

from actors.bag.recorder import Channel, Entry, FlightRecord, FlightRecorder, Source
from actors.bag.trace import Trace

__all__ = ["Channel", "Entry", "FlightRecord", "FlightRecorder", "Source", "Trace"]
