"""The scripted children of the supervisor's tests, each life of them in a simulated process."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import count
from random import Random
from typing import Any, cast

from actors.checks import create
from actors.errors import ProgramExit
from actors.processes.child_processes import SimulatedProcess
from actors.processes.life import Process, ProcessLife
from actors.processes.messages import Event, News, Order, Over, Ready, Request, StopAsked, Told
from actors.supervision.child import Child
from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import Supervisor
from actors.supervision.errors import StartFailed
from actors.supervision.peers import Life
from actors.supervision.policy import Intensity, any_significant, temporary
from actors.supervision.reasons import ExitReason, Stopped
from actors.supervision.refs import ChildState
from actors.supervision.report import Report
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import World

_numbers = count(1)
_life_here = World.life


def life_in_a_process(world: World, task: ChildTask) -> Life:
    """A life as `World.life` makes it, but in a simulated process. A script that fails when it is made does so at once, as it did there."""

    async def launch(order: Order, take: Callable[[Event], None]) -> Process:
        def host(tell: Callable[[Event], None]) -> ScriptedHost:
            return ScriptedHost(world, task, tell)

        return SimulatedProcess(next(_numbers), host, take, lambda: None)

    return ProcessLife(SupervisorsHome(world, task), launch)


class SupervisorsHome:
    """The parent's side without a system: only the task of the supervisor that runs the life, and its reports."""

    def __init__(self, world: World, task: ChildTask) -> None:
        self._world = world
        self._task = task

    def order(self) -> Any:
        return None

    def begin(self, process: Process) -> None: ...

    def take(self, event: News) -> None:
        assert isinstance(event, Told)
        self._world.report(event.report)

    async def known(self) -> None: ...

    def end(self) -> None: ...

    def exits(self, code: int) -> ProgramExit:
        raise NotImplementedError

    def killed(self) -> bool:
        return self._task.killed is not None

    def kill(self, after: float) -> None:
        self._task.kill(after)

    def bound(self) -> None:
        self._task.bound()

    def state_of(self, path: Sequence[str]) -> ChildState:
        return "stopped"


class ScriptedHost:
    """What runs in the process: the script, below a supervisor of its own, as `ChildTree` runs a node."""

    def __init__(self, world: World, of: ChildTask, tell: Callable[[Event], None]) -> None:
        child, path = of.entry.spec, of.ref.path
        self._world = world
        self._of = of
        self._tell = tell
        self._reason: ExitReason | None = None
        self._asked = ""
        self._killed = False
        self._started = False
        self._task: asyncio.Task[None] | None = None
        above = Supervisor(
            path[-2],
            children=[cast("Child", child).replace(restart=temporary, significant=True, backoff=None)],
            intensity=Intensity(0),
            auto_shutdown=any_significant,
        )
        self._supervisor = create(RunningSupervisor, above, self, path[:-1], killed=lambda: self._killed)

    async def run(self) -> None:
        self._task = asyncio.current_task()
        try:
            with suppress(StartFailed):
                await self._supervisor.run(self._ready)
        finally:
            while self._supervisor.leaked:  # a simulated process is over when nothing of it runs any more
                await asyncio.wait([leaked.task for leaked in self._supervisor.leaked])
        reason = self._reason or Stopped(self._asked)
        self._tell(Over(reason, declined=not (self._reason or self._asked or self._started)))

    def _ready(self) -> None:
        if self._supervisor.children():
            self._started = True
            self._tell(Ready())
        else:
            asyncio.get_running_loop().call_soon(self._supervisor.stop)

    def take(self, request: Request) -> None:
        assert isinstance(request, StopAsked)
        self._asked = request.reason
        self._supervisor.stop(request.reason)

    def terminate(self) -> None:
        self.kill()

    def kill(self) -> None:
        self._killed = True
        assert self._task is not None
        self._task.cancel()

    # -- the runtime of the supervisor in the process

    @property
    def rng(self) -> Random:
        return self._world.rng

    def life(self, task: ChildTask) -> Life:
        return _life_here(self._world, self._of)

    def gone(self, path: tuple[str, ...], kept: bool) -> None: ...

    def report(self, report: Report) -> None:
        if report.context == "unexpected":
            self._tell(Told(report))
        elif report.reason is not None:
            self._reason = report.reason
