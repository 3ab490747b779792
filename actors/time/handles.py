"""The handles of the virtual loop. They are created faster than asyncio's, since every wake-up of a task creates one."""

# pyright: reportPrivateUsage=false
# mypy: disable-error-code="misc, assignment"
from __future__ import annotations

import asyncio
import time
from asyncio import Future
from asyncio.log import logger
from collections.abc import Callable
from contextvars import Context, copy_context
from typing import Any


class SoonHandle(asyncio.Handle):
    """The handle returned by `call_soon`. Attributes that are only used in debug mode are constants of the class."""

    __slots__ = ()
    _repr = None
    _source_traceback = None

    def __init__(
        self,
        callback: Callable[..., object],
        args: tuple[object, ...],
        loop: asyncio.AbstractEventLoop,
        context: Context | None,
    ) -> None:
        self._callback = callback
        self._args = args
        self._loop = loop
        self._context = copy_context() if context is None else context
        self._cancelled = False


class Timer(asyncio.TimerHandle):
    """The handle returned by `call_at`. The loop finds canceled timers itself, so `cancel` does not notify it."""

    __slots__ = ()
    _repr = None
    _source_traceback = None

    def __init__(
        self,
        when: float,
        callback: Callable[..., object],
        args: tuple[object, ...],
        loop: asyncio.AbstractEventLoop,
        context: Context | None,
    ) -> None:
        self._when = when
        self._callback = callback
        self._args = args
        self._loop = loop
        self._context = copy_context() if context is None else context
        self._cancelled = False

    def cancel(self) -> None:
        self._cancelled = True
        self._callback = None
        self._args = ()


def owner(handle: object) -> object:
    """The task whose step a handle runs, or the object whose method it calls."""
    return getattr(getattr(handle, "_callback", None), "__self__", None)


def is_dead(item: Future[None] | asyncio.TimerHandle) -> bool:
    """Whether a timer or a sleeper has been canceled or completed, so that nothing is left to fire."""
    return item.done() if isinstance(item, Future) else item._cancelled


def checked_timer(
    when: float, callback: Callable[..., object], args: tuple[object, ...], loop: Any, context: Context | None
) -> asyncio.TimerHandle:
    """Create the handle returned by `call_at` in debug mode, after asyncio's own checks. Called as `Timer` is."""
    loop._check_closed()
    loop._check_thread()
    loop._check_callback(callback, "call_at")
    return asyncio.TimerHandle(when, callback, args, loop, context)


def run_watched(loop: Any, handle: asyncio.Handle) -> None:
    """Run a handle in debug mode, and report one that blocks the loop for long in real time."""
    loop._current_handle = handle
    begin = time.perf_counter()
    try:
        handle._run()
    finally:
        loop._current_handle = None
    if (took := time.perf_counter() - begin) >= loop.slow_callback_duration:
        logger.warning("Executing %r took %.3f seconds", handle, took)
