"""`RemoteProcess`: a process on another machine, or the search for a machine that takes it, as the life of its child sees it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from actors.errors import ProcessDied
from actors.hosts.messages import ProcessRequest, Signaled, Watched
from actors.processes.messages import Event, Order, Over, Request, StopAsked
from actors.processes.pickling import pack
from actors.supervision.reasons import Stopped


class Place:
    """A process at an agent, or the way to it."""

    def __init__(self, number: int, send: Callable[[object], None]) -> None:
        self._number = number
        self._send = send

    def send(self, request: Request) -> None:
        self._send(ProcessRequest(self._number, pack(request)))

    def watch(self, on: bool) -> None:
        self._send(Watched(self._number, on))

    def signal(self, kill: bool) -> None:
        self._send(Signaled(self._number, kill))


class RemoteProcess:
    """A process on another machine (`life.Process`). It begins without one: `place` gives it one.

    Invariants:

    - `ended` is done once the process has ended for certain: its agent has said so, or must have killed it, or there was none.
    - What is asked before it has a place is done at once: a process that was not launched is stopped, and killed, by not launching it.
    """

    def __init__(self, order: Order, take: Callable[[Event], None]) -> None:
        self.order = order
        self.take = take
        self.id = 0
        """Its id on its machine; 0 before it runs."""
        self.ended: asyncio.Future[Exception] = asyncio.get_running_loop().create_future()
        self._there: Place | None = None

    def __repr__(self) -> str:
        return f"<remote process {self.id} of {'/'.join(self.order.path)}>"

    def place(self, there: Place) -> None:
        """An agent has been told to launch it."""
        self._there = there

    def end(self, how: Exception) -> None:
        """It has ended. Further calls have no effect."""
        if not self.ended.done():
            self.ended.set_result(how)

    def send(self, request: Request) -> None:
        """Send a request; it is lost if the process has ended."""
        if self._there is not None:
            self._there.send(request)
        elif isinstance(request, StopAsked) and not self.ended.done():
            self.take(Over(Stopped(request.reason)))
            self._never()

    def watch(self) -> None:
        """From now on have the process killed when its event loop hangs."""
        if self._there is not None:
            self._there.watch(True)

    def unwatch(self) -> None:
        """Do so no more."""
        if self._there is not None:
            self._there.watch(False)

    def terminate(self) -> None:
        """Have its end asked for."""
        self._signal(False)

    def kill(self) -> None:
        """Have SIGKILL sent to it."""
        self._signal(True)

    def _signal(self, kill: bool) -> None:
        if self._there is not None:
            self._there.signal(kill)
        else:
            self._never()

    def _never(self) -> None:
        self.end(ProcessDied(0, "no machine had taken it yet"))
