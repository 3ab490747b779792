"""A running supervisor, for those who use it: run it, look at its children, and change them while it runs."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

from actors.errors import WrongThread
from actors.supervision.child_task import GRACE, ChildTask, LeakedChild
from actors.supervision.children import Children, Phase
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.entry import Entry
from actors.supervision.errors import NotFound
from actors.supervision.events import (
    DeleteChild,
    Reconfigure,
    ReplaceFactory,
    Request,
    RestartChild,
    Spawn,
    StartChild,
    TerminateChild,
)
from actors.supervision.executor import Executor
from actors.supervision.reasons import Gone
from actors.supervision.refs import ChildInfo, ChildRef, ChildState, Counts, Down
from actors.supervision.seam import ChildStatus, Life, Runtime
from actors.supervision.watching import complete_on_end, share_fate

__all__ = ["LeakedChild", "Path", "RunningSupervisor"]

Path: TypeAlias = str | Sequence[str]
"""The way down from a supervisor: "gaits/walk", or ("gaits", "walk")."""


class RunningSupervisor:
    """One run of a `Supervisor` or `DynamicSupervisor`: `await RunningSupervisor(spec, runtime).run(started)`.

    Is a `Life`, so supervisors nest. All requests answer at once, also while children are starting or restarting; those that
    start or stop a child wait for just that child. They must come from the event loop's own thread. A caller that is cancelled
    takes nothing back: the child goes on starting or stopping. Before `run`, and once it is stopping, requests raise
    `SupervisorDown`.

    Invariants: the books, `Children`, say all there is to know of the children; what follows from an event, `decide` says; only
    the `Executor`, which lives as long as `run` does, changes the books and touches the children's tasks.

    It has no public constructor: `System.supervisor` gives one.
    """

    def __init__(
        self,
        spec: Supervisor | DynamicSupervisor,
        runtime: Runtime,
        path: tuple[str, ...] | None = None,
        *,
        leaked: list[LeakedChild] | None = None,
        killed: Callable[[], bool] = lambda: True,
    ) -> None:
        self.path = (spec.name,) if path is None else path
        self.leaked: list[LeakedChild] = [] if leaked is None else leaked
        self._runtime = runtime
        self._killed = killed
        self._children = Children(spec, self.path)
        self._executor: Executor | None = None

    def __repr__(self) -> str:
        return f"<supervisor {self.name}: {self.phase}, {len(self._children)} children>"

    @property
    def name(self) -> str:
        """The path from the root, as one text."""
        return self._children.name

    @property
    def spec(self) -> Supervisor | DynamicSupervisor:
        """Its declaration, the one that was last put in its place by `reconfigure`."""
        return self._children.spec

    @property
    def phase(self) -> Phase:
        """What the supervisor itself does: it is new, starting, running, stopping or over."""
        return self._children.phase

    # ------------------------------------------------------------------ running

    async def run(self, started: Callable[[], object], /) -> None:
        """Start all children in order, call `started()`, supervise until stopped, stop all children.

        Returns after `stop`, or after the end of a significant child shut it down. Raises `StartFailed` when a child
        does not start the first time, `SupervisorGaveUp` when the restart intensity is reached; in each case after all
        children have stopped. When its task is cancelled it kills all children at once and passes the cancellation on;
        so it does with an exception of its own, or of a runtime that does not keep to its protocol. A
        cancellation of which its owner's `killed()` knows nothing comes from somebody else, such as `asyncio.run` at its end:
        then it stops all children in order before it passes it on.
        """
        children = self._children
        if children.phase != "new":
            raise RuntimeError(f"{self!r} has been run before; make a new one for another run")
        if children.why:
            children.phase = "over"
            return
        self._executor = Executor(
            children,
            self._runtime,
            started,
            leaked=self.leaked,
            killed=self._killed,
            nest=self._nest,
            grace_of=_grace_of,
        )
        await self._executor.run()

    def stop(self, reason: str = "shutdown", /) -> None:
        """Ask for an orderly end: retries are dropped, then the children stop in reverse order."""
        if self._executor is None:
            self._children.why = reason or "shutdown"
        else:
            self._executor.stop(reason)

    def _nest(
        self, spec: Supervisor | DynamicSupervisor, path: tuple[str, ...], killed: Callable[[], bool]
    ) -> RunningSupervisor:
        return RunningSupervisor(spec, self._runtime, path, leaked=self.leaked, killed=killed)

    # ------------------------------------------------------------------ looking

    def children(self) -> list[ChildInfo]:
        """All children in start order (OTP lists the newest first)."""
        return [entry.info for entry in self._children]

    def counts(self) -> Counts:
        """How many there are. One that is restarting counts in `specs`, not in `active`."""
        entries = self._children
        supervisors = sum(entry.spec.kind == "supervisor" for entry in entries)
        active = sum(entry.state == "running" for entry in entries)
        return Counts(len(entries), active, supervisors, len(entries) - supervisors)

    def child_spec(self, id: str) -> Spec:
        """The child's complete declaration, with all defaults. Raises `NotFound`."""
        return self._children.find(id).spec

    def which(self, path: Path) -> ChildRef | None:
        """The live reference of a descendant; None while it is not running. Raises `NotFound` for an unknown one."""
        entry = self._entry(path)
        return None if entry is None else entry.info.ref

    def life(self, path: Path) -> Life | None:
        """The present life of a descendant, also while it starts or stops. Raises `NotFound`.

        Of a supervisor it is a `RunningSupervisor`.
        """
        task = self.incarnation(path)
        return None if task is None else task.life

    def incarnation(self, path: Path) -> ChildTask | None:
        """The task of a descendant's present life, also while it starts or stops. Raises `NotFound`."""
        entry = self._entry(path)
        return None if entry is None else entry.now

    def state_of(self, path: Path) -> ChildState:
        """The state of a descendant, to show: "stopping" also while it cleans up after an end of its own.

        Of one whose own supervisor does not run, it is that supervisor's; of one that is not known, "stopped".
        """
        first, *rest = path.split("/") if isinstance(path, str) else path
        entry = self._children.entries.get(first)
        if entry is None:
            return "stopped"
        now = entry.now
        if rest and now is not None and isinstance(now.life, RunningSupervisor):
            return now.life.state_of(rest)
        state = entry.state
        return "stopping" if state == "running" and now is not None and now.ending else state

    @property
    def recent_restarts(self) -> int:
        """How many restarts the window of its intensity held at the last restart."""
        return len(self._children.window.times)

    def statuses(self) -> dict[str, ChildStatus]:
        """What the books say of each child, in start order."""
        return dict(self._children.entries)

    def below(self) -> Iterator[RunningSupervisor]:
        """This supervisor, and all running ones below it."""
        yield self
        for life in self.lives():
            if isinstance(life, RunningSupervisor):
                yield from life.below()

    def lives(self) -> list[Life | None]:
        """The present lives of its children, those that have one; None of one whose task has not come to its first step."""
        return [entry.now.life for entry in self._children if entry.now is not None]

    # ------------------------------------------------------------------ changing

    async def start_child(self, spec: Spec) -> ChildRef | None:
        """Add a child after the others and start it; returns when it is ready, None if it declined to start.

        Raises `AlreadyStarted`, `AlreadyPresent`, `DeclarationError`; `StartFailed`, and then the spec is not kept.
        """
        return await self._request(StartChild(spec))

    async def spawn(
        self, *args: object, name: str | None = None, parameters: Mapping[str, object] | None = None
    ) -> ChildRef | None:
        """Start an instance of a dynamic supervisor's template; returns when it is ready, None if it declined.

        `args` follow the template's own arguments, `parameters` override its parameters; both are kept for restarts.
        `name` defaults to the template's with a running number. Raises `TooManyChildren`, and what `start_child` does.
        """
        return await self._request(Spawn(args, name, parameters))

    async def terminate_child(self, target: str | ChildRef) -> None:
        """Stop a child, or drop its pending restart; returns when it has ended. Its spec stays, and nothing but
        `restart_child` starts it again. Temporary children and instances of a template are forgotten.

        A child that is stopped already, or a reference to an ended incarnation, is fine. Raises `NotFound`.
        """
        await self._request(TerminateChild(target))

    async def restart_child(self, id: str) -> ChildRef | None:
        """Start a stopped child from its spec; returns when it is ready, None if it declined.

        Raises `Running`, `Restarting`, `NotFound`; `StartFailed`, and then the spec stays, without an automatic retry.
        """
        return await self._request(RestartChild(id))

    async def delete_child(self, id: str) -> None:
        """Forget a stopped child. Raises `Running`, `Restarting`, `NotFound`."""
        await self._request(DeleteChild(id))

    async def replace(self, id: str, factory: Callable[..., object]) -> ChildRef | None:
        """Change what makes a child, and put the new in the place of the old: stop in order, start, one child only.

        Returns when the new one is ready, None if the child was not running; then `factory` serves its next start. Not
        counted as a restart. Raises `NotFound`, `DeclarationError`; `StartFailed`, and then the child is stopped.
        """
        return await self._request(ReplaceFactory(id, factory))

    async def reconfigure(self, spec: Supervisor | DynamicSupervisor) -> None:
        """Put another declaration of the same kind and name in the place of this supervisor's.

        Running children keep running. Options, and what is said about the end of a child, hold from the next end on;
        what is said about its start from the next start on. Children that are not in the new declaration stay until
        terminated; new ones are known, but not started. Raises `DeclarationError`, and then nothing has changed.
        """
        await self._request(Reconfigure(spec))

    async def _request(self, request: Request) -> ChildRef | None:
        """Let a request be handled as an event, in its turn; that, or a later event, answers."""
        self._children.check_open()
        executor = self._executor
        assert executor is not None
        if asyncio.get_running_loop() is not executor.loop:
            raise WrongThread(
                f"supervisor {self.name} was asked from a foreign event loop: ask it by asyncio.run_coroutine_threadsafe(..., loop)"
            )
        return await executor.serve(request)

    # ------------------------------------------------------------------ watching

    def watch(self, ref: ChildRef) -> Awaitable[Down]:
        """A future of the end of this very incarnation, anywhere below; of `Gone` at once if it has ended already.

        Cancel the future to stop watching. Raises `NotFound` for a reference into another tree.
        """
        future: asyncio.Future[Down] = asyncio.get_running_loop().create_future()
        incarnation = self._task(ref)
        if incarnation is None:
            future.set_result(Down(ref, Gone()))
        else:
            complete_on_end(incarnation, future)
        return future

    def link(self, one: ChildRef, other: ChildRef) -> None:
        """Let two share their fate: when one fails, the other is ended in order and counts as failed (`LinkBroken`).

        A return or an orderly stop breaks nothing. Raises `NotFound` if one has ended already, or is of another tree.
        """
        first, second = self._task(one), self._task(other)
        if first is None or second is None:
            gone = one if first is None else other
            raise NotFound(f"{self.name} cannot link {one} to {other}: {gone} has ended")
        share_fate(first, second)

    # ------------------------------------------------------------------ finding

    def _entry(self, path: Path) -> Entry | None:
        """What is known of a descendant; None if a supervisor on the way to it does not run."""
        first, *rest = path.split("/") if isinstance(path, str) else path
        entry = self._children.find(first)
        if not rest or entry.now is None:
            return entry if not rest else None
        if not isinstance(life := entry.now.life, RunningSupervisor):
            raise NotFound(f"{self.name}: {first} is not a running supervisor, so it has no {'/'.join(rest)}")
        return life._entry(rest)

    def _task(self, ref: ChildRef) -> ChildTask | None:
        """The life that `ref` means; None if it has ended."""
        depth = len(self.path)
        if ref.path[:depth] != self.path or len(ref.path) == depth:
            raise NotFound(f"{ref} is not below {self.name}")
        try:
            task = self.incarnation(ref.path[depth:])
        except NotFound:
            return None
        return task if task is not None and task.ref == ref else None


def _grace_of(life: Life | None) -> float:
    """Seconds from the kill of a child to its abandonment: a supervisor needs one more than its slowest child."""
    if not isinstance(life, RunningSupervisor):
        return GRACE
    return GRACE + max((_grace_of(each) for each in life.lives()), default=0.0)
