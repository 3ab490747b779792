"""`ParentSide`: brings what a process tells into the system of its parent: log lines, reports, and the records of its nodes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, cast

from actors.errors import ProgramExit
from actors.logs import LogRecord
from actors.processes.messages import Line, News, NodeFacts, Order, Packed, Told
from actors.processes.pickling import pack
from actors.supervision.child import Child
from actors.supervision.declarations import Supervisor
from actors.transport.protocol import WireUnavailable
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.processes.life import Process
    from actors.processes.rendezvous import Rendezvous
    from actors.runtime.runtime import NodeRecord, Runtime
    from actors.supervision.child_task import ChildTask
    from actors.supervision.refs import ChildState

KNOWN_SECONDS: Final = 2.0
"""A child that is ready waits until its nodes are known to its parent's transport; after so many seconds a line says so,"""
UNMET_SECONDS: Final = 20.0
"""and after so many the start has failed. A machine that is busy needs a while."""


class ParentSide:
    """The parent's side of one child of another process, over one life. What a next life needs of this one is in the records of the nodes.

    Invariants: every node that the process has told of has a record, in which `process` is the id of that process. What the parent itself
    knows of the child, the restarts of a node with a process of its own, is not taken from the process.
    """

    def __init__(
        self,
        runtime: Runtime,
        rendezvous: Rendezvous,
        task: ChildTask,
        running: Callable[[Process, bool], None],
    ) -> None:
        self._runtime = runtime
        self._rendezvous = rendezvous
        self._task = task
        """The supervisor's task of the child."""
        self._spec = cast("Child | Supervisor", task.entry.spec)
        self._path = task.ref.path
        self._states: dict[tuple[str, ...], ChildState] = {}
        """The state of each node that the process has told of, by path."""
        self._looking = Waiters()
        """Who waits for another state of a node, or of the graph."""
        self._running = running
        self._process: Process | None = None
        if isinstance(self._spec, Child):
            runtime.enter(self._spec, self._path)

    def order(self) -> Order:
        """What the next process is to run."""
        runtime = self._runtime
        return Order(
            spec=self._spec,
            path=self._path,
            seed=runtime.seed,
            level=runtime.system_log.level,
            options=runtime.options,
            transport=self._rendezvous.sibling(),
            domain_id=self._rendezvous.domain_id,
            nodes=tuple(self._facts_of(record) for record in runtime.directory.below(self._path) if record.incarnation),
            wall=runtime.clock.wall() - runtime.loop.time() if runtime.clock.virtual else None,
            placement=runtime.placement,
        )

    def begin(self, process: Process) -> None:
        """The process has been launched."""
        self._process = process
        self._running(process, True)
        record = self._runtime.directory.records.get(self._path)
        if record is not None:
            record.process = process.id

    def end(self) -> None:
        """The process has ended."""
        assert self._process is not None
        self._running(self._process, False)
        now = self._runtime.loop.time()
        for record in self._runtime.directory.below(self._path):
            record.ended_at = now

    # -- what the process tells ---------------------------------------------------------------------------------------------

    def take(self, event: News) -> None:
        """The process has told something that is not about its own life."""
        if isinstance(event, Line):
            self._line(event)
        elif isinstance(event, Told):
            self._runtime.system_log.keep(event.report)
        else:
            for facts in event.changed:
                self._note(facts)
            for path in event.gone:
                del self._states[path]
                self._runtime.gone(path, False)
            self._looking.wake_all()

    def _line(self, line: Line) -> None:
        system_log = self._runtime.system_log
        # The time of this process may have slipped, that of the line's has not: it is never later than its arrival.
        now = min(line.at, self._runtime.loop.time()) - self._runtime.clock.loop_time(0.0)
        fields = {"process": self._id, **line.fields}
        system_log.write(
            LogRecord(
                now, line.level, line.node, line.incarnation, line.event, fields, times=line.times, trace=line.trace
            )
        )

    def _note(self, facts: NodeFacts) -> None:
        runtime = self._runtime
        self._states[facts.path] = facts.state
        own = self._spec if isinstance(self._spec, Child) else facts.child
        record = runtime.enter(own, facts.path)
        record.process, record.incarnation = facts.process or self._id, facts.incarnation
        record.asked_state = facts.asked_state
        record.saved = None if facts.saved is None else Packed(facts.saved)
        if facts.path != self._path:
            record.restart_count = facts.restart_count
            origin = runtime.clock.loop_time(0.0)
            record.restarts = [(at - origin, why) for at, why in facts.restarts]

    def _facts_of(self, record: NodeRecord) -> NodeFacts:
        """What the next process has to know of a node's earlier lives."""
        origin, saved = self._runtime.clock.loop_time(0.0), record.saved
        return NodeFacts(
            record.path,
            record.child,
            "stopped",
            record.incarnation,
            record.restart_count,
            tuple((origin + at, why) for at, why in record.restarts),
            record.asked_state,
            saved=saved.data if isinstance(saved, Packed) else None if saved is None else pack(saved),
        )

    @property
    def _id(self) -> int:
        assert self._process is not None
        return self._process.id

    async def known(self) -> None:
        """Wait until the transport knows the nodes of the process that are running now.

        Raises `WireUnavailable` if it does not after `UNMET_SECONDS`. Of a process on another machine it waits for `KNOWN_SECONDS` only: the
        network between them may come later.
        """
        if await self._met(KNOWN_SECONDS) or self._spec.hosts:
            return
        named = sorted(self._missing())
        self._runtime.log.warning(
            "waiting for a process that is ready, and not reached yet", process=self._id, nodes=named
        )
        if not await self._met(UNMET_SECONDS - KNOWN_SECONDS):
            raise WireUnavailable(
                f"process {self._id} is ready, but the transport has not reached {', '.join(named)} for "
                f"{UNMET_SECONDS:g} s: the processes of a machine meet on its loopback interface, at the port of ROBACTOR_GOSSIP_PORT "
                "(7446): is the interface up, is the port not 0, and does no other program listen there? (docs/howto/ros2-network.md)"
            )

    async def _met(self, within: float) -> bool:
        """Wait until no node is missing, at most so many seconds; whether none is."""
        leave = self._runtime.graph.on_change(self._looking.wake_all)
        try:
            async with asyncio.timeout(within):
                while self._missing():
                    await self._looking.wait()
        except TimeoutError:
            return False
        finally:
            leave()
        return True

    def _missing(self) -> set[str]:
        records = self._runtime.directory.records
        running = {records[path].identity.fqn for path, state in self._states.items() if state == "running"}
        return running - {node.fqn for node in self._runtime.graph.elsewhere()}

    def state_of(self, path: Sequence[str]) -> ChildState:
        """The state of a descendant of the child, as the process has told it last."""
        return self._states.get((*self._path, *path), "stopped")

    # -- the supervisor's task of the child ---------------------------------------------------------------------------------

    def killed(self) -> bool:
        """Whether the supervisor has killed or abandoned this life."""
        return self._task.over or self._task.killed is not None

    def kill(self, after: float) -> None:
        """Have this life count as killed, after so many seconds of clean-up."""
        self._task.kill(after)

    def bound(self) -> None:
        """Limit the clean-up to the stop timeout of the child."""
        self._task.bound()

    def exits(self, code: int) -> ProgramExit:
        """Have the whole system stop in order, because a node of the process asks the program to exit."""
        request = ProgramExit("/".join(self._path), SystemExit(code))
        self._runtime.exits(request)
        return request
