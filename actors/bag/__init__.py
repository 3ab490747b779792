"""Recording and playing: the messages and events of a system as files for ROS 2's tools, or as one hash to compare two runs.

`Recorder` and `Player` are nodes that write and play bags, in the format of rosbag2. `BagReader`, `BagWriter`, `rewrite`, `recover` and
`reindex` work on the files alone. `FlightRecorder` keeps the last seconds of everything and writes them to an MCAP file on request, and
`Trace` hashes everything; these two are attached to a `System`, preferably before its tree starts:
``run(tree, observers=(recorder, trace))``.
"""

from __future__ import annotations

from actors.bag.contents import BagError, BagMessage, BagTopic, topic_of
from actors.bag.flight_recorder import FlightRecord, FlightRecorder
from actors.bag.metadata import BagFile, BagMetadata
from actors.bag.options import PlayOptions, RecordOptions, qos_overrides
from actors.bag.player import Player
from actors.bag.reader import BagReader
from actors.bag.recorder import Recorder
from actors.bag.rewriting import Recovered, recover, reindex, rewrite
from actors.bag.ring import Channel, Entry, Source
from actors.bag.schemas import type_of
from actors.bag.selection import Selection
from actors.bag.trace import Trace
from actors.bag.writer import BagWriter, Split, WriterOptions

__all__ = [
    "BagError",
    "BagFile",
    "BagMessage",
    "BagMetadata",
    "BagReader",
    "BagTopic",
    "BagWriter",
    "Channel",
    "Entry",
    "FlightRecord",
    "FlightRecorder",
    "PlayOptions",
    "Player",
    "RecordOptions",
    "Recorder",
    "Recovered",
    "Selection",
    "Source",
    "Split",
    "Trace",
    "WriterOptions",
    "qos_overrides",
    "recover",
    "reindex",
    "rewrite",
    "topic_of",
    "type_of",
]
