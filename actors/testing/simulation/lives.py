"""A system in which nodes die at an await, start late and handle slowly, as the faults of a simulated run say."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Generator, Sequence
from typing import TYPE_CHECKING, Any, cast

from actors.control import Failure, Unwinding
from actors.errors import CallCycle
from actors.life import NodeLife
from actors.system import System
from actors.testing.faults import CLOCK, Fault, Profile
from actors.testing.simulation.links import Link, entrance

if TYPE_CHECKING:
    from actors.channel import Queue
    from actors.core import Core
    from actors.feeds import Feed
    from actors.supervision.report import Report
    from actors.supervisor import Child
    from actors.timers import TimerItem

__all__ = ["InjectedCrash", "SimulatedSystem"]


class InjectedCrash(Exception):
    """The simulation ended a node here."""


class _Death(Unwinding):
    """Thrown into a node that dies: nothing that catches errors may catch it."""


class SimulatedSystem(System):
    """A `System` with faults. What happened is counted in `profile`."""

    def __init__(self, faults: Sequence[Fault], profile: Profile, **options: Any) -> None:
        super().__init__(**options)
        self.faults = tuple(faults)
        self.profile = profile
        self.links: dict[Queue[Any], Link] = {}
        self.bereaved: dict[Core, float] = {}
        """Incarnations that ended before their tasks -> when that was."""
        self.reported = 0
        """How many reports of supervisors there were."""
        self.disgraces: list[Exception] = []
        """Errors that are nobody's answer, though callers were answered with them: a failed assertion, a deadlock that was refused."""
        self.graph.entrance = entrance(self.links, faults, profile)
        for fault in faults:
            if fault.kind == "clock-jump" and fault.target == CLOCK:
                self.loop.call_at(self.clock.loop_time(fault.nth / 1000.0), self.clock.shift_wall, fault.by)
            elif fault.kind == "kill":
                self.loop.call_at(self.clock.loop_time(fault.nth / 1000.0), self._kill, fault.target)

    def ended(self, core: Core) -> None:
        super().ended(core)
        if core.tasks:
            self.bereaved[core] = self.loop.time()

    def report(self, report: Report) -> None:
        super().report(report)
        self.reported += 1

    def answered(self, error: Exception) -> None:
        super().answered(error)
        if isinstance(error, (AssertionError, CallCycle)):
            self.disgraces.append(error)

    def faults_of(self, kind: str, node: str) -> dict[int, Fault]:
        """The faults of one kind in one node, by their number."""
        return {fault.nth: fault for fault in self.faults if fault.kind == kind and fault.target == node}

    def _kill(self, node: str) -> None:
        core = self.core_of(node)
        if core is not None and self.stop_reason is None:
            core.inbox.put_control(Failure(InjectedCrash(f"{node} was ended by the simulation"), "simulation"))

    def life(self, child: Child, path: tuple[str, ...], incarnation: int) -> NodeLife:
        plain = super().life(child, path, incarnation)
        return plain if path[0] == "guests" else _SimulatedLife(self, child, plain.identity, plain.mailbox)

    def check_place(self, child: Child, path: tuple[str, ...]) -> None:
        """A child with ``process=True`` runs in this process: its contracts are the same, and the only clock is here."""

    def running_now(self, core: Core) -> None:
        super().running_now(core)
        if core.identity.path[0] != "guests":
            _slow_down(core, self.profile, self.faults_of("slow-handler", core.fqn))


class _SimulatedLife(NodeLife):
    """One incarnation that may start late and die at an await."""

    __slots__ = ()
    system: SimulatedSystem

    async def run(self, started: Callable[[], None]) -> None:
        node = self.identity.fqn
        self.system.profile.awaits.setdefault(node, 0)
        late = self.system.faults_of("slow-start", node).get(self.mailbox.incarnation + 1)
        if late is not None:
            await asyncio.sleep(late.by)
        deaths = self.system.faults_of("crash", node)
        try:
            await _Mortal(
                super().run(started),
                lambda: self.phase == "running" and self.system.stop_reason is None and self._resumed(node, deaths),
            )
        except _Death:
            raise InjectedCrash(f"{node} was ended here by the simulation") from None

    def _resumed(self, node: str, deaths: dict[int, Fault]) -> bool:
        """Count one more await of the node; whether it is to die there."""
        awaits = self.system.profile.awaits
        count = awaits[node] = awaits.get(node, 0) + 1
        return count in deaths


class _Mortal:
    """A coroutine that dies at the await at which `dies` says so: the awaited expression raises."""

    def __init__(self, inner: Coroutine[Any, Any, None], dies: Callable[[], bool]) -> None:
        self.cr_await = inner  # the name by which debuggers and our own reports follow a suspended coroutine
        self.cr_frame = None
        self._dies = dies

    def __await__(self) -> Generator[Any, Any, None]:
        return cast("Generator[Any, Any, None]", self)

    def __next__(self) -> Any:
        return self.send(None)

    def send(self, value: Any) -> Any:
        if self._dies():
            return self.cr_await.throw(_Death())
        return self.cr_await.send(value)

    def throw(self, *error: Any) -> Any:
        return self.cr_await.throw(*error)


def _slow_down(core: Core, profile: Profile, slow: dict[int, Fault]) -> None:
    """Count the handler runs of a node, and let those that are to be slow wait before they begin."""

    def counted(handler: Callable[..., Any]) -> Callable[..., Any]:
        def handle(*arguments: Any) -> Awaitable[None] | None:
            count = profile.handled[core.fqn] = profile.handled.get(core.fqn, 0) + 1
            fault = slow.get(count)
            if fault is None:
                result: Awaitable[None] | None = handler(*arguments)
                return result
            return _late(handler, arguments, fault.by)

        return handle

    items: list[Feed[Any] | TimerItem] = [*core.mailbox.feeds, *core.timers]
    for item in items:
        item.handler = counted(cast("Callable[..., Any]", item.handler))


async def _late(handler: Callable[..., Any], arguments: tuple[Any, ...], seconds: float) -> None:
    await asyncio.sleep(seconds)
    pending = handler(*arguments)
    if pending is not None:
        await pending
