"""A system whose nodes end or are delayed at any step, start late and handle slowly, as the faults of a simulated run require."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Sequence
from typing import TYPE_CHECKING, Any, cast

from actors.checks import create
from actors.errors import CallCycle
from actors.places import USER, chain_of, owner_of
from actors.runtime.interceptor import Interceptor
from actors.system import System
from actors.testing.fault_values import CLOCK, Fault, Profile
from actors.testing.simulation.links import Links
from actors.testing.simulation.steps import Death, Delay, Steps, Watched

if TYPE_CHECKING:
    from actors.actions.client import SentGoals
    from actors.actions.peers import ActionPeer, GoalFollower
    from actors.graph.servers import ActionEntry
    from actors.interfaces.message import Message, Req, Resp
    from actors.runtime.incarnation import Incarnation
    from actors.services.client import Client
    from actors.services.peers import Caller, OpenCall, ServiceCall, ServicePeer, Submit
    from actors.supervision.peers import Life
    from actors.supervision.report import Report
    from actors.time.virtual_loop import VirtualLoop
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target
    from actors.transport.simulated.topology import Host


class InjectedCrash(Exception):
    """The simulation has ended a node."""


class Simulation(Interceptor):
    """Applies the faults of one simulated system, and records what happens in it. `profile` receives the counts.

    Invariant: it observes the system through the system's observers, and changes its behaviour only by faults.
    """

    def __init__(self, faults: Sequence[Fault], profile: Profile, *, host: Host | None = None, **options: Any) -> None:
        self.faults = tuple(faults)
        self.profile = profile
        self.host = host
        """The machine of a `Lab` on which the system runs."""
        self.orphaned: dict[Incarnation, float] = {}
        """Incarnation that ended before its tasks -> when it ended, in virtual seconds."""
        self.reported = 0
        """The number of reports of supervisors."""
        self.mistakes: list[Exception] = []
        """Errors that fail the run although a caller received them: failed assertions and refused cycles of calls."""
        self.deaths = 0
        """The number of nodes that have ended without clean-up."""
        self.interrupted: dict[tuple[str, ...], str] = {}
        """Path of a node that was canceled while it stopped -> where it waited then."""
        self._links = Links(faults, profile)
        self._lives: dict[object, _SimulatedLife] = {}
        self.system = system = create(System, **options)
        system.observe(reports=self._reported)
        system.runtime.intercept(self)
        observers = system.runtime.observers
        observers.answered.append(self.note)
        observers.ended.append(self._ended)
        self._schedule()

    def _schedule(self) -> None:
        system = self.system
        for fault in self.faults:
            if fault.kind == "clock-jump" and fault.target == CLOCK:
                system.loop.call_at(system.clock.loop_time(fault.nth / 1000.0), system.clock.shift_wall, fault.by)
            elif fault.kind == "kill":
                system.loop.call_at(system.clock.loop_time(fault.nth / 1000.0), self._kill, fault.target)

    def _kill(self, node: str) -> None:
        if self.system.stop_reason is None and self.system.runtime.directory.find(node) is not None:
            self.system.crash(node, InjectedCrash(f"{node} was ended by the simulation"))

    def life(self, path: tuple[str, ...], make: Callable[[], Life], /) -> Life:
        life = make()
        record = self.system.runtime.directory.records[path]
        if record.life is None or not self.system.runtime.tree.holds(path):
            return life
        simulated = self._lives[record.life] = _SimulatedLife(self, record.life, life)
        return simulated

    def creating_task(
        self, node: Caller, work: Coroutine[object, None, object], name: str
    ) -> Coroutine[object, None, object]:
        life = self._lives.get(node)
        if life is None:
            return work
        name = name or str(getattr(work, "__qualname__", work))
        return Watched(work, lambda: life.task_step(name))

    def invoking(self, node: Caller, label: str, handler: Callable[..., Any]) -> Callable[..., object]:
        if node not in self._lives:
            return handler
        handled, slow = self.profile.handled, self.faults_of("slow-handler", node.fqn)

        def invoked(*arguments: Any) -> Awaitable[object] | None:
            count = handled[node.fqn] = handled.get(node.fqn, 0) + 1
            fault = slow.get(count)
            if fault is None or cast("VirtualLoop", self.system.loop).stands_still:
                result: Awaitable[object] | None = handler(*arguments)
                return result
            return _late(handler, arguments, fault.by)

        return invoked

    def calling(self, client: Client[Req, Resp], submit: Submit) -> Submit:
        def submitted(server: ServicePeer, message: Message, caller: Caller, timeout: float) -> ServiceCall:
            call = submit(server, message, caller, timeout)
            call.future.add_done_callback(self._answered)
            return call

        return submitted

    def sending_goals(self, node: Caller, entry: ActionEntry, ways: SentGoals) -> SentGoals:
        def submit(server: ActionPeer, goal_id: bytes, message: Message, client: GoalFollower) -> OpenCall:
            request = ways.submit(server, goal_id, message, client)
            request.future.add_done_callback(self._answered)
            return request

        return ways._replace(submit=submit)

    def delivering(self, publisher: PublisherPeer, subscription: SubscriptionPeer, target: Target) -> Target:
        return self._links.delivering(publisher, subscription, target)

    def _answered(self, future: asyncio.Future[object]) -> None:
        if not future.cancelled() and isinstance(error := future.exception(), CallCycle):
            self.note(error)

    def _ended(self, life: Incarnation) -> None:
        self._lives.pop(life, None)
        if life.tasks:
            self.orphaned[life] = self.system.loop.time()

    def _reported(self, report: Report) -> None:
        self.reported += 1

    def note(self, error: Exception) -> None:
        """Keep an error that a caller received, if it fails the run in any case."""
        if isinstance(error, (AssertionError, CallCycle)) and error not in self.mistakes:
            self.mistakes.append(error)

    def faults_of(self, kind: str, node: str) -> dict[int, Fault]:
        """The faults of one kind for one node, by `nth`."""
        return {fault.nth: fault for fault in self.faults if fault.kind == kind and fault.target == node}


class _SimulatedLife:
    """A life that may start late, and may be delayed or ended at any step of its work. Each step of its tasks is counted."""

    def __init__(self, simulation: Simulation, node: Incarnation, life: Life) -> None:
        self._simulation = simulation
        self._node = node
        self._life = life
        simulation.profile.awaits.setdefault(node.fqn, 0)
        self._steps = Steps(node.fqn, simulation.faults, simulation.profile.steps)
        self._doomed = False
        self._task: asyncio.Task[object] | None = None
        self._body: Coroutine[object, None, None] | None = None

    async def run(self, started: Callable[[], None], /) -> None:
        simulation, node = self._simulation, self._node.fqn
        deaths = simulation.faults_of("crash", node)
        late = simulation.faults_of("slow-start", node).get(self._node.incarnation)
        self._task = asyncio.current_task()
        self._body = self._run_late(started, 0.0 if late is None else late.by)
        try:
            await Watched(self._body, lambda: self._own_step(deaths), self._interrupted)
        except Death:
            simulation.deaths += 1
            raise InjectedCrash(f"{node} was ended here by the simulation") from None

    def stop(self, reason: str, /) -> None:
        self._life.stop(reason)

    async def _run_late(self, started: Callable[[], None], seconds: float) -> None:
        if seconds:
            try:
                await asyncio.sleep(seconds)
            except BaseException:  # the node has not begun to start, so there is nothing to clean up
                self._node.release()
                self._node.runtime.ended(self._node)
                raise
        await self._life.run(started)

    @property
    def _mortal(self) -> bool:
        return self._node.phase == "running" and self._node.runtime.stop_reason is None

    def _own_step(self, deaths: dict[int, Fault]) -> Delay:
        """Count an await of the node's own task. Returns the delay of the following step."""
        if not self._mortal:
            return 0.0
        awaits, node = self._simulation.profile.awaits, self._node.fqn
        count = awaits[node] = awaits.get(node, 0) + 1
        item = self._node.inbox.current
        fault = self._steps.count(item.label) if item is not None else None
        if count in deaths or (fault is not None and fault.kind == "crash"):
            raise Death
        return self._late(fault)

    def task_step(self, work: str) -> Delay:
        """Count a step of a task of this node. Returns its delay: infinite if the node ends at this step."""
        fault = self._steps.count(work) if self._mortal else None
        if fault is not None and fault.kind == "crash" and self._task is not None:
            self._doomed = True
            self._task.cancel()
            return math.inf
        return self._late(fault)

    def _late(self, fault: Fault | None) -> Delay:
        """The delay of a step; 0 while time stands still, since this step may be what time waits for."""
        host = self._simulation.host
        paused = None if host is None else host.resumed
        if (fault is None and paused is None) or cast("VirtualLoop", self._node.runtime.loop).stands_still:
            return 0.0
        return paused or cast("Fault", fault).by

    def _interrupted(self, error: object) -> None:
        """Handle an error that is thrown into the node's own task."""
        if self._doomed:
            raise Death
        if self._node.asked is not None and isinstance(error, asyncio.CancelledError):
            self._simulation.interrupted[self._node.identity.path] = "; ".join(self._waits())

    def _waits(self) -> Iterator[str]:
        """Yield where the node's own task waits, and then each of its other tasks."""
        if place := _place(self._body):
            yield f"it waited at {place}"
        for task in self._node.tasks:
            yield f"its task {task.get_name()} waited at {_place(task.get_coro()) or 'its beginning'}"


def _place(suspended: object) -> str:
    """The innermost line of user code at which a coroutine waits, as ``file:line in function``."""
    frames = [frame for _, frame in chain_of(suspended) if owner_of(frame.f_code.co_filename) == USER]
    return f"{frames[-1].f_code.co_filename}:{frames[-1].f_lineno} in {frames[-1].f_code.co_qualname}" if frames else ""


async def _late(handler: Callable[..., Any], arguments: tuple[object, ...], seconds: float) -> object:
    await asyncio.sleep(seconds)
    pending = handler(*arguments)
    return None if pending is None else await pending
