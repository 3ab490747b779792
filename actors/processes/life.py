"""`ProcessLife`: the life of a child that runs in another process, as its supervisor sees it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from typing import Any, Final, Protocol

from actors.processes.messages import Event, Order, Over, Ready, Request, StopAsked
from actors.processes.parent import ParentSide
from actors.supervision.reasons import Failed, Killed, Leaked, Skip, Stop, Stopped
from actors.supervision.refs import ChildState

TERMINATION_SECONDS: Final = 0.3
"""Seconds between `terminate` and SIGKILL for a process that has not stopped in its time."""
UNMET_STOP_SECONDS: Final = 5.0
"""Seconds that a process whose nodes are not reached may take to stop; then it is killed."""
LAST_SECONDS: Final = 1.0
"""Seconds that a process may take to exit after its child has ended; then it is killed."""


class Process(Protocol):
    """A process that has been launched. `ended` is done when it is over and all that it told has been taken; its result says how it ended."""

    ended: asyncio.Future[Exception]

    @property
    def id(self) -> int: ...

    def send(self, request: Request, /) -> None:
        """Send a request; it is lost if the process has ended."""
        ...

    def watch(self) -> None:
        """From now on kill the process when its event loop hangs."""
        ...

    def unwatch(self) -> None:
        """Do so no more: it ends, which has a time limit of its own."""
        ...

    def terminate(self) -> None:
        """Ask the process for its end; if it ends already, for one without a clean-up."""
        ...

    def kill(self) -> None:
        """End the process by SIGKILL."""
        ...


Launch = Callable[[Order, Callable[[Event], None]], Awaitable[Process]]
"""Launches a process with an order; it calls the function with all that the process tells."""


class ProcessLife:
    """One life of a child in a process of its own. For its supervisor it is a `Life`, and a `Subtree`.

    Invariants:

    - At most one process is launched. `run` does not return before it has ended, so there is one incarnation at a time.
    - `_over` is done when the process has told how its child has ended. If the process ends without, its life has failed.
    - `_unmet` is the error for which a process was stopped whose nodes are not reached.
    - `_asked` is the reason for which the end was asked for; None before. `_doomed` is set once the process is to be killed.
    """

    def __init__(self, parent: ParentSide, launch: Launch) -> None:
        self._parent = parent
        self._launch = launch
        self._loop = asyncio.get_running_loop()
        self._process: Process | None = None
        self._ready: asyncio.Future[None] = self._loop.create_future()
        self._over: asyncio.Future[Over] = self._loop.create_future()
        self._asked: str | None = None
        self._doomed = False
        self._unmet: BaseException | None = None

    async def run(self, started: Callable[[], None]) -> None:
        """Run the process until it has ended. Returns after an orderly end that was asked for, and raises what ended the child otherwise."""
        work = self._loop.create_task(self._work(started), name=f"process of {asyncio.current_task()}")
        canceled: asyncio.CancelledError | None = None
        while not work.done():
            try:
                await asyncio.wait([work])
            except asyncio.CancelledError as error:
                if self._parent.killed():
                    canceled = error
                    self._put_down()
                elif self._asked is None:  # by somebody other than the supervisor: end in order, as a node does
                    canceled = error
                    self._parent.bound()
                    self.stop("its task was canceled by somebody else")
        died = work.result()
        if canceled is not None:
            raise canceled
        self._raise_end(died)

    def stop(self, reason: str) -> None:
        """Ask for an orderly end."""
        self._asked = reason
        if self._process is not None:
            self._process.unwatch()
            self._process.send(StopAsked(reason))

    def state_of(self, path: Sequence[str]) -> ChildState:
        """The state of a descendant of the child, as far as the process has told it."""
        return self._parent.state_of(path)

    async def _work(self, started: Callable[[], None]) -> Exception:
        """Launch the process and wait for its end, which is returned."""
        process = self._process = await self._launch(self._parent.order(), self._take)
        self._parent.begin(process)
        if self._asked is not None:
            process.send(StopAsked(self._asked))
        if self._doomed:
            process.kill()
        await _first_of(self._ready, self._over, process.ended)
        if self._ready.done():
            known = self._loop.create_task(self._parent.known())
            await _first_of(known, self._over, process.ended)
            if known.done() and (error := known.exception()) is not None:
                self._unmet = error
                process.send(StopAsked(str(error)))
                self._loop.call_later(UNMET_STOP_SECONDS, process.kill)
            else:
                known.cancel()
                if self._asked is None:
                    process.watch()
                started()
        await _first_of(self._over, process.ended)
        process.unwatch()
        late = self._loop.call_later(LAST_SECONDS, process.kill)
        await _first_of(process.ended)
        late.cancel()
        self._parent.end()
        return process.ended.result()

    def _take(self, event: Event) -> None:
        if isinstance(event, Ready):
            self._ready.set_result(None)
        elif isinstance(event, Over):
            self._over.set_result(event)
        else:
            self._parent.take(event)

    def _put_down(self) -> None:
        """End the process: by SIGKILL, but after an orderly end that took too long first by `terminate`."""
        self._doomed = True
        process = self._process
        if process is None:
            return
        if self._asked is None:
            process.kill()
        else:
            process.terminate()
            late = self._loop.call_later(TERMINATION_SECONDS, process.kill)
            process.ended.add_done_callback(lambda _: late.cancel())

    def _raise_end(self, died: Exception) -> None:
        """Raise what ended the child, so that its supervisor judges this life as it would judge it in this process."""
        if self._unmet is not None:
            raise self._unmet.with_traceback(None)
        if not self._over.done():
            raise died
        over = self._over.result()
        if over.exit is not None:
            request = self._parent.exits(over.exit)
            raise request from request.error
        reason = over.reason
        if isinstance(reason, Failed):
            raise reason.error
        if isinstance(reason, (Killed, Leaked)):
            if reason.after is not None:
                self._parent.kill(reason.after)
            raise asyncio.CancelledError
        if isinstance(reason, Stopped):
            if reason.cause is not None:
                raise reason.cause
            if self._asked is None:
                raise Skip(reason.why) if over.declined else Stop(reason.why)


async def _first_of(*futures: asyncio.Future[Any]) -> None:
    """Wait until one of these is done; unlike an await, it neither raises its error nor cancels it."""
    await asyncio.wait(futures, return_when=asyncio.FIRST_COMPLETED)
