"""`System`: one running tree with its clock, graph, log and random numbers. `run(tree)` starts one and stops it in order.

::

    async with run(tree) as system:
        await system.wait()
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, TypeVar, overload

from actors.checks import NoPublicConstructor, create
from actors.errors import NotStarted
from actors.inbox.control import Failure
from actors.logs import INFO, LogRecord, LogSink, structlog_sink
from actors.runtime.incarnation import incarnation_of
from actors.runtime.master import ApplicationMaster
from actors.runtime.open_systems import OpenSystems
from actors.runtime.placement import HERE, Placement
from actors.runtime.runtime import NodeRecord, OtherProcesses, Runtime
from actors.runtime.standard import StandardEndpoints
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.time.lockstep import Simulated

if TYPE_CHECKING:
    from actors.graph.queries import NodeGraph
    from actors.graph.snapshot import Snapshot
    from actors.runtime.joined import JoinedNode
    from actors.runtime.node import Node
    from actors.runtime.options import RunOptions
    from actors.supervision.report import Report
    from actors.supervision.running import RunningSupervisor

N = TypeVar("N", bound="Node")


class System(metaclass=NoPublicConstructor):
    """One running tree, and the nodes that joined beside it. Everything in it belongs to the event loop in which it was made.

    It has no public constructor: `run` gives one. `runtime` and `master` are for the framework's own use.
    Invariants: at most one tree is started, once; `open_node` finds the system exactly from `open` until everything in it has ended.
    """

    def __init__(
        self,
        *,
        seed: int = 0,
        sinks: tuple[LogSink, ...] = (structlog_sink,),
        level: int = INFO,
        options: RunOptions | None = None,
        processes: Callable[[Runtime], OtherProcesses] | None = None,
        placement: Placement = HERE,
        make_runtime: Callable[..., Runtime] = Runtime,
    ) -> None:
        self.runtime = runtime = make_runtime(
            seed=seed, sinks=sinks, level=level, options=options, processes=processes, placement=placement
        )
        StandardEndpoints(runtime)
        self.master = create(ApplicationMaster, runtime)
        self._tree = runtime.tree
        self.seed, self.loop = seed, runtime.loop
        self.clock, self.graph, self.log = runtime.clock, runtime.graph, runtime.log
        self.nodes: dict[tuple[str, ...], NodeRecord] = runtime.directory.records
        """The record of every node, by its path in the tree; nodes beside the tree are included."""
        self.records: deque[LogRecord] = runtime.system_log.records
        """The newest 1000 log lines."""
        self.reports: deque[Report] = runtime.system_log.reports
        """The newest 10,000 reports of supervisors."""

    def __repr__(self) -> str:
        return repr(self.runtime)

    def open(self) -> None:
        """Let `open_node` find this system until it has ended. Calling it twice is fine."""
        if _open.add(self.loop, self):
            self.runtime.observers.closed.append(lambda: _open.remove(self.loop, self))
            self.runtime.open()

    async def start(self, tree: Supervisor | DynamicSupervisor, path: tuple[str, ...] | None = None) -> None:
        """Start the tree and return when every child is ready. `path` is that of its root, if it is a part of a tree elsewhere.

        Raises `StartFailed` if a child cannot start, `NotRunning` if the system is stopped meanwhile, and then nothing runs any more.
        """
        if self.supervisor is not None:
            raise RuntimeError("this system runs a tree already: make another system")
        self.open()
        await self.master.start(tree, path or (tree.name,))

    async def wait(self) -> None:
        """Wait until the tree has ended. Raises `SupervisorGaveUp` if it ended because its restarts were used up."""
        await self.master.wait()

    async def stop(self, reason: str = "stop") -> None:
        """Stop everything, the newest node first, each within its stop timeout, and return when all has ended. Stopping twice is fine.

        It does not raise the error that ended the tree; `wait` does. Canceling the caller does not cut the stop short, even if it is done
        repeatedly: the cancellation is raised when everything has stopped. `kill` and a second signal do cut it short.

        A node that calls this is stopped, too: in a handler or hook the call does not wait; a task waits here until it is canceled.
        """
        await self.master.stop(reason)

    def kill(self) -> None:
        """Kill everything: all nodes are canceled without a clean-up. Returns at once; `stop` waits until all has ended."""
        self._tree.kill()

    @property
    def killed(self) -> bool:
        """Whether the tree was ended by `kill`, or by a second signal."""
        return self._tree.killed

    @property
    def running(self) -> bool:
        """Whether the tree has been started and has not ended."""
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
        """The error that ended the tree: `SupervisorGaveUp`, or None."""
        return self._tree.failure

    @property
    def argv(self) -> tuple[str, ...]:
        """The arguments in the `argv` of `run` that are not for ROS, in order. No program name is added."""
        return () if self.runtime.options is None else self.runtime.options.argv

    @property
    def exit_code(self) -> int:
        """The program's exit code: 3 if the supervisor gave up, the code of a `sys.exit` in a node, 128 plus a signal's number, or 0."""
        return self._tree.exit_code

    @overload
    def node(self, node: type[N]) -> N: ...
    @overload
    def node(self, node: str) -> Node: ...
    def node(self, node: type[Node] | str) -> Node:
        """The running node object of this class (or of a class derived from it), or of this name or full name.

        Raises `LookupError` when no node matches, or several do, and `NotStarted` when the node is not running now.
        """
        record = self.runtime.directory.named(node)
        if record.node is None:
            where = (
                f"runs in process {record.process}: ask it by its services" if record.process else "is not running now"
            )
            raise NotStarted(f"{node if isinstance(node, str) else node.__name__} {where}")
        return record.node

    def crash(self, node: type[Node] | str, error: Exception) -> None:
        """Make a node fail as if one of its handlers had raised `error`; its `on_error` is asked. Raises what `node` raises."""
        record = self.runtime.directory.named(node)
        if record.running is not None:
            put = record.inbox.put_control

            def fail(error: Exception) -> None:
                put(Failure(error, "crash"))

            record.running.entering("crash", fail)(error)
        elif record.process and record.state == "running":
            self.runtime.processes.crash(record.path, error)
        else:
            raise NotStarted(f"{record.identity.fqn} is not running: it cannot crash now")

    def kill_process(self, node: type[Node] | str) -> None:
        """Kill the process in which a node runs, with all that it runs, as ``kill -9`` does; its supervisor restarts it.

        Raises `LookupError` as `node` does, and `NotStarted` for a node that runs in this process, or in none.
        """
        record = self.runtime.directory.named(node)
        if not record.process:
            raise NotStarted(f"{record.identity.fqn} has no process of its own: declare it with process=True")
        self.runtime.processes.kill(record.path)

    async def join(self, child: Child) -> JoinedNode:
        """Run one more node beside the tree, which is never restarted, and return when it is ready. Raises the error of its start, and
        `DeclarationError` for a child with a process or a host of its own."""
        return await self.master.joined.join(child)

    async def leave(self, node: JoinedNode, reason: str = "left") -> None:
        """Stop a node that joined, within its stop timeout, and return when it has ended. Raises the error that ended it, if one did."""
        await self.master.joined.leave(node, reason)

    def observe(
        self,
        *,
        reports: Callable[[Report], None] | None = None,
        lines: LogSink | None = None,
        end: Callable[[], None] | None = None,
    ) -> None:
        """From now on, call `reports` with every report of a supervisor before it is logged, `lines` with every log line, and `end` when
        the tree has ended for any reason. They must not block. Only `lines` may raise; the line is then lost to it.
        """
        self.runtime.observers.add(reports=reports, lines=lines, end=end)

    @property
    def dead_letters(self) -> int:
        """How many messages were lost because they waited for a next life that never came, or for a handler that the next life lacks."""
        return self.runtime.dead_letters

    def snapshot(self) -> Snapshot:
        """The nodes, topics, services and actions at this instant, as a value; see `actors.graph.snapshot`."""
        from actors.graph.snapshot import take

        return take(self.clock.now(), self.nodes.values(), self.graph)


def keep_step(tree: Spec) -> None:
    """Let the running loop keep step with the worlds that nodes of `tree` simulate. To be called before its system is made."""
    if isinstance(tree, Supervisor):
        for child in tree.children:
            keep_step(child)
    elif isinstance(tree, Child):
        for one in tree.args:
            if isinstance(one, Simulated) and not one.real_time:
                one.keep_step(asyncio.get_running_loop())


_open: Final[OpenSystems[System]] = OpenSystems()


def system_here() -> System | None:
    """The newest open system of the running event loop, or None."""
    return next(reversed(_open.of(asyncio.get_running_loop())), None)


def system_of(node: Node) -> System:
    """The system that runs this node object. Raises `NotStarted` before its start, and when its system has ended."""
    runtime = incarnation_of(node).runtime
    for system in _open.of(runtime.loop):
        if system.runtime is runtime:
            return system
    raise NotStarted(f"{node!r}: its system has ended")


def graph_of(node: Node) -> NodeGraph:
    """The graph as this node sees it: who publishes, who serves, and waiting for them. Raises what `system_of` raises."""
    from actors.graph.queries import NodeGraph

    system = system_of(node)
    return create(NodeGraph, system.graph, incarnation_of(node).identity, system.snapshot)
