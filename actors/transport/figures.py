"""The figures that a process publishes about itself: its CPU time, its memory, and the state of each of its nodes.

It is published on a topic, ``/_robactor/figures``, by a publisher that is not shown. It costs nothing without a
subscription. While there is one, each process of this library sends its figures at once, and then every `PERIOD`.
"""

from __future__ import annotations

import os
import socket
import sys
import time
from asyncio import TimerHandle
from typing import Final

from actors.contracts.contracts import Topic
from actors.interfaces.cdr import encode
from actors.interfaces.message import Message
from actors.interfaces.types import Many, default, uint32, uint64
from actors.runtime.runtime import NodeRecord, Runtime
from actors.transport.local_side import LocalSide, type_info
from actors.transport.protocol import PublisherHere

PERIOD: Final = 1.0
"""Seconds from one report of a process to the next, while it is watched."""


_MOST: Final = 2**32 - 1
"""The largest number of the field `depth`, a uint32."""


class HandlerFigures(Message, frozen=True, kw_only=True):
    """One handler of a node, as far as it is measured; see `actors.inbox.load.HandlerLoad`. Times are in seconds."""

    handler: str
    mean: float
    longest: float


class TimerFigures(Message, frozen=True, kw_only=True):
    """One timer of a node, over all its lives."""

    handler: str
    hz: float
    fired: uint64
    missed: uint64
    """How many of its ticks were lost, because the node or the event loop was busy when they were due."""
    blocked: uint64
    """How many of those were lost because the event loop was blocked."""


class QueueFigures(Message, frozen=True, kw_only=True):
    """One subscription with a handler, and its queue."""

    topic: str
    handler: str
    received: uint64
    dropped: uint64
    waiting: uint32
    depth: uint32


class ServedFigures(Message, frozen=True, kw_only=True):
    """One service of a node, and how often it was called."""

    service: str
    calls: uint64
    clients: Many[str] = default()
    """The full names of the nodes that have called it, of this and of other processes."""


class NodeFigures(Message, frozen=True, kw_only=True):
    """One node of the process."""

    name: str
    state: str
    incarnation: uint32
    restarts: uint32
    """How many of its lives have ended in a restart."""
    handled: uint64
    """How many messages, requests and ticks it has handled, in all its lives."""
    waiting: uint32
    """How many wait in its inbox."""
    inbox_age: float
    """For how long the one that is measured has waited, seconds."""
    handlers: Many[HandlerFigures] = default()
    timers: Many[TimerFigures] = default()
    queues: Many[QueueFigures] = default()
    services: Many[ServedFigures] = default()


class LeaseFigures(Message, frozen=True, kw_only=True):
    """One machine to which the process gives parts of its tree."""

    host: str
    left: float
    """For how many seconds its agent may still run them, as the tree knows; 0 if it cannot be reached."""
    parts: uint32


class ProcessFigures(Message, frozen=True, kw_only=True):
    """One process."""

    host: str
    process: uint32
    session: str
    """Its identity on the network."""
    program: str
    """The name of its main module; not its arguments, which may be nobody's business."""
    at: float
    """When this was measured, in seconds on the monotonic clock of its machine; on that of a virtual event loop."""
    cpu: float
    """The CPU time of all its threads since it began, seconds."""
    starved: float = 0.0
    """For how long the thread of its event loop has waited for a processor since then, as Linux tells it, seconds."""
    memory: uint64
    """Its resident memory, bytes; 0 if the system does not tell."""
    unreadable: uint64
    """How much has come from other processes that could not be read."""
    nodes: Many[NodeFigures] = default()
    leases: Many[LeaseFigures] = default()


FIGURES: Final = Topic(ProcessFigures, "/_robactor/figures", 1000)
"""Each process has a publisher of it, which is not shown."""


class StatsPublisher:
    """Publishes the figures of one process.

    Invariant: a timer is running while it is open and somebody watches; otherwise nothing of it runs.
    """

    def __init__(self, side: LocalSide) -> None:
        self._side = side
        self._loop = side.runtime.loop
        self._publisher: PublisherHere | None = None
        self._timer: TimerHandle | None = None
        self._sent = 0

    def open(self) -> None:
        """Publish from now on, while anybody subscribes. To be called when the transport is open."""
        publisher = self._side.participant.publisher(None, FIGURES.name, type_info(ProcessFigures), FIGURES.qos)
        self._publisher = publisher
        publisher.open()
        self.wanted(publisher)

    def wanted(self, publisher: PublisherHere) -> None:
        """See `Events.wanted`."""
        if publisher is not self._publisher:
            return
        if publisher.wanted and self._timer is None:
            self._tell(publisher)
        elif not publisher.wanted:
            self._rest()

    def close(self) -> None:
        """Publish no more."""
        self._rest()
        publisher, self._publisher = self._publisher, None
        if publisher is not None:
            publisher.close()

    def _rest(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tell(self, publisher: PublisherHere) -> None:
        self._timer = self._loop.call_later(PERIOD, self._tell, publisher)
        self._sent += 1
        publisher.put(encode(self._figures()), self._sent, self._side.wall_ns())

    def _figures(self) -> ProcessFigures:
        side = self._side
        return process_figures(side.runtime, side.session, side.unreadable.count)


def process_figures(runtime: Runtime, session: str = "", unreadable: int = 0) -> ProcessFigures:
    """The figures of this process now. A system without a transport has no session, and nothing unreadable comes to it."""
    return ProcessFigures(
        host=socket.gethostname(),
        process=os.getpid(),
        session=session,
        program=_program(),
        at=runtime.loop.time() if runtime.clock.virtual else time.monotonic(),
        cpu=time.process_time(),
        starved=0.0 if runtime.stalls is None else runtime.stalls.processor.share().waited,
        memory=_memory(),
        unreadable=unreadable,
        nodes=[_node(record) for record in runtime.directory.records.values() if not record.process],
        leases=[
            LeaseFigures(host=one.host, left=one.left, parts=one.parts)
            for leases in runtime.observers.leases
            for one in leases()
        ],
    )


def _node(record: NodeRecord) -> NodeFigures:
    load = record.load
    return NodeFigures(
        name=record.identity.fqn,
        state=record.state,
        incarnation=record.incarnation,
        restarts=record.restart_count,
        handled=load.handled,
        waiting=load.waiting,
        inbox_age=load.age,
        handlers=[HandlerFigures(handler=one.handler, mean=one.mean, longest=one.longest) for one in load.handlers],
        timers=[
            TimerFigures(handler=name, hz=timer.hz, fired=timer.fired, missed=timer.missed, blocked=timer.blocked)
            for name, timer in record.timers.items()
        ],
        queues=[
            QueueFigures(
                topic=one.entry.name,
                handler=one.label,
                received=one.received,
                dropped=one.dropped,
                waiting=one.waiting,
                depth=min(one.depth, _MOST),
            )
            for one in record.subscriptions
        ],
        services=[
            ServedFigures(service=name, calls=server.calls, clients=sorted(server.entry.clients))
            for name, server in record.services.items()
        ],
    )


def _program() -> str:
    main = sys.modules.get("__main__")
    module = getattr(getattr(main, "__spec__", None), "name", "") or os.path.basename(sys.argv[0])
    return module.removesuffix(".__main__")


def _memory() -> int:
    """Resident bytes, as Linux tells."""
    try:
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0
