"""`Runtime`: the parts of a system that its nodes and supervisors use; `Directory` and `NodeRecord`: its nodes, each over all its lives."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from functools import partial
from random import Random
from threading import get_ident
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

from actors.checks import create
from actors.errors import DeclarationError
from actors.graph.graph import Graph
from actors.inbox.boundary import BOUNDARY, outside
from actors.inbox.inbox import Inbox
from actors.logs import structlog_sink
from actors.logs.levels import Level, LevelTree
from actors.runtime.endpoints import NOTHING
from actors.runtime.incarnation import Incarnation, made
from actors.runtime.offload import Offload
from actors.runtime.options import identity_of
from actors.runtime.placement import HERE, Placement
from actors.runtime.preload import preload
from actors.runtime.stall import Runner, StallWatch
from actors.runtime.start_watch import StartWatch
from actors.runtime.system_log import SystemLog
from actors.runtime.threads import CallsFromThreads
from actors.runtime.tree import Tree
from actors.suggest import did_you_mean
from actors.supervision.child import Child
from actors.time.clock import Clock
from actors.time.deadlines import Deadlines
from actors.time.ticker import Ticker
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.errors import ProgramExit
    from actors.inbox.load import Load
    from actors.logs import LogSink
    from actors.names.identity import Identity
    from actors.parameters import ParameterChange
    from actors.runtime.interceptor import Interceptor
    from actors.runtime.node import Node
    from actors.runtime.options import RunOptions
    from actors.runtime.timers import TimerRecord
    from actors.services.server import Server
    from actors.supervision.child_task import ChildTask
    from actors.supervision.peers import Life
    from actors.supervision.refs import ChildState
    from actors.supervision.report import Report


KEPT_RESTARTS: Final = 100
"""How many restarts of one node are kept with their time and reason."""


class GraphEntry(Protocol):
    """A topic, service or action in the graph, as `NodeRecord.forget` uses it."""

    def forget(self, node: str) -> None:
        """Remove all that is kept for `node`, which will not come back."""
        ...


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
        self.opening: list[Callable[[], Coroutine[object, None, None]]] = []
        """Run beside the start of the tree, which is over when they have returned. They must not raise."""
        self.closing: list[Callable[[], Coroutine[object, None, None]]] = []
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

    def life(self, task: ChildTask, /) -> Life:
        """Make a new life of a child with ``process=True``, as `supervision.peers.Runtime.life` does."""
        ...

    def crash(self, path: tuple[str, ...], error: Exception, /) -> None:
        """Make the node at this path, in another process, fail with `error`; nothing happens if that process has ended."""
        ...

    def kill(self, path: tuple[str, ...], /) -> None:
        """Kill the process in which the node at this path runs, as ``kill -9`` does; nothing happens if it has ended."""
        ...


class NodeRecord:
    """One node, by its place in the tree, over all its lives: the state that outlives a life, and the figures for reports and tools.

    It has no public constructor: `System.nodes` holds them.

    Invariants:

    - `life` is the one incarnation that uses this record, or None. It is set when an incarnation is made and cleared when that one is
      released, so two incarnations never hold endpoints or take messages under one name.
    - `incarnation` counts the lives and never falls; `life.incarnation` equals it.
    - `state` is not stored here: the node's supervisor keeps it.
    - Between two lives the subscriptions, with their messages, and the servers stay here, and no handler runs. After `close` it has none.
    """

    __slots__ = (
        "_tree",
        "actions",
        "asked_state",
        "child",
        "ended_at",
        "identity",
        "inbox",
        "incarnation",
        "life",
        "node_class",
        "process",
        "restart_count",
        "restarts",
        "saved",
        "services",
        "subscriptions",
        "task",
        "timers",
        "used",
    )

    def __init__(self, child: Child, identity: Identity, tree: Tree, inbox: Inbox) -> None:
        self._tree = tree
        self.child = child
        self.identity = identity
        self.inbox = inbox
        self.process = 0
        """The id of the process in which the node runs or has run last; 0 for this process."""
        self.incarnation = 0
        """The number of the present or last life, from 1; 0 before the first."""
        self.task: ChildTask | None = None
        """The supervisor's task that is to run the next life, until that is made."""
        self.life: Incarnation | None = None
        self.node_class: type | None = None
        """The class of the last node object that became ready."""
        self.restarts: Sequence[tuple[float, str]] = ()
        """The newest `KEPT_RESTARTS` ends that led to a restart: (seconds on the system's clock, reason)."""
        self.restart_count = 0
        """How many ends led to a restart, in all."""
        self.ended_at: float | None = None
        """When its last life ended, seconds on the event loop's clock; None before."""
        self.asked_state: str | None = None
        """The primary state that was last requested of a lifecycle node; None before the first request."""
        self.saved: Any = None
        """The state that the node left for its next incarnation by `checkpoint` or `handover`; None without any."""
        self.timers: Mapping[str, TimerRecord] = NOTHING
        self.subscriptions: tuple[HandlerSubscription[Any], ...] = ()
        self.services: Mapping[str, Server] = NOTHING
        self.actions: Mapping[str, ActionServer] = NOTHING
        self.used: set[GraphEntry] | None = None
        """The graph entries that endpoints of this node used and left; see `forget`. None instead of an empty set."""

    def __repr__(self) -> str:
        return f"<record of {self.identity.fqn}, {self.state}, incarnation {self.incarnation}>"

    @property
    def path(self) -> tuple[str, ...]:
        """The path of the node in the tree, from the root to the node."""
        return self.identity.path

    @property
    def state(self) -> ChildState:
        """ "starting", "running", "stopping" (its end was asked for, or it cleans up), "restarting", or "stopped" for good."""
        return self._tree.state_of(self.identity.path)

    @property
    def running(self) -> Incarnation | None:
        """The present incarnation from the moment it is ready until it has ended; else None."""
        life = self.life
        return life if life is not None and life.phase == "running" else None

    @property
    def node(self) -> Node | None:
        """The node object of the `running` incarnation, or None."""
        life = self.running
        return None if life is None else life.node

    @property
    def load(self) -> Load:
        """The measured load of the node: times of its handlers, and waiting times in its inbox."""
        return self.inbox.load

    def note_restart(self, at: float, why: str) -> None:
        """Count an end that leads to a restart. `at` is in seconds on the system's clock."""
        self.restart_count += 1
        self.restarts = [*self.restarts[1 - KEPT_RESTARTS :], (at, why)]

    def note(self, entries: Iterable[GraphEntry]) -> None:
        """Remember the graph entries of endpoints that are about to end, for `forget`."""
        if self.used is None:
            self.used = set()
        self.used.update(entries)

    # -- between two lives --------------------------------------------------------------------------------------------------

    def park(self, error: Callable[[], Exception]) -> None:
        """Suspend the endpoints after the end of an incarnation: waiting callers get `error()`, messages of subscriptions are kept."""
        for subscription in self.subscriptions:
            if isinstance(subscription, ConcurrentSubscription):
                subscription.pause()
        for server in self._servers():
            server.fail_all(error)
            if server.entry.server is server:
                server.entry.pause(self.identity.fqn, self.incarnation)
        inbox = self.inbox
        inbox.clear(keep=lambda item: isinstance(item, HandlerSubscription))
        inbox.leave()

    def work_on(self) -> None:
        """Let concurrent subscriptions go on with their waiting messages, after an error that did not end the node."""
        for subscription in self.subscriptions:
            if isinstance(subscription, ConcurrentSubscription):
                subscription.work()

    def sweep(self, life: Incarnation) -> int:
        """Close the subscriptions and servers of the last incarnation that `life` has not opened. Returns how many messages were lost."""
        lost = 0
        if gone := [each for each in self.subscriptions if each.node is not life]:
            lost = sum(len(each.messages) for each in gone)
            for subscription in gone:
                subscription.close()
            self.inbox.clear(keep=lambda item: not isinstance(item, HandlerSubscription) or item.node is life)
            self.subscriptions = tuple(each for each in self.subscriptions if each.node is life)
        if left := [each for each in self._servers() if each.node is not life]:
            self.services = {name: each for name, each in self.services.items() if each.node is life}
            self.actions = {name: each for name, each in self.actions.items() if each.node is life}
            for server in left:
                if server.entry.server is None:
                    server.entry.close(self.identity.fqn)
        return lost

    def close(self) -> int:
        """Close all endpoints, because there will be no next life. Returns how many messages waited for one."""
        dead_letters = 0
        if self.subscriptions:
            dead_letters = sum(len(each.messages) for each in self.subscriptions)
            self.note(each.entry for each in self.subscriptions)
            for subscription in self.subscriptions:
                subscription.close()
            self.subscriptions = ()
        if servers := self._servers():
            self.note(server.entry for server in servers)
            for server in servers:
                if server.entry.server is None:
                    server.entry.close(self.identity.fqn)
            self.services = self.actions = NOTHING
        self.inbox.clear(keep=lambda item: False)
        return dead_letters

    def forget(self) -> None:
        """Remove from the graph what was kept there for this node. To be called after `close`, when nothing will ask for the node again."""
        for entry in self.used or ():
            entry.forget(self.identity.fqn)

    def _servers(self) -> list[Server | ActionServer]:
        return [*self.services.values(), *self.actions.values()]


class Directory:
    """The records of all nodes of one system.

    Invariants:

    - `records` has one record for each path, from the start of the node's first life until its supervisor forgets it.
    - A full name belongs to at most one path. A node that has ended for good gives up its name; its record stays until it is removed.
    """

    def __init__(self, tree: Tree, loop: asyncio.AbstractEventLoop, options: RunOptions | None) -> None:
        self.records: dict[tuple[str, ...], NodeRecord] = {}
        self._tree = tree
        self._options = options
        self._loop = loop
        self._paths: dict[str, tuple[str, ...]] = {}
        self.on_step: Callable[[Inbox, str, float], None] | None = None
        """That of the inboxes; None on the virtual clock, and while the system is not open."""

    def enter(self, child: Child, path: tuple[str, ...]) -> NodeRecord:
        """The record for the next life of the child at `path`: that of its earlier lives, or a new one.

        Raises `DeclarationError` when another node has the child's full name, `InvalidName` when one of the child's names is invalid.
        """
        record = self.records.get(path)
        if record is not None and record.child is child and self._paths.get(record.identity.fqn) == path:
            return record
        identity = self._identity(child, path, record)
        if record is None:
            record = self.records[path] = NodeRecord(child, identity, self._tree, Inbox(self._loop, self.on_step))
        record.child, record.identity = child, identity
        return record

    def renew(self, record: NodeRecord) -> int:
        """Let the next life of a node find nothing of the earlier ones but their number, and what they have saved.

        To be called between two lives. Returns how many messages were lost.
        """
        lost = record.close()
        record.inbox, record.timers = Inbox(self._loop, self.on_step), NOTHING
        return lost

    def find(self, fqn: str) -> Incarnation | None:
        """The running incarnation of the node with this full name; None if there is none."""
        path = self._paths.get(fqn)
        record = self.records.get(path) if path is not None else None
        return record.running if record is not None else None

    def owner_of(self, task: asyncio.Task[Any]) -> NodeRecord | None:
        """The node that `task` belongs to: its main task or one that it owns. None for any other task. May be called from any thread."""
        for record in list(self.records.values()):
            if record.inbox.task is task or (record.life is not None and record.life.owns(task)):
                return record
        return None

    def runner_of(self, one: asyncio.Task[object] | Inbox) -> Runner | None:
        """The node of a task or of an inbox, for the stall watch."""
        of_inbox = (each for each in self.records.values() if each.inbox is one)
        record = next(of_inbox, None) if isinstance(one, Inbox) else self.owner_of(one)
        return None if record is None else Runner(record.identity.fqn, record.incarnation, record.inbox)

    def below(self, path: tuple[str, ...]) -> list[NodeRecord]:
        """The record of the node at `path`; for the path of a supervisor, the records of all nodes below it."""
        record = self.records.get(path)
        if record is not None:
            return [record]
        return [each for each in self.records.values() if each.path[: len(path)] == path]

    def release_name(self, record: NodeRecord) -> None:
        """Give up the full name of a node that has ended for good, so that another node may take it."""
        self._paths.pop(record.identity.fqn, None)

    def remove(self, record: NodeRecord) -> None:
        """Remove a node that its supervisor has forgotten, here and from the graph."""
        record.forget()
        del self.records[record.path]

    def named(self, node: type | str) -> NodeRecord:
        """The one node of this class (or a derived one), name or full name. Raises `LookupError` when there is none, or several."""
        found = [record for record in self.records.values() if _is_called(record, node)]
        if len(found) == 1:
            return found[0]
        asked = f"called {node!r}" if isinstance(node, str) else f"a {node.__name__}"
        if found:
            several = ", ".join(sorted(record.identity.fqn for record in found))
            raise LookupError(f"{len(found)} nodes are {asked}: say which one by its full name: {several}")
        known = (
            ", ".join(sorted(_introduced(record) for record in self.records.values() if self._tree.holds(record.path)))
            or "none"
        )
        raise LookupError(f"no node in this system is {asked}; there are: {known}{self._meant(node)}")

    def _meant(self, node: type | str) -> str:
        identities = [record.identity for record in self.records.values()]
        candidates = [name for one in identities for name in (one.name, one.fqn)]
        candidates += [kind.__name__ for record in self.records.values() if (kind := class_of(record)) is not None]
        return did_you_mean(node if isinstance(node, str) else node.__name__, candidates)

    def _identity(self, child: Child, path: tuple[str, ...], before: NodeRecord | None) -> Identity:
        identity = identity_of(child, path, self._options)
        other = self._paths.get(identity.fqn)
        if other is not None and other != path:
            raise DeclarationError(
                f"{'/'.join(path)} would be the second node named {identity.fqn}, the first being {'/'.join(other)}: "
                "give it another name= or namespace="
            )
        if before is not None and self._paths.get(before.identity.fqn) == path:
            del self._paths[before.identity.fqn]
        self._paths[identity.fqn] = path
        return identity


def class_of(record: NodeRecord) -> type | None:
    """The class of a node, also before its first life if a class is its factory; None if a function is, until it has run."""
    made_by = record.child.factory
    return record.node_class or (made_by if isinstance(made_by, type) else None)


def _is_called(record: NodeRecord, node: type | str) -> bool:
    if isinstance(node, str):
        return node in (record.identity.name, record.identity.fqn)
    return (kind := class_of(record)) is not None and issubclass(kind, node)


def _introduced(record: NodeRecord) -> str:
    kind = class_of(record)
    return f"{record.identity.fqn} ({kind.__name__})" if kind is not None else record.identity.fqn


class Runtime:
    """The parts of one system that all its nodes share: clock, graph, logs, random numbers and tree. It is a `supervision.peers.Runtime`.

    `options` are those of the run. `processes` makes the source of lives in other processes, at its first use; without it the system has
    none. `placement` is that of this system in the tree of which it is a part. `make_graph` and `make_deadlines` make
    the graph and the timeouts of calls.

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
        make_deadlines: Callable[[asyncio.AbstractEventLoop], Deadlines] = Deadlines,
    ) -> None:
        self.loop = loop = asyncio.get_running_loop()
        self.thread = get_ident()
        self.seed = seed
        self.placement = placement
        self.clock = create(Clock, loop, virtual=bool(getattr(loop, "virtual", False)))
        self.ticker = Ticker(loop)
        self.deadlines = make_deadlines(loop)
        self.threads = CallsFromThreads(loop)
        self.offload = Offload(self.clock)
        self.rng = self.random("supervision")
        self.process = ""
        """What makes the ids of this process differ from those of others with the same seed."""
        self.id_streams: Counter[str] = Counter()
        """Full name -> how many lives of the node have drawn ids: a node that is opened again must not repeat those of the last time."""
        self.observers = Observers(sinks)
        self.options = options
        self.system_log = SystemLog(
            loop,
            self.clock,
            LevelTree(Level(level)) if options is None else options.levels,
            self.observers.sinks,
            self.observers.reports,
        )
        self.log = self.system_log.log("system", 1)
        self.graph = make_graph(self.clock.now)
        self.tree = Tree()
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

    def __repr__(self) -> str:
        return f"<system of {len(self.directory.records)} nodes, {self.clock!r}>"

    def open(self) -> None:
        """Begin what runs beside the start. On the real clock, import what is used later, too, and begin to watch the event loop.

        To be called once, before the first node starts.
        """
        self.openings = tuple(self.loop.create_task(self._begin(opening)) for opening in self.observers.opening)
        if not self.clock.virtual:
            preload(structlog=structlog_sink in self.observers.sinks)
            self.stalls = self.stall_watch()
            self.directory.on_step = self.stalls.ran
            self.stalls.start()

    def stall_watch(self) -> StallWatch:
        """What finds the handlers that block the event loop, still to be started."""
        return StallWatch(self.loop, self.thread, self.system_log, self.directory.runner_of)

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
            self.stalls = self.directory.on_step = None
        for observer in self.observers.closed:
            observer()

    async def opened(self) -> None:
        """Wait until all that runs beside the start has ended."""
        if self.openings:
            await asyncio.wait(self.openings)

    async def _begin(self, opening: Callable[[], Coroutine[object, None, None]]) -> None:
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

    def life(self, task: ChildTask, /) -> Life:
        """Make a new life of a child, which takes over inbox and waiting messages of the last one. Raises what `incarnate` raises."""
        child = task.entry.spec
        if isinstance(child, Child) and not child.process:
            return self.new_life(child, self.directory.enter(child, task.ref.path), task)
        return self.processes.life(task)

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
        self.system_log.keep(report)
        reason = "" if report.reason is None else str(report.reason)
        if report.context == "child_terminated" and record is not None:
            record.note_restart(self.clock.now(), reason)
        self.system_log.write_report(report, reason, None if record is None else record.ended_at)

    # -- the lives of nodes -------------------------------------------------------------------------------------------------

    def enter(self, child: Child, path: tuple[str, ...]) -> NodeRecord:
        """The record for a life of the child at `path`. Raises what `Directory.enter` raises."""
        return self.directory.enter(child, path)

    def renew(self, record: NodeRecord) -> None:
        """Let the next life of a node find nothing of the earlier ones but their number, and what they have saved."""
        self.lost(record.identity.fqn, self.directory.renew(record))

    def new_life(self, child: Child, record: NodeRecord, task: ChildTask) -> Life:
        """A new life of this node, which `task` will run, behind the interceptors. Raises what `incarnate` raises."""
        record.task = task
        if not self.interceptors:
            return self.incarnate(child, record)
        make: Callable[[], Life] = partial(self.incarnate, child, record)
        for each in self.interceptors:
            make = partial(each.life, record.path, make)
        return make()

    def incarnate(self, child: Child, record: NodeRecord) -> Incarnation:
        """Make the node object of `child` and its incarnation, which does not run yet. Raises what the child's factory raises."""
        return Incarnation(self, record, made(self, child, record.identity.fqn))

    def ready(self, life: Incarnation) -> None:
        """Note that an incarnation is ready, and tell the observers."""
        if BOUNDARY.get() is not None:
            with outside():
                return self.ready(life)
        self.starts.end(life)
        if not life.ended:  # else it was abandoned, and another one may run in its place
            life.record.node_class = type(life.node)
            for observer in self.observers.ready:
                observer(life)

    def ended(self, life: Incarnation) -> None:
        """Note that an incarnation has ended, and tell the observers. If the system stops, close its record as well."""
        if BOUNDARY.get() is not None:
            with outside():
                return self.ended(life)
        record = life.record
        record.ended_at = self.loop.time()
        if self.tree.stop_reason is not None:
            self._dismiss(record)
        for observer in self.observers.ended:
            observer(life)

    def exits(self, request: ProgramExit) -> None:
        """Stop the tree in order because a node's code asks the program to exit; the block of `run` raises `request.error`."""
        tree = self.tree
        if tree.supervisor is not None and tree.exit_request is None:
            tree.exit_request = request
            self.log.info("stopping", because=str(request))
            tree.stop_reason = tree.stop_reason or str(request)
            tree.supervisor.stop(str(request))

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
