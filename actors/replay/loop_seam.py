"""The seam in the event loop: callbacks, tasks, clock readings and threads of journaled nodes are noticed there."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextvars import Context
from threading import get_ident
from typing import Any, Protocol, cast

from actors.inbox.boundary import BOUNDARY, Boundary, outside
from actors.replay.errors import ReplayError
from actors.waiting import wake

Callback = Callable[..., object]


class LoopBoundary(Boundary, Protocol):
    """The boundary of a node, as the event loop meets it."""

    def schedule(
        self,
        plain: Callable[..., asyncio.Handle],
        when: float | None,
        callback: Callback,
        arguments: tuple[Any, ...],
        context: Context | None,
    ) -> asyncio.Handle:
        """Have `callback` called soon, or at the loop time `when`. `plain(callback, *arguments, context=context)` is the loop's own way."""
        ...

    def read(self, clock: Callable[[], float]) -> float:
        """The time that the node's code reads from `clock`."""
        ...

    def begin(self, task: OwnedTask) -> None:
        """A task of the node has been made."""
        ...

    def cancel(self, task: OwnedTask, cancel: Callable[[Any], bool], message: Any) -> bool:
        """Other code cancels a task of the node: call `cancel(message)`."""
        ...

    def in_thread(self, start: Callable[[], asyncio.Future[Any]], name: str) -> asyncio.Future[Any]:
        """The future of work in an executor, which `start()` begins."""
        ...


class OwnedTask(asyncio.Task[Any]):
    """A task that knows whose code runs in it, so that it is noticed if other code cancels it."""

    boundary: LoopBoundary | None = None
    number = 0
    """Its place among the tasks of its node."""

    def cancel(self, msg: Any = None) -> bool:
        if self.boundary is None or BOUNDARY.get() is self.boundary:
            return super().cancel(msg)
        return self.boundary.cancel(self, super().cancel, msg)


class LoopSeam:
    """Replaces some methods of one event loop object, for as long as that lives, by ones that ask the boundary of the present code.

    Code that belongs to no journaled node is served as before. Raises `ReplayError` for a loop with a task factory of its own.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        if loop.get_task_factory() is not None:
            raise ReplayError("a journal needs an event loop without a task factory of its own (eager tasks?)")
        self._loop = loop
        self._thread = get_ident()
        self._virtual = bool(getattr(loop, "virtual", False))
        self._call_soon, self._call_at, self._call_later = loop.call_soon, loop.call_at, loop.call_later
        self._run_in_executor = loop.run_in_executor
        self.time = loop.time
        """The loop's own clock."""
        replaced: Any = loop
        replaced.call_soon, replaced.call_at, replaced.call_later = self.call_soon, self.call_at, self.call_later
        replaced.run_in_executor = self.run_in_executor
        if self._virtual:
            self._sleep_until: Callable[[float], asyncio.Future[None]] = replaced.sleep_until
            replaced.sleep_until = self.sleep_until
        else:
            replaced.time = self.read
        loop.set_task_factory(cast("Any", self.task))

    def call_soon(self, callback: Callback, *args: Any, context: Context | None = None) -> asyncio.Handle:
        boundary = _boundary_of(context)
        if boundary is None:
            return self._call_soon(callback, *args, context=context)
        return boundary.schedule(self._call_soon, None, callback, args, context)

    def call_at(
        self, when: float, callback: Callback, *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        boundary = _boundary_of(context)
        if boundary is None:
            return self._call_at(when, callback, *args, context=context)

        def plain(callback: Callback, *args: Any, context: Context | None) -> asyncio.TimerHandle:
            return self._call_at(when, callback, *args, context=context)

        return cast("asyncio.TimerHandle", boundary.schedule(plain, when, callback, args, context))

    def call_later(
        self, delay: float, callback: Callback, *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        boundary = _boundary_of(context)
        if boundary is None:
            return self._call_later(delay, callback, *args, context=context)
        if not self._virtual:
            return self.call_at(self._loop.time() + delay, callback, *args, context=context)

        def plain(callback: Callback, *args: Any, context: Context | None) -> asyncio.TimerHandle:
            return self._call_later(delay, callback, *args, context=context)

        return cast("asyncio.TimerHandle", boundary.schedule(plain, self.time() + delay, callback, args, context))

    def sleep_until(self, when: float) -> asyncio.Future[None]:
        if BOUNDARY.get() is None:
            return self._sleep_until(when)
        future: asyncio.Future[None] = self._loop.create_future()
        self.call_at(when, wake, future, None)
        return future

    def read(self) -> float:
        boundary = BOUNDARY.get()
        if boundary is None or get_ident() != self._thread:  # work in a thread inherits the context of the node
            return self.time()
        return cast("LoopBoundary", boundary).read(self.time)

    def run_in_executor(self, executor: Any, function: Callback, *args: Any) -> asyncio.Future[Any]:
        boundary = BOUNDARY.get()
        if boundary is None:
            return self._run_in_executor(executor, function, *args)

        def start() -> asyncio.Future[Any]:
            with outside():
                return self._run_in_executor(executor, function, *args)

        return cast("LoopBoundary", boundary).in_thread(start, "executor")

    def task(
        self, loop: asyncio.AbstractEventLoop, coroutine: Coroutine[Any, Any, Any], **options: Any
    ) -> asyncio.Task[Any]:
        """The loop's task factory."""
        task = OwnedTask(coroutine, loop=loop, **options)
        boundary = _boundary_of(options.get("context"))
        if boundary is not None:
            boundary.begin(task)
        return task


def _boundary_of(context: Context | None) -> LoopBoundary | None:
    """The boundary in a context; in the present one for None."""
    boundary = BOUNDARY.get() if context is None else context.get(BOUNDARY)
    return cast("LoopBoundary | None", boundary)
