"""The Protocols between a supervisor and the system around it: the life of a child, and the source of lives.

The two meet through these Protocols only, so that either can be replaced. The state of a child is
stored in one place, its supervisor; all that show it derive it from there, by `RunningSupervisor.state_of`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random
from typing import TYPE_CHECKING, Protocol, TypeGuard

from actors.supervision.declarations import Spec
from actors.supervision.refs import ChildState
from actors.supervision.report import Report

if TYPE_CHECKING:
    from actors.supervision.child_task import ChildTask


class Declared(Protocol):
    """The holder of a child's present declaration, which a request may replace while a life of the child runs."""

    @property
    def spec(self) -> Spec: ...


class Life(Protocol):
    """One incarnation of a child, from its start phase to the end of its clean-up."""

    async def run(self, started: Callable[[], None], /) -> None:
        """Run the whole life, in a task of its own: start phase, `started()` when ready, service, clean-up.

        Returning is a normal end, `raise Stop(reason)` an orderly one, any other exception a failure. `raise Skip`
        before `started()` declines to start. The supervisor cancels the task in two cases. Right after `stop`, before
        `started()`, it breaks off the start phase: clean up what was made, within the stop timeout. Otherwise it kills:
        there is no time for a clean-up, and one second later the task is abandoned.
        """
        ...

    def stop(self, reason: str, /) -> None:
        """Ask for an orderly end; `run` then cleans up and returns. It is called at most once, at any time while `run` runs,
        also before `started()`. It must not block."""
        ...


class Subtree(Protocol):
    """A life that runs children of its own, and knows their states."""

    def state_of(self, path: Sequence[str], /) -> ChildState:
        """The state of a descendant, for display; "stopped" for an unknown one. `path` leads from this life to it."""
        ...


def is_subtree(life: Life | None) -> TypeGuard[Subtree]:
    """Whether a life is a `Subtree`. States are asked for many times a second, and `isinstance` with a Protocol is slow."""
    return hasattr(life, "state_of")


class Runtime(Protocol):
    """What a supervisor needs of the system in which it runs. Times are those of the running event loop, in seconds."""

    @property
    def rng(self) -> Random:
        """The system's seeded random numbers, for the jitter of a backoff. Read only when they are needed."""
        ...

    def life(self, task: ChildTask, /) -> Life:
        """Make the life that `task` is to run: that of a node, or of a supervisor with a process of its own. It is called in that task, so an
        exception is a failed start of that child."""
        ...

    def gone(self, path: tuple[str, ...], kept: bool, /) -> None:
        """Called when the child at `path` has ended and only a request will start it again; unless `kept`, the supervisor has
        forgotten the child, and no request can. For a supervisor this applies to all children below it. When a supervisor
        ends itself, this is called only for its instances of a template. It must not block."""
        ...

    def report(self, report: Report, /) -> None:
        """Called with each report. It must not block; an exception goes to the event loop's exception handler."""
        ...
