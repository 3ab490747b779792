"""Why a child ended, as a value; and the two exceptions with which a child says so itself."""

from __future__ import annotations

from typing import TypeAlias

import msgspec

from actors.errors import described

__all__ = [
    "ExitReason",
    "Failed",
    "Gone",
    "Killed",
    "Leaked",
    "Returned",
    "Skip",
    "Stop",
    "Stopped",
    "cause_of",
    "is_abnormal",
]


class Stop(Exception):
    """Raise it in a node to end its incarnation in order ('shutdown'): a transient node is then not restarted."""

    def __init__(self, reason: str = "shutdown") -> None:
        super().__init__(reason)
        self.reason = reason


class Skip(Exception):
    """Raise it in a start phase to decline: the spec stays without an instance, the siblings start as usual."""

    def __init__(self, reason: str = "") -> None:
        super().__init__(reason)
        self.reason = reason


class Returned(msgspec.Struct, frozen=True):
    """It came to its end ('normal')."""

    def __str__(self) -> str:
        return "it returned"


class Stopped(msgspec.Struct, frozen=True):
    """It was asked to stop, or raised `Stop` ('shutdown'). `cause`: the error of a supervisor that gave up."""

    why: str = "shutdown"
    cause: BaseException | None = None

    def __str__(self) -> str:
        return f"it stopped: {self.why}" + (f" ({self.cause})" if self.cause else "")


class Failed(msgspec.Struct, frozen=True):
    """It raised `error` ('abnormal')."""

    error: BaseException

    def __str__(self) -> str:
        return f"it raised {described(self.error)}"


class Killed(msgspec.Struct, frozen=True):
    """It was cancelled, without a clean-up, `after` so many seconds of waiting for its own ('abnormal').

    `after=None`: somebody other than its supervisor cancelled it.
    """

    after: float | None

    def __str__(self) -> str:
        if self.after is None:
            return "it was cancelled by somebody other than its supervisor"
        return f"it was killed after {self.after:g} s of clean-up" if self.after else "it was killed"


class Leaked(msgspec.Struct, frozen=True):
    """It refused even to be killed and was abandoned: its task may still be running ('abnormal')."""

    after: float

    def __str__(self) -> str:
        return f"it refused to die within {self.after:g} s after the kill and was abandoned; its task may still run"


class Gone(msgspec.Struct, frozen=True):
    """It had ended before anybody watched; nothing is kept of how."""

    def __str__(self) -> str:
        return "it had ended before it was watched"


ExitReason: TypeAlias = Returned | Stopped | Failed | Killed | Leaked
"""How one incarnation ended."""


def is_abnormal(reason: ExitReason) -> bool:
    """Whether a transient child is restarted after it: anything but a return or an orderly stop."""
    return not isinstance(reason, (Returned, Stopped))


def cause_of(reason: ExitReason) -> BaseException | None:
    """The exception behind a reason, to chain a further error to."""
    if isinstance(reason, Failed):
        return reason.error
    return reason.cause if isinstance(reason, Stopped) else None
