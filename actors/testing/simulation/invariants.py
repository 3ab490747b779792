"""The invariants of a simulated system, checked whenever it is quiet: nothing can run without time passing."""

from __future__ import annotations

import asyncio
import gc
import math
from collections.abc import Iterable, Iterator, Sequence
from types import FrameType, MethodType
from typing import TYPE_CHECKING, Any, Protocol, cast

import anyio

from actors.places import awaited_in, parked
from actors.supervision.child_task import ChildTask

if TYPE_CHECKING:
    from actors.inbox.inbox import Item
    from actors.runtime.runtime import NodeRecord
    from actors.supervision.entry import Entry
    from actors.system import System
    from actors.testing.simulation.lives import Simulation
    from actors.time.virtual_loop import VirtualLoop
    from actors.topics.peers import Peer

PATIENCE = 10.0
"""How many seconds a handler may hold its node, or a canceled goal may go on, before it counts as stuck."""


class Invariant(Protocol):
    """A check of a quiet system. Raises `AssertionError` if it fails."""

    def __call__(self, system: System, /) -> None: ...


class InvariantBroken(AssertionError):
    """A simulated system was in a state that must never occur."""


class Watch:
    """Checks a system whenever it is quiet.

    It checks that endpoints belong to living nodes, that the records of supervisors agree with what is running, and that no handler holds
    its node for longer than `patience` seconds. The same limit applies to tasks that wait for each other's locks, to canceled goals and to
    the tasks of a node that has ended. Then the invariants `more` are called. `limit` is that of `Scenario`;
    `beside` holds all systems of the event loop, now or later.

    Invariants:

    * `_version` and `_reported` are those of the last check of the graph and of the counts, which are repeated only after a change.
    * The checks that need time (`look`) run at most ten times in `patience` seconds, and not while the system stops.
    """

    def __init__(
        self,
        simulation: Simulation,
        more: Sequence[Invariant] = (),
        patience: float = PATIENCE,
        limit: float = math.inf,
        beside: Sequence[System] = (),
    ) -> None:
        self._beside = beside
        self._simulation = simulation
        self._system = simulation.system
        self._patience = patience
        self._more = tuple(more)
        self._limit = limit
        self._version = -1
        self._reported = 0
        self._next = 0.0
        self._holding: dict[str, tuple[Item, int, float]] = {}
        self._canceling: dict[object, float] = {}

    def __call__(self) -> None:
        system = self._system
        if system.loop.time() > self._limit:
            self._limit = math.inf  # the clean-up needs time
            raise InvariantBroken(f"t={system.loop.time():g} s, and no end: {self._unfinished()}")
        if self._simulation.mistakes:
            raise self._simulation.mistakes.pop(0)
        if system.stop_reason is None:
            now = system.loop.time()
            if now >= self._next:
                self.look(now)
            for invariant in self._more:
                invariant(system)
        if self._simulation.reported != self._reported:
            self._reported = self._simulation.reported
            self._look_at_counts()
        ended_early = system.failure is not None or system.killed  # some of its endpoints are closed at its stop
        if not ended_early and system.graph.version != self._version:
            self._version = system.graph.version
            self._look_at_graph()

    def look(self, now: float) -> None:
        """Check for handlers, goals, tasks and locks that make no progress.

        It is called ten times in `patience` seconds while the system is quiet, and once at the end of a body, because a system in which
        nothing more happens has no quiet moments.
        """
        self._next = now + self._patience / 10.0
        self._look_at_handlers(now)
        self._look_at_goals(now)
        self._look_at_orphans(now)
        self._look_at_locks(now)
        self._look_at_counts()

    def _unfinished(self) -> str:
        """The nodes that are starting, stopping or busy, and where they wait."""
        stopping = self._system.stop_reason is not None
        about: list[str] = []
        for state in self._system.nodes.values():
            idle = not stopping or state.inbox.current is None
            if state.state == "stopped" or (state.state == "running" and idle):
                continue
            task = state.inbox.task
            where = awaited_in(task) if task is not None and not task.done() else ""
            about.append(f"{state.identity.fqn} is {state.state}" + (f", at {where}" if where else ""))
        return "; ".join(
            [*(["the system is to stop"] if stopping else []), *(about or ["no node is on the way to anything"])]
        )

    def _look_at_counts(self) -> None:
        """Check the records of the supervisors. This is also done after each of their reports."""
        for sentence in miscounts(self._system, self._beside):
            raise InvariantBroken(sentence)

    def _look_at_graph(self) -> None:
        """Check that no publisher, subscription or server belongs to a node that has ended for good."""
        states = self._system.nodes.values()
        alive = {state.identity.fqn for state in states if state.state != "stopped"}
        gone = {state.identity.fqn for state in states} - alive
        for entry in self._system.graph.topics.values():
            endpoints: list[Peer] = [*entry.publishers, *entry.subscriptions]
            for endpoint in endpoints:
                if endpoint.here and endpoint.node.fqn in gone:
                    raise InvariantBroken(f"{endpoint!r} has outlived its node")

    def _look_at_handlers(self, now: float) -> None:
        for state in self._system.nodes.values():
            inbox, node = state.inbox, state.identity.fqn
            item = inbox.current
            if item is None:
                self._holding.pop(node, None)
                continue
            held = self._holding.get(node)
            if held is None or held[0] is not item or held[1] != inbox.handled:
                held = self._holding[node] = (item, inbox.handled, self._last_step(inbox.task, now))
            if now - held[2] > self._patience:
                where = f", at {awaited_in(inbox.task)}" if inbox.task is not None else ""
                raise InvariantBroken(
                    f"{item.label} of {node} is stuck: it has been waiting since t={held[2]:.3f} s{where}, "
                    f"and {len(inbox.items)} more items wait behind it"
                )

    def _look_at_goals(self, now: float) -> None:
        canceling: dict[object, float] = {}
        for state in self._system.nodes.values():
            for server in state.actions.values():
                for goal in server.running:
                    if goal.interruption is None:
                        continue
                    since = canceling[goal] = self._canceling.get(goal, now)
                    if now - since > self._patience:
                        raise InvariantBroken(
                            f"{server.describe(goal)} was asked to cancel at t={since:.3f} s and goes on"
                        )
        self._canceling = canceling

    def _look_at_locks(self, now: float) -> None:
        """Check for a cycle of locks that has lasted for `patience` seconds; a timeout may break a shorter one."""
        circle = circle_of_locks(asyncio.all_tasks(self._system.loop))
        since = max((self._last_step(task, now) for task in circle), default=now)
        if now - since > self._patience:
            each = [f"{task.get_name()}, at {awaited_in(task)}" for task in circle]
            chain = " waits for a lock of ".join([*each, circle[0].get_name()])
            raise InvariantBroken(f"deadlock since t={since:.3f} s: {chain}")

    def _last_step(self, task: asyncio.Task[object] | None, now: float) -> float:
        """When a task last ran, in virtual seconds."""
        return cast("VirtualLoop", self._system.loop).last_step(task, now)

    def _look_at_orphans(self, now: float) -> None:
        orphaned = self._simulation.orphaned
        for life, since in list(orphaned.items()):
            if not life.tasks:
                del orphaned[life]
            elif now - since > self._patience:
                names = ", ".join(task.get_name() for task in life.tasks)
                raise InvariantBroken(f"{life.fqn} ended at t={since:.3f} s, and these tasks of it go on: {names}")


def miscounts(system: System, beside: Iterable[System] = ()) -> Iterator[str]:
    """Yield a sentence for each contradiction in the counts of a system in which nothing can run without time passing.

    A child has a running task exactly if its supervisor counts it as present. A node has an incarnation only while its supervisor has a
    task for it, and has had more incarnations than restarts. A supervisor that goes on has not counted more restarts than it allows.
    `beside` are other systems on the same event loop, whose tasks are known, too.
    """
    if system.supervisor is None:
        return
    tree = system.runtime.tree
    leaked = {one.ref.path for each in tree.supervisors() for one in each.leaked}
    for each in tree.supervisors():
        children = each.statuses()
        active = each.counts().active
        alive = _running(children.values())
        if active > len(alive):
            yield f"supervisor {each.name} counts {active} active children, and {len(alive)} have a task that runs"
        if each.phase == "running" and each.recent_restarts > each.spec.intensity.restarts:
            yield f"supervisor {each.name} goes on after {each.recent_restarts} restarts, and {each.spec.intensity} are allowed"
        for name, status in children.items():
            record = system.nodes.get((*each.path, name))
            if record is not None:
                yield from _miscounted(record, status, record.path in leaked)
    known = set[object]().union(*(_known(one) for one in (system, *beside)))
    for task in asyncio.all_tasks(system.loop) - known:
        if ChildTask.runs_in(task):
            yield f"{task.get_name()} runs, and no supervisor counts it among its children"


def _known(system: System) -> set[object]:
    """The tasks that the supervisors of a system count."""
    known: set[object] = set()
    for each in system.runtime.tree.supervisors():
        known |= {one.task for one in each.leaked} | _running(each.statuses().values())
    return known


def _running(children: Iterable[Entry]) -> set[object]:
    return {status.task for status in children if status.task is not None and not status.task.done()}


def _miscounted(record: NodeRecord, status: Entry, leaked: bool) -> Iterator[str]:
    where = "/".join(record.path)
    if record.life is not None and status.task is None and not leaked:
        yield f"{where} is {status.state} for its supervisor, and an incarnation of it has not ended"
    if record.restart_count > record.incarnation - (status.state == "running"):
        yield f"{where} has had {record.restart_count} restarts in {record.incarnation} lives"


def circle_of_locks(tasks: Iterable[asyncio.Task[Any]]) -> tuple[asyncio.Task[Any], ...]:
    """Return the tasks of one deadlock, each waiting for a lock of the next, the last for one of the first; empty if there is none."""
    waiting: dict[asyncio.Task[Any], object] = {}
    holders: dict[int, asyncio.Task[Any]] = {}
    for task in tasks:
        chain = parked(task)
        lock = _awaited(chain[-1][1]) if chain else None
        if lock is None:
            continue
        waiting[task] = lock
        held = [each for owner, _ in chain for each in _entered(owner)]
        if lock in held:  # a task that waits to enter has `__aexit__` on its stack already
            held.remove(lock)
        holders.update((id(each), task) for each in held)
    for first in waiting:
        path = [first]
        while (following := holders.get(id(waiting[path[-1]]))) is not None and following not in path:
            path.append(following)
        if following is first:
            return tuple(path)
    return ()


def _awaited(frame: FrameType) -> object | None:
    """The lock that a task waits for; None if it waits for none."""
    lock = frame.f_locals.get("self") if frame.f_code.co_name == "acquire" else None
    return lock if isinstance(lock, (asyncio.Lock, anyio.Lock)) else None


def _entered(suspended: object) -> list[object]:
    """The locks in whose ``async with`` block a coroutine is suspended."""
    ways_out = [each for each in gc.get_referents(suspended) if isinstance(each, MethodType)]
    return [
        way.__self__
        for way in ways_out
        if way.__name__ == "__aexit__" and isinstance(way.__self__, (asyncio.Lock, anyio.Lock))
    ]
