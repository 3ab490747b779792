"""A system: one running tree, with its clock, graph, logs and randomness. `run(tree)` starts one and ends it in order.

::

    async with run(tree) as system:
        await system.wait()
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, TypeVar, overload

from actors.errors import NotStarted
from actors.inbox.control import Failure
from actors.logs import INFO, LogRecord, LogSink, structlog_sink
from actors.runtime.incarnation import incarnation_of
from actors.runtime.open_systems import OpenSystems
from actors.runtime.runtime import Runtime

if TYPE_CHECKING:
    from actors.graph.snapshot import Snapshot
    from actors.node.node import Node
    from actors.runtime.options import RunOptions
    from actors.runtime.record import NodeRecord
    from actors.runtime.unsupervised import UnsupervisedNode
    from actors.supervision.declarations import Child, DynamicSupervisor, Supervisor
    from actors.supervision.report import Report
    from actors.supervision.running import RunningSupervisor

__all__ = ["System", "system_here", "system_of"]

N = TypeVar("N", bound="Node")


class System:
    """One running tree. Make it with `run(tree)`; everything in it lives in the event loop that made it.

    It has no public constructor: `run` gives one. What its nodes use of it is in `runtime`, which is the framework's own.
    """

    def __init__(
        self,
        *,
        seed: int = 0,
        sinks: tuple[LogSink, ...] = (structlog_sink,),
        level: int = INFO,
        options: RunOptions | None = None,
        make_runtime: Callable[..., Runtime] = Runtime,
    ) -> None:
        self.runtime = runtime = make_runtime(seed=seed, sinks=sinks, level=level, options=options)
        self._tree = runtime.tree
        self.seed, self.loop = seed, runtime.loop
        self.clock, self.graph, self.log = runtime.clock, runtime.graph, runtime.log
        self.nodes: dict[tuple[str, ...], NodeRecord] = runtime.directory.records
        """The record of every node, by its path in the tree; of nodes beside the tree, too."""
        self.records: deque[LogRecord] = runtime.journal.records
        """The newest 1000 log lines."""
        self.reports: deque[Report] = runtime.journal.reports
        """The newest 10,000 reports of supervisors."""

    def __repr__(self) -> str:
        return repr(self._tree)

    def open(self) -> None:
        """Let `open_node` find this system."""
        if _open.add(self.loop, self):
            self.runtime.observers.closed.append(lambda: _open.remove(self.loop, self))
            self.runtime.open()

    async def start(self, tree: Supervisor | DynamicSupervisor) -> None:
        """Start the tree and return when all of it is ready.

        Raises `StartFailed` when a child cannot start, `NotRunning` when the system is stopped meanwhile; nothing runs then.
        """
        if self.supervisor is not None:
            raise RuntimeError("this system runs a tree already: make another system")
        self.open()
        await self._tree.start(tree)

    async def wait(self) -> None:
        """Wait until the tree has ended. Raises `SupervisorGaveUp` when it ended because its restarts were used up."""
        await self._tree.wait()

    async def stop(self, reason: str = "stop") -> None:
        """Stop everything, the newest first, each node within its stop timeout, and leave nothing behind. Stopping twice is fine.

        Never raises for what ended the tree; `wait` does. Canceling the caller does not cut it short, however often that happens: the
        cancellation is raised when everything has stopped. `kill` and a second signal cut it short.

        A node whose code asks for this is one of those that are stopped: its handlers and hooks ask, and do not wait, and its tasks are
        canceled while they wait.
        """
        await self._tree.stop(reason)

    def kill(self) -> None:
        """End everything at once: no node has time for a clean-up. Returns at once; `stop` waits until it has come to pass."""
        self._tree.kill()

    @property
    def running(self) -> bool:
        """Whether the tree runs."""
        return self._tree.running

    @property
    def supervisor(self) -> RunningSupervisor | None:
        """The root of the running tree; None before its start."""
        return self._tree.supervisor

    @property
    def stop_reason(self) -> str | None:
        """Why the system stops or has stopped; None while it does not."""
        return self._tree.stop_reason

    @property
    def failure(self) -> BaseException | None:
        """What ended the tree by itself: `SupervisorGaveUp`, or None."""
        return self._tree.failure

    @property
    def argv(self) -> tuple[str, ...]:
        """What the `argv` of `run` holds for the program itself: all that is not for ROS, in order, without a program's name that it did not have."""
        return () if self.runtime.options is None else self.runtime.options.argv

    @property
    def exit_code(self) -> int:
        """What a program should exit with: 0, 3 after its supervisor gave up, 128 and the number of the signal, or what `sys.exit` was given."""
        return self._tree.exit_code

    @overload
    def node(self, node: type[N]) -> N: ...
    @overload
    def node(self, node: str) -> Node: ...
    def node(self, node: type[Node] | str) -> Node:
        """The running node object of this class, or of the node of this name or full name.

        Raises `LookupError` when no node is called so, or several are, and `NotStarted` when it is not running now.
        """
        record = self.runtime.directory.named(node)
        if record.node is None:
            raise NotStarted(f"{node if isinstance(node, str) else node.__name__} is not running now")
        return record.node

    def crash(self, node: type[Node] | str, error: Exception) -> None:
        """Make a node fail, as if a handler of it had raised `error`: its `on_error` is asked. Raises `LookupError` and `NotStarted`."""
        record = self.runtime.directory.named(node)
        if record.running is None:
            raise NotStarted(f"{record.identity.fqn} is not running: it cannot crash now")
        record.inbox.put_control(Failure(error, "crash"))

    async def join(self, child: Child) -> UnsupervisedNode:
        """Run one more node beside the tree, not supervised by it, and return when it is ready. Raises what its start raises."""
        return await self._tree.unsupervised.join(child)

    async def leave(self, node: UnsupervisedNode, reason: str = "left") -> None:
        """End a node that joined, within its stop timeout. Raises the error that ended it before, if one did."""
        await self._tree.unsupervised.leave(node, reason)

    def observe(
        self,
        *,
        reports: Callable[[Report], None] | None = None,
        lines: LogSink | None = None,
        end: Callable[[], None] | None = None,
    ) -> None:
        """From now on, call `reports` with every report of a supervisor before it is logged, `lines` with every log line, and `end` once the
        tree has ended, however. They must not block; only `lines` may raise, and loses that line then.
        """
        self.runtime.observers.add(reports=reports, lines=lines, end=end)

    @property
    def dead_letters(self) -> int:
        """Messages that waited for a node's next life, which never came, or for a handler that it no longer has."""
        return self.runtime.dead_letters

    def snapshot(self) -> Snapshot:
        """The graph at this instant, as a value: see `actors.graph.snapshot`."""
        from actors.graph.snapshot import take

        return take(self.clock.now(), self.nodes.values(), self.graph)


_open: Final[OpenSystems[System]] = OpenSystems()


def system_here() -> System | None:
    """The newest system that runs in this event loop, or None."""
    return next(reversed(_open.of(asyncio.get_running_loop())), None)


def system_of(node: Node) -> System:
    """The system that runs this node object. Raises `NotStarted` before its start, and when its system has ended."""
    runtime = incarnation_of(node).runtime
    for system in _open.of(runtime.loop):
        if system.runtime is runtime:
            return system
    raise NotStarted(f"{node!r}: its system has ended")
