"""What a process and its parent tell each other: the order, with which the process begins, requests of the parent, and what goes back to the parent."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, TypeAlias

import msgspec

from actors.runtime.placement import HERE, Placement
from actors.supervision.child import Child
from actors.supervision.declarations import Supervisor
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildState
from actors.supervision.report import Report

if TYPE_CHECKING:
    from actors.processes.flight_records import Recorder
    from actors.runtime.options import RunOptions
    from actors.transport.protocol import Transport

BEAT: Final = b"\0"
"""What a process writes to its pipe for notes, while its event loop turns. The parent looks there when it wants to know: it is not woken."""

BEATS = 5
"""How often a process must tell that its event loop turns while `hang` seconds pass, at least; and at least ten times a second."""


MOST_BEAT_SECONDS: Final = 0.1
"""The longest time between two beats."""


def beat_seconds(hang: float) -> float:
    """The time between two beats of a process that is killed after `hang` seconds without any."""
    return min(MOST_BEAT_SECONDS, hang / BEATS)


def next_beat(now: float, period: float) -> float:
    """When the next beat is due, or is looked for: at the multiples of `period`, so that one turn of a loop looks for those of all its processes.

    Half a period or more after `now`, so that a timer that fires a little late or early counts no beat twice.
    """
    return (round(now / period) + 1) * period


class NodeFacts(msgspec.Struct, frozen=True):
    """What is known of one node of a process. Times are loop time in seconds, which all processes of a machine share.

    `process` is the id of the process in which it runs, if that is one below the process that tells this; else 0.
    """

    path: tuple[str, ...]
    child: Child
    state: ChildState
    incarnation: int
    restart_count: int = 0
    restarts: tuple[tuple[float, str], ...] = ()
    asked_state: str | None = None
    process: int = 0
    saved: bytes | None = None
    """What the node leaves for its next life, pickled; None without any."""


class Packed(msgspec.Struct, frozen=True):
    """What a node leaves for its next life, as the process packed it in which it ran: this one need not understand it."""

    data: bytes


class Opaque(msgspec.Struct, frozen=True):
    """What only passes through this process, as it was packed: this one need not understand it. `line`: it is a `Line`."""

    data: bytes
    line: bool = False


class Order(msgspec.Struct, frozen=True):
    """What a process is to run: the child, its path in the tree, and what it shares with the rest of the tree.

    `nodes` is what earlier lives have left. `wall` is the time of day at loop time 0, for a simulated process; None on the real clock.
    `recorders` make what records the process, and writes that down when the child fails. `placement` is that of the runtime.
    """

    spec: Child | Supervisor
    path: tuple[str, ...]
    seed: int
    level: int
    options: RunOptions | None
    transport: Callable[[], Transport]
    domain_id: int
    nodes: tuple[NodeFacts, ...] = ()
    wall: float | None = None
    recorders: tuple[Callable[[], Recorder], ...] = ()
    placement: Placement = HERE


class StopAsked(msgspec.Struct, frozen=True):
    """End in order."""

    reason: str


class CrashAsked(msgspec.Struct, frozen=True):
    """Make the node at this path fail with this error, as `System.crash` does."""

    path: tuple[str, ...]
    error: Exception


class Ready(msgspec.Struct, frozen=True):
    """The child is ready."""


class Line(msgspec.Struct, frozen=True):
    """A log line; `at` is loop time in seconds."""

    at: float
    level: int
    node: str
    incarnation: int
    event: str
    fields: dict[str, object]
    times: int = 1
    trace: str = ""


class Told(msgspec.Struct, frozen=True):
    """A report of a supervisor of the process."""

    report: Report


class Nodes(msgspec.Struct, frozen=True):
    """What has changed about the nodes of the process; `gone` are the paths of those that were forgotten."""

    changed: tuple[NodeFacts, ...]
    gone: tuple[tuple[str, ...], ...] = ()


class Over(msgspec.Struct, frozen=True):
    """The child has ended for `reason`; its process is about to end. `exit` is the exit code that a node asked the program for, or None.

    `declined` says that the child declined to start.
    """

    reason: ExitReason
    exit: int | None = None
    declined: bool = False


Request: TypeAlias = StopAsked | CrashAsked
"""What a parent tells a process."""
News: TypeAlias = Line | Told | Nodes
"""What a process tells about its nodes."""
Event: TypeAlias = Ready | Over | News
"""What a process tells its parent. A real one sends beats, too."""
