"""Nodes beside the tree, such as the node of a script or a test. They are children of a supervisor of their own, which restarts none.

Such a node ends when it leaves, when it fails, or with the system.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from actors.checks import NoPublicConstructor, create
from actors.errors import DeclarationError, NotRunning, NotStarted, WrongThread
from actors.logs import ERROR
from actors.places import error_fields
from actors.shield import see_through
from actors.supervision.declarations import Supervisor
from actors.supervision.errors import StartFailed, SupervisorDown
from actors.supervision.events import StartChild, TerminateChild
from actors.supervision.policy import temporary
from actors.supervision.reasons import ExitReason, Gone, Leaked, Stop

if TYPE_CHECKING:
    from actors.names.identity import Identity
    from actors.runtime.master import ApplicationMaster
    from actors.runtime.node import Node
    from actors.runtime.runtime import NodeRecord, Runtime
    from actors.runtime.tree import Top
    from actors.supervision.child import Child
    from actors.supervision.child_task import ChildTask
    from actors.supervision.executor import Caller
    from actors.supervision.peers import Life
    from actors.supervision.report import Report
    from actors.supervision.running import RunningSupervisor

JOINED: Final = ("/unsupervised",)
"""The path of the supervisor. No tree has it, because a name has no '/'."""


class JoinedNode(metaclass=NoPublicConstructor):
    """One node beside the tree. It has no public constructor: `System.join` gives one.

    Invariants:

    - `over` is done when the node's task has ended or was abandoned.
    - `leaving` is set when the node's end was asked for. A node that ends by itself is kept until then.
    """

    __slots__ = ("leaving", "over", "record", "run")

    def __init__(self, record: NodeRecord, run: ChildTask, over: asyncio.Future[None]) -> None:
        self.record = record
        self.run = run
        self.over = over
        self.leaving = False

    def __repr__(self) -> str:
        return f"<joined node {self.record.identity.fqn}>"

    @property
    def node(self) -> Node:
        """The node object. Raises `NotStarted` before the node is ready, and when it has ended."""
        node = self.record.node
        if node is None:
            raise NotStarted(f"{self.record.identity.fqn} is not running")
        return node

    @property
    def error(self) -> BaseException | None:
        """The exception with which the node's task ended, `Stop` included; None if it has not ended, or ended as it was asked to."""
        task = self.run.task
        return task.exception() if task.done() and not task.cancelled() else None


class JoinedNodes:
    """The nodes beside the tree of one system, in the order in which they joined.

    It is the `supervision.peers.Runtime` of their supervisor, of which they are temporary children. It runs from the start of the tree on, or from the
    first join on.

    Invariants:

    - A node is in `_nodes` from its joining until it has ended and its end was asked for. Its record stays as long.
    - The end of a node does not depend on the tasks that asked for it: several may ask, and each may be canceled.
    """

    def __init__(self, runtime: Runtime, master: ApplicationMaster) -> None:
        self._runtime = runtime
        self._master = master
        self.rng = runtime.rng
        self._joining = 0
        """How many nodes wait for the first step of their supervisor."""
        self._nodes: dict[JoinedNode, None] = {}
        self._places: dict[tuple[str, ...], JoinedNode] = {}
        """Path -> the newest node there. An earlier one may have ended and not left yet."""

    def __len__(self) -> int:
        return len(self._nodes) + self._joining

    async def join(self, child: Child) -> JoinedNode:
        """See `System.join`."""
        runtime = self._runtime
        if asyncio.get_running_loop() is not runtime.loop:
            raise WrongThread(
                f"{runtime!r} runs in another event loop: use blocking.open_node(name, system=system) in this thread"
            )
        self._check_open()
        if child.process or child.hosts:
            raise DeclarationError(
                f"{child!r}: a node beside the tree runs in this process, and nobody would restart it: add it to a supervisor, as in "
                "await system.supervisor.start_child(child), or drop process=True and host"
            )
        try:
            joined, start = self._begin(child, await self._supervisor())
        except BaseException:
            self._master.close_if_empty()
            raise
        try:
            await start
        except asyncio.CancelledError:
            await self.leave(joined, "the start was canceled")
            raise
        except StartFailed:
            pass  # the error of the node's task is raised below
        if not joined.run.ready:
            await self.leave(joined, "left")
            raise NotRunning(f"{joined.record.identity.fqn} ended before it was ready")
        return joined

    def begin(self) -> Top:
        """Begin to run the supervisor of the nodes, unless it runs or has run."""
        tree = self._runtime.tree
        if tree.joined is None:
            tree.joined = self._master.begin(Supervisor("joined"), self, JOINED)
            tree.joined.task.add_done_callback(lambda _: self._forget_all())
        return tree.joined

    async def _supervisor(self) -> RunningSupervisor:
        top = self.begin()
        self._joining += 1
        try:
            await top.started()
        finally:
            self._joining -= 1
        self._check_open()
        return top.supervisor

    def _check_open(self) -> None:
        runtime = self._runtime
        if runtime.stop_reason is not None:
            raise NotRunning(f"{runtime!r} has been stopped ({runtime.stop_reason}): no node can join it any more")

    def _begin(self, child: Child, supervisor: RunningSupervisor) -> tuple[JoinedNode, Caller]:
        """Begin the start of a node. Returns with it the future of the start."""
        id = child.name if not child.namespace else f"{child.namespace.strip('/')}/{child.name}"
        path = (*JOINED, id)
        if (other := self._places.get(path)) is not None and not other.run.over:
            raise DeclarationError(
                f"a node named {other.record.identity.fqn} is open already: give the second one another name= or namespace="
            )
        record = self._runtime.enter(child, path)
        unrestarted = child.varied(restart=temporary, significant=False)
        start = supervisor.ask(StartChild(unrestarted, id))
        run = supervisor.incarnation((id,))
        assert run is not None
        joined = self._places[path] = create(JoinedNode, record, run, self._runtime.loop.create_future())
        self._nodes[joined] = None
        run.watch(lambda down: self._ended(joined, down.reason))
        return joined, start

    async def leave(self, node: JoinedNode, reason: str) -> None:
        """See `System.leave`."""
        if node not in self._nodes:
            return
        node.leaving = True
        if node.run.over:
            self._forget(node)
        else:
            with suppress(SupervisorDown):  # then it stops its children, this one in its turn
                self.begin().supervisor.ask(TerminateChild(node.run.ref, reason))
        await see_through(node.over)
        if (error := node.error) is not None:
            raise error

    def failed(self) -> list[tuple[Identity, BaseException]]:
        """The nodes that failed and have not left yet, each with its error."""
        return [
            (node.record.identity, error)
            for node in self._nodes
            if (error := node.error) is not None and not isinstance(error, Stop)
        ]

    def _ended(self, node: JoinedNode, reason: ExitReason | Gone) -> None:
        """Note that a node has ended, for whichever reason."""
        node.over.set_result(None)
        runtime, fqn = self._runtime, node.record.identity.fqn
        if isinstance(reason, Leaked):
            runtime.log.error("a node beside the tree refused to die and was abandoned", node_name=fqn)
        elif (error := node.error) is not None and not isinstance(error, Stop):
            fields = {"node_name": fqn, **error_fields(error)}
            told = runtime.system_log.new_error(error, fields.get("at", ""))
            runtime.log.write(ERROR, "a node beside the tree failed", fields, *told)
        if node.leaving:
            self._forget(node)
        else:
            runtime.gone(node.record.path, True)

    def _forget(self, node: JoinedNode) -> None:
        del self._nodes[node]
        path = node.record.path
        if self._places[path] is node:
            del self._places[path]
            self._runtime.gone(path, False)
        self._master.close_if_empty()

    def _forget_all(self) -> None:
        for node in list(self._nodes):
            self._forget(node)

    # -- what their supervisor calls ----------------------------------------------------------------------------------------

    def life(self, task: ChildTask, /) -> Life:
        record = self._runtime.directory.records[task.ref.path]
        return self._runtime.new_life(record.child, record, task)

    def gone(self, path: tuple[str, ...], kept: bool, /) -> None:
        """Do nothing: `_ended` follows, and keeps the record of a node that has not left."""

    def report(self, report: Report, /) -> None:
        """Do nothing: the one who opened the node receives its error, and `_ended` logs it."""
