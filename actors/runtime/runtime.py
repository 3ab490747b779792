"""`Runtime`: the parts of a system that its nodes and supervisors use."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Coroutine, Iterable
from functools import partial
from random import Random
from threading import get_ident
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from actors.checks import create
from actors.errors import DeclarationError
from actors.graph.graph import Graph
from actors.inbox.boundary import outside
from actors.logs import structlog_sink
from actors.logs.levels import Level, LevelTree
from actors.runtime.incarnation import Incarnation, made
from actors.runtime.journal import Journal
from actors.runtime.offload import CallsFromThreads, Offload
from actors.runtime.placement import HERE, Placement
from actors.runtime.preload import preload
from actors.runtime.record import Directory, NodeRecord
from actors.runtime.stall import StallWatch
from actors.runtime.start_watch import StartWatch
from actors.runtime.tree import RunningTree
from actors.supervision.child import Child
from actors.supervision.declarations import Supervisor
from actors.time.clock import Clock
from actors.time.deadlines import Deadlines
from actors.time.ticker import Ticker

if TYPE_CHECKING:
    from actors.logs import LogSink
    from actors.parameters import ParameterChange
    from actors.runtime.interceptor import Interceptor
    from actors.runtime.options import RunOptions
    from actors.runtime.record import NodeRecord
    from actors.supervision.child_task import ChildTask
    from actors.supervision.peers import Life
    from actors.supervision.report import Report


class HostLease(NamedTuple):
    """What a machine holds to which parts of the tree are given: for how many seconds it may run them, 0 if it cannot be reached, and how many."""

    host: str
    left: float
    parts: int


class Observers:
    """The callbacks of one system, one list for each kind of event. The callbacks of a list are called in its order.

    A callback must not block. Those in `sinks` may raise, and then do not get that line; the others must not raise.

    Invariants: a callback is never removed while the system exists.
    """

    __slots__ = (
        "answered", "closed", "closing", "dismissed", "ended", "leases", "opening", "parameters", "ready", "reports", "sinks", "tree_ended",
    )  # fmt: skip

    def __init__(self, sinks: tuple[LogSink, ...]) -> None:
        self.sinks: list[LogSink] = list(sinks)
        """Called with every log line, those of supervisors' reports included."""
        self.reports: list[Callable[[Report], None]] = []
        """Called with every report of a supervisor, before it is logged."""
        self.parameters: list[Callable[[Incarnation, ParameterChange], None]] = []
        """Called when parameters were declared, set or undeclared, but not for those declared before the first of these was added."""
        self.ready: list[Callable[[Incarnation], None]] = []
        """Called when an incarnation has become ready, before it handles any item of its inbox."""
        self.answered: list[Callable[[Exception], None]] = []
        """Called with the error that left a service handler or an action body, which is the answer to the caller, and with that of a call
        that was refused because it would wait for itself."""
        self.ended: list[Callable[[Incarnation], None]] = []
        """Called when an incarnation has ended and closed its endpoints; its tasks may still be ending."""
        self.dismissed: list[Callable[[NodeRecord], None]] = []
        """Called when a node has ended for good and its endpoints are closed; may be called again for the same node."""
        self.leases: list[Callable[[], Iterable[HostLease]]] = []
        """Called for the leases of the machines to which parts of the tree are given, when they are to be shown."""
        self.opening: list[Callable[[], Coroutine[Any, Any, None]]] = []
        """Run beside the start of the tree, which is over when they have returned. They must not raise."""
        self.closing: list[Callable[[], Coroutine[Any, Any, None]]] = []
        """Run after the tree and the nodes beside it have ended, before the stop of the system returns. They must not raise."""
        self.tree_ended: list[Callable[[], None]] = []
        """Called when the tree has ended, for any reason."""
        self.closed: list[Callable[[], None]] = []
        """Called when the system has ended: the tree, and the nodes beside it."""

    def add(
        self,
        *,
        reports: Callable[[Report], None] | None = None,
        lines: LogSink | None = None,
        end: Callable[[], None] | None = None,
    ) -> None:
        """See `System.observe`."""
        if reports is not None:
            self.reports.append(reports)
        if lines is not None:
            self.sinks.append(lines)
        if end is not None:
            self.tree_ended.append(end)


class OtherProcesses(Protocol):
    """The source of lives in processes of their own."""

    def life(self, child: Child | Supervisor, path: tuple[str, ...], incarnation: int, /) -> Life:
        """Make a new life of a child with ``process=True``, as `supervision.seam.Runtime.life` does."""
        ...

    def crash(self, path: tuple[str, ...], error: Exception, /) -> None:
        """Make the node at this path, in another process, fail with `error`; nothing happens if that process has ended."""
        ...

    def kill(self, path: tuple[str, ...], /) -> None:
        """Kill the process in which the node at this path runs, as ``kill -9`` does; nothing happens if it has ended."""
        ...


class Runtime:
    """The parts of one system that all its nodes share: clock, graph, logs, random numbers and tree. It is a `supervision.seam.Runtime`.

    `options` are those of the run. `processes` makes the source of lives in other processes, at its first use; without it the system has
    none. `placement` is that of this system in the tree of which it is a part. `make_graph` makes the graph.

    Invariants:

    - It belongs to the event loop and the thread in which it was made.
    - The numbers of `random` depend on `seed` and the key only; those of `ids` also on the process, if `distinguish` was called, and on how
      many lives of the node have drawn ids before.
    - `close` is called once, after the tree and the nodes beside it have ended.
    """

    def __init__(
        self,
        *,
        seed: int,
        sinks: tuple[LogSink, ...],
        level: int,
        options: RunOptions | None = None,
        processes: Callable[[Runtime], OtherProcesses] | None = None,
        placement: Placement = HERE,
        make_graph: Callable[..., Graph] = Graph,
    ) -> None:
        self.loop = loop = asyncio.get_running_loop()
        self.thread = get_ident()
        self.seed = seed
        self.placement = placement
        self.clock = create(Clock, loop, virtual=bool(getattr(loop, "virtual", False)))
        self.ticker = Ticker(loop)
        self.deadlines = Deadlines(loop)
        self.threads = CallsFromThreads(loop)
        self.offload = Offload(self.clock)
        self.rng = self.random("supervision")
        self.process = ""
        """What makes the ids of this process differ from those of others with the same seed."""
        self.id_streams: Counter[str] = Counter()
        """Full name -> how many lives of the node have drawn ids: a node that is opened again must not repeat those of the last time."""
        self.observers = Observers(sinks)
        self.options = options
        self.journal = Journal(
            loop,
            self.clock,
            LevelTree(Level(level)) if options is None else options.levels,
            self.observers.sinks,
            self.observers.reports,
        )
        self.log = self.journal.log("system", 1)
        self.graph = make_graph(self.clock.now)
        self.tree = RunningTree(self)
        self.directory = Directory(self.tree, loop, options)
        self.starts = StartWatch(loop, virtual=self.clock.virtual)
        self.openings: tuple[asyncio.Task[None], ...] = ()
        """What runs beside the start; see `Observers.opening`."""
        self.interceptors: tuple[Interceptor, ...] = ()
        """What stands between the nodes and their world; the first is the nearest to the nodes."""
        self.stalls: StallWatch | None = None
        """Finds the handlers that block the event loop; None on the virtual clock, and while the system is not open."""
        self.dead_letters = 0
        """How many messages were lost because they waited for a life that never came, or for a handler that the next life lacks."""
        self._make_processes = processes
        self._processes: OtherProcesses | None = None

    def open(self) -> None:
        """Begin what runs beside the start. On the real clock, import what is used later, too, and begin to watch the event loop.

        To be called once, before the first node starts.
        """
        self.openings = tuple(self.loop.create_task(self._begin(opening)) for opening in self.observers.opening)
        if not self.clock.virtual:
            preload(structlog=structlog_sink in self.observers.sinks)
            self.stalls = self.stall_watch()
            self.stalls.start()

    def stall_watch(self) -> StallWatch:
        """What finds the handlers that block the event loop, still to be started."""
        return StallWatch(self.loop, self.thread, self.journal, self.directory.runner_of)

    def intercept(self, interceptor: Interceptor, *, first: bool = False) -> None:
        """Let `interceptor` stand between the nodes and their world; with `first`, nearest to the nodes.

        It is asked about what is made from now on; so it is added before the tree starts, or the lives concerned are begun anew.
        """
        self.interceptors = (interceptor, *self.interceptors) if first else (*self.interceptors, interceptor)
        self.graph.intercept(interceptor, first=first)

    def close(self) -> None:
        """Close all records and stop watching, after the tree and the nodes beside it have ended."""
        for record in self.directory.records.values():
            self._dismiss(record)
        self.deadlines.close()
        self.starts.close()
        if self.stalls is not None:
            self.stalls.stop()
            self.stalls = None
        for observer in self.observers.closed:
            observer()

    async def opened(self) -> None:
        """Wait until all that runs beside the start has ended."""
        if self.openings:
            await asyncio.wait(self.openings)

    async def _begin(self, opening: Callable[[], Coroutine[Any, Any, None]]) -> None:
        try:
            await opening()
        except Exception:
            self.log.exception("what begins beside the start has failed; the system runs without it")

    async def leave(self) -> None:
        """End what was begun beside the start, after `close`."""
        for opening in self.openings:
            opening.cancel()
        await self.opened()
        for closing in self.observers.closing:
            await closing()

    @property
    def stop_reason(self) -> str | None:
        """Why the system stops or has stopped; None while it does not."""
        return self.tree.stop_reason

    # -- what supervisors call ----------------------------------------------------------------------------------------------

    def life(self, child: Child | Supervisor, path: tuple[str, ...], incarnation: int, /) -> Life:
        """Make a new life of `child`, which takes over inbox and waiting messages of the last one. Raises what `incarnate` raises."""
        if child.process or isinstance(child, Supervisor):
            return self.processes.life(child, path, incarnation)
        return self.new_life(child, self.enter(child, path))

    @property
    def processes(self) -> OtherProcesses:
        """The source of lives in other processes. Raises `DeclarationError` if this system can have none."""
        if self._processes is None:
            if self._make_processes is None:
                raise DeclarationError(
                    "this system can start no other process: use run(tree) for a tree with process=True"
                )
            self._processes = self._make_processes(self)
        return self._processes

    def gone(self, path: tuple[str, ...], kept: bool, /) -> None:
        """Close the records of a node, or of all nodes below a supervisor, that have ended for good: calls to them fail at once.

        Unless `kept`, the records are removed, too.
        """
        for record in self.directory.below(path):
            self._dismiss(record)
            if not kept:
                self.directory.remove(record)

    def report(self, report: Report, /) -> None:
        """Keep a supervisor's report, tell the observers, and log it."""
        record = self.directory.records.get(report.child.path)
        self.journal.keep(report)
        if report.context == "child_terminated" and record is not None:
            record.note_restart(self.clock.now(), str(report.reason))
        self.journal.write_report(report, None if record is None else record.ended_at)

    # -- the lives of nodes -------------------------------------------------------------------------------------------------

    def enter(self, child: Child, path: tuple[str, ...]) -> NodeRecord:
        """The record for a life of the child at `path`. Raises what `Directory.enter` raises."""
        return self.directory.enter(child, path, self.stalls)

    def renew(self, record: NodeRecord) -> None:
        """Let the next life of a node find nothing of the earlier ones but their number, and what they have saved."""
        self.lost(record.identity.fqn, self.directory.renew(record, self.stalls))

    def new_life(self, child: Child, record: NodeRecord) -> Life:
        """A new life of this node, behind the interceptors. Raises what `incarnate` raises."""
        make: Callable[[], Life] = partial(self.incarnate, child, record)
        for each in self.interceptors:
            make = partial(each.life, record.path, make)
        return make()

    def incarnate(self, child: Child, record: NodeRecord) -> Incarnation:
        """Make the node object of `child` and its incarnation, which does not run yet. Raises what the child's factory raises."""
        return Incarnation(self, record, made(self, child, record.identity.fqn))

    def ready(self, life: Incarnation) -> None:
        """Note that an incarnation is ready, and tell the observers."""
        with outside():
            self.starts.end(life.inbox)
            if not life.ended:  # else it was abandoned, and another one may run in its place
                life.record.node_class = type(life.node)
                for observer in self.observers.ready:
                    observer(life)

    def cleans_up(self, life: Incarnation) -> None:
        """Limit the time of a clean-up that begins now, if the end was not asked for: else it has a limit already."""
        if life.asked is None and (child := self.child_of(life)) is not None:
            with outside():
                child.bound()

    def ended(self, life: Incarnation) -> None:
        """Note that an incarnation has ended, and tell the observers. If the system stops, close its record as well."""
        with outside():
            record = life.record
            record.ended_at = self.loop.time()
            if self.stop_reason is not None:
                self._dismiss(record)
            for observer in self.observers.ended:
                observer(life)

    def child_of(self, life: Incarnation) -> ChildTask | None:
        """The supervisor's task of an incarnation; None if it was abandoned, since another one may run in its place."""
        return None if life.ended else self.tree.child_at(life.identity.path)

    def killed(self, life: Incarnation) -> bool:
        """Whether an incarnation was killed or abandoned, and so has no time for a clean-up."""
        child = self.child_of(life)
        return child is None or child.killed is not None

    def lost(self, node: str, messages: int) -> None:
        """Count messages that waited for a life or a handler that will not come, and log them unless the system stops."""
        self.dead_letters += messages
        if messages and self.stop_reason is None:
            self.log.info("dead letters", node_name=node, messages=messages)

    def _dismiss(self, record: NodeRecord) -> None:
        if record.life is not None:  # it refused a kill and was abandoned: take its endpoints from it
            record.life.release()
        self.lost(record.identity.fqn, record.close())
        self.directory.release_name(record)
        for observer in self.observers.dismissed:
            observer(record)

    # -- what nodes use -----------------------------------------------------------------------------------------------------

    def random(self, key: str) -> Random:
        """A generator of random numbers for `key`, which depends on the system's seed and `key` only."""
        return Random(f"{self.seed}/{key}")

    def distinguish(self, process: str) -> None:
        """Draw ids that differ from those of another process with the same seed. To be called before the first id is drawn."""
        self.process = process

    def ids(self, fqn: str) -> Random:
        """The generator of the ids of one more life of a node."""
        self.id_streams[fqn] += 1
        return self.random(f"ids of {self.process} {fqn}#{self.id_streams[fqn]}")
