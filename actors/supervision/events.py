"""The events that a supervisor handles: those of its children's lives, those of its own life, and requests. All are values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import msgspec

from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef


class Ready(msgspec.Struct, frozen=True, gc=False):
    """A life has called `started()`: its start phase is over."""

    life: ChildTask


class Ended(msgspec.Struct, frozen=True):
    """A life has ended. `at` is the loop time of the end in seconds; 0.0 if the end was asked for, since it is not needed then."""

    life: ChildTask
    reason: ExitReason
    at: float


class AllReady(msgspec.Struct, frozen=True):
    """All children have been started for the first time."""


class StopAsked(msgspec.Struct, frozen=True):
    """The supervisor is asked to end in order."""

    why: str


class KillAsked(msgspec.Struct, frozen=True):
    """The supervisor is killed: it is to end at once."""


class StartChild(msgspec.Struct, frozen=True):
    spec: Spec
    id: str = ""


class Spawn(msgspec.Struct, frozen=True):
    args: tuple[object, ...]
    name: str | None
    parameters: Mapping[str, object] | None


class TerminateChild(msgspec.Struct, frozen=True):
    target: str | ChildRef
    why: str = "shutdown"


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
"""The requests of users; see the methods of `RunningSupervisor`."""

Event: TypeAlias = Ready | Ended | AllReady | StopAsked | KillAsked | Request
