"""`RunningSupervisor`: the interface of a running supervisor, to run it, to inspect its children, and to change them."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

from actors.checks import NoPublicConstructor, create
from actors.errors import WrongThread
from actors.supervision.child_task import GRACE, ChildTask, LeakedChild
from actors.supervision.children import Children, Phase
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor, child_of
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
from actors.supervision.executor import Caller, Executor
from actors.supervision.monitors import complete_on_end, share_fate
from actors.supervision.peers import Life, Runtime, is_subtree
from actors.supervision.reasons import Gone
from actors.supervision.refs import ChildInfo, ChildRef, ChildState, Counts, Down

Path: TypeAlias = str | Sequence[str]
"""The path from a supervisor down to a descendant: "gaits/walk", or ("gaits", "walk")."""


class RunningSupervisor(metaclass=NoPublicConstructor):
    """One run of a `Supervisor` or `DynamicSupervisor`: `await RunningSupervisor(spec, runtime).run(started)`.

    It is a `Life`, so supervisors nest. Requests are handled at once, also while children are starting or restarting; a request
    that starts or stops a child waits for that child only. Requests must come from the event loop's own thread. Canceling the
    caller of a request does not undo it: the child goes on starting or stopping. Before `run`, and once the supervisor is
    stopping, requests raise `SupervisorDown`.

    It has no public constructor: `System.supervisor` gives one.

    Invariants:

    - `Children` holds the whole state of the children, and `decide` alone says what follows from an event.
    - While `run` runs, only the `Executor` that it makes changes that state and uses the children's tasks.
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
        """The path from the root, joined by slashes."""
        return self._children.name

    @property
    def spec(self) -> Supervisor | DynamicSupervisor:
        """The present declaration of the supervisor, which `reconfigure` replaces."""
        return self._children.spec

    @property
    def phase(self) -> Phase:
        """The phase of the supervisor itself: "new", "starting", "running", "stopping" or "over"."""
        return self._children.phase

    # ------------------------------------------------------------------ running

    async def run(self, started: Callable[[], object], /) -> None:
        """Start all children in order, call `started()`, supervise until stopped, stop all children.

        Returns after `stop`, or after the end of a significant child shut it down. Raises `StartFailed` when a child
        does not start the first time, `SupervisorGaveUp` when the restart intensity is reached; in each case after all
        children have stopped. When its owner kills it, by a cancellation of its task for which `killed()` is true, it kills
        all children at once and raises the cancellation. After any other cancellation, such as that of `asyncio.run` at its
        end, it stops all children in order first. After an error of its own, or of a runtime that breaks its protocol, it
        kills all children and raises the error.
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
        """Ask for an orderly end: pending restarts are dropped, and the children stop in reverse order."""
        if self._executor is None:
            self._children.why = reason or "shutdown"
        else:
            self._executor.stop(reason)

    def _nest(
        self, spec: Supervisor | DynamicSupervisor, path: tuple[str, ...], killed: Callable[[], bool]
    ) -> RunningSupervisor:
        return create(RunningSupervisor, spec, self._runtime, path, leaked=self.leaked, killed=killed)

    # ------------------------------------------------------------------ inspecting

    def children(self) -> list[ChildInfo]:
        """All children, in start order (OTP lists the newest first)."""
        return [entry.info for entry in self._children]

    def counts(self) -> Counts:
        """The numbers of children. A child that is restarting counts in `specs`, not in `active`."""
        entries = self._children
        supervisors = sum(entry.spec.kind == "supervisor" for entry in entries)
        active = sum(entry.state == "running" for entry in entries)
        return Counts(len(entries), active, supervisors, len(entries) - supervisors)

    def child_spec(self, id: str) -> Spec:
        """The child's complete declaration, with all defaults. Raises `NotFound`."""
        return self._children.find(id).spec

    def which(self, path: Path) -> ChildRef | None:
        """The live reference of a descendant; None while it is not running. Raises `NotFound` for an unknown child."""
        entry = self._entry(path)
        return None if entry is None else entry.info.ref

    def life(self, path: Path) -> Life | None:
        """The present life of a descendant, also while it starts or stops. Raises `NotFound`.

        The life of a supervisor is a `RunningSupervisor`.
        """
        task = self.incarnation(path)
        return None if task is None else task.life

    def incarnation(self, path: Path) -> ChildTask | None:
        """The task of a descendant's present life, also while it starts or stops. Raises `NotFound`."""
        entry = self._entry(path)
        return None if entry is None else entry.now

    def state_of(self, path: Path) -> ChildState:
        """The state of a descendant, for display: "stopping" also while it cleans up after an end by itself.

        For a descendant whose supervisor does not run, it is the state of that supervisor; for an unknown one it is "stopped".
        """
        first, *rest = path.split("/") if isinstance(path, str) else path
        entry = self._children.entries.get(first)
        if entry is None:
            return "stopped"
        now = entry.now
        if rest and now is not None and is_subtree(now.life):
            return now.life.state_of(rest)
        state = entry.state
        return "stopping" if state == "running" and now is not None and now.ending else state

    @property
    def recent_restarts(self) -> int:
        """How many restarts counted for the restart intensity at the last restart."""
        return len(self._children.window.times)

    def statuses(self) -> dict[str, Entry]:
        """What is known of each child by its id, in start order, to be read only."""
        return dict(self._children.entries)

    def below(self) -> Iterator[RunningSupervisor]:
        """This supervisor, and all running supervisors below it."""
        yield self
        for life in self.lives():
            if isinstance(life, RunningSupervisor):
                yield from life.below()

    def lives(self) -> list[Life | None]:
        """The present lives of the children that have one; None for a child whose task has not taken its first step."""
        return [entry.now.life for entry in self._children if entry.now is not None]

    # ------------------------------------------------------------------ changing

    async def start_child(self, spec: Spec | type[object]) -> ChildRef | None:
        """Add a child after the others and start it; a class stands for ``Child(class)``. Returns its reference when it is ready, None if it
        declined to start.

        Raises `AlreadyStarted`, `AlreadyPresent`, `DeclarationError`; `StartFailed`, and then the child is not kept.
        """
        return await self.ask(StartChild(child_of(spec)))

    async def spawn(
        self, *args: object, name: str | None = None, parameters: Mapping[str, object] | None = None
    ) -> ChildRef | None:
        """Start an instance of a dynamic supervisor's template. Returns its reference when it is ready, None if it declined.

        `args` follow the template's own arguments, `parameters` override its parameters; both are kept for restarts.
        `name` defaults to that of the template with a number. Raises `TooManyChildren`, and what `start_child` raises.
        """
        return await self.ask(Spawn(args, name, parameters))

    async def terminate_child(self, target: str | ChildRef) -> None:
        """Stop a child, or drop its pending restart, and return when it has ended.

        The child is kept, and only `restart_child` starts it again; temporary children and instances of a template are
        forgotten. Nothing happens for a child that is stopped already, or a reference to an ended incarnation. Raises
        `NotFound`.
        """
        await self.ask(TerminateChild(target))

    async def restart_child(self, id: str) -> ChildRef | None:
        """Start a stopped child. Returns its reference when it is ready, None if it declined to start.

        Raises `Running`, `Restarting`, `NotFound`; `StartFailed`, and then the child is kept, without an automatic retry.
        """
        return await self.ask(RestartChild(id))

    async def delete_child(self, id: str) -> None:
        """Forget a stopped child. Raises `Running`, `Restarting`, `NotFound`."""
        await self.ask(DeleteChild(id))

    async def replace(self, id: str, factory: Callable[..., object]) -> ChildRef | None:
        """Replace the factory of a child, and if the child runs, restart it in order; other children go on.

        Returns the new reference when it is ready; None if the child was not running, and then `factory` is used at its next
        start. This does not count as a restart. Raises `NotFound`, `DeclarationError`; `StartFailed`, and then the child is
        stopped.
        """
        return await self.ask(ReplaceFactory(id, factory))

    async def reconfigure(self, spec: Supervisor | DynamicSupervisor) -> None:
        """Replace the declaration of this supervisor by another one of the same kind and name.

        Running children keep running. The supervisor's own options, and those of a child about its end, apply from the next
        end on; those of a child about its start from its next start on. Children that are not in the new declaration stay
        until they are terminated; new ones are added, but not started. Raises `DeclarationError`, and then nothing has
        changed.
        """
        await self.ask(Reconfigure(spec))

    def ask(self, request: Request) -> Caller:
        """Have a request handled in its turn. The future has the answer, which this or a later event gives."""
        self._children.check_open()
        executor = self._executor
        assert executor is not None
        if asyncio.get_running_loop() is not executor.loop:
            raise WrongThread(
                f"supervisor {self.name} was asked from a foreign event loop: ask it by asyncio.run_coroutine_threadsafe(..., loop)"
            )
        return executor.serve(request)

    # ------------------------------------------------------------------ watching

    def watch(self, ref: ChildRef) -> Awaitable[Down]:
        """A future of the end of this incarnation, at any depth below; it is done at once, with `Gone`, if that has ended already.

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
        """Link two incarnations: when one fails, the other is ended in order and counts as failed (`LinkBroken`).

        A return or an orderly stop does not end the other. Raises `NotFound` if one has ended already, or is of another tree.
        """
        first, second = self._task(one), self._task(other)
        if first is None or second is None:
            gone = one if first is None else other
            raise NotFound(f"{self.name} cannot link {one} to {other}: {gone} has ended")
        share_fate(first, second)

    # ------------------------------------------------------------------ finding

    def _entry(self, path: Path) -> Entry | None:
        """The entry of a descendant; None if a supervisor on the way to it does not run. Raises `NotFound`."""
        first, *rest = path.split("/") if isinstance(path, str) else path
        entry = self._children.find(first)
        if not rest or entry.now is None:
            return entry if not rest else None
        if not isinstance(life := entry.now.life, RunningSupervisor):
            where = "runs in another process" if is_subtree(life) else "is not a running supervisor"
            raise NotFound(f"{self.name}: {first} {where}, so {'/'.join(rest)} cannot be reached there")
        return life._entry(rest)

    def _task(self, ref: ChildRef) -> ChildTask | None:
        """The task of the life that `ref` refers to; None if that has ended. Raises `NotFound` for a reference outside of this tree."""
        depth = len(self.path)
        if ref.path[:depth] != self.path or len(ref.path) == depth:
            raise NotFound(f"{ref} is not below {self.name}")
        try:
            task = self.incarnation(ref.path[depth:])
        except NotFound:
            return None
        return task if task is not None and task.ref == ref else None


def _grace_of(life: Life | None) -> float:
    """Seconds from the kill of a child to its abandonment: for a supervisor, `GRACE` more than for the slowest of its children."""
    if not isinstance(life, RunningSupervisor):
        return GRACE
    return GRACE + max((_grace_of(each) for each in life.lives()), default=0.0)
