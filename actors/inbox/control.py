"""The end of an incarnation: the control items that bring it about, and the rules for exceptions that leave a node's code."""

from __future__ import annotations

import asyncio
from typing import cast

from actors.errors import ProgramExit


class NodeExit(BaseException):
    """Base of the exceptions that the framework throws through a node's code to end its incarnation. They are not a handler's fault, and
    answer no caller."""


class Failure:
    """An inbox item that raises `error`. With `decided` it ends the incarnation without asking `on_error`."""

    __slots__ = ("decided", "error", "label")

    def __init__(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        self.error = error
        self.label = label
        self.decided = decided

    def run(self) -> None:
        raise self.error


class StopServing(NodeExit):
    """Ends `Inbox.serve` in order. It is not an `Exception`, so that `except Exception` in user code does not catch it."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class StopRequest:
    """An inbox item that raises `StopServing`: the node's orderly end."""

    __slots__ = ("reason",)
    label = "stop"

    def __init__(self, reason: str) -> None:
        self.reason = reason

    def run(self) -> None:
        raise StopServing(self.reason)


def stray_cancel(error: asyncio.CancelledError, label: str) -> RuntimeError | None:
    """The failure of the code `label` if `error` left it without a cancellation of the running task; None if the task is being canceled.

    Code that awaits a task or future receives a `CancelledError` when that one is canceled. Letting it out is an error of that code; it
    does not count as the cancellation of the task that runs it. Outside of a task the answer is None.
    """
    task = asyncio.current_task()
    if task is None or task.cancelling():
        return None
    failure = RuntimeError(f"{label} awaited something that was canceled, and did not handle it")
    failure.__cause__ = error
    return failure


def blame(error: BaseException, label: str) -> BaseException | None:
    """The failure to report when `error` leaves the code `label`; None if `error` only ends its task or its node.

    `SystemExit` and `KeyboardInterrupt`, also inside of an exception group, become `ProgramExit`: raised out of a task they would end the
    event loop before any node has cleaned up.
    """
    if isinstance(error, Exception) and not isinstance(error, BaseExceptionGroup):
        return error
    if isinstance(error, asyncio.CancelledError):
        return stray_cancel(error, label)
    if exits := _exits_in(error):
        return ProgramExit(label, exits[0])
    if isinstance(error, GeneratorExit):  # thrown into an abandoned coroutine, or raised by its own code
        return RuntimeError(f"{label} raised GeneratorExit") if in_task() else None
    return None if isinstance(error, NodeExit) else error


def _exits_in(error: BaseException) -> list[SystemExit | KeyboardInterrupt]:
    """The requests to exit the program in `error`: the error itself, or those at any depth of an exception group."""
    if isinstance(error, (SystemExit, KeyboardInterrupt)):
        return [error]
    if not isinstance(error, BaseExceptionGroup):
        return []
    group = cast("BaseExceptionGroup[BaseException]", error)
    return [exit for one in group.exceptions for exit in _exits_in(one)]


def in_task() -> bool:
    """Whether the caller runs in a task. A coroutine that is closed after its loop has ended does not, and can await nothing."""
    try:
        return asyncio.current_task() is not None
    except RuntimeError:
        return False
