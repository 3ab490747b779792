"""`Tree`: the supervisors at the top of one system, the state of its run, and the states of its nodes."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import TYPE_CHECKING

from actors.checks import create
from actors.supervision.running import RunningSupervisor

if TYPE_CHECKING:
    import signal

    from actors.errors import ProgramExit
    from actors.supervision import peers
    from actors.supervision.declarations import DynamicSupervisor, Supervisor
    from actors.supervision.refs import ChildState


class Top:
    """One of the supervisors at the top of a system, and the task that runs it."""

    __slots__ = ("_ready", "killed", "supervisor", "task")

    def __init__(
        self,
        spec: Supervisor | DynamicSupervisor,
        runtime: peers.Runtime,
        path: tuple[str, ...],
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        self.killed = False
        self._ready: asyncio.Future[None] = loop.create_future()
        self.supervisor = create(RunningSupervisor, spec, runtime, path, killed=lambda: self.killed)
        life = self.supervisor.run(lambda: self._ready.set_result(None))
        self.task: asyncio.Task[None] = loop.create_task(life, name=f"supervisor {spec.name}")

    async def started(self) -> bool:
        """Wait until all children are ready; False if the supervisor has ended before."""
        if not self._ready.done():
            await asyncio.wait([self._ready, self.task], return_when=asyncio.FIRST_COMPLETED)
        return self._ready.done()

    def kill(self) -> bool:
        """Kill all children at once. False if they have ended already."""
        if self.task.done():
            return False
        self.killed = True
        return self.task.cancel()


class Tree:
    """What runs in one system: its root, and the supervisor of the nodes beside it. `actors.runtime.master` starts and ends both.

    Invariants:

    - `root` is set once, when the tree is started, and `joined` before it or at the first node that joins.
    - `stop_reason` is set as soon as the system is to stop, and never cleared. From then on no node joins, and callers are answered with
      `NotRunning`, not with `NodeRestarting`.
    - `failure` and `exit_request` are set at most once each.
    """

    __slots__ = ("exit_request", "failure", "joined", "root", "signal", "signal_at", "stop_reason", "waiting")

    def __init__(self) -> None:
        self.root: Top | None = None
        self.joined: Top | None = None
        """The supervisor of the nodes beside the tree; None before the first of them."""
        self.stop_reason: str | None = None
        """Why the system stops or has stopped; None while it does not."""
        self.failure: BaseException | None = None
        """The error that ended the tree, or None."""
        self.signal: signal.Signals | None = None
        """The signal that stopped the system, or None."""
        self.signal_at = 0.0
        """When it came, loop time in seconds."""
        self.exit_request: ProgramExit | None = None
        """The `SystemExit` or `KeyboardInterrupt` out of a node's code that stopped the system, or None."""
        self.waiting = 0
        """How many tasks wait in `System.wait`."""

    @property
    def tops(self) -> list[Top]:
        """What is to end, in this order: the supervisor of the nodes beside the tree, and the tree."""
        return [top for top in (self.joined, self.root) if top is not None]

    @property
    def supervisor(self) -> RunningSupervisor | None:
        """The supervisor at the root of the tree; None before its start."""
        return None if self.root is None else self.root.supervisor

    @property
    def killed(self) -> bool:
        """Whether the tree was killed."""
        return self.root is not None and self.root.killed

    @property
    def running(self) -> bool:
        """Whether the tree runs."""
        return self.root is not None and not self.root.task.done()

    @property
    def exit_code(self) -> int:
        """See `System.exit_code`."""
        if self.failure is not None:
            return 3
        if self.exit_request is not None:
            return self.exit_request.code
        return 0 if self.signal is None else 128 + self.signal

    def kill(self) -> None:
        """See `System.kill`."""
        for top in self.tops:
            top.kill()

    # -- the states of nodes ------------------------------------------------------------------------------------------------

    def state_of(self, path: tuple[str, ...]) -> ChildState:
        """The state of the node at `path`; "stopped" when there is none."""
        supervisor = self._above(path)
        return "stopped" if supervisor is None else supervisor.state_of(path[len(supervisor.path) :])

    def holds(self, path: tuple[str, ...]) -> bool:
        """Whether the node at `path` belongs to the tree; False for a node beside it."""
        return self.root is not None and self._above(path) is self.root.supervisor

    def _above(self, path: tuple[str, ...]) -> RunningSupervisor | None:
        """The supervisor at the top that has the node at `path` below it."""
        for top in (self.joined, self.root):
            if top is not None and path[: len(top.supervisor.path)] == top.supervisor.path:
                return top.supervisor
        return None

    def supervisors(self) -> Iterator[RunningSupervisor]:
        """All supervisors that run, that of the nodes beside the tree included."""
        for top in self.tops:
            yield from top.supervisor.below()
