"""The acts of a supervisor, with which `decide` answers an event. Each is a value; children are named by their ids."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import msgspec

from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.events import Ended
from actors.supervision.reasons import ExitReason
from actors.supervision.report import Context


class Tell(msgspec.Struct, frozen=True):
    """Report an event of a life."""

    context: Context
    life: ChildTask
    reason: ExitReason | None = None
    note: str = ""


class Confirm(msgspec.Struct, frozen=True):
    """Mark the child as ready: its start is no longer due, and the caller that waits for it is answered."""

    child: str


class Start(msgspec.Struct, frozen=True):
    """Start the child now, or in its place in the order while ordered work is under way."""

    child: str


class Restart(msgspec.Struct, frozen=True):
    """Count a restart at `at`, loop time in seconds, and start the child again: now, or after the delay of its backoff.

    `earlier` is the number of attempts in a row that did not hold; None without a backoff.
    """

    child: str
    at: float
    earlier: int | None


class RestartGroup(msgspec.Struct, frozen=True):
    """Count a restart at `at`, loop time in seconds, and restart the child together with its group.

    The children in `stops` are stopped in this order. Then, after the delay of the child's backoff, all children that are due are started
    in start order: the child itself, those in `due`, and those that were due before.
    """

    child: str
    at: float
    earlier: int | None
    stops: tuple[str, ...]
    due: tuple[str, ...]


class Stop(msgspec.Struct, frozen=True):
    """Ask a child that lives for its orderly end."""

    child: str
    why: str


class Kill(msgspec.Struct, frozen=True):
    """Kill a child: it has no time for a clean-up."""

    child: str


class Forget(msgspec.Struct, frozen=True):
    """Remove the child from the state of the supervisor."""

    child: str


class Gone(msgspec.Struct, frozen=True):
    """Tell the system that only a request will start this child again; unless `kept`, that is not possible either."""

    child: str
    kept: bool


class Drop(msgspec.Struct, frozen=True):
    """Cancel what is due for the child. The caller that waits for its start gets `error`, or None if the child declined to start.

    With `park`, restarts of its group leave it alone from now on.
    """

    child: str
    error: Exception | None = None
    park: bool = False


class EndHold(msgspec.Struct, frozen=True):
    """End the wait for a backoff that holds up the starts of a group."""


class ShutDown(msgspec.Struct, frozen=True):
    """Begin the end of the supervisor: all that is due is canceled and no child starts. At the end `run` raises `failure`, if given."""

    why: str
    failure: Exception | None = None


class StopNext(msgspec.Struct, frozen=True):
    """Ask the last child that lives for its end; without any, the supervisor is over."""


class CloseWhenReady(msgspec.Struct, frozen=True):
    """End the supervisor once all children are ready, because a significant child ended while others were starting."""

    end: Ended


class Add(msgspec.Struct, frozen=True):
    """Add a child after the others and start it, as `Start` does. The caller of the request waits for that.

    For an instance of a template, `given` are its arguments and parameters, and `numbered` is the last number used to name an instance.
    `id` is the child's id, if that is not its name.
    """

    spec: Spec
    given: tuple[tuple[object, ...], Mapping[str, object] | None] = ((), None)
    numbered: int = 0
    id: str = ""


class Due(msgspec.Struct, frozen=True):
    """Make a start of the child due. The caller of the request waits for it."""

    child: str


class Update(msgspec.Struct, frozen=True):
    """Replace the declaration of the child."""

    child: str
    spec: Spec


class Adopt(msgspec.Struct, frozen=True):
    """Replace the declaration of the supervisor."""

    spec: Supervisor | DynamicSupervisor


class Answer(msgspec.Struct, frozen=True):
    """Tell the caller of the request that it is done."""


class Terminate(msgspec.Struct, frozen=True):
    """Drop and park a child that lives, and ask for its orderly end. The caller of the request waits for that.

    `error` is given to a caller that waits for the child's start.
    """

    child: str
    error: Exception | None = None
    why: str = "shutdown"


Act: TypeAlias = (
    Tell | Confirm | Start | Restart | RestartGroup | Stop | Kill | Forget | Gone | Drop | EndHold | ShutDown | StopNext
    | CloseWhenReady | Add | Due | Update | Adopt | Answer | Terminate
)  # fmt: skip
