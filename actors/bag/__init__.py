"""Recording: the messages and events of a system as a file for ROS 2's tools, or as one hash to compare two runs.

`FlightRecorder` keeps the last seconds of everything and writes them to an MCAP file on request. `Trace` hashes everything. Both are
attached to a `System`, preferably before its tree starts: ``run(tree, observers=(recorder, trace))``.
"""

from __future__ import annotations

from actors.bag.recorder import Channel, Entry, FlightRecord, FlightRecorder, Source
from actors.bag.trace import Trace

__all__ = ["Channel", "Entry", "FlightRecord", "FlightRecorder", "Source", "Trace"]
