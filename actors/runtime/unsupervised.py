"""Unsupervised nodes: those beside the tree, such as the node of a script or a test. They are not restarted.

Such a node ends when it leaves, when it fails, or with the system.
"""

from __future__ import annotations

import asyncio
from itertools import count
from typing import TYPE_CHECKING

from actors.errors import DeclarationError, NotRunning, NotStarted, WrongThread
from actors.logs import ERROR
from actors.places import error_fields
from actors.runtime.record import UNSUPERVISED
from actors.shield import see_through
from actors.supervision.child_task import GRACE, ChildTask
from actors.supervision.reasons import ExitReason, Leaked, Stop
from actors.supervision.refs import ChildRef

if TYPE_CHECKING:
    from actors.names.identity import Identity
    from actors.runtime.node import Node
    from actors.runtime.record import NodeRecord
    from actors.runtime.runtime import Runtime
    from actors.supervision.child import Child
    from actors.supervision.refs import ChildState
    from actors.supervision.seam import Life


class UnsupervisedNode:
    """One node beside the tree, and the task that runs it.

    Invariants:

    - `started` is done when the node is ready, `over` when its task has ended or was abandoned.
    - `leaving` is set when the node's end was asked for. A node that ends by itself is kept until then.
    """

    __slots__ = ("leaving", "over", "record", "run", "started")

    def __init__(self, owner: UnsupervisedNodes, record: NodeRecord, ref: ChildRef) -> None:
        self.record = record
        self.started: asyncio.Future[None] = owner.loop.create_future()
        self.over: asyncio.Future[None] = owner.loop.create_future()
        self.leaving = False
        self.run = ChildTask(owner, self, ref)

    @property
    def spec(self) -> Child:
        """The declaration of the node."""
        return self.record.child

    def __repr__(self) -> str:
        return f"<unsupervised node {self.record.identity.fqn}>"

    @property
    def node(self) -> Node:
        """The node object. Raises `NotStarted` before the node is ready, and when it has ended."""
        node = self.record.node
        if node is None:
            raise NotStarted(f"{self.record.identity.fqn} is not running")
        return node

    def leave(self, reason: str) -> None:
        """Ask for the orderly end of the node, within the stop timeout of its declaration."""
        self.leaving = True
        if not self.run.over:
            self.run.stop(reason, self.record.child.stop)

    @property
    def error(self) -> BaseException | None:
        """The exception with which the node's task ended, `Stop` included; None if it has not ended, or ended as it was asked to."""
        task = self.run.task
        return task.exception() if task.done() and not task.cancelled() else None


class UnsupervisedNodes:
    """The nodes beside the tree of one system, in the order in which they joined.

    Invariants:

    - A node is in `_nodes` from its joining until it has ended and its end was asked for.
    - The end of a node does not depend on the tasks that asked for it: several may ask, and each may be canceled.
    """

    def __init__(self, runtime: Runtime) -> None:
        self.loop = runtime.loop
        self._runtime = runtime
        self._nodes: dict[UnsupervisedNode, None] = {}
        self._places: dict[tuple[str, ...], UnsupervisedNode] = {}
        """Path -> the newest node there. An earlier one may have ended and not left yet."""
        self._serials = count(1)

    def __len__(self) -> int:
        return len(self._nodes)

    async def join(self, child: Child) -> UnsupervisedNode:
        """See `System.join`."""
        runtime = self._runtime
        if asyncio.get_running_loop() is not self.loop:
            raise WrongThread(
                f"{runtime.tree!r} runs in another event loop: use blocking.open_node(name, system=system) in this thread"
            )
        if runtime.stop_reason is not None:
            raise NotRunning(f"{runtime.tree!r} has been stopped ({runtime.stop_reason}): no node can join it any more")
        if child.process or child.hosts:
            raise DeclarationError(
                f"{child!r}: a node beside the tree runs in this process, and nobody would restart it: add it to a supervisor, as in "
                "await system.supervisor.start_child(child), or drop process=True and host"
            )
        name = child.name if not child.namespace else f"{child.namespace.strip('/')}/{child.name}"
        path = (UNSUPERVISED, name)
        if (other := self._places.get(path)) is not None and not other.run.over:
            raise DeclarationError(
                f"a node named {other.record.identity.fqn} is open already: give the second one another name= or namespace="
            )
        try:
            record = runtime.enter(child, path)
        except Exception:
            runtime.tree.close_if_empty()
            raise
        joined = UnsupervisedNode(self, record, ChildRef(path, 1, next(self._serials)))
        self._nodes[joined] = None
        self._places[path] = joined
        try:
            await asyncio.wait([joined.started, joined.over], return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            await self.leave(joined, "the start was canceled")
            raise
        if not joined.run.ready:
            await self.leave(joined, "left")
            raise NotRunning(f"{record.identity.fqn} ended before it was ready")
        return joined

    async def leave(self, node: UnsupervisedNode, reason: str) -> None:
        """See `System.leave`."""
        if node not in self._nodes:
            return
        node.leave(reason)
        if node.run.over:
            self._forget(node)
            self._runtime.tree.unsupervised_left()
        await see_through(node.over)
        if (error := node.error) is not None:
            raise error

    def end_last(self, reason: str) -> bool:
        """Ask the node that joined last for its end. Returns False when no node is left that has not ended."""
        while self._nodes:
            node = next(reversed(self._nodes))
            node.leave(reason)
            if not node.run.over:
                return True
            self._forget(node)
        return False

    def kill(self) -> None:
        """Kill all nodes, without a clean-up."""
        for node in reversed(list(self._nodes)):
            node.leaving = True
            node.run.kill()

    def failed(self) -> list[tuple[Identity, BaseException]]:
        """The nodes that failed and have not left yet, each with its error."""
        return [
            (node.record.identity, error)
            for node in self._nodes
            if (error := node.error) is not None and not isinstance(error, Stop)
        ]

    def child_at(self, path: tuple[str, ...]) -> ChildTask | None:
        """The task of the node at this path, or None."""
        node = self._places.get(path)
        return node.run if node is not None else None

    def state_of(self, path: tuple[str, ...]) -> ChildState:
        """The state of the node at this path; "stopped" when there is none."""
        node = self._places.get(path)
        return node.run.state if node is not None else "stopped"

    @property
    def tasks(self) -> list[asyncio.Task[None]]:
        """The tasks that run the nodes."""
        return [node.run.task for node in self._nodes]

    def _forget(self, node: UnsupervisedNode) -> None:
        del self._nodes[node]
        path = node.record.path
        if self._places.get(path) is node:
            del self._places[path]
            self._runtime.gone(path, False)

    # -- called by the child tasks, as by those of a supervisor -------------------------------------------------------------

    def _of(self, run: ChildTask) -> UnsupervisedNode:
        return self._places[run.ref.path]

    def make_life(self, incarnation: ChildTask, /) -> Life:
        node = self._of(incarnation)
        return self._runtime.new_life(node.record.child, node.record)

    def grace_of(self, life: Life | None, /) -> float:
        return GRACE

    def ready(self, incarnation: ChildTask, /) -> None:
        incarnation.ready = True
        self._of(incarnation).started.set_result(None)

    def ended(self, incarnation: ChildTask, reason: ExitReason, /) -> None:
        """Note that the node has ended, for whichever reason. It is not started again."""
        node = self._of(incarnation)
        node.over.set_result(None)
        journal, fqn = self._runtime.journal, node.record.identity.fqn
        if isinstance(reason, Leaked):
            self._runtime.log.error("a node beside the tree refused to die and was abandoned", node_name=fqn)
        elif (error := node.error) is not None and not isinstance(error, Stop):
            fields = {"node_name": fqn, **error_fields(error)}
            told = journal.new_error(error, fields.get("at", ""))
            self._runtime.log.write(ERROR, "a node beside the tree failed", fields, *told)
        if node.leaving:
            self._forget(node)
            self._runtime.tree.unsupervised_left()
        else:
            self._runtime.gone(node.record.path, True)

    def abandoned(self, incarnation: ChildTask, /) -> None:
        """Do nothing: `ended` follows and logs the error. The abandoned task is left alone."""
