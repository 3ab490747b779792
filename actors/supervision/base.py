"""The ground of a supervisor: what it knows, its inbox, the start of one child, and how it tells others."""

from __future__ import annotations

import asyncio
import contextvars
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from itertools import count
from typing import Any, Literal, TypeAlias, TypeVarTuple

from actors.supervision.child_task import GRACE, ChildTask, LeakedChild
from actors.supervision.declarations import Child, DynamicSupervisor, Spec, Supervisor
from actors.supervision.entry import Entry
from actors.supervision.lane import Lane
from actors.supervision.policy import temporary
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef, Down
from actors.supervision.report import Context, Report
from actors.supervision.seam import Life, Runtime
from actors.supervision.window import Window

__all__ = ["Base"]

Args = TypeVarTuple("Args")

Phase: TypeAlias = Literal["new", "starting", "running", "stopping", "over"]

_serials = count(1)


class Base(ABC):
    """State and elementary acts. Handlers, here and in all that is built on it, run one at a time and never wait."""

    loop: asyncio.AbstractEventLoop
    _context: contextvars.Context

    def __init__(
        self,
        spec: Supervisor | DynamicSupervisor,
        runtime: Runtime,
        path: tuple[str, ...] | None = None,
        *,
        leaked: list[LeakedChild] | None = None,
        killed: Callable[[], bool] = lambda: True,
    ) -> None:
        self.spec = spec
        self.runtime = runtime
        self.path = (spec.name,) if path is None else path
        self.leaked: list[LeakedChild] = [] if leaked is None else leaked
        self._killed = killed
        self._entries: dict[str, Entry] = {}
        self._positions = count(1)
        self._names = count(1)
        self._lane = Lane()
        self._window = Window()
        self._phase: Phase = "new"
        self._inbox: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._busy = False
        for child in spec.children if isinstance(spec, Supervisor) else ():
            self._add(child)

    def __repr__(self) -> str:
        return f"<supervisor {'/'.join(self.path)}: {self._phase}, {len(self._entries)} children>"

    @property
    def name(self) -> str:
        """The path from the root, as one text."""
        return "/".join(self.path)

    @property
    def dynamic(self) -> bool:
        return isinstance(self.spec, DynamicSupervisor)

    def post(self, handler: Callable[[*Args], None], *args: *Args) -> None:
        """Put an event into the inbox, and handle what is in it unless that is already under way."""
        self._inbox.append((handler, args))
        if not self._busy:
            self._busy = True
            try:
                self._context.run(self._handle_all)
            finally:
                self._busy = False

    def _handle_all(self) -> None:
        while self._inbox:
            handler, args = self._inbox.popleft()
            try:
                handler(*args)
            except Exception as error:
                self._broken(error)

    def _add(self, spec: Spec) -> Entry:
        entry = self._entries[spec.name] = Entry(spec, next(self._positions))
        return entry

    def _start(self, entry: Entry) -> None:
        entry.number += 1
        ref = ChildRef((*self.path, entry.spec.name), entry.number, next(_serials))
        entry.now = ChildTask(self, entry, ref)

    def _ask(self, incarnation: ChildTask, why: str) -> None:
        incarnation.stop(why, incarnation.entry.spec.stop)

    def _forget(self, entry: Entry) -> None:
        """What ends for good leaves no trace if it is temporary, or an instance of a template."""
        if entry.spec.restart == temporary or self.dynamic:
            self._entries.pop(entry.spec.name, None)

    def _keeps(self, entry: Entry) -> bool:
        """Whether this child stays known after its end: it is declared, or waits for a request to start it again."""
        if isinstance(self.spec, DynamicSupervisor):
            return False
        name = entry.spec.name
        return self._entries.get(name) is entry or any(child.name == name for child in self.spec.children)

    # ------------------------------------------------------------------ what incarnations ask and tell

    def make_life(self, incarnation: ChildTask, /) -> Life:
        spec, ref = incarnation.entry.spec, incarnation.ref
        if isinstance(spec, Child):
            return self.runtime.life(spec, ref.path, ref.incarnation)
        return type(self)(
            spec, self.runtime, ref.path, leaked=self.leaked, killed=lambda: incarnation.killed is not None
        )

    def ready(self, incarnation: ChildTask, /) -> None:
        self.post(self._on_ready, incarnation)

    def ended(self, incarnation: ChildTask, reason: ExitReason, /) -> None:
        self.post(self._on_ended, incarnation, reason)

    def abandoned(self, incarnation: ChildTask, /) -> None:
        leaked = LeakedChild(incarnation.ref, incarnation.task)
        self.leaked.append(leaked)
        incarnation.task.add_done_callback(lambda _: self.leaked.remove(leaked))

    @abstractmethod
    async def run(self, started: Callable[[], object], /) -> None: ...

    @abstractmethod
    def stop(self, reason: str = "shutdown", /) -> None: ...

    @abstractmethod
    def _broken(self, error: Exception) -> None: ...

    @abstractmethod
    def _on_ready(self, incarnation: ChildTask) -> None: ...

    @abstractmethod
    def _on_ended(self, incarnation: ChildTask, reason: ExitReason) -> None: ...

    def grace_of(self, life: Life | None, /) -> float:
        """Seconds from the kill of a child to its abandonment: a supervisor needs one more than its slowest child."""
        if not isinstance(life, Base):
            return GRACE
        below = (self.grace_of(entry.now.life) for entry in life._entries.values() if entry.now is not None)
        return GRACE + max(below, default=0.0)

    # ------------------------------------------------------------------ telling others

    def _notify(self, incarnation: ChildTask, reason: ExitReason) -> None:
        if incarnation.watchers:
            down = Down(incarnation.ref, reason)
            for watcher in list(incarnation.watchers):
                watcher(down)

    def _report(
        self, context: Context, incarnation: ChildTask, reason: ExitReason | None = None, note: str = ""
    ) -> None:
        restart = incarnation.entry.spec.restart
        report = Report(context, self.path, incarnation.ref, restart, self.loop.time(), reason, note)
        self._guard("report()", self.runtime.report, report)

    def _tell_gone(self, entry: Entry) -> None:
        """Nothing but a request will start this child again. Whoever ends as a whole need not say so of each child, unless
        it would not know them again."""
        if self.dynamic or self._phase in ("starting", "running"):
            self._guard("gone()", self.runtime.gone, (*self.path, entry.spec.name), self._keeps(entry))

    def _guard(self, hook: str, call: Callable[[*Args], object], *args: *Args) -> None:
        """Call somebody else's code. What it raises must not keep the supervisor from its work."""
        try:
            call(*args)
        except Exception as error:
            message = f"supervisor {self.name}: {hook} raised; the supervisor goes on"
            self.loop.call_exception_handler({"message": message, "exception": error})
