"""`SimulatedProcess`: a process on the virtual loop of its parent, with a system and a transport of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from actors.errors import ProcessDied, described
from actors.processes.messages import Event, Opaque, Request
from actors.processes.pickling import unpack

if TYPE_CHECKING:
    from actors.processes.child_tree import ChildTree


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
