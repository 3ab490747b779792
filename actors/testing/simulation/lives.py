"""A system in which nodes die or are late at any step, start late and handle slowly, as the faults of a simulated run say."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Awaitable, Callable, Coroutine, Generator, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar, cast

from actors.actions.client import Goal
from actors.errors import CallCycle
from actors.graph.graph import Graph
from actors.inbox.control import Failure
from actors.interfaces.message import Message
from actors.places import USER, chain_of, owner_of
from actors.runtime.core import Core
from actors.runtime.life import NodeLife
from actors.services.client import Client
from actors.system import System
from actors.testing.faults import CLOCK, Fault, Profile
from actors.testing.simulation.links import Link, interceptor
from actors.testing.simulation.steps import Death, Steps, Watched

if TYPE_CHECKING:
    from actors.contracts.contracts import Action, Service
    from actors.node.node import Node
    from actors.runtime.timers import NodeTimer
    from actors.services.server import Server
    from actors.supervision.declarations import Child
    from actors.supervision.report import Report
    from actors.time.virtual_loop import VirtualLoop
    from actors.topics.handler import HandlerSubscription
    from actors.topics.peers import SubscriptionPeer

__all__ = ["InjectedCrash", "SimulatedSystem"]

G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)
Req = TypeVar("Req", bound=Message)
Resp = TypeVar("Resp", bound=Message)


class InjectedCrash(Exception):
    """The simulation ended a node here."""


class SimulatedSystem(System):
    """A `System` with faults. What happened is counted in `profile`."""

    def __init__(self, faults: Sequence[Fault], profile: Profile, **options: Any) -> None:
        self.links: dict[SubscriptionPeer, Link] = {}
        intercept = interceptor(self.links, faults, profile)
        super().__init__(make_graph=partial(Graph, intercept=intercept), **options)
        self.faults = tuple(faults)
        self.profile = profile
        self.bereaved: dict[Core, float] = {}
        """Incarnations that ended before their tasks -> when that was."""
        self.reported = 0
        """How many reports of supervisors there were."""
        self.disgraces: list[Exception] = []
        """Errors that are nobody's answer, though callers were answered with them: a failed assertion, a deadlock that was refused."""
        self.deaths = 0
        """How many nodes have died without a clean-up."""
        self.interrupted: dict[tuple[str, ...], str] = {}
        """Path of a node that was to end and was canceled -> where it waited then."""
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
        if isinstance(error, (AssertionError, CallCycle)) and error not in self.disgraces:
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

    def running_now(self, core: Core) -> None:
        super().running_now(core)
        if core.identity.path[0] != "guests":
            _slow_down(core, self.profile, self.faults_of("slow-handler", core.fqn))


class _SimulatedLife(NodeLife):
    """One incarnation that may start late, be late at a step of its work, and die there."""

    __slots__ = ("_body", "_doomed", "_steps", "_task")
    system: SimulatedSystem

    async def run(self, started: Callable[[], None]) -> None:
        system, node = self.system, self.identity.fqn
        system.profile.awaits.setdefault(node, 0)
        late = system.faults_of("slow-start", node).get(self.mailbox.incarnation + 1)
        if late is not None:
            await asyncio.sleep(late.by)
        deaths = system.faults_of("crash", node)
        self._steps = Steps(node, system.faults, system.profile.steps)
        self._task = cast("asyncio.Task[Any]", asyncio.current_task())
        self._doomed = False
        self._body = super().run(started)
        try:
            await Watched(self._body, lambda: self._own_step(deaths), self._interrupted)
        except Death:
            system.deaths += 1
            raise InjectedCrash(f"{node} was ended here by the simulation") from None

    def _make_core(self, node: Node) -> Core:
        return _SimulatedCore(self, node)

    @property
    def _mortal(self) -> bool:
        return self.phase == "running" and self.system.stop_reason is None

    def _own_step(self, deaths: dict[int, Fault]) -> float:
        """Count one more await of the node's own task. By how much its step is late."""
        if not self._mortal:
            return 0.0
        awaits, node = self.system.profile.awaits, self.identity.fqn
        count = awaits[node] = awaits.get(node, 0) + 1
        item = self.mailbox.inbox.current
        fault = self._steps.count(item.label) if item is not None else None
        if count in deaths or (fault is not None and fault.kind == "crash"):
            raise Death
        return self._late(fault)

    def task_step(self, work: str) -> float:
        """Count one more step of a task of this node. By how much it is late: for ever, if the node dies there."""
        fault = self._steps.count(work) if self._mortal else None
        if fault is not None and fault.kind == "crash":
            self._doomed = True
            self._task.cancel()
            return math.inf
        return self._late(fault)

    def _late(self, fault: Fault | None) -> float:
        """Nothing is late while time stands still: it may stand still for what this very step has to end."""
        return fault.by if fault is not None and not cast("VirtualLoop", self.system.loop).stands_still else 0.0

    def _interrupted(self, error: object) -> None:
        """Something is thrown into the node's own task."""
        if self._doomed:
            raise Death
        if self.asked is not None and isinstance(error, asyncio.CancelledError):
            self.system.interrupted[self.identity.path] = "; ".join(self._waits())

    def _waits(self) -> Iterator[str]:
        """Where the node's own task waits, and each of its others."""
        if place := _place(self._body):
            yield f"it waited at {place}"
        for task in self.core.tasks if self.core is not None else ():
            yield f"its task {task.get_name()} waited at {_place(task.get_coro()) or 'its beginning'}"


def _place(suspended: object) -> str:
    """The innermost line of the user at which a coroutine waits, as ``file:line in function``."""
    frames = [frame for _, frame in chain_of(suspended) if owner_of(frame.f_code.co_filename) == USER]
    return f"{frames[-1].f_code.co_filename}:{frames[-1].f_lineno} in {frames[-1].f_code.co_qualname}" if frames else ""


class _SimulatedCore(Core):
    """A core whose tasks are watched step by step, and whose refused calls are told, also when the caller is content with the error."""

    __slots__ = ("_life",)
    system: SimulatedSystem

    def __init__(self, life: _SimulatedLife, node: Node) -> None:
        super().__init__(life.system, node, type(node).declarations, life.identity, life.mailbox)
        self._life = life

    def spawn(self, work: Coroutine[Any, Any, Any], *, name: str = "") -> asyncio.Task[Any]:
        name = name or str(getattr(work, "__qualname__", work))
        return super().spawn(Watched(work, lambda: self._life.task_step(name)), name=name)

    def client(self, service: Service[Req, Resp]) -> Client[Req, Resp]:
        plain = super().client(service)
        client = self.clients[service] = _ToldClient(self, plain.entry, service)
        return client

    def goal(self, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]:
        super().goal(action, message, timeout)
        return _ToldGoal(self, self.system.graph.action(self.identity.service(action.name)), action, message, timeout)


class _ToldClient(Client[Req, Resp]):
    __slots__ = ()
    node: _SimulatedCore

    async def call(self, message: Req, timeout: float) -> Resp:
        with _told(self.node.system):
            return await super().call(message, timeout)


class _ToldGoal(Goal[R, F]):
    __slots__ = ()
    _node: _SimulatedCore

    async def send(self) -> None:
        with _told(self._node.system):
            await super().send()


@contextlib.contextmanager
def _told(system: SimulatedSystem) -> Generator[None]:
    """Let the system know of a call that would have waited for itself, whatever becomes of the error."""
    try:
        yield
    except CallCycle as cycle:
        system.answered(cycle)
        raise


def _slow_down(core: Core, profile: Profile, slow: dict[int, Fault]) -> None:
    """Count the handler runs of a node, and let those that are to be slow wait before they begin."""

    def counted(handler: Callable[..., Any]) -> Callable[..., Any]:
        def handle(*arguments: Any) -> Awaitable[Any] | None:
            count = profile.handled[core.fqn] = profile.handled.get(core.fqn, 0) + 1
            fault = slow.get(count)
            if fault is None or cast("VirtualLoop", core.system.loop).stands_still:
                result: Awaitable[Any] | None = handler(*arguments)
                return result
            return _late(handler, arguments, fault.by)

        return handle

    items: list[HandlerSubscription[Any] | NodeTimer | Server] = [
        *core.mailbox.feeds,
        *core.timers,
        *core.mailbox.services.values(),
    ]
    for item in items:
        item.handler = counted(cast("Callable[..., Any]", item.handler))


async def _late(handler: Callable[..., Any], arguments: tuple[Any, ...], seconds: float) -> Any:
    await asyncio.sleep(seconds)
    pending = handler(*arguments)
    return None if pending is None else await pending
