"""The reasons of a child's end, as values; and the exceptions `Stop` and `Skip`, which a child raises to end."""

from __future__ import annotations

from typing import TypeAlias

import msgspec

from actors.errors import described


class Stop(Exception):
    """Raise it in a node to end its incarnation in order ('shutdown'). A transient node is not restarted after it."""

    def __init__(self, reason: str = "shutdown") -> None:
        super().__init__(reason)
        self.reason = reason


class Skip(Exception):
    """Raise it in a start phase to decline the start: the node does not run, and its siblings start as usual."""

    def __init__(self, reason: str = "") -> None:
        super().__init__(reason)
        self.reason = reason


class Returned(msgspec.Struct, frozen=True):
    """The child returned: its work is done ('normal')."""

    def __str__(self) -> str:
        return "it returned"


class Stopped(msgspec.Struct, frozen=True):
    """The child was asked to stop, or raised `Stop` ('shutdown'). `cause` is the error of a supervisor that gave up."""

    why: str = "shutdown"
    cause: BaseException | None = None

    def __str__(self) -> str:
        return f"it stopped: {self.why}" + (f" ({self.cause})" if self.cause else "")


class Failed(msgspec.Struct, frozen=True):
    """The child raised `error` ('abnormal')."""

    error: BaseException

    def __str__(self) -> str:
        return f"it raised {described(self.error)}"


class Killed(msgspec.Struct, frozen=True):
    """The child was killed after it had been given `after` seconds for its own clean-up ('abnormal').

    With `after=None` its task was canceled by code other than its supervisor.
    """

    after: float | None

    def __str__(self) -> str:
        if self.after is None:
            return "it was cancelled by somebody other than its supervisor"
        return f"it was killed after {self.after:g} s of clean-up" if self.after else "it was killed"


class Leaked(msgspec.Struct, frozen=True):
    """The child did not end within `after` seconds of its kill and was abandoned: its task may still run ('abnormal')."""

    after: float

    def __str__(self) -> str:
        return f"it refused to die within {self.after:g} s after the kill and was abandoned; its task may still run"


class Gone(msgspec.Struct, frozen=True):
    """The child had ended before it was watched; the reason is not known any more."""

    def __str__(self) -> str:
        return "it had ended before it was watched"


ExitReason: TypeAlias = Returned | Stopped | Failed | Killed | Leaked
"""The reason of the end of one incarnation."""


def is_abnormal(reason: ExitReason) -> bool:
    """Whether a transient child is restarted after this end: after any but a return or an orderly stop."""
    return not isinstance(reason, (Returned, Stopped))


def cause_of(reason: ExitReason) -> BaseException | None:
    """The exception behind a reason, or None; used as the `__cause__` of further errors."""
    if isinstance(reason, Failed):
        return reason.error
    return reason.cause if isinstance(reason, Stopped) else None
