"""Handles of the virtual loop: asyncio's, made in a third of the steps (every wake-up of a task makes one)."""

# pyright: reportPrivateUsage=false
# mypy: disable-error-code="misc, assignment"
from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextvars import Context, copy_context
from typing import Any

__all__ = ["SoonHandle", "Timer", "owner"]


class SoonHandle(asyncio.Handle):
    """What `call_soon` returns. The attributes that only debug mode fills are constants of the class."""

    __slots__ = ()
    _repr = None
    _source_traceback = None

    def __init__(
        self,
        callback: Callable[..., object],
        args: tuple[Any, ...],
        loop: asyncio.AbstractEventLoop,
        context: Context | None,
    ) -> None:
        self._callback = callback
        self._args = args
        self._loop = loop
        self._context = copy_context() if context is None else context
        self._cancelled = False


class Timer(asyncio.TimerHandle):
    """What `call_at` returns. The loop drops cancelled timers by itself, so `cancel` need not tell it."""

    __slots__ = ()
    _repr = None
    _source_traceback = None

    def __init__(
        self,
        when: float,
        callback: Callable[..., object],
        args: tuple[Any, ...],
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
    """The task whose step a handle is, or the object whose method it calls."""
    return getattr(getattr(handle, "_callback", None), "__self__", None)
