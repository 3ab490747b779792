"""Outside work: the threads and processes that a task waits for, and that the virtual loop waits for in real time; and input."""

# pyright: reportPrivateUsage=false
# anyio starts its worker threads and processes itself without telling the event loop. Only its run variables show which of them are busy.
from __future__ import annotations

import asyncio
import contextvars
import functools
import os
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

from anyio import to_process
from anyio._backends import _asyncio as anyio_backend
from anyio.lowlevel import _run_vars

from actors.time.deadlock import parked_frames

# typeshed's `classmethod` hides the function below it.
_ANYIO_CALL = anyio_backend.AsyncIOBackend.run_sync_in_worker_thread.__func__.__code__  # type: ignore[attr-defined]


class OutsideWork:
    """The threads and processes of one loop that a task waits for, with a name for each; and how long input has held up virtual time.

    Work that was abandoned, because its future or task was canceled, does not count.
    """

    __slots__ = ("_input_at", "_input_since", "_loop", "anyio", "jobs")

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self.jobs: dict[object, str] = {}
        self.anyio: dict[Any, Any] = _run_vars.setdefault(loop, {})
        self._input_at = self._input_since = -1.0

    def possible(self) -> bool:
        """Whether there may be any. Cheap enough to be checked before every jump of the clock."""
        return bool(self.jobs) or (bool(self.anyio) and self._busy_anyio_threads())

    def names(self) -> list[str]:
        """A phrase for each piece of work in progress."""
        names = [name for job, name in list(self.jobs.items()) if not self._is_over(job)]
        if self._busy_anyio_threads():
            names += self._anyio_calls()
        return sorted(names)

    def input_lasts(self, instant: float, limit: float) -> bool:
        """Whether sockets and signals have had news at this instant of virtual time for more than `limit` real seconds, without outside work.

        Called at each news. If so, the time is counted anew: the loop is still needed for the clean-up.
        """
        now = time.perf_counter()
        if self._input_at != instant or self.possible():
            self._input_at, self._input_since = instant, now
        lasts = now - self._input_since > limit
        if lasts:
            self._input_since = now
        return lasts

    @contextmanager
    def during(self, reason: str) -> Generator[None]:
        """Count the block as outside work."""
        key = object()
        self.jobs[key] = reason
        try:
            yield
        finally:
            del self.jobs[key]

    def add_thread(self, future: asyncio.Future[Any], function: Callable[..., object]) -> None:
        """Count a call in an executor until its future is completed or canceled."""
        self.jobs[future] = f"thread running {_function_name(function)}"
        future.add_done_callback(self.jobs.pop)

    def add_process(self, transport: asyncio.SubprocessTransport) -> None:
        """Count a process until it has exited."""
        command = transport.get_extra_info("subprocess").args
        words = command if isinstance(command, (str, bytes)) else " ".join(map(os.fsdecode, command))
        self.jobs[transport] = f"process {transport.get_pid()} ({words!s:.80})"

    def _is_over(self, job: object) -> bool:
        if not isinstance(job, asyncio.SubprocessTransport):
            return False
        if job.get_returncode() is None:
            return job.get_pid() in self._idle_anyio_processes()
        del self.jobs[job]
        return True

    def _idle_anyio_processes(self) -> set[int]:
        return {process.pid for process, _ in self.anyio.get(to_process._process_pool_idle_workers, ())}

    def _busy_anyio_threads(self) -> bool:
        workers = self.anyio.get(anyio_backend._threadpool_workers, ())
        return len(workers) > len(self.anyio.get(anyio_backend._threadpool_idle_workers, ()))

    def _anyio_calls(self) -> list[str]:
        """The calls that a task still waits for. A thread whose caller was canceled runs on without being waited for."""
        frames = (stack[-1] for task in asyncio.all_tasks(self._loop) if (stack := parked_frames(task)))
        return [
            f"thread running {_function_name(frame.f_locals['func'])}"
            for frame in frames
            if frame.f_code is _ANYIO_CALL
        ]


def _function_name(function: object) -> str:
    if isinstance(function, functools.partial):
        inner: object = function.func  # asyncio.to_thread submits partial(context.run, function, ...)
        wraps = isinstance(getattr(inner, "__self__", None), contextvars.Context)
        return _function_name(function.args[0] if wraps else inner)
    return str(getattr(function, "__qualname__", function))
