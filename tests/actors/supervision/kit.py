"""What the tests of the supervisor share: children that follow a script, a runtime that takes notes, virtual time."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import AsyncGenerator, Callable, Coroutine
from contextlib import asynccontextmanager
from random import Random
from typing import Any, ParamSpec

from actors.checks import create
from actors.supervision.child import Child
from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.reasons import Failed
from actors.supervision.report import Report
from actors.supervision.running import RunningSupervisor
from actors.time.virtual_loop import VirtualLoop

P = ParamSpec("P")


def run_virtual(story: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine to its end on a virtual-time loop of its own."""
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(story)


def virtual(test: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Run an async test on virtual time."""

    @functools.wraps(test)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        run_virtual(test(*args, **kwargs))

    return run


def node() -> None:
    """The factory of all scripted children; the scripts are the world's, by name."""


def child(name: str, **options: Any) -> Child:
    """A child that follows the script of this name."""
    return Child(node, name=name, **options)


class Script:
    """What a child does. `start`: seconds of its start phase; `refuse`: what it raises at the end of it; `after`: seconds
    until it ends by itself, by returning or raising `end`; `cleanup`: seconds that it needs to stop; `stubborn`: it
    swallows every cancellation until the world releases it; `hides`: it takes its supervisor's callback off its own task."""

    def __init__(
        self,
        *,
        start: float = 0.0,
        refuse: BaseException | None = None,
        after: float | None = None,
        end: BaseException | None = None,
        cleanup: float = 0.0,
        stubborn: bool = False,
        hides: bool = False,
    ) -> None:
        self.start = start
        self.refuse = refuse
        self.after = after
        self.end = end
        self.cleanup = cleanup
        self.stubborn = stubborn
        self.hides = hides


class ScriptedLife:
    """One incarnation of a scripted child."""

    def __init__(self, world: World, child: Child, path: tuple[str, ...], incarnation: int, script: Script) -> None:
        self.world = world
        self.child = child
        self.name = path[-1]
        self.path = path
        self.incarnation = incarnation
        self.script = script
        self.fate: asyncio.Future[BaseException | None] = asyncio.get_running_loop().create_future()
        self.task = asyncio.current_task()

    async def run(self, started: Callable[[], object]) -> None:
        self.started = started
        self.world.alive.append(self)
        try:
            await self._run(started)
        except asyncio.CancelledError:
            self.world.note("cancelled", self)
            raise
        finally:
            self.world.alive.remove(self)

    async def _run(self, started: Callable[[], object]) -> None:
        script = self.script
        self.world.note("start", self)
        if script.start:
            await asyncio.sleep(script.start)
        if script.refuse is not None:
            raise script.refuse
        self.world.note("ready", self)
        started()
        if script.hides:
            self._hide()
        if script.after is not None:
            asyncio.get_running_loop().call_later(script.after, self.end, script.end)
        if script.stubborn:
            await self._refuse_to_die()
        fate = await self.fate
        if script.cleanup:
            await asyncio.sleep(script.cleanup)
        self.world.note("end", self)
        if fate is not None:
            raise fate

    async def _refuse_to_die(self) -> None:
        while not self.world.released.is_set():
            try:
                await self.world.released.wait()
            except asyncio.CancelledError:
                self.world.note("refused", self)
        self.end(self.script.end)

    def _hide(self) -> None:
        task: Any = asyncio.current_task()
        for callback, _ in task._callbacks:
            task.remove_done_callback(callback)

    def end(self, error: BaseException | None = None) -> None:
        """Let it end by itself: return, or raise `error`."""
        if not self.fate.done():
            self.fate.set_result(error)

    def stop(self, reason: str) -> None:
        self.world.note("stop", self)
        self.world.reasons.append(reason)
        if not self.fate.done():
            self.fate.set_result(None)


class World:
    """The runtime of the tests. `log` holds (event, child) in order, `times` the same with the time."""

    def __init__(self, **scripts: Script | list[Script]) -> None:
        self.scripts = scripts
        self.rng = Random(7)
        self.reports: list[Report] = []
        self.gone_for_good: list[str] = []
        self.forgotten: list[str] = []
        self.times: list[tuple[float, str, str]] = []
        self.alive: list[ScriptedLife] = []
        self.reasons: list[str] = []
        self.released = asyncio.Event()
        self.host: asyncio.Task[None]
        self.ready: asyncio.Event

    @property
    def log(self) -> list[tuple[str, str]]:
        return [(event, name) for _, event, name in self.times]

    def life(self, task: ChildTask) -> ScriptedLife:
        spec, ref = task.entry.spec, task.ref
        assert isinstance(spec, Child)
        script = self.scripts.get(ref.id, Script())
        if isinstance(script, list):  # one for each incarnation; the last one for all further ones
            script = script[min(ref.incarnation, len(script)) - 1]
        return ScriptedLife(self, spec, ref.path, ref.incarnation, script)

    def gone(self, path: tuple[str, ...], kept: bool) -> None:
        self.gone_for_good.append("/".join(path))
        if not kept:
            self.forgotten.append("/".join(path))

    def report(self, report: Report) -> None:
        self.reports.append(report)

    def note(self, event: str, life: ScriptedLife) -> None:
        self.times.append((round(asyncio.get_running_loop().time(), 6), event, life.name))

    def events(self, *kinds: str) -> list[str]:
        """What happened, in order, as "kind name", of these kinds only."""
        return [f"{event} {name}" for event, name in self.log if event in kinds]

    def errors(self) -> list[str]:
        """The reports that are not progress, as "context child"."""
        return [f"{each.context} {each.child.id}" for each in self.reports if each.context != "progress"]

    def __getitem__(self, name: str) -> ScriptedLife:
        """The live incarnation of a child."""
        (life,) = [life for life in self.alive if life.name == name]
        return life

    def crash(self, name: str, error: BaseException | None = None) -> None:
        """Let a child raise."""
        self[name].end(error if error is not None else OSError(f"{name} broke"))

    def finish(self, name: str) -> None:
        """Let a child return."""
        self[name].end()

    def names(self) -> list[str]:
        """Who is alive, in the order of their starts."""
        return [life.name for life in self.alive]


TURNS = 500
"""The most turns of the loop that `settle` takes: a child may take its turns for ever."""


async def settle() -> None:
    """Let everything that can happen without time passing happen."""
    loop, idle = asyncio.get_running_loop(), 0
    for _ in range(TURNS):
        await asyncio.sleep(0)
        idle = idle + 1 if isinstance(loop, VirtualLoop) and loop.idle else 0
        if idle == 3:  # what is due at this instant has had its turn as well
            return


async def launch(world: World, spec: Supervisor | DynamicSupervisor) -> RunningSupervisor:
    """Begin to run a supervisor in `world.host`, without waiting for it to be ready."""
    supervisor = create(RunningSupervisor, spec, world)
    world.ready = asyncio.Event()
    world.host = asyncio.create_task(supervisor.run(world.ready.set))
    await settle()
    return supervisor


async def run_to_end(world: World, spec: Supervisor | DynamicSupervisor) -> None:
    """Run a supervisor that ends by itself; raises what it raises."""
    await launch(world, spec)
    await world.host


@asynccontextmanager
async def running(world: World, spec: Supervisor | DynamicSupervisor) -> AsyncGenerator[RunningSupervisor]:
    """A supervisor that is ready; stopped in order at the end of the block, unless it has ended before."""
    supervisor = await launch(world, spec)
    ready = asyncio.ensure_future(world.ready.wait())
    await asyncio.wait([ready, world.host], return_when=asyncio.FIRST_COMPLETED)
    ready.cancel()
    try:
        yield supervisor
    finally:
        supervisor.stop("end of test")
        world.released.set()
        await asyncio.wait([world.host])
        assert not world.alive, f"still alive: {world.names()}"
        await settle()


def state(supervisor: RunningSupervisor, name: str) -> str:
    """The state of a child in `children()`."""
    (found,) = [each for each in supervisor.children() if each.id == name]
    return found.state


def failure(reason: object) -> str:
    """The text of the exception in a `Failed`."""
    assert isinstance(reason, Failed), reason
    return str(reason.error)
