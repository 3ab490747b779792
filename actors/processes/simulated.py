"""`SimulatedProcess`: a process on the virtual loop of its parent, with a system and a transport of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar, cast

from msgspec import structs

from actors.errors import ProcessDied, described
from actors.processes.messages import MOST_BEAT_SECONDS, Event, Opaque, Order, Request
from actors.processes.pickling import pack, unpack

if TYPE_CHECKING:
    from actors.processes.child_tree import ChildTree
    from actors.transport.simulated.session import SimulatedTransport


class Hosted(Protocol):
    """What runs in a process."""

    async def run(self) -> None:
        """Run to the end, and tell it."""
        ...

    def take(self, request: Request, /) -> None: ...

    def terminate(self) -> None:
        """Do what `Process.terminate` asks for."""
        ...

    def kill(self) -> None:
        """End without a clean-up."""
        ...


H = TypeVar("H", bound=Hosted)


async def simulate(order: Order, take: Callable[[Event], None]) -> SimulatedProcess[ChildTree]:
    """Launch a simulated process for `order`; `take` gets what it tells. Its declaration is copied, as that of a real one is.

    On another machine it tells of its nodes as often as a real one does: that may end without a last word. Otherwise, when something changes.
    """
    from actors.processes.child_processes import ChildProcesses
    from actors.processes.child_tree import ChildTree

    transport = cast("SimulatedTransport", order.transport())
    copied = structs.replace(order, spec=unpack(pack(order.spec)))

    def host(tell: Callable[[Event], None]) -> ChildTree:
        return ChildTree(copied, transport, tell, lambda runtime: ChildProcesses(runtime, transport, order.recorders))

    process = SimulatedProcess(transport.process, host, take, transport.crash)
    if order.placement.away:
        _beat(process)
    return process


def _beat(process: SimulatedProcess[ChildTree]) -> None:
    if not process.ended.done():
        process.hosted.tell_nodes()
        asyncio.get_running_loop().call_later(MOST_BEAT_SECONDS, _beat, process)


class SimulatedProcess(Generic[H]):
    """A process that is no process (`life.Process`). `host` makes what runs in it, with the function that tells events; `crash` is called
    when it is killed.

    Invariants: events and the end come to the parent in later turns of the loop, in order. A process that was killed tells nothing more.
    """

    def __init__(
        self,
        number: int,
        host: Callable[[Callable[[Event], None]], H],
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
