"""The running tree of a system and the supervisor of the nodes beside it: their start, and their orderly end."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Iterator
from typing import TYPE_CHECKING

from actors.checks import create
from actors.errors import NotRunning, NotStarted, ProgramExit
from actors.runtime.joined import JoinedNodes
from actors.shield import see_through
from actors.supervision.errors import NotFound
from actors.supervision.running import RunningSupervisor

if TYPE_CHECKING:
    from actors.runtime.runtime import Runtime
    from actors.supervision.child_task import ChildTask
    from actors.supervision.declarations import DynamicSupervisor, Supervisor
    from actors.supervision.refs import ChildState

SECOND_SIGNAL_SECONDS = 2.0
"""A second signal within this time, in seconds, kills what is still stopping."""


class Top:
    """One of the supervisors at the top of a system, and the task that runs it."""

    __slots__ = ("_ready", "killed", "supervisor", "task")

    def __init__(
        self,
        spec: Supervisor | DynamicSupervisor,
        runtime: peers.Runtime,
        path: tuple[str, ...],
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        self.killed = False
        self._ready: asyncio.Future[None] = loop.create_future()
        self.supervisor = create(RunningSupervisor, spec, runtime, path, killed=lambda: self.killed)
        life = self.supervisor.run(lambda: self._ready.set_result(None))
        self.task: asyncio.Task[None] = loop.create_task(life, name=f"supervisor {spec.name}")

    async def started(self) -> bool:
        """Wait until all children are ready; False if the supervisor has ended before."""
        if not self._ready.done():
            await asyncio.wait([self._ready, self.task], return_when=asyncio.FIRST_COMPLETED)
        return self._ready.done()

    def kill(self) -> bool:
        """Kill all children at once. False if they have ended already."""
        if self.task.done():
            return False
        self.killed = True
        return self.task.cancel()


class RunningTree:
    """The root of one system, as an application master of OTP: it runs two supervisors, those of the tree and of the nodes beside it,
    restarts neither, and stops them in reverse order.

    Invariants:

    - A tree is started at most once. Before, `_top` is None.
    - `stop_reason` is set as soon as the system is to stop, and never cleared. From then on no node joins, and callers are answered with
      `NotRunning`, not with `NodeRestarting`.
    - An orderly end has these steps: end the nodes beside the tree, the newest first, one after another; end the tree; close the system,
      once; close what was opened beside the start; let `stop` return. The end of each step triggers the next one. No task waits for a
      step, so no cancellation can skip one.
    - `failure` and `exit_request` are set at most once each.
    """

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime
        self._loop = runtime.loop
        self.joined = JoinedNodes(runtime)
        self.stop_reason: str | None = None
        self.failure: BaseException | None = None
        """The error that ended the tree, or None."""
        self.signal: signal.Signals | None = None
        """The signal that stopped the system, or None."""
        self.exit_request: ProgramExit | None = None
        """The `SystemExit` or `KeyboardInterrupt` out of a node's code that stopped the system, or None."""
        self.waiting = 0
        """How many tasks wait in `wait()`."""
        self._top: Top | None = None
        self._stopping = False
        self._closed: asyncio.Future[None] = self._loop.create_future()
        self._leaving: asyncio.Task[None] | None = None
        self._interrupted_at = 0.0

    def __repr__(self) -> str:
        return f"<system of {len(self._runtime.directory.records)} nodes, {self._runtime.clock!r}>"

    # -- the start ----------------------------------------------------------------------------------------------------------

    async def start(self, tree: Supervisor | DynamicSupervisor, path: tuple[str, ...]) -> None:
        """See `System.start`."""
        self.joined.begin()
        self._top = top = self.begin(tree, self._runtime, path)
        self._runtime.starts.hold()
        try:
            if started := await top.started():
                await self._runtime.opened()
        except asyncio.CancelledError:
            try:
                await self.stop("the start was canceled")
            finally:
                if top.task.done() and not top.task.cancelled():
                    top.task.exception()  # its failure is in the reports; mark it as retrieved
            raise
        finally:
            self._runtime.starts.release()
        if not started:
            await self.stop("the start failed")
            if not top.task.cancelled():
                await top.task
            raise NotRunning(f"{self!r} was stopped while it started: {self.stop_reason}")
        top.task.add_done_callback(self._tree_ended)

    def begin(self, spec: Supervisor | DynamicSupervisor, runtime: peers.Runtime, path: tuple[str, ...]) -> Top:
        """Begin to run a supervisor at the top of the system."""
        top = Top(spec, runtime, path, self._loop)
        top.task.add_done_callback(lambda _: self._next_end())
        return top

    @property
    def _tops(self) -> list[Top]:
        """What is to end, in this order: the supervisor of the nodes beside the tree, and the tree."""
        return [top for top in (self.joined.top, self._top) if top is not None]

    @property
    def supervisor(self) -> RunningSupervisor | None:
        """The supervisor at the root of the tree; None before its start."""
        return None if self._top is None else self._top.supervisor

    @property
    def killed(self) -> bool:
        """Whether the tree was killed."""
        return self._top is not None and self._top.killed

    @property
    def running(self) -> bool:
        """Whether the tree runs."""
        return self._top is not None and not self._top.task.done()

    async def wait(self) -> None:
        """See `System.wait`."""
        if self._top is None:
            raise NotStarted("this system has not been started: use `async with run(tree) as system`")
        self.waiting += 1
        try:
            await asyncio.wait([self._top.task])
        finally:
            self.waiting -= 1
        if self.failure is not None:
            raise self.failure

    def _tree_ended(self, host: asyncio.Task[None]) -> None:
        if not host.cancelled():
            self.failure = host.exception()
        for observer in self._runtime.observers.tree_ended:
            observer()

    # -- the end ------------------------------------------------------------------------------------------------------------

    async def stop(self, reason: str) -> None:
        """See `System.stop`."""
        if self.stop_reason is None:
            self.stop_reason = reason
        self._stopping = True
        self._next_end()
        current = asyncio.current_task()
        asking = self._runtime.directory.owner_of(current) if current is not None else None
        if asking is None or asking.life is None:
            await see_through(self._closed)
        elif asking.inbox.task is current:
            # The node's main task must not wait for its own end. A start phase is canceled at this await.
            await asyncio.sleep(0)
        else:
            await asyncio.wait([self._closed])

    def kill(self) -> None:
        """See `System.kill`."""
        for top in self._tops:
            top.kill()

    def interrupt(self, number: signal.Signals) -> bool:
        """Handle a signal: the first one stops the tree in order, a second one within 2 s kills. False if the tree has ended already."""
        if self._top is not None and self._top.task.done():
            return False
        now = self._loop.time()
        if self.signal is not None and now - self._interrupted_at < SECOND_SIGNAL_SECONDS:
            self.kill()
            return True
        self.signal = number
        self._interrupted_at = now
        self.stop_reason = number.name
        self._runtime.log.info("stopping", signal=number.name)
        if self.supervisor is not None:
            self.supervisor.stop(number.name)
        return True

    def note_signal(self, number: signal.Signals) -> None:
        """Note the signal that ends the program after the tree has ended; the first signal counts."""
        self.signal = self.signal or number

    def exits(self, request: ProgramExit) -> None:
        """Stop the tree in order because a node's code asks the program to exit; the block of `run` raises `request.error`."""
        if self.supervisor is not None and self.exit_request is None:
            self.exit_request = request
            self._runtime.log.info("stopping", because=str(request))
            self.stop_reason = self.stop_reason or str(request)
            self.supervisor.stop(str(request))

    @property
    def exit_code(self) -> int:
        """See `System.exit_code`."""
        if self.failure is not None:
            return 3
        if self.exit_request is not None:
            return self.exit_request.code
        return 0 if self.signal is None else 128 + self.signal

    def close_if_empty(self) -> None:
        """End a system without a tree when its last node has left."""
        if self._top is None and not self.joined and not self._stopping:
            self.stop_reason = "its last node left"
            self._stopping = True
            self._next_end()

    def _next_end(self) -> None:
        """Take the next step of an orderly end: the nodes beside the tree, then the tree, then the system. Called at the end of each step."""
        if not self._stopping or self._closed.done():
            return
        for top in self._tops:
            if not top.task.done():
                top.supervisor.stop(self.stop_reason or "")
                return
        self._close()

    def _close(self) -> None:
        """Close the system, and then what was opened beside its start, in a task of its own. Calling it twice is harmless."""
        if self._leaving is not None:
            return
        self._runtime.close()
        if self._runtime.observers.closing:
            self._leaving = self._loop.create_task(self._runtime.leave(), name="end of the system")
            self._leaving.add_done_callback(lambda _: self._closed.set_result(None))
        else:
            self._closed.set_result(None)

    # -- the states of nodes ------------------------------------------------------------------------------------------------

    def state_of(self, path: tuple[str, ...]) -> ChildState:
        """The state of the node at `path`; "stopped" when there is none."""
        supervisor = self._above(path)
        return "stopped" if supervisor is None else supervisor.state_of(path[len(supervisor.path) :])

    def child_at(self, path: tuple[str, ...]) -> ChildTask | None:
        """The task of the present life of the node at `path`; None between lives, and for an unknown node."""
        supervisor = self._above(path)
        try:
            return None if supervisor is None else supervisor.incarnation(path[len(supervisor.path) :])
        except NotFound:
            return None

    def holds(self, path: tuple[str, ...]) -> bool:
        """Whether the node at `path` belongs to the tree; False for a node beside it."""
        return self._top is not None and self._above(path) is self._top.supervisor

    def _above(self, path: tuple[str, ...]) -> RunningSupervisor | None:
        """The supervisor at the top that has the node at `path` below it."""
        for top in self._tops:
            if path[: len(top.supervisor.path)] == top.supervisor.path:
                return top.supervisor
        return None

    def supervisors(self) -> Iterator[RunningSupervisor]:
        """All supervisors that run, that of the nodes beside the tree included."""
        for top in self._tops:
            yield from top.supervisor.below()
