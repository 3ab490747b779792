"""The flight recorder: it keeps the last seconds of everything that happens in a system, and writes them to a file on request.

::

    recorder = FlightRecorder(seconds=30.0)
    async with run(tree, observers=(recorder,)) as system:
        ...
        recorder.dump("flight.mcap")

It only observes: a run is the same with and without it. The file is in MCAP format, as written by rosbag2.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import partial
from heapq import merge
from itertools import count
from pathlib import Path
from typing import Any, Final, Self, cast

from actors.bag.mcap_stream import McapFile
from actors.bag.offers import known_type
from actors.bag.ring import Channel, Entry, Ring, Source, placed, weight_of
from actors.checks import NoPublicConstructor, create
from actors.errors import NotStarted
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.cdr import encode
from actors.interfaces.errors import CdrError
from actors.interfaces.message import Message
from actors.interfaces.types import default, string, uint32
from actors.logs import LogRecord, log_message, printable
from actors.qos import DEFAULT
from actors.qos import ROSOUT as ROSOUT_QOS
from actors.qos.policies import QoS
from actors.runtime.standard import ROSOUT
from actors.supervision.report import Report
from actors.system import System
from actors.time.values import stamp_of
from actors.topics.peers import PublisherPeer

SUPERVISOR_EVENTS = "/supervisor_events"
"""The topic of a recording that holds the reports of the supervisors."""


class SupervisorEvent(Message, frozen=True, kw_only=True):
    """One report of a supervisor. `context` is a value of `actors.supervision.report.Context`; `reason` is empty if there is none."""

    stamp: Time = default()
    supervisor: string = ""
    context: string = ""
    child: string = ""
    incarnation: uint32 = 0
    restart: string = ""
    reason: string = ""
    note: string = ""


def event_message(report: Report, nanoseconds: int) -> SupervisorEvent:
    """Convert a report of this wall time, in nanoseconds. The text of an error is kept, not the error with the objects it refers to."""
    return SupervisorEvent(
        stamp=stamp_of(nanoseconds),
        supervisor="/".join(report.supervisor),
        context=report.context,
        child="/".join(report.child.path),
        incarnation=report.child.incarnation,
        restart=str(report.restart),
        reason=printable("" if report.reason is None else str(report.reason)),
        note=printable(report.note),
    )


SECONDS: Final = 30.0
MAX_BYTES: Final = 64 * 1024 * 1024
PROCESS_BYTES: Final = 8 * 1024 * 1024
"""The most memory of a recorder in a process of its own: its record is written before the process ends, which takes time."""
LINES_SHARE: Final = 8
"""One part in `LINES_SHARE` of the memory is reserved for log lines and events, so that large messages cannot displace them."""


_new: Any = cast("Any", tuple).__new__  # creates an `Entry` in half the time


class FlightRecorder:
    """Keeps the last `seconds` of all topics, log lines and supervisor events, in at most `max_bytes` of memory.

    If there is not enough room, the oldest entries are dropped early and counted in `lost`; an eighth of the memory is reserved for log
    lines and events. The current messages of latched topics (a map, a robot description) are kept however old they are. Messages are kept
    by reference and encoded only when the record is written. Topics that exist only while they are used (the feedback and status of an
    action, /parameter_events) are recorded only then.
    """

    def __init__(self, *, seconds: float = SECONDS, max_bytes: int = MAX_BYTES) -> None:
        if not seconds > 0.0:
            raise ValueError(f"FlightRecorder(seconds={seconds}): give a positive number of seconds")
        self.seconds = seconds
        self._max_bytes = max_bytes
        self._system: System | None = None
        self._order = count()
        self._messages = Ring(max_bytes - max_bytes // LINES_SHARE)
        self._lines = Ring(max_bytes // LINES_SHARE)
        self._channels: dict[tuple[str, type[Message]], Channel] = {}

    def __repr__(self) -> str:
        held = len(self._messages.entries) + len(self._lines.entries)
        return f"<flight recorder of the last {self.seconds:g} s: {held} entries, {self.bytes} bytes, {self.lost} lost>"

    @property
    def bytes(self) -> int:
        """The approximate memory that the recording takes, in bytes."""
        return self._messages.bytes + self._lines.bytes

    @property
    def lost(self) -> int:
        """The number of entries dropped early because there was no room for them."""
        return self._messages.lost + self._lines.lost

    def attach(self, system: System) -> Self:
        """Record `system` from now on: from the first message if it has not started yet, otherwise beginning with its latched messages."""
        if self._system is not None:
            raise RuntimeError("this recorder records a system already: make another recorder")
        self._system = system
        system.graph.tap(self._tap)
        system.observe(lines=self._log, reports=self._report)
        return self

    def for_process(self) -> Callable[[], FlightRecorder]:
        """A function that makes the recorder of another process of the recorded tree, for which less memory suffices.

        When the child of that process fails, its record is written to a file, which is named in the log.
        """
        return partial(FlightRecorder, seconds=self.seconds, max_bytes=min(self._max_bytes, PROCESS_BYTES))

    def freeze(self) -> FlightRecord:
        """Return the present contents as a value that does not change. Only references are copied."""
        newest = max((ring.entries[-1].at for ring in self._rings if ring.entries), default=0.0)
        for ring in self._rings:
            ring.trim(newest - self.seconds)
        latched = sorted(entry for channel in self._channels.values() for entry in channel.held())
        entries = tuple(merge(*(ring.entries for ring in self._rings)))
        return create(FlightRecord, self.system, entries, tuple(latched), self)

    def dump(self, path: str | os.PathLike[str], *, notes: Mapping[str, str] | None = None) -> Path:
        """Write the present contents to an MCAP file and return its path. `notes` are stored in the file. Raises `OSError`.

        To avoid blocking the loop, use ``await asyncio.to_thread(recorder.freeze().write, path)``.
        """
        return self.freeze().write(path, notes=notes)

    @property
    def system(self) -> System:
        """The recorded system. Raises `NotStarted` if there is none yet."""
        if self._system is None:
            raise NotStarted("this recorder records no system yet: recorder.attach(system)")
        return self._system

    @property
    def _rings(self) -> tuple[Ring, Ring]:
        return self._lines, self._messages

    def _channel(self, topic: str, type: type[Message]) -> Channel:
        channel = self._channels.get((topic, type))
        if channel is None:
            channel = self._channels[topic, type] = Channel(topic, type)
        return channel

    def _tap(self, publisher: PublisherPeer) -> Callable[[Message], None]:
        qos, topic = publisher.qos, publisher.entry.name
        if topic == ROSOUT:  # log lines are recorded by the sink
            return _nothing
        kind = known_type(publisher.type)
        if kind is None:  # a publisher of another process, whose messages cannot be read here
            return _nothing
        channel = self._channel(topic, kind)
        channel.offer(qos)
        source = Source(channel, publisher.node.fqn, qos.limit if qos.transient_local else 0)
        weigh, order, seconds, now = weight_of(channel.type), self._order, self.seconds, self.system.clock.now
        ring = self._messages
        entries, max_bytes = ring.entries, ring.max_bytes

        # `Ring.append`, inlined: this runs for every message of the system.
        def deliver(message: Message) -> None:
            at = now()
            weight = weigh(message)
            entries.append(_new(Entry, (next(order), at, source, message, weight, None)))
            ring.bytes += weight
            if ring.bytes > max_bytes or entries[0].at < at - seconds:
                ring.trim(at - seconds)

        for message in publisher.latched:
            deliver(message)
        return deliver

    def _log(self, record: LogRecord) -> None:
        message = log_message(record, self.system.clock.wall_ns_at(record.time))
        self._line(ROSOUT, message, record.time, ROSOUT_QOS)

    def _report(self, report: Report) -> None:
        clock = self.system.clock
        now = clock.now()
        self._line(SUPERVISOR_EVENTS, event_message(report, clock.wall_ns_at(now)), now, DEFAULT)

    def _line(self, topic: str, message: Message, at: float, qos: QoS) -> None:
        """Record a log line or event as a message at once: what it refers to may change, and must not be kept alive."""
        channel = self._channel(topic, type(message))
        channel.offer(qos)
        entry = Entry(next(self._order), at, Source(channel), message, weight_of(channel.type)(message))
        self._lines.append(entry, at - self.seconds)


class FlightRecord(metaclass=NoPublicConstructor):
    """The contents of a recorder at one instant: `entries` in order, and `latched`, older messages that were still valid.

    It has no public constructor: `FlightRecorder.freeze` gives one.
    """

    __slots__ = ("entries", "latched", "lost", "seconds", "system")

    def __init__(
        self, system: System, entries: tuple[Entry, ...], latched: tuple[Entry, ...], recorder: FlightRecorder
    ) -> None:
        self.system = system
        self.entries = entries
        self.latched = latched
        self.seconds = recorder.seconds
        self.lost = recorder.lost

    def __repr__(self) -> str:
        return f"<flight record of {len(self.entries)} entries and {len(self.latched)} latched messages>"

    def write(self, path: str | os.PathLike[str], *, notes: Mapping[str, str] | None = None) -> Path:
        """Write an MCAP file and return its path. Callable from any thread. `notes` are added to the metadata record `flight_record`.

        Log lines are on /rosout, supervisor events on /supervisor_events. Times are those of publication; a latched message from before the
        recorded period keeps its own as `publish_time` and has the start of the period as `log_time`. A file cannot hold times before 1970:
        if the clock showed any, all times are increased by the nanoseconds stored as `shifted_ns` in the metadata. Messages that cannot be
        encoded are left out and counted in the metadata. Raises `OSError`.
        """
        clock = self.system.clock
        first = min((entry.at for entry in (*self.latched, *self.entries)), default=0.0)
        shift = max(0, -clock.wall_ns_at(first))

        def wall(at: float) -> int:
            return clock.wall_ns_at(at) + shift

        numbers: dict[Channel, int] = {}
        unencodable = 0
        with McapFile(path) as file:
            for entry, at in placed(self.latched, self.entries):
                channel = entry.source.channel
                if channel not in numbers:
                    numbers[channel] = file.channel(channel.topic, channel.type, channel.offered)
                try:
                    data = encode(entry.message)
                except CdrError:
                    unencodable += 1
                    continue
                file.write(numbers[channel], data, received_ns=wall(at), published_ns=wall(entry.at))
            file.metadata("flight_record", self._facts(unencodable, shift) | dict(notes or {}))
        return file.path

    def _facts(self, unencodable: int, shift: int) -> dict[str, str]:
        return {
            "clock": "virtual" if self.system.clock.virtual else "real",
            "seed": str(self.system.seed),
            "seconds": f"{self.seconds:g}",
            "entries": str(len(self.entries)),
            "latched": str(len(self.latched)),
            "lost": str(self.lost),
            "unencodable": str(unencodable),
            **({"shifted_ns": str(shift)} if shift else {}),
        }


def _nothing(message: object) -> None:
    """Ignore a message that is recorded elsewhere."""
