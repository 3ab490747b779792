"""What a supervisor can hear of: events of its children's lives, of its own, and requests of administration. All are values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import msgspec

from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef

__all__ = [
    "AllReady",
    "DeleteChild",
    "Ended",
    "Event",
    "KillAsked",
    "Ready",
    "Reconfigure",
    "ReplaceFactory",
    "Request",
    "RestartChild",
    "Spawn",
    "StartChild",
    "StopAsked",
    "TerminateChild",
]


class Ready(msgspec.Struct, frozen=True, gc=False):
    """The life says that its start phase is over."""

    life: ChildTask


class Ended(msgspec.Struct, frozen=True):
    """The life has ended. `at`: when, in seconds of the event loop; 0.0 of an end that was asked for, which is no matter then."""

    life: ChildTask
    reason: ExitReason
    at: float


class AllReady(msgspec.Struct, frozen=True):
    """All children have been started for the first time."""


class StopAsked(msgspec.Struct, frozen=True):
    """The supervisor itself is to end in order."""

    why: str


class KillAsked(msgspec.Struct, frozen=True):
    """The supervisor itself is to end at once."""


class StartChild(msgspec.Struct, frozen=True):
    spec: Spec


class Spawn(msgspec.Struct, frozen=True):
    args: tuple[object, ...]
    name: str | None
    parameters: Mapping[str, object] | None


class TerminateChild(msgspec.Struct, frozen=True):
    target: str | ChildRef


class RestartChild(msgspec.Struct, frozen=True):
    child: str


class DeleteChild(msgspec.Struct, frozen=True):
    child: str


class ReplaceFactory(msgspec.Struct, frozen=True):
    child: str
    factory: Callable[..., object]


class Reconfigure(msgspec.Struct, frozen=True):
    spec: Supervisor | DynamicSupervisor


Request: TypeAlias = StartChild | Spawn | TerminateChild | RestartChild | DeleteChild | ReplaceFactory | Reconfigure
"""What users ask for: see the methods of `RunningSupervisor`."""

Event: TypeAlias = Ready | Ended | AllReady | StopAsked | KillAsked | Request
