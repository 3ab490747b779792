"""Ending an incarnation: the control items of its inbox, and the exceptions thrown through its code."""

from __future__ import annotations

import asyncio
from typing import cast

from actors.errors import ProgramExit

__all__ = ["Failure", "StopRequest", "StopServing", "Unwinding", "blame", "in_task", "stray_cancel"]


class Unwinding(BaseException):
    """Base of what the framework itself throws through a node's code. No caller is answered with it, no handler is blamed for it."""


class Failure:
    """An inbox item that ends the incarnation with the error of a task; `decided`: `on_error` has had its say."""

    __slots__ = ("decided", "error", "label")

    def __init__(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        self.error = error
        self.label = label
        self.decided = decided

    def run(self) -> None:
        raise self.error


class StopServing(Unwinding):
    """Ends `Inbox.serve` in an orderly way; not an `Exception`, so no handler's `except` can mistake it for its own."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class StopRequest:
    """An inbox item that ends the node's service."""

    __slots__ = ("reason",)
    label = "stop"

    def __init__(self, reason: str) -> None:
        self.reason = reason

    def run(self) -> None:
        raise StopServing(self.reason)


def stray_cancel(error: asyncio.CancelledError, label: str) -> RuntimeError | None:
    """A cancellation that was not meant for the running task, as the error of the code that let it out; else None.

    Code that awaits a task or future which somebody cancels meets it: that is its failure, not the end of the task that runs it.
    """
    task = asyncio.current_task()
    if task is None or task.cancelling():
        return None
    failure = RuntimeError(f"{label} awaited something that was canceled, and did not handle it")
    failure.__cause__ = error
    return failure


def blame(error: BaseException, label: str) -> BaseException | None:
    """The fault of the code `label` when `error` leaves it; None if its task or its node is being ended.

    `SystemExit` and `KeyboardInterrupt` become `ProgramExit`: out of a task they would end the loop before any node has cleaned up.
    """
    if isinstance(error, asyncio.CancelledError):
        return stray_cancel(error, label)
    if exits := _exits_in(error):
        return ProgramExit(label, exits[0])
    if isinstance(error, GeneratorExit):  # thrown at a coroutine that nobody runs any more, or raised by its own code
        return RuntimeError(f"{label} raised GeneratorExit") if in_task() else None
    return None if isinstance(error, Unwinding) else error


def _exits_in(error: BaseException) -> list[SystemExit | KeyboardInterrupt]:
    """The request to exit the program: `error` itself, or one inside it at any depth if it is an exception group."""
    if isinstance(error, (SystemExit, KeyboardInterrupt)):
        return [error]
    if not isinstance(error, BaseExceptionGroup):
        return []
    group = cast("BaseExceptionGroup[BaseException]", error)
    return [exit for one in group.exceptions for exit in _exits_in(one)]


def in_task() -> bool:
    """Whether code runs in a task; a coroutine that is thrown away when its loop is gone does not, and cannot await anything."""
    try:
        return asyncio.current_task() is not None
    except RuntimeError:
        return False
