"""A system: one running tree, with its clock, graph, logs and randomness. `run(tree)` starts one and ends it in order.

::

    async with run(tree) as system:
        await system.wait()
"""

from __future__ import annotations

import asyncio
import os
import signal
from collections import deque
from collections.abc import Callable
from functools import partial
from random import Random
from threading import Lock, get_ident
from typing import TYPE_CHECKING, Any

from actors.errors import DeclarationError, NotRunning, NotStarted, ProgramExit, WrongThread
from actors.graph.graph import Graph
from actors.logs import DEBUG, INFO, LogRecord, LogSink, NodeLog, structlog_sink
from actors.names.identity import Identity
from actors.places import place_of
from actors.runtime import standard
from actors.runtime.core import Core
from actors.runtime.life import NodeLife
from actors.runtime.mailbox import Mailbox
from actors.runtime.options import RunOptions, identity_of
from actors.runtime.preload import preload
from actors.runtime.stall import StallWatch
from actors.runtime.start_watch import StartWatch
from actors.runtime.unsupervised import UnsupervisedNodes
from actors.shield import see_through
from actors.supervision.errors import NotFound
from actors.supervision.log_lines import log_line
from actors.supervision.reasons import cause_of
from actors.supervision.running import RunningSupervisor
from actors.time.clock import Clock
from actors.time.deadlines import Deadlines
from actors.time.ticker import Ticker

if TYPE_CHECKING:
    from anyio import CapacityLimiter

    from actors.graph.snapshot import Snapshot
    from actors.inbox.load import Load
    from actors.logs.levels import NanosecondClock
    from actors.parameters import ParameterChange
    from actors.supervision.child_task import ChildTask
    from actors.supervision.declarations import Child, DynamicSupervisor, Supervisor
    from actors.supervision.report import Report

__all__ = ["NodeState", "System", "system_here"]


SECOND_SIGNAL_SECONDS = 2.0
"""A second SIGINT or SIGTERM within this time kills what is still stopping."""


KEPT_RESTARTS = 100
"""So many restarts of one node are remembered, with time and reason."""


class NodeState:
    """What the system knows of one node over all its incarnations: for reports and tools.

    It has no public constructor: `System.nodes` holds them.
    """

    __slots__ = (
        "child", "core", "ended_at", "identity", "mailbox", "node_class", "path", "restart_count", "restarts", "state"
    )  # fmt: skip

    def __init__(self, identity: Identity, mailbox: Mailbox) -> None:
        self.child: Child | None = None
        self.identity = identity
        self.mailbox = mailbox
        self.path = identity.path
        self.core: Core | None = None
        self.node_class: type | None = None
        self.state = "starting"
        """starting, running, stopping (it cleans up), restarting or stopped (for good)."""
        self.restarts: list[tuple[float, str]] = []
        """(seconds on the system's clock, why) of the newest ends that a restart follows or followed, at most `KEPT_RESTARTS`."""
        self.restart_count = 0
        """How many there were in all."""
        self.ended_at: float | None = None
        """When its last life ended, seconds on the event loop's clock; None before."""

    @property
    def incarnation(self) -> int:
        return self.mailbox.incarnation

    def note_restart(self, at: float, why: str) -> None:
        """The node has ended, and a restart follows."""
        self.restart_count += 1
        self.restarts.append((at, why))
        del self.restarts[:-KEPT_RESTARTS]

    @property
    def load(self) -> Load:
        """How busy the node is: handler times, and how long what comes waits for its turn."""
        return self.mailbox.inbox.load


class System:
    """One running tree. Make it with `run(tree)`; everything in it lives in the event loop that made it.

    It has no public constructor: `run` gives one.
    """

    def __init__(
        self,
        *,
        seed: int = 0,
        sinks: tuple[LogSink, ...] = (structlog_sink,),
        level: int = INFO,
        make_graph: Callable[..., Graph] = Graph,
        options: RunOptions | None = None,
    ) -> None:
        self.loop = asyncio.get_running_loop()
        self.thread = get_ident()
        self.seed = seed
        self.level = level
        self.clock = Clock(self.loop, virtual=bool(getattr(self.loop, "virtual", False)))
        self.graph = make_graph(
            self.clock.now,
            open_standard_service=partial(standard.open_service, self),
            open_standard_topic=partial(standard.open_topic, self),
        )
        self.ticker = Ticker(self.loop)
        self.deadlines = Deadlines(self.loop)
        self.starts = StartWatch(self.loop, virtual=self.clock.virtual)
        self.rng = self.random("supervision")
        self.nodes: dict[tuple[str, ...], NodeState] = {}
        self.unsupervised = UnsupervisedNodes(self)
        self.reports: deque[Report] = deque(maxlen=10_000)
        self.dead_letters = 0
        """Messages that waited for a node's next life, which never came, or for a handler that it no longer has."""
        self.supervisor: RunningSupervisor | None = None
        self.stop_reason: str | None = None
        self.stalls: StallWatch | None = None
        """Who blocks the loop: watched on the real clock only."""
        self.failure: BaseException | None = None
        """What ended the tree by itself: `SupervisorGaveUp`, or None."""
        self.signal: signal.Signals | None = None
        """The signal that stopped the system, if one did."""
        self.exit_request: ProgramExit | None = None
        """`SystemExit` or `KeyboardInterrupt` out of a node's code, which stopped the system, if one did."""
        self.waiting = 0
        """How many tasks are in `wait()`."""
        self.records: deque[LogRecord] = deque(maxlen=1000)
        """The newest log lines."""
        self.rosout: LogSink | None = None
        self.on_parameters: Callable[[Core, ParameterChange], None] | None = None
        self._options = options
        self._sinks = sinks
        self._ids = self.random("ids")
        self._host: asyncio.Task[None] | None = None
        self._stopping = self._killed = False
        self._closed: asyncio.Future[None] = self.loop.create_future()
        self._on_end: list[Callable[[System], None]] = []
        self._on_report: list[Callable[[Report], None]] = []
        self._interrupted_at = 0.0
        self._names: dict[str, tuple[str, ...]] = {}
        self._from_threads: list[Callable[[], object]] = []
        self._threads_lock = Lock()
        self._threads: CapacityLimiter | None = None
        self._log_levels: dict[str, int] = {}
        self._errors: dict[tuple[type[BaseException], str], int] = {}
        self._last_error: BaseException | None = None
        self.log = self.node_log("system", 1)

    def __repr__(self) -> str:
        return f"<system of {len(self.nodes)} nodes, {self.clock!r}>"

    # -- life ---------------------------------------------------------------------------------------------------------------

    def open(self) -> None:
        """Let `open_node` find this system."""
        here = _systems.setdefault(self.loop, [])
        if self not in here:
            here.append(self)
            if not self.clock.virtual:
                preload(structlog=structlog_sink in self._sinks)
                self.stalls = StallWatch(self)
                self.stalls.start()

    async def start(self, tree: Supervisor | DynamicSupervisor) -> None:
        """Start the tree and return when all of it is ready.

        Raises `StartFailed` when a child cannot start, `NotRunning` when the system is stopped meanwhile; nothing runs then.
        """
        if self._host is not None:
            raise RuntimeError("this system runs a tree already: make another system")
        self.open()
        ready: asyncio.Future[None] = self.loop.create_future()
        self.supervisor = RunningSupervisor(tree, self, (tree.name,), killed=lambda: self._killed)
        life = self.supervisor.run(lambda: ready.set_result(None))
        self._host = self.loop.create_task(life, name=f"supervisor {tree.name}")
        self._host.add_done_callback(lambda host: self._next_end())
        self.starts.hold()
        try:
            await asyncio.wait([ready, self._host], return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            try:
                await self.stop("the start was canceled")
            finally:
                if self._host.done() and not self._host.cancelled():
                    self._host.exception()  # it had failed meanwhile, which the reports tell
            raise
        finally:
            self.starts.release()
        if not ready.done():
            await self.stop("the start failed")
            if not self._host.cancelled():
                await self._host
            raise NotRunning(f"{self!r} was stopped while it started: {self.stop_reason}")
        self._host.add_done_callback(self._tree_ended)

    async def wait(self) -> None:
        """Wait until the tree has ended. Raises `SupervisorGaveUp` when it ended because its restarts were used up."""
        if self._host is None:
            raise NotStarted("this system has not been started: use `async with run(tree) as system`")
        self.waiting += 1
        try:
            await asyncio.wait([self._host])
        finally:
            self.waiting -= 1
        if self.failure is not None:
            raise self.failure

    def on_end(self, callback: Callable[[System], None]) -> None:
        """Call `callback` once the tree has ended, however."""
        self._on_end.append(callback)

    def on_report(self, callback: Callable[[Report], None]) -> None:
        """Call `callback`, which must not raise, with every report of a supervisor, in order and before it is logged."""
        self._on_report.append(callback)

    def interrupt(self, number: signal.Signals) -> bool:
        """A signal's way in: the first one asks for the orderly end, a second one within 2 s kills. False when the tree has ended already."""
        if self._host is not None and self._host.done():
            return False
        now = self.loop.time()
        if self.signal is not None and now - self._interrupted_at < SECOND_SIGNAL_SECONDS:
            self.kill()
            return True
        self.signal = number
        self._interrupted_at = now
        self.stop_reason = number.name
        self.log.info("stopping", signal=number.name)
        if self.supervisor is not None:
            self.supervisor.stop(number.name)
        return True

    @property
    def argv(self) -> tuple[str, ...]:
        """What the `argv` of `run` holds for the program itself: all that is not for ROS, in order, without a program's name that it did not have."""
        return () if self._options is None else self._options.argv

    @property
    def exit_code(self) -> int:
        """What a program should exit with: 0, 3 after its supervisor gave up, 128 and the number of the signal, or what `sys.exit` was given."""
        if self.failure is not None:
            return 3
        if self.exit_request is not None:
            return self.exit_request.code
        return 0 if self.signal is None else 128 + self.signal

    async def stop(self, reason: str = "stop") -> None:
        """Stop everything, the newest first, each node within its stop timeout, and leave nothing behind. Stopping twice is fine.

        Never raises for what ended the tree; `wait` does. Canceling the caller does not cut it short, however often that happens: the
        cancellation is raised when everything has stopped. `kill` and a second signal cut it short.

        A node whose code asks for this is one of those that are stopped: its handlers and hooks ask, and do not wait, and its tasks are
        canceled while they wait.
        """
        if self.stop_reason is None:
            self.stop_reason = reason
        self._stopping = True
        self._next_end()
        core = self._asking()
        if core is None:
            await see_through(self._closed)
        elif core.inbox.task is asyncio.current_task():
            await asyncio.sleep(0)  # a start is broken off here, and not in its clean-up
        else:
            await asyncio.wait([self._closed])

    def _asking(self) -> Core | None:
        """The node whose own code is running, if it is one of ours."""
        task = asyncio.current_task()
        cores = (state.mailbox.core for state in self.nodes.values())
        return next(
            (core for core in cores if core is not None and (core.inbox.task is task or task in core.tasks)), None
        )

    def kill(self) -> None:
        """End everything at once: no node has time for a clean-up. Returns at once; `stop` waits until it has come to pass."""
        self.unsupervised.kill()
        if self._host is not None and self.supervisor is not None and not self._host.done():
            self._killed = True
            self._host.cancel()

    def _next_end(self) -> None:
        """The next step of an orderly end, each taken when the one before it is over: nodes beside the tree, the tree, the books."""
        if not self._stopping or self._closed.done() or self.unsupervised.end_last(self.stop_reason or ""):
            return
        if self._host is not None and self.supervisor is not None and not self._host.done():
            self.supervisor.stop(self.stop_reason or "")
        else:
            self._close()

    @property
    def running(self) -> bool:
        """Whether the tree runs."""
        return self._host is not None and not self._host.done()

    async def join(self, child: Child) -> NodeLife:
        """Run one more node beside the tree, not supervised by it, and return when it is ready. Raises what its start raises."""
        if asyncio.get_running_loop() is not self.loop:
            raise WrongThread(
                f"{self!r} runs in another event loop: use blocking.open_node(name, system=system) in this thread"
            )
        return await self.unsupervised.join(child)

    async def leave(self, life: NodeLife, reason: str = "left") -> None:
        """End a node that joined, within its stop timeout. Raises the error that ended it before, if one did."""
        await self.unsupervised.leave(life, reason)

    def failed_beside(self) -> list[tuple[Identity, BaseException]]:
        """The nodes beside the tree that failed and have not left yet, each with its error."""
        return self.unsupervised.failed()

    def _tree_ended(self, host: asyncio.Task[None]) -> None:
        if not host.cancelled():
            self.failure = host.exception()
        for callback in self._on_end:
            callback(self)

    def exits(self, request: ProgramExit) -> None:
        """Code of a node asks the program to exit: the tree, if there is one, stops in order, and the block of `run` raises it."""
        if self.supervisor is not None and self.exit_request is None:
            self.exit_request = request
            self.log.info("stopping", because=str(request))
            self.stop_reason = self.stop_reason or str(request)
            self.supervisor.stop(str(request))

    def guest_left(self) -> None:
        """A node beside the tree has ended and left the books."""
        if self._stopping:
            self._next_end()
        else:
            self.close_if_empty()

    def close_if_empty(self) -> None:
        """A system without a tree ends with the last node that joined it."""
        if self._host is None and not self.unsupervised:
            self.stop_reason = "its last node left"
            self._close()

    def _close(self) -> None:
        for state in self.nodes.values():
            self._dismiss(state)
        self.deadlines.close()
        self.starts.close()
        if self.stalls is not None:
            self.stalls.stop()
            self.stalls = None
        here = _systems.get(self.loop, [])
        if self in here:
            here.remove(self)
        if not here:
            _systems.pop(self.loop, None)
        self._closed.set_result(None)

    # -- what the supervisor asks -------------------------------------------------------------------------------------------

    def life(self, child: Child, path: tuple[str, ...], incarnation: int) -> NodeLife:
        """A new incarnation of `child`; the inbox and the waiting messages of the last one are handed over."""
        state = self.nodes.get(path)
        if state is None or state.child is not child or state.state == "stopped":
            identity = self._identity(child, path)
            if state is None:
                state = self.nodes[path] = NodeState(identity, Mailbox(self.loop))
                if self.stalls is not None:
                    state.mailbox.inbox.on_step = self.stalls.ran
            state.child, state.identity, state.state = child, identity, "starting"
        return NodeLife(self, child, state.identity, state.mailbox)

    def incarnation(self, core: Core) -> ChildTask | None:
        """An incarnation as its supervisor sees it; None when it has been given up, and its place may have been taken."""
        path = core.identity.path
        if core.ended:
            return None
        if path[0] == "guests":
            return self.unsupervised.incarnation(path)
        try:
            return self.supervisor.incarnation(path[1:]) if self.supervisor is not None else None
        except NotFound:
            return None

    def killed(self, core: Core) -> bool:
        """Whether no time is left for a clean-up."""
        incarnation = self.incarnation(core)
        return incarnation is None or incarnation.killed is not None

    def running_now(self, core: Core) -> None:
        """A node is ready."""
        self.starts.end(core)
        if core.ended:  # it had been given up, and its place may have been taken
            return
        state = self.nodes[core.identity.path]
        state.core = core
        state.node_class = type(core.node)
        state.state = "running"

    def stopping(self, core: Core) -> None:
        """A node has begun to clean up."""
        if not core.ended:
            self.nodes[core.identity.path].state = "stopping"

    def ended(self, core: Core) -> None:
        """An incarnation is over. The supervisor will say whether another one follows, unless everything ends."""
        self.starts.end(core)
        state = self.nodes[core.identity.path]
        state.core = None
        state.state = "restarting"
        state.ended_at = self.loop.time()
        if self.stop_reason is not None:
            self._dismiss(state)

    def answered(self, error: Exception) -> None:
        """An error left a service handler or an action body, and is the answer to whoever asked. Here, nobody else need know."""

    def gone(self, path: tuple[str, ...], kept: bool) -> None:
        """A node, or all nodes below a supervisor, have ended for good: they leave the graph, and calls to them fail at once.

        Of those that their supervisor has not `kept`, either, nothing is left but reports.
        """
        state = self.nodes.get(path)
        ended = (
            [state] if state is not None else [each for each in self.nodes.values() if each.path[: len(path)] == path]
        )
        for state in ended:
            self._dismiss(state)
            if not kept:
                state.mailbox.forget(state.identity.fqn)
                del self.nodes[state.path]

    def _dismiss(self, state: NodeState) -> None:
        if state.mailbox.core is not None:  # it refused to die; what it holds is taken from it
            state.mailbox.core.release()
        state.core = None
        state.state = "stopped"
        self.lost(state.identity.fqn, state.mailbox.close(state.identity.fqn))
        self._names.pop(state.identity.fqn, None)

    def lost(self, node: str, messages: int) -> None:
        """So many messages waited for a life or a handler of a node that there will not be: counted, and said unless everything ends."""
        self.dead_letters += messages
        if messages and self.stop_reason is None:
            self.log.info("dead letters", node_name=node, messages=messages)

    def report(self, report: Report) -> None:
        """Take notice of a supervisor's event: kept, and logged in words."""
        self.reports.append(report)
        for callback in self._on_report:
            callback(report)
        state = self.nodes.get(report.child.path)
        if report.context == "child_terminated" and state is not None:
            state.note_restart(self.clock.now(), str(report.reason))
        if report.context == "progress" and report.child.incarnation == 1 and self.level > DEBUG:
            return  # what every node says once, and hardly anybody hears
        level, event, fields = log_line(report, None if state is None else state.ended_at)
        if level < self.level:
            return
        error, times = None, 1
        cause = None if report.reason is None else cause_of(report.reason)
        if cause is not None and report.context != "shutdown":  # the line before has told of that one
            if place := place_of(cause):
                fields["at"] = place
            error, times = self.new_error(cause)
        supervisor = "/".join(report.supervisor)
        self._write(
            LogRecord(self.clock.now(), level, supervisor, report.child.incarnation, event, fields, error, times)
        )

    def new_error(self, error: BaseException) -> tuple[BaseException | None, int]:
        """The error for a log line, None if the line before told of it; and the how-manieth of its kind, type and place, it is."""
        if error is self._last_error:
            return None, 1
        self._last_error = error
        kind = (type(error), place_of(error))
        self._errors[kind] = times = self._errors.get(kind, 0) + 1
        return error, times

    def snapshot(self) -> Snapshot:
        """The graph at this instant, as a value: see `actors.graph.snapshot`."""
        from actors.graph.snapshot import take

        return take(self.clock.now(), self.nodes.values(), self.graph)

    # -- what nodes ask -----------------------------------------------------------------------------------------------------

    def node_log(self, node: str, incarnation: int, throttle_clock: NanosecondClock | None = None) -> NodeLog:
        """The log of one life of a node, with the level that was last set for it."""
        return NodeLog(
            node,
            incarnation,
            self.clock,
            self._write,
            self.level if self._options is None else self._options.level(node),
            levels=self._log_levels,
            throttle_clock=throttle_clock,
        )

    def random(self, key: str) -> Random:
        """Random numbers for `key`: the same for the same seed, whatever else the run does."""
        return Random(f"{self.seed}/{key}")

    def new_id(self) -> bytes:
        """A fresh 16-byte id in the form of a random UUID, from the system's seed."""
        raw = bytearray(self._ids.randbytes(16))
        raw[6] = raw[6] & 0x0F | 0x40
        raw[8] = raw[8] & 0x3F | 0x80
        return bytes(raw)

    def threadsafe(self, function: Callable[[], object]) -> None:
        """From any thread: call `function`, which must not raise, in the loop. One wake-up serves all that is waiting."""
        with self._threads_lock:
            self._from_threads.append(function)
            first = len(self._from_threads) == 1
        if first:
            self.loop.call_soon_threadsafe(self._drain_threads)

    def _drain_threads(self) -> None:
        with self._threads_lock:
            waiting, self._from_threads = self._from_threads, []
        for function in waiting:
            function()

    async def offload(
        self, function: Callable[..., Any], arguments: tuple[Any, ...], takes: float, *, thread: bool
    ) -> Any:
        """See `Node.offload`."""
        if self.clock.virtual:
            result = function(*arguments)
            await self.clock.sleep(takes)
            return result
        if thread:
            from anyio import CapacityLimiter, to_thread

            if self._threads is None:
                self._threads = CapacityLimiter(os.cpu_count() or 2)
            return await to_thread.run_sync(function, *arguments, abandon_on_cancel=False, limiter=self._threads)
        from anyio import to_process

        return await to_process.run_sync(function, *arguments, cancellable=True)

    def add_sink(self, sink: LogSink) -> None:
        """Send log records to `sink`, too."""
        self._sinks = (*self._sinks, sink)

    def core_of(self, fqn: str) -> Core | None:
        """The present incarnation of the node with this full name, or None."""
        path = self._names.get(fqn)
        return self.nodes[path].core if path is not None and path in self.nodes else None

    def _write(self, record: LogRecord) -> None:
        self.records.append(record)
        if self.rosout is not None:
            self.rosout(record)
        for sink in self._sinks:
            try:
                sink(record)
            except Exception as error:  # a pipe that broke, a disk that is full: no reason for a robot to fall over
                message = f"the log sink {getattr(sink, '__qualname__', sink)} failed; the line is lost: {record!r}"
                self.loop.call_exception_handler({"message": message, "exception": error})
        record.let_go()

    def _identity(self, child: Child, path: tuple[str, ...]) -> Identity:
        identity = identity_of(child, path, self._options)
        other = self._names.get(identity.fqn)
        if other is not None and other != path:
            raise DeclarationError(
                f"{'/'.join(path)} would be the second node named {identity.fqn}, the first being {'/'.join(other)}: "
                "give it another name= or namespace="
            )
        old = self.nodes.get(path)
        if old is not None and self._names.get(old.identity.fqn) == path:
            del self._names[old.identity.fqn]
        self._names[identity.fqn] = path
        return identity


_systems: dict[asyncio.AbstractEventLoop, list[System]] = {}


def system_here() -> System | None:
    """The newest system that runs in this event loop, or None."""
    systems = _systems.get(asyncio.get_running_loop())
    return systems[-1] if systems else None
