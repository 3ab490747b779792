"""`ChildTree`: runs the child that a process was made for, and tells the parent what becomes of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final

from msgspec import structs

from actors.checks import create
from actors.errors import NotRunning, NotStarted
from actors.logs import LogRecord
from actors.processes.flight_records import save
from actors.processes.messages import (
    CrashAsked,
    Event,
    Line,
    NodeFacts,
    Nodes,
    Order,
    Over,
    Packed,
    Ready,
    Request,
    StopAsked,
    Told,
)
from actors.processes.pickling import pack, unpack
from actors.runtime.node import Node
from actors.runtime.runtime import NodeRecord, OtherProcesses, Runtime
from actors.supervision.child import Child
from actors.supervision.declarations import Supervisor
from actors.supervision.errors import StartFailed
from actors.supervision.policy import Intensity, any_significant, temporary
from actors.supervision.process_options import HANG_SECONDS
from actors.supervision.reasons import ExitReason, Stopped, is_abnormal
from actors.supervision.report import Report
from actors.system import System, keep_step
from actors.transport.bridge import connect
from actors.transport.protocol import Transport

_NOTHING: Final = (None, None)


def _news(facts: NodeFacts) -> tuple[object, ...]:
    """The facts that change, to be compared; a declaration may hold what cannot be."""
    return structs.astuple(facts)[2:]


class ChildTree:
    """The child of an order, with a system of its own, below a supervisor with the path of its real supervisor.

    It runs once. `tell` gets all events, the last of them `Over`.

    Invariants:

    - `_reason` is the reason of the child's end, from the report of the supervisor above it; None before, and after an orderly end.
    - `_told` is what has been told of each node, but its declaration; only what differs from it is told again. `_seen` is what it was made
      from: only nodes of which that has changed are compared. What they leave for their next lives is compared by identity, in `_saved`.
    """

    def __init__(
        self,
        order: Order,
        transport: Transport,
        tell: Callable[[Event], None],
        processes: Callable[[Runtime], OtherProcesses],
    ) -> None:
        self._path = order.path
        self._tell = tell
        self._spec: Child | Supervisor = order.spec.replace(
            process=False, hosts=(), hang=HANG_SECONDS, restart=temporary, significant=True, backoff=None
        )
        self._reason: ExitReason | None = None
        self._told = {facts.path: _news(facts) for facts in order.nodes}
        self._seen: dict[tuple[str, ...], tuple[object, ...]] = {}
        self._saved: dict[tuple[str, ...], tuple[object, bytes | None]] = {}
        self._children: dict[tuple[str, ...], tuple[Child, Child]] = {}
        self._stop_asked: str | None = None
        self._started = False
        keep_step(self._spec)
        self.system = system = create(
            System,
            seed=order.seed,
            sinks=(self._line,),
            level=order.level,
            options=order.options,
            processes=processes,
            placement=order.placement,
        )
        if order.wall is not None:
            system.clock.shift_wall(order.wall + system.loop.time() - system.clock.wall())
        connect(system.runtime, transport, order.domain_id)
        self._recorders = [make() for make in order.recorders]
        for recorder in self._recorders:
            recorder.attach(system)
        observers = system.runtime.observers
        observers.reports.append(self._reported)
        observers.ready.append(lambda life: self.tell_nodes())
        observers.ended.append(self._changed)
        observers.dismissed.append(self._changed)
        self._remember(order)

    async def run(self) -> None:
        """Run the child to its end, and tell how it has ended."""
        system = self.system
        above = Supervisor(self._path[-2], children=[self._spec], intensity=Intensity(0), auto_shutdown=any_significant)
        try:
            system.open()
            await system.runtime.opened()
            if self._stop_asked is None:
                with suppress(StartFailed, NotRunning):
                    await system.start(above, self._path[:-1])
                    if self._begin():
                        await system.wait()
        finally:
            await system.stop(self._stop_asked or "its child has ended")
            self.tell_nodes()
        over = self._end()
        if is_abnormal(over.reason):
            for file in save(self._recorders, self._path, str(over.reason)):
                system.log.warning("flight record of a process", file=file)
        self._tell(over)

    def take(self, request: Request) -> None:
        """Do what the parent asks for."""
        if isinstance(request, StopAsked):
            self.stop(request.reason)
        else:
            self._crash(request)

    def stop(self, reason: str) -> None:
        """Ask for the orderly end of the child; a second call, once it is under way, has no effect."""
        if self._stop_asked is None:
            self._stop_asked = reason
            supervisor = self.system.supervisor
            if supervisor is not None:
                supervisor.stop(reason)

    def terminate(self) -> None:
        """Do what `Process.terminate` asks for: end the child in order; if that is under way already, without a clean-up."""
        if self._stop_asked is None:
            self.stop("terminated")
        else:
            self.system.kill()

    def kill(self) -> None:
        """End without a clean-up. What a real process tells with each beat is told now."""
        self.tell_nodes()
        self._stop_asked = self._stop_asked or "killed"
        self.system.kill()

    # -- telling the parent -------------------------------------------------------------------------------------------------

    def tell_nodes(self) -> None:
        """Tell what has changed about the nodes since it was told last."""
        nodes, tree = self.system.nodes, self.system.runtime.tree
        touched = [record for record in nodes.values() if tree.holds(record.path) and self._touched(record)]
        changed = tuple(
            facts for record in touched if _news(facts := self._facts_of(record)) != self._told.get(record.path)
        )
        gone = tuple(path for path in self._told if path not in nodes)
        if changed or gone:
            self._told.update({facts.path: _news(facts) for facts in changed})
            for path in gone:
                del self._told[path]
                self._seen.pop(path, None)
            self._tell(Nodes(changed, gone))

    def _touched(self, record: NodeRecord) -> bool:
        """Whether anything of the record has changed since the last call."""
        saved = record.saved
        last = self._saved.get(record.path, _NOTHING)[0]
        now = (record.state, record.incarnation, record.restart_count, record.asked_state, record.process)
        if saved is last and self._seen.get(record.path) == now:
            return False
        self._seen[record.path] = now
        return True

    def _facts_of(self, record: NodeRecord) -> NodeFacts:
        origin = self.system.clock.loop_time(0.0)
        return NodeFacts(
            record.path,
            self._portable(record),
            record.state,
            record.incarnation,
            record.restart_count,
            tuple((origin + at, why) for at, why in record.restarts),
            record.asked_state,
            record.process,
            self._saved_by(record),
        )

    def _portable(self, record: NodeRecord) -> Child:
        """The declaration of a node as its parent needs it: without arguments, which only its own process uses; it is made once."""
        child, portable = self._children.get(record.path, (None, None))
        if child is not record.child or portable is None:
            portable = record.child.replace(args=(), parameters={})
            try:
                pack(portable)
            except Exception:  # it was added within the process, where nothing has to be copied
                portable = portable.replace(factory=Node)
            self._children[record.path] = (record.child, portable)
        return portable

    def _saved_by(self, record: NodeRecord) -> bytes | None:
        """What the node leaves for its next life, as bytes; it is packed once."""
        if isinstance(record.saved, Packed):
            return record.saved.data
        value, packed = self._saved.get(record.path, (None, None))
        if record.saved is not value:
            try:
                packed = pack(record.saved)
            except Exception as error:
                packed = None
                self.system.log.warning(
                    "a checkpoint cannot cross to another process", node_name=record.identity.fqn, because=str(error)
                )
            self._saved[record.path] = (record.saved, packed)
        return packed

    def _line(self, record: LogRecord) -> None:
        if record.node != "/".join(self._path[:-1]):  # the real supervisor writes its own lines
            at = self.system.clock.loop_time(record.time)
            self._tell(
                Line(
                    at,
                    record.level,
                    record.node,
                    record.incarnation,
                    record.event,
                    record.fields,
                    record.times,
                    record.traceback,
                )
            )

    def _reported(self, report: Report) -> None:
        self._changed(report)
        if report.supervisor != self._path[:-1] or report.context == "unexpected":
            self._tell(Told(report))
        elif report.reason is not None:
            self._reason = report.reason

    # -- the child ----------------------------------------------------------------------------------------------------------

    def _changed(self, node: object) -> None:
        self.system.loop.call_soon(self.tell_nodes)  # in the next turn its supervisor knows of it, too

    def _begin(self) -> bool:
        """Tell that the child is ready; False if it declined to start."""
        supervisor = self.system.supervisor
        self._started = supervisor is not None and bool(supervisor.children())
        if self._started:
            self.tell_nodes()
            self._tell(Ready())
        return self._started

    def _end(self) -> Over:
        request = self.system.runtime.tree.exit_request
        reason = self._reason or Stopped(self._stop_asked or self.system.stop_reason or "")
        declined = self._reason is None and self._stop_asked is None and not self._started
        return Over(reason, None if request is None else request.code, declined)

    def _crash(self, request: CrashAsked) -> None:
        with suppress(LookupError, NotStarted):  # it has ended meanwhile
            self.system.crash(self.system.nodes[request.path].identity.fqn, request.error)

    def _remember(self, order: Order) -> None:
        """Give the nodes what their earlier lives, in other processes, have left."""
        origin = self.system.clock.loop_time(0.0)
        for facts in order.nodes:
            child = self._spec if isinstance(self._spec, Child) else facts.child
            record = self.system.runtime.enter(child, facts.path)
            record.incarnation, record.restart_count = facts.incarnation, facts.restart_count
            record.restarts = [(at - origin, why) for at, why in facts.restarts]
            record.asked_state = facts.asked_state
            if facts.saved is not None:
                record.saved = unpack(facts.saved)
                self._saved[facts.path] = (record.saved, facts.saved)
