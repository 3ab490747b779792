"""`ApplicationMaster`: the start of a system, that is of its tree and of the supervisor of the nodes beside it, and their orderly end."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from actors.checks import NoPublicConstructor
from actors.errors import NotRunning, NotStarted
from actors.runtime.joined import JoinedNodes
from actors.runtime.tree import Top
from actors.shield import see_through

if TYPE_CHECKING:
    from actors.runtime.runtime import Runtime
    from actors.supervision import peers
    from actors.supervision.declarations import DynamicSupervisor, Supervisor


class ApplicationMaster(metaclass=NoPublicConstructor):
    """Starts and ends one system, as an application master of OTP: it runs two supervisors, those of the tree and of the nodes beside it,
    restarts neither, and stops them in reverse order.

    It has no public constructor: each `System` has one.

    Invariants:

    - A tree is started at most once.
    - An orderly end has these steps: end the nodes beside the tree, the newest first, one after another; end the tree; close the system,
      once; close what was opened beside the start; let `stop` return. The end of each step triggers the next one. No task waits for a
      step, so no cancellation can skip one.
    """

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime
        self._tree = runtime.tree
        self._loop = runtime.loop
        self.joined = JoinedNodes(runtime, self)
        self._stopping = False
        self._closed: asyncio.Future[None] = self._loop.create_future()
        self._leaving: asyncio.Task[None] | None = None

    # -- the start ----------------------------------------------------------------------------------------------------------

    async def start(self, tree: Supervisor | DynamicSupervisor, path: tuple[str, ...]) -> None:
        """See `System.start`."""
        self.joined.begin()
        self._tree.root = top = self.begin(tree, self._runtime, path)
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
            raise NotRunning(f"{self._runtime!r} was stopped while it started: {self._tree.stop_reason}")
        top.task.add_done_callback(self._tree_ended)

    def begin(self, spec: Supervisor | DynamicSupervisor, runtime: peers.Runtime, path: tuple[str, ...]) -> Top:
        """Begin to run a supervisor at the top of the system."""
        top = Top(spec, runtime, path, self._loop)
        top.task.add_done_callback(lambda _: self._next_end())
        return top

    async def wait(self) -> None:
        """See `System.wait`."""
        if self._tree.root is None:
            raise NotStarted("this system has not been started: use `async with run(tree) as system`")
        self._tree.waiting += 1
        try:
            await asyncio.wait([self._tree.root.task])
        finally:
            self._tree.waiting -= 1
        if self._tree.failure is not None:
            raise self._tree.failure

    def _tree_ended(self, host: asyncio.Task[None]) -> None:
        if not host.cancelled():
            self._tree.failure = host.exception()
        for observer in self._runtime.observers.tree_ended:
            observer()

    # -- the end ------------------------------------------------------------------------------------------------------------

    async def stop(self, reason: str) -> None:
        """See `System.stop`."""
        if self._tree.stop_reason is None:
            self._tree.stop_reason = reason
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

    def close_if_empty(self) -> None:
        """End a system without a tree when its last node has left."""
        if self._tree.root is None and not self.joined and not self._stopping:
            self._tree.stop_reason = "its last node left"
            self._stopping = True
            self._next_end()

    def _next_end(self) -> None:
        """Take the next step of an orderly end: the nodes beside the tree, then the tree, then the system. Called at the end of each step."""
        if not self._stopping or self._closed.done():
            return
        for top in self._tree.tops:
            if not top.task.done():
                top.supervisor.stop(self._tree.stop_reason or "")
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
