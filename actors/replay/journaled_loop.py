"""The event loop of journaled nodes: their callbacks, tasks, clock readings and threads are noticed there."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from contextvars import Context
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING, Any, TypeVar, TypeVarTuple, cast

from actors.inbox.boundary import BOUNDARY, outside
from actors.replay.errors import ReplayError
from actors.time.lockstep import extend
from actors.waiting import wake

if TYPE_CHECKING:
    from actors.replay.boundary import JournalBoundary

    _Loop = asyncio.BaseEventLoop
else:
    _Loop = object

Callback = Callable[..., object]

_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")


class OwnedTask(asyncio.Task[object]):
    """A task that knows whose code runs in it, so that it is noticed if other code cancels it."""

    boundary: JournalBoundary | None = None
    number = 0
    """Its place among the tasks of its node."""

    def cancel(self, msg: object = None) -> bool:
        if self.boundary is None or BOUNDARY.get() is self.boundary:
            return super().cancel(msg)
        return self.boundary.cancel(self, super().cancel, msg)


class JournaledLoop(_Loop):
    """The methods of an event loop in which journaled nodes run, before those of its own class: they ask the boundary of the present code.

    Code that belongs to no journaled node is served as before.
    """

    thread: int
    """That of the loop."""

    def own_time(self) -> float:
        """The loop's own clock, seconds, which is read for nobody."""
        return super().time()

    def call_soon(
        self, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.Handle:
        boundary = _boundary_of(context)
        if boundary is None:
            return super().call_soon(callback, *args, context=context)
        return boundary.schedule(super().call_soon, None, callback, args, context)

    def call_at(
        self, when: float, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        boundary = _boundary_of(context)
        if boundary is None:
            return super().call_at(when, callback, *args, context=context)
        handle = boundary.schedule(partial(super().call_at, when), when, callback, args, context)
        return cast("asyncio.TimerHandle", handle)

    def run_in_executor(self, executor: Executor | None, func: Callable[[*_Ts], _T], *args: *_Ts) -> asyncio.Future[_T]:
        boundary, run = BOUNDARY.get(), super().run_in_executor
        if boundary is None:
            return run(executor, func, *args)

        def begin() -> asyncio.Future[_T]:
            with outside():
                return run(executor, func, *args)

        return cast("JournalBoundary", boundary).in_thread(begin, "executor")


class RealJournaledLoop(JournaledLoop):
    """Such a loop on the real clock, whose readings are kept."""

    def time(self) -> float:
        boundary = BOUNDARY.get()
        if boundary is None or get_ident() != self.thread:  # work in a thread inherits the context of the node
            return super().time()
        return cast("JournalBoundary", boundary).read(super().time)

    def call_later(
        self, delay: float, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        if _boundary_of(context) is None:
            return super().call_later(delay, callback, *args, context=context)
        return self.call_at(self.time() + delay, callback, *args, context=context)


class VirtualJournaledLoop(JournaledLoop):
    """Such a loop on virtual time."""

    def call_later(
        self, delay: float, callback: Callable[[*_Ts], object], *args: *_Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        boundary = _boundary_of(context)
        if boundary is None:
            return super().call_later(delay, callback, *args, context=context)
        plain = partial(super().call_later, delay)
        return cast("asyncio.TimerHandle", boundary.schedule(plain, self.time() + delay, callback, args, context))

    def sleep_until(self, when: float) -> asyncio.Future[None]:
        if BOUNDARY.get() is None:
            own: Any = super()
            slept: asyncio.Future[None] = own.sleep_until(when)
            return slept
        future: asyncio.Future[None] = self.create_future()
        self.call_at(when, wake, future, None)
        return future


def journaled(loop: asyncio.AbstractEventLoop) -> JournaledLoop:
    """The loop, which from now on notices what journaled nodes do with it.

    Raises `ReplayError` for a loop that is not written in Python, and for one with a task factory of its own.
    """
    if isinstance(loop, JournaledLoop):
        return loop
    if loop.get_task_factory() is not None:
        raise ReplayError("a journal needs an event loop without a task factory of its own (eager tasks?)")
    try:
        extend(loop, VirtualJournaledLoop if getattr(loop, "virtual", False) else RealJournaledLoop)
    except TypeError as error:
        raise ReplayError(f"a journal needs an event loop of asyncio, not {loop!r:.60}") from error
    made = cast("JournaledLoop", loop)
    made.thread = get_ident()
    made.set_task_factory(cast("Any", _task))
    return made


def _task(loop: asyncio.AbstractEventLoop, coroutine: Coroutine[Any, Any, Any], **options: Any) -> asyncio.Task[Any]:
    """The task factory of such a loop."""
    task = OwnedTask(coroutine, loop=loop, **options)
    boundary = _boundary_of(options.get("context"))
    if boundary is not None:
        boundary.begin(task)
    return task


def _boundary_of(context: Context | None) -> JournalBoundary | None:
    """The boundary in a context; in the present one for None."""
    boundary = BOUNDARY.get() if context is None else context.get(BOUNDARY)
    return cast("JournalBoundary | None", boundary)
