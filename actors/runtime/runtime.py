"""`Runtime`: what nodes and supervisors use of the system that they are in."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from random import Random
from threading import get_ident
from typing import TYPE_CHECKING

from actors.graph.graph import Graph
from actors.logs import structlog_sink
from actors.runtime.directory import Directory
from actors.runtime.incarnation import Incarnation
from actors.runtime.journal import Journal
from actors.runtime.life import made
from actors.runtime.observers import Observers
from actors.runtime.offload import CallsFromThreads, Offload
from actors.runtime.preload import preload
from actors.runtime.stall import StallWatch
from actors.runtime.standard import StandardEndpoints
from actors.runtime.start_watch import StartWatch
from actors.runtime.tree import RunningTree
from actors.time.clock import Clock
from actors.time.deadlines import Deadlines
from actors.time.ticker import Ticker

if TYPE_CHECKING:
    from actors.logs import LogSink
    from actors.node.node import Node
    from actors.runtime.options import RunOptions
    from actors.runtime.record import NodeRecord
    from actors.supervision.child_task import ChildTask
    from actors.supervision.declarations import Child
    from actors.supervision.report import Report

__all__ = ["Runtime"]


class Runtime:
    """Everything of one system that its nodes share. For the supervisors it is the `supervision.seam.Runtime`.

    `options` are what this run says of its nodes besides the tree. `make_graph` and `incarnations` make the graph and the lives of nodes: a
    simulation has a graph that loses messages, and lives that end on demand.

    Invariants: it belongs to the event loop and the thread that made it. What it hands out depends on `seed` and the keys asked for only, and
    never on the order of events. After `close` nothing of it is used any more but what reports read.
    """

    def __init__(
        self,
        *,
        seed: int,
        sinks: tuple[LogSink, ...],
        level: int,
        options: RunOptions | None = None,
        make_graph: Callable[..., Graph] = Graph,
        incarnations: Callable[[Runtime, NodeRecord, Node], Incarnation] = Incarnation,
    ) -> None:
        self.loop = loop = asyncio.get_running_loop()
        self.thread = get_ident()
        self.seed = seed
        self.clock = Clock(loop, virtual=bool(getattr(loop, "virtual", False)))
        self.ticker = Ticker(loop)
        self.deadlines = Deadlines(loop)
        self.threads = CallsFromThreads(loop)
        self.offload = Offload(self.clock)
        self.rng = self.random("supervision")
        self._ids = self.random("ids")
        self.observers = Observers(sinks)
        self.options = options
        self.journal = Journal(loop, self.clock, level, self.observers, options)
        self.log = self.journal.log("system", 1)
        standard = StandardEndpoints(self)
        self.graph = make_graph(
            self.clock.now,
            open_standard_service=standard.open_service,
            open_standard_topic=standard.open_topic,
        )
        self.tree = RunningTree(self)
        self.directory = Directory(self.tree, loop, options)
        self.starts = StartWatch(loop, virtual=self.clock.virtual)
        self.stalls: StallWatch | None = None
        """Finds out who blocks the loop: on the real clock only, while the system is open."""
        self.dead_letters = 0
        """Messages that waited for a node's next life, which never came, or for a handler that it no longer has."""
        self._incarnations = incarnations

    def open(self) -> None:
        """Begin to watch the loop; before the first node starts."""
        if not self.clock.virtual:
            preload(structlog=structlog_sink in self.observers.sinks)
            self.stalls = StallWatch(self)
            self.stalls.start()

    def close(self) -> None:
        """The tree and the nodes beside it have ended."""
        for record in self.directory.records.values():
            self._dismiss(record)
        self.deadlines.close()
        self.starts.close()
        if self.stalls is not None:
            self.stalls.stop()
            self.stalls = None
        for observer in self.observers.closed:
            observer()

    @property
    def stop_reason(self) -> str | None:
        """Why the system stops or has stopped; None while it does not."""
        return self.tree.stop_reason

    # -- what supervisors call ----------------------------------------------------------------------------------------------

    def life(self, child: Child, path: tuple[str, ...], incarnation: int, /) -> Incarnation:
        """A new life of `child`; the inbox and the waiting messages of the last one are handed over."""
        return self.incarnate(child, self.enter(child, path))

    def gone(self, path: tuple[str, ...], kept: bool, /) -> None:
        """A node, or all nodes below a supervisor, have ended for good: they leave the graph, and calls to them fail at once.

        Of those that their supervisor has not `kept`, either, nothing is left but reports.
        """
        for record in self.directory.below(path):
            self._dismiss(record)
            if not kept:
                self.directory.remove(record)

    def report(self, report: Report, /) -> None:
        """Take notice of a supervisor's event: kept, told to the observers, and logged in words."""
        record = self.directory.records.get(report.child.path)
        self.journal.keep(report)
        if report.context == "child_terminated" and record is not None:
            record.note_restart(self.clock.now(), str(report.reason))
        self.journal.write_report(report, None if record is None else record.ended_at)

    # -- the lives of nodes -------------------------------------------------------------------------------------------------

    def enter(self, child: Child, path: tuple[str, ...]) -> NodeRecord:
        """The record of the child at `path`. Raises `DeclarationError` when it cannot run there."""
        return self.directory.enter(child, path, self.stalls)

    def incarnate(self, child: Child, record: NodeRecord) -> Incarnation:
        """Make the node object of `child`, and its incarnation, which has not begun to run. Raises what the child's factory raises."""
        return self._incarnations(self, record, made(self, child, record.identity.fqn))

    def ready(self, life: Incarnation) -> None:
        """An incarnation is ready."""
        self.starts.end(life)
        if not life.ended:  # else it had been given up, and its place may have been taken
            life.record.node_class = type(life.node)
            for observer in self.observers.ready:
                observer(life)

    def cleans_up(self, life: Incarnation) -> None:
        """An incarnation begins its clean-up; if nobody has asked for its end, its time for that is limited from now on."""
        if life.asked is None and (child := self.child_of(life)) is not None:
            child.bound()

    def ended(self, life: Incarnation) -> None:
        """An incarnation is over. The supervisor will say whether another one follows, unless everything ends."""
        self.starts.end(life)
        record = life.record
        record.ended_at = self.loop.time()
        if self.stop_reason is not None:
            self._dismiss(record)
        for observer in self.observers.ended:
            observer(life)

    def child_of(self, life: Incarnation) -> ChildTask | None:
        """An incarnation as its supervisor has it; None when it has been given up, and its place may have been taken."""
        return None if life.ended else self.tree.child_at(life.identity.path)

    def killed(self, life: Incarnation) -> bool:
        """Whether no time is left for a clean-up."""
        child = self.child_of(life)
        return child is None or child.killed is not None

    def lost(self, node: str, messages: int) -> None:
        """So many messages waited for a life or a handler of a node that there will not be: counted, and said unless everything ends."""
        self.dead_letters += messages
        if messages and self.stop_reason is None:
            self.log.info("dead letters", node_name=node, messages=messages)

    def _dismiss(self, record: NodeRecord) -> None:
        if record.life is not None:  # it refused to die; what it holds is taken from it
            record.life.release()
        self.lost(record.identity.fqn, record.close())
        self.directory.release_name(record)

    # -- what nodes use -----------------------------------------------------------------------------------------------------

    def random(self, key: str) -> Random:
        """Random numbers for `key`: the same for the same seed, whatever else the run does."""
        return Random(f"{self.seed}/{key}")

    def new_id(self) -> bytes:
        """A fresh 16-byte id in the form of a random UUID, from the system's seed."""
        raw = bytearray(self._ids.randbytes(16))
        raw[6] = raw[6] & 0x0F | 0x40
        raw[8] = raw[8] & 0x3F | 0x80
        return bytes(raw)
