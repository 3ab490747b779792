"""A running supervisor, for those who use it: look at its children, and change them while it runs."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Mapping

from actors.supervision.base import Phase
from actors.supervision.child_task import ChildTask, LeakedChild
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.errors import NotFound
from actors.supervision.reasons import Gone
from actors.supervision.refs import ChildInfo, ChildRef, ChildState, Counts, Down
from actors.supervision.requests import Path, Requests
from actors.supervision.seam import ChildStatus, Life
from actors.supervision.watching import complete_on_end, share_fate

__all__ = ["LeakedChild", "RunningSupervisor"]


class RunningSupervisor(Requests):
    """One run of a `Supervisor` or `DynamicSupervisor`: `await RunningSupervisor(spec, runtime).run(started)`.

    All requests answer at once, also while children are starting or restarting; those that start or stop a child wait
    for just that child. They must come from the event loop's own thread. A caller that is cancelled takes nothing back:
    the child goes on starting or stopping. Before `run`, and once it is stopping, requests raise `SupervisorDown`.

    It has no public constructor: `System.supervisor` gives one.
    """

    # ------------------------------------------------------------------ looking

    def children(self) -> list[ChildInfo]:
        """All children in start order (OTP lists the newest first)."""
        return [entry.info for entry in self._entries.values()]

    def counts(self) -> Counts:
        """How many there are. One that is restarting counts in `specs`, not in `active`."""
        entries = self._entries.values()
        supervisors = sum(entry.spec.kind == "supervisor" for entry in entries)
        active = sum(entry.state == "running" for entry in entries)
        return Counts(len(entries), active, supervisors, len(entries) - supervisors)

    def child_spec(self, id: str) -> Spec:
        """The child's complete declaration, with all defaults. Raises `NotFound`."""
        return self._entry(id).spec

    def which(self, path: Path) -> ChildRef | None:
        """The live reference of a descendant; None while it is not running. Raises `NotFound` for an unknown one."""
        incarnation = self._walk(path)
        running = incarnation is not None and incarnation.entry.state == "running"
        return incarnation.ref if incarnation is not None and running else None

    def life(self, path: Path) -> Life | None:
        """The life of a descendant's present incarnation, also while it starts or stops. Raises `NotFound`.

        Of a supervisor it is a `RunningSupervisor`.
        """
        incarnation = self._walk(path)
        return incarnation.life if incarnation else None

    def incarnation(self, path: Path) -> ChildTask | None:
        """A descendant as its supervisor sees it, while it runs, starts or stops. Raises `NotFound`."""
        return self._walk(path)

    def state_of(self, path: Path) -> ChildState:
        """The state of a descendant, to show: "stopping" also while it cleans up after an end of its own.

        Of one whose own supervisor does not run, it is that supervisor's; of one that is not known, "stopped".
        """
        first, *rest = path.split("/") if isinstance(path, str) else path
        entry = self._entries.get(first)
        if entry is None:
            return "stopped"
        now = entry.now
        if rest and now is not None and isinstance(now.life, RunningSupervisor):
            return now.life.state_of(rest)
        state = entry.state
        return "stopping" if state == "running" and now is not None and now.ending else state

    @property
    def phase(self) -> Phase:
        """What the supervisor itself does: it is new, starting, running, stopping or over."""
        return self._phase

    @property
    def recent_restarts(self) -> int:
        """How many restarts the window of its intensity held at the last restart."""
        return len(self._window.times)

    def statuses(self) -> dict[str, ChildStatus]:
        """What the books say of each child, in start order."""
        return dict(self._entries)

    def below(self) -> Iterator[RunningSupervisor]:
        """This supervisor, and all running ones below it."""
        yield self
        for entry in self._entries.values():
            if entry.now is not None and isinstance(entry.now.life, RunningSupervisor):
                yield from entry.now.life.below()

    # ------------------------------------------------------------------ changing

    async def start_child(self, spec: Spec) -> ChildRef | None:
        """Add a child after the others and start it; returns when it is ready, None if it declined to start.

        Raises `AlreadyStarted`, `AlreadyPresent`, `DeclarationError`; `StartFailed`, and then the spec is not kept.
        """
        return await self._request(self._on_start_child, spec)

    async def spawn(
        self, *args: object, name: str | None = None, parameters: Mapping[str, object] | None = None
    ) -> ChildRef | None:
        """Start an instance of a dynamic supervisor's template; returns when it is ready, None if it declined.

        `args` follow the template's own arguments, `parameters` override its parameters; both are kept for restarts.
        `name` defaults to the template's with a running number. Raises `TooManyChildren`, and what `start_child` does.
        """
        return await self._request(self._on_spawn, args, name, parameters)

    async def terminate_child(self, target: str | ChildRef) -> None:
        """Stop a child, or drop its pending restart; returns when it has ended. Its spec stays, and nothing but
        `restart_child` starts it again. Temporary children and instances of a template are forgotten.

        A child that is stopped already, or a reference to an ended incarnation, is fine. Raises `NotFound`.
        """
        await self._request(self._on_terminate, target)

    async def restart_child(self, id: str) -> ChildRef | None:
        """Start a stopped child from its spec; returns when it is ready, None if it declined.

        Raises `Running`, `Restarting`, `NotFound`; `StartFailed`, and then the spec stays, without an automatic retry.
        """
        return await self._request(self._on_restart_child, id)

    async def delete_child(self, id: str) -> None:
        """Forget a stopped child. Raises `Running`, `Restarting`, `NotFound`."""
        await self._request(self._on_delete, id)

    async def replace(self, id: str, factory: Callable[..., object]) -> ChildRef | None:
        """Change what makes a child, and put the new in the place of the old: stop in order, start, one child only.

        Returns when the new one is ready, None if the child was not running; then `factory` serves its next start. Not
        counted as a restart. Raises `NotFound`, `DeclarationError`; `StartFailed`, and then the child is stopped.
        """
        return await self._request(self._on_replace, id, factory)

    async def reconfigure(self, spec: Supervisor | DynamicSupervisor) -> None:
        """Put another declaration of the same kind and name in the place of this supervisor's.

        Running children keep running. Options, and what is said about the end of a child, hold from the next end on;
        what is said about its start from the next start on. Children that are not in the new declaration stay until
        terminated; new ones are known, but not started. Raises `DeclarationError`, and then nothing has changed.
        """
        await self._request(self._on_reconfigure, spec)

    # ------------------------------------------------------------------ watching

    def watch(self, ref: ChildRef) -> Awaitable[Down]:
        """A future of the end of this very incarnation, anywhere below; of `Gone` at once if it has ended already.

        Cancel the future to stop watching. Raises `NotFound` for a reference into another tree.
        """
        future: asyncio.Future[Down] = asyncio.get_running_loop().create_future()
        incarnation = self._incarnation(ref)
        if incarnation is None:
            future.set_result(Down(ref, Gone()))
        else:
            complete_on_end(incarnation, future)
        return future

    def link(self, one: ChildRef, other: ChildRef) -> None:
        """Let two share their fate: when one fails, the other is ended in order and counts as failed (`LinkBroken`).

        A return or an orderly stop breaks nothing. Raises `NotFound` if one has ended already, or is of another tree.
        """
        first, second = self._incarnation(one), self._incarnation(other)
        if first is None or second is None:
            gone = one if first is None else other
            raise NotFound(f"{self.name} cannot link {one} to {other}: {gone} has ended")
        share_fate(first, second)
