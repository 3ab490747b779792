"""`ChildProcesses`: the children of one system that run in processes of their own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, cast

from msgspec import structs

from actors.errors import DeclarationError, ProcessDied, described
from actors.processes.life import Launch, Process, ProcessLife
from actors.processes.messages import MOST_BEAT_SECONDS, CrashAsked, Event, Opaque, Order, Request
from actors.processes.parent import ParentSide
from actors.processes.pickling import pack, unpack
from actors.processes.rendezvous import Rendezvous

if TYPE_CHECKING:
    from actors.processes.child_tree import ChildTree
    from actors.processes.flight_records import Recorder
    from actors.processes.os_process import Started
    from actors.processes.prefork import PreforkPool
    from actors.runtime.runtime import Runtime
    from actors.supervision.child_task import ChildTask
    from actors.transport.protocol import Transport
    from actors.transport.simulated.session import SimulatedTransport


class ChildProcesses:
    """The source of lives in processes of their own, of one system (`runtime.OtherProcesses`), and those that run. `elsewhere` launches those
    on other machines.

    Invariants: `running` has each process that runs, by the path of its child. `_prefork` is None until a process of this machine is launched.
    """

    def __init__(
        self,
        runtime: Runtime,
        transport: Transport | None = None,
        recorders: tuple[Callable[[], Recorder], ...] = (),
        elsewhere: Launch | None = None,
    ) -> None:
        self._runtime = runtime
        self._elsewhere = elsewhere
        self._recorders = recorders
        self._rendezvous = Rendezvous(runtime, transport)
        self._prefork: PreforkPool | None = None
        self.running: dict[tuple[str, ...], Process] = {}

    def life(self, task: ChildTask) -> ProcessLife:
        """Make a new life of a child. Raises what `Directory.enter` raises."""
        parent = ParentSide(self._runtime, self._rendezvous, task, partial(self._running, task.ref.path))
        return ProcessLife(parent, self._launch)

    def crash(self, path: tuple[str, ...], error: Exception) -> None:
        """Make the node at this path fail with `error`."""
        if (process := self._process_of(path)) is not None:
            process.send(CrashAsked(path, error))

    def kill(self, path: tuple[str, ...]) -> None:
        """Kill the process in which the node at this path runs."""
        if (process := self._process_of(path)) is not None:
            process.kill()

    def _process_of(self, path: tuple[str, ...]) -> Process | None:
        """The process, of those that this one has launched, in which the node at this path runs, or in one of whose processes it does."""
        return next((process for top, process in self.running.items() if path[: len(top)] == top), None)

    def _running(self, path: tuple[str, ...], process: Process, runs: bool) -> None:
        if runs:
            self.running[path] = process
        else:
            del self.running[path]

    async def _launch(self, order: Order, take: Callable[[Event], None]) -> Process:
        order = structs.replace(order, recorders=self._recorders)
        if order.spec.hosts:
            if self._elsewhere is None:
                raise DeclarationError(f"{order.spec!r}: say where its hosts are: run(tree, hosts=..., transport=...)")
            return await self._elsewhere(order, take)
        await self._rendezvous.open()
        if self._runtime.clock.virtual:
            return await simulate(order, take)
        from actors.processes.os_process import spawn

        return await spawn(order, take, await self._started_ahead(order))

    async def _started_ahead(self, order: Order) -> Started | None:
        """The process that waits for this order, if one does. With the first order those of the rest of the tree are started."""
        if self._prefork is None:
            from actors.processes.prefork import PreforkPool

            supervisor = self._runtime.tree.supervisor
            assert supervisor is not None
            self._prefork = PreforkPool(supervisor.spec, supervisor.path, order)
            self._runtime.observers.closing.append(self._prefork.close)
        return await self._prefork.take(order)


async def simulate(order: Order, take: Callable[[Event], None]) -> SimulatedProcess:
    """Launch a simulated process for `order`; `take` gets what it tells. Its declaration is copied, as that of a real one is.

    On another machine it tells of its nodes as often as a real one does: that may end without a last word. Otherwise, when something changes.
    """
    from actors.processes.child_tree import ChildTree

    transport = cast("SimulatedTransport", order.transport())
    copied = structs.replace(order, spec=unpack(pack(order.spec)))

    def host(tell: Callable[[Event], None]) -> ChildTree:
        return ChildTree(copied, transport, tell, lambda runtime: ChildProcesses(runtime, transport, order.recorders))

    process = SimulatedProcess(transport.process, host, take, transport.crash)
    if order.placement.away:
        _beat(process)
    return process


def _beat(process: SimulatedProcess) -> None:
    if not process.ended.done():
        process.hosted.tell_nodes()
        asyncio.get_running_loop().call_later(MOST_BEAT_SECONDS, _beat, process)


class SimulatedProcess:
    """A process that is no process (`life.Process`). `host` makes what runs in it, with the function that tells events; `crash` is called
    when it is killed.

    Invariants: events and the end come to the parent in later turns of the loop, in order. A process that was killed tells nothing more.
    """

    def __init__(
        self,
        number: int,
        host: Callable[[Callable[[Event], None]], ChildTree],
        take: Callable[[Event], None],
        crash: Callable[[], None],
    ) -> None:
        self._loop = loop = asyncio.get_running_loop()
        self._number = number
        self._take = take
        self._crash = crash
        self._killed = False
        self.ended: asyncio.Future[Exception] = loop.create_future()
        self.hosted = host(self._tell)
        self._task = loop.create_task(self.hosted.run(), name=f"simulated process {number}")
        self._task.add_done_callback(lambda task: loop.call_soon(self.ended.set_result, self._end()))

    @property
    def id(self) -> int:
        return self._number

    def send(self, request: Request | Opaque) -> None:
        """Send a request; it is lost if the process has ended."""
        self._loop.call_soon(self._receive, request)

    def watch(self) -> None:
        """Nothing: a loop that all processes share cannot hang in one of them."""

    def unwatch(self) -> None:
        """Nothing."""

    def terminate(self) -> None:
        """Ask for its end, unless it has ended."""
        if not self._task.done():
            self.hosted.terminate()

    def kill(self) -> None:
        """Send SIGKILL, unless the process has ended."""
        if not self._task.done() and not self._killed:
            self.hosted.kill()
            self._killed = True
            self._crash()

    def _receive(self, request: Request | Opaque) -> None:
        if not self._task.done():
            self.hosted.take(unpack(request.data) if isinstance(request, Opaque) else request)

    def _tell(self, event: Event) -> None:
        if not self._killed:
            self._loop.call_soon(self._take, event)

    def _end(self) -> Exception:
        if self._killed:
            return ProcessDied(self._number, "signal SIGKILL")
        error = None if self._task.cancelled() else self._task.exception()
        return ProcessDied(self._number, "exit code 0" if error is None else f"exit code 1: {described(error)}")
