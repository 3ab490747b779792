"""The seam between a supervisor and the system around it: what a child's life is, where lives come from, and what the
supervisor's books say of a child.

A seam is the place where two parts meet through Protocols only, so that either can be replaced (Feathers). A child's state
is stored in one place, its supervisor's books; whoever shows it derives it from there: `RunningSupervisor.state_of`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from random import Random
from typing import Protocol

from actors.supervision.declarations import Child, Spec
from actors.supervision.refs import ChildState
from actors.supervision.report import Report

__all__ = ["ChildStatus", "Declared", "Life", "Runtime"]


class Declared(Protocol):
    """What a life belongs to, with what is declared of it now: a request may change that while the life runs."""

    @property
    def spec(self) -> Spec: ...


class ChildStatus(Protocol):
    """What the books of a supervisor say of one child, to read: always as it is at the moment."""

    @property
    def state(self) -> ChildState:
        """As `children()` tells it."""
        ...

    @property
    def number(self) -> int:
        """How many lives it has had since its supervisor began to run, the present one counted."""
        ...

    @property
    def task(self) -> asyncio.Task[None] | None:
        """The task of its present life; None between lives."""
        ...


class Life(Protocol):
    """One incarnation of a child, from its start phase to the end of its clean-up."""

    async def run(self, started: Callable[[], None], /) -> None:
        """The whole life, in a task of its own: start phase, `started()` when ready, serve, clean up.

        Returning is a normal end, `raise Stop(reason)` an orderly one, any other exception a failure. `raise Skip`
        before `started()` declines to start. The supervisor cancels the task in two cases. Before `started()`, right
        after `stop`, to break off a start phase: clean up what it has made, within the stop timeout. After `started()`,
        to kill: there is no time left for a clean-up, and one second later the task is abandoned.
        """
        ...

    def stop(self, reason: str, /) -> None:
        """Ask for an orderly end; `run` then cleans up and returns. May come at any time while `run` runs, also before
        `started()`; comes at most once. Must not block."""
        ...


class Runtime(Protocol):
    """What a supervisor needs of the system it is in. Time is the running event loop's."""

    @property
    def rng(self) -> Random:
        """The system's seeded source of randomness, for the jitter of a backoff. Asked for only when needed."""
        ...

    def life(self, child: Child, path: tuple[str, ...], incarnation: int, /) -> Life:
        """A new life for `child`. `path` leads from the root to it. Called in the child's own task, so what it raises
        is a failed start of that child."""
        ...

    def gone(self, path: tuple[str, ...], kept: bool, /) -> None:
        """The child at `path` has ended, and nothing will start it again but a request; not `kept`, not even that: its
        supervisor has forgotten it. If it is a supervisor, that holds for all below it. Of the children of a supervisor
        that is itself ending only instances of a template are told of. Must not block."""
        ...

    def report(self, report: Report, /) -> None:
        """Take notice of an event. Must not block; what it raises goes to the event loop's exception handler."""
        ...
