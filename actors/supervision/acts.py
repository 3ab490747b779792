"""What a supervisor can do: the acts that `decide` answers an event with. Each is a value; children are named by their ids."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

import msgspec

from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.events import Ended
from actors.supervision.reasons import ExitReason
from actors.supervision.report import Context

__all__ = [
    "Act",
    "Add",
    "Adopt",
    "Answer",
    "CloseWhenReady",
    "Confirm",
    "Drop",
    "Due",
    "EndHold",
    "Forget",
    "Gone",
    "Kill",
    "Restart",
    "RestartGroup",
    "ShutDown",
    "Start",
    "Stop",
    "StopNext",
    "Tell",
    "Terminate",
    "Update",
]


class Tell(msgspec.Struct, frozen=True):
    """Report what became of a life."""

    context: Context
    life: ChildTask
    reason: ExitReason | None = None
    note: str = ""


class Confirm(msgspec.Struct, frozen=True):
    """The child is ready: nothing is due for it any more, and who waits for its start hears of it."""

    child: str


class Start(msgspec.Struct, frozen=True):
    """Start it now or, while ordered work is under way, in its place."""

    child: str


class Restart(msgspec.Struct, frozen=True):
    """Count a restart at `at`, and start the child again: now, or after the wait of its backoff.

    `earlier`: how many attempts in a row did not hold; None without a backoff.
    """

    child: str
    at: float
    earlier: int | None


class RestartGroup(msgspec.Struct, frozen=True):
    """Count a restart at `at`, and restart the child's group: stop `stops` in this order, then, after the wait of the child's
    backoff, start all that is due in start order: the child, `due`, and whatever was due before."""

    child: str
    at: float
    earlier: int | None
    stops: tuple[str, ...]
    due: tuple[str, ...]


class Stop(msgspec.Struct, frozen=True):
    """Ask a running child for its orderly end."""

    child: str
    why: str


class Kill(msgspec.Struct, frozen=True):
    """End a child without a clean-up."""

    child: str


class Forget(msgspec.Struct, frozen=True):
    """Take the child out of the books."""

    child: str


class Gone(msgspec.Struct, frozen=True):
    """Tell the system that nothing but a request will start this child again; not `kept`, not even that."""

    child: str
    kept: bool


class Drop(msgspec.Struct, frozen=True):
    """Nothing is due for the child any more; who waits for its start hears `error`, or None of one that declined.

    `park`: restarts of its group leave it alone from now on.
    """

    child: str
    error: Exception | None = None
    park: bool = False


class EndHold(msgspec.Struct, frozen=True):
    """What waited for a backoff to end need not wait any more."""


class ShutDown(msgspec.Struct, frozen=True):
    """The supervisor begins to end: nothing is due any more, no child starts. In the end it raises `failure`, if any."""

    why: str
    failure: Exception | None = None


class StopNext(msgspec.Struct, frozen=True):
    """Ask the last child that is still alive for its end; when there is none, the supervisor is over."""


class CloseWhenReady(msgspec.Struct, frozen=True):
    """A significant child has ended while others were starting: the supervisor ends once they are ready."""

    end: Ended


class Add(msgspec.Struct, frozen=True):
    """Enter a new child after the others and start it, as `Start` does; the caller of this request waits for that.

    Of an instance of a template, `given` are its arguments and parameters. `numbered`: the last number that was used to name one.
    """

    spec: Spec
    given: tuple[tuple[object, ...], Mapping[str, object] | None] = ((), None)
    numbered: int = 0


class Due(msgspec.Struct, frozen=True):
    """A start of the child is due, and the caller of this request waits for it."""

    child: str


class Update(msgspec.Struct, frozen=True):
    """Put another declaration in the place of the child's."""

    child: str
    spec: Spec


class Adopt(msgspec.Struct, frozen=True):
    """Put another declaration in the place of the supervisor's."""

    spec: Supervisor | DynamicSupervisor


class Answer(msgspec.Struct, frozen=True):
    """Tell the caller of this request that it is done."""


class Terminate(msgspec.Struct, frozen=True):
    """Drop and park a child that lives, and ask for its orderly end; the caller of this request waits for that.

    `error`: for who waits for its start.
    """

    child: str
    error: Exception | None = None


Act: TypeAlias = (
    Tell | Confirm | Start | Restart | RestartGroup | Stop | Kill | Forget | Gone | Drop | EndHold | ShutDown | StopNext
    | CloseWhenReady | Add | Due | Update | Adopt | Answer | Terminate
)  # fmt: skip
