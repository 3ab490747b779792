"""How a supervisor starts: in order, each child after the one before is ready, all or none."""

from __future__ import annotations

import asyncio
import re
import subprocess
import sys
import textwrap
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest

from actors.checks import create
from actors.errors import DeclarationError
from actors.supervision.child import Child
from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import AlreadyPresent, StartFailed, SupervisorDown
from actors.supervision.policy import any_significant, rest_for_one, temporary, transient
from actors.supervision.reasons import Skip, Stop, Stopped
from actors.supervision.refs import Counts
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import (
    Script,
    ScriptedLife,
    World,
    child,
    launch,
    run_to_end,
    running,
    settle,
    state,
    virtual,
)


@virtual
async def test_empty_supervisor() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[Supervisor("empty")])) as root:
        ref = root.which("empty")
        assert ref is not None
        down = root.watch(ref)
        assert root.children()[0].state == "running"
        await root.terminate_child("empty")
        assert (await down).reason == Stopped("shutdown")
    assert world.host.result() is None


@virtual
async def test_ordered_blocking_start() -> None:
    world = World(a=Script(start=1), b=Script(start=2), c=Script(start=3))
    supervisor = await launch(world, Supervisor("root", children=[child("a"), child("b"), child("c")]))
    await asyncio.sleep(5.9)
    assert not world.ready.is_set()
    assert [each.state for each in supervisor.children()] == ["running", "running", "starting"]
    await asyncio.sleep(0.2)
    assert world.ready.is_set()
    assert world.times == [
        (0, "start", "a"),
        (1, "ready", "a"),
        (1, "start", "b"),
        (3, "ready", "b"),
        (3, "start", "c"),
        (6, "ready", "c"),
    ]
    supervisor.stop()
    await world.host


@virtual
async def test_failed_start_is_rolled_back() -> None:
    broken = OSError("no such device")
    world = World(a=Script(cleanup=1), b=Script(cleanup=1), c=Script(start=1, refuse=broken))
    tree = Supervisor("root", children=[child("a"), child("b"), child("c"), child("d")])
    with pytest.raises(StartFailed) as failed:
        await run_to_end(world, tree)
    assert failed.value.child == "c"
    assert failed.value.path == ("root", "c")
    assert failed.value.__cause__ is broken
    assert "no such device" in str(failed.value)
    assert world.events("stop", "end") == ["stop b", "end b", "stop a", "end a"]
    assert ("start", "d") not in world.log
    assert world.errors() == ["start_error c"]


@virtual
async def test_a_broken_factory_is_a_failed_start() -> None:
    class Broken(World):
        def life(self, *_: object) -> None:  # type: ignore[override]
            raise TypeError("no argument 'port'")

    world = Broken()
    with pytest.raises(StartFailed, match="TypeError: no argument 'port'"):
        await run_to_end(world, Supervisor("root", children=[child("a")]))


@pytest.mark.parametrize("end", [None, Stop("not today")])
@virtual
async def test_ending_before_being_ready_is_a_failed_start(end: Stop | None) -> None:
    class Early:
        async def run(self, started: object) -> None:
            if end is not None:
                raise end

        def stop(self, reason: str) -> None: ...

    class Runtime(World):
        def life(self, *_: object) -> Early:  # type: ignore[override]
            return Early()

    world = Runtime()
    with pytest.raises(StartFailed, match="before it had started"):
        await run_to_end(world, Supervisor("root", children=[child("a")]))


@virtual
async def test_a_child_may_decline_to_start() -> None:
    world = World(a=Script(start=1, refuse=Skip("no camera on this robot")))
    async with running(world, Supervisor("root", children=[child("a", restart=transient), child("b")])) as supervisor:
        assert state(supervisor, "a") == "stopped"
        assert supervisor.which("a") is None
        assert supervisor.counts() == Counts(specs=2, active=1, supervisors=0, workers=2)
        assert world.names() == ["b"]
        assert world.errors() == []
        assert await supervisor.start_child(child("c")) is not None
        world.scripts["d"] = Script(refuse=Skip())
        assert await supervisor.start_child(child("d")) is None
        assert state(supervisor, "d") == "stopped"


@virtual
async def test_a_child_that_has_started_cannot_decline_any_more() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a")])):
        world.crash("a", Skip("not after all"))
        await settle()
        assert world["a"].incarnation == 2
        assert world.errors() == ["child_terminated a"]


@virtual
async def test_a_temporary_child_that_declines_leaves_no_trace() -> None:
    world = World(a=Script(refuse=Skip()), b=Script(refuse=Skip()))
    async with running(world, Supervisor("root", children=[child("a", restart=temporary)])) as supervisor:
        assert supervisor.counts().specs == 0
        assert await supervisor.start_child(child("b", restart=temporary)) is None
        assert supervisor.counts().specs == 0


@pytest.mark.parametrize("spec", [42, None, child, Supervisor])
@virtual
async def test_a_bad_spec_given_to_start_child_disturbs_nobody(spec: object) -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        with pytest.raises(DeclarationError, match="a child must be a Child or a Supervisor"):
            await supervisor.start_child(spec)  # type: ignore[arg-type]
        assert world.log == [("start", "a"), ("ready", "a")]
        assert supervisor.counts().specs == 1


@virtual
async def test_a_significant_child_is_refused_by_a_running_supervisor_without_auto_shutdown() -> None:
    significant = child("b", restart=transient, significant=True)
    async with running(World(), Supervisor("root")) as supervisor:
        with pytest.raises(DeclarationError, match=r"significant=True.*auto_shutdown=never"):
            await supervisor.start_child(significant)
    async with running(World(), Supervisor("root", auto_shutdown=any_significant)) as supervisor:
        assert await supervisor.start_child(significant) is not None


@virtual
async def test_failed_start_child_is_forgotten() -> None:
    broken = OSError("no such port")
    world = World(x=Script(start=1, refuse=broken))
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        for _ in range(10):  # more often than the intensity allows: it is not a restart
            with pytest.raises(StartFailed) as failed:
                await supervisor.start_child(child("x"))
            assert failed.value.__cause__ is broken
        assert [each.id for each in supervisor.children()] == ["a"]
        assert world.log[:2] == [("start", "a"), ("ready", "a")]
        assert world.names() == ["a"]
        assert world.errors() == ["start_error x"] * 10


@virtual
async def test_failed_manual_restart_keeps_the_spec() -> None:
    world = World(a=[Script(), Script(refuse=OSError("gone"))])
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        await supervisor.terminate_child("a")
        with pytest.raises(StartFailed, match="gone"):
            await supervisor.restart_child("a")
        assert state(supervisor, "a") == "stopped"
        await asyncio.sleep(100)
        assert world.events("start") == ["start a", "start a"]
        assert supervisor.counts() == Counts(specs=1, active=0, supervisors=0, workers=1)


@virtual
async def test_a_child_that_fails_while_a_later_one_starts_is_restarted_at_once() -> None:
    world = World(a=[Script(after=1, end=OSError("early")), Script()], b=Script(start=5))
    async with running(world, Supervisor("root", children=[child("a"), child("b"), child("c")])):
        assert [entry for entry in world.times if entry[1] == "start"] == [
            (0, "start", "a"),
            (0, "start", "b"),
            (1, "start", "a"),
            (5, "start", "c"),
        ]


@virtual
async def test_a_group_that_fails_while_it_starts_begins_anew_and_is_ready_only_then() -> None:
    world = World(a=[Script(after=1, end=OSError("early")), Script(start=1)], b=Script(start=5, cleanup=1))
    tree = Supervisor("root", strategy=rest_for_one, children=[child("a"), child("b"), child("c")])
    async with running(world, tree):
        starts = [entry for entry in world.times if entry[1] in ("start", "cancelled")]
        assert starts == [
            (0, "start", "a"),
            (0, "start", "b"),
            (1, "cancelled", "b"),
            (1, "start", "a"),
            (2, "start", "b"),
            (7, "start", "c"),
        ]


@virtual
async def test_a_child_added_while_the_others_start_waits_for_its_turn() -> None:
    world = World(a=Script(start=1), b=Script(start=1))
    supervisor = await launch(world, Supervisor("root", children=[child("a"), child("b")]))
    added = asyncio.ensure_future(supervisor.start_child(child("c")))
    await settle()
    assert state(supervisor, "c") == "starting"
    with pytest.raises(AlreadyPresent, match="it is starting"):
        await supervisor.start_child(child("c"))
    assert (await added) is not None
    assert world.events("start") == ["start a", "start b", "start c"]
    supervisor.stop()
    await world.host


@virtual
async def test_stopping_breaks_off_a_start() -> None:
    world = World(a=Script(cleanup=1), b=Script(start=1000))
    supervisor = await launch(world, Supervisor("root", children=[child("a"), child("b"), child("c")]))
    await asyncio.sleep(1)
    supervisor.stop()
    await world.host
    assert asyncio.get_running_loop().time() == 2.0
    assert not world.ready.is_set()
    assert world.log[-4:] == [("stop", "b"), ("cancelled", "b"), ("stop", "a"), ("end", "a")]


@virtual
async def test_stopping_breaks_off_the_start_of_a_whole_subtree_in_order() -> None:
    world = World(a=Script(cleanup=1), b=Script(start=1000))
    tree = Supervisor("root", children=[Supervisor("sub", children=[child("a"), child("b")])])
    supervisor = await launch(world, tree)
    await asyncio.sleep(1)
    supervisor.stop()
    await world.host
    assert world.log[-4:] == [("stop", "b"), ("cancelled", "b"), ("stop", "a"), ("end", "a")]
    assert world.errors() == []


@virtual
async def test_a_child_that_says_it_is_ready_while_it_is_being_stopped_does_not_count_as_ready() -> None:
    class Persistent:
        async def run(self, started: Callable[[], None]) -> None:
            with suppress(asyncio.CancelledError):
                await asyncio.sleep(10)
            started()

        def stop(self, reason: str) -> None: ...

    class Runtime(World):
        def life(self, *_: object) -> Persistent:  # type: ignore[override]
            return Persistent()

    world = Runtime()
    async with running(world, Supervisor("root")) as supervisor:
        starting = asyncio.ensure_future(supervisor.start_child(child("a")))
        await asyncio.sleep(1)
        await supervisor.terminate_child("a")
        with pytest.raises(StartFailed, match="terminated"):
            await starting
        assert world.reports == []
        assert state(supervisor, "a") == "stopped"


class Curious(World):
    """Looks, when it is asked for a life, how the supervisor `root` has that child in its books."""

    root: RunningSupervisor

    def __init__(self) -> None:
        super().__init__()
        self.seen: list[str] = []

    def life(self, task: ChildTask) -> ScriptedLife:
        if task.ref.id == "eager":
            known = self.root.incarnation("eager")
            self.seen.append("unknown" if known is None else f"{known.ref} {known.state}")
        return super().life(task)


@virtual
async def test_with_tasks_that_start_eagerly_a_life_is_made_only_when_its_supervisor_knows_of_it() -> None:
    world = Curious()
    steps: list[object] = []

    def eagerly(loop: asyncio.AbstractEventLoop, life: Any, **options: Any) -> asyncio.Task[Any]:
        """As `asyncio.eager_task_factory` does from Python 3.12 on: the first step is made within `create_task`."""
        steps.append(life.send(None))
        return asyncio.Task(life, loop=loop, **options)

    async with running(world, Supervisor("root", children=[])) as world.root:
        loop = asyncio.get_running_loop()
        before = loop.get_task_factory()
        adding = world.root.start_child(child("eager"))
        loop.set_task_factory(eagerly)
        try:
            ref = await adding
            world.crash("eager")
            await asyncio.sleep(1)
        finally:
            loop.set_task_factory(before)
        assert steps == [None, None], "each has given way once, before anything of its life was made"
        assert world.seen == ["root/eager#1 starting", "root/eager#2 starting"]
        assert world.events("start", "ready") == ["start eager", "ready eager"] * 2
        assert ref is not None
        assert ref.incarnation == 1


@virtual
async def test_a_supervisor_runs_once() -> None:
    world = World()
    async with running(world, Supervisor("root")) as supervisor:
        with pytest.raises(RuntimeError, match="make a new one"):
            await supervisor.run(lambda: None)


@virtual
async def test_a_supervisor_that_is_stopped_before_it_runs_starts_nothing() -> None:
    world = World()
    supervisor = create(RunningSupervisor, Supervisor("root", children=[child("a")]), world)
    with pytest.raises(SupervisorDown, match="it is new"):
        await supervisor.start_child(child("b"))
    supervisor.stop("changed my mind")
    supervisor.stop("again")
    await supervisor.run(lambda: None)
    assert world.log == []
    supervisor.stop("too late")
    assert repr(supervisor) == "<supervisor root: over, 1 children>"
    with pytest.raises(SupervisorDown, match="it is over"):
        await supervisor.terminate_child("a")


@virtual
async def test_a_start_failure_deep_in_the_tree_names_the_leaf() -> None:
    broken = OSError("encoder missing")
    world = World(walk=Script(refuse=broken))
    tree = Supervisor("robot", children=[Supervisor("gaits", children=[child("stand"), child("walk")])])
    with pytest.raises(StartFailed) as failed:
        await run_to_end(world, tree)
    assert failed.value.path == ("robot", "gaits", "walk")
    assert failed.value.__cause__ is broken
    assert "_run" in "".join(traceback.format_exception(failed.value)), "the original traceback"
    assert world.errors() == ["start_error walk", "start_error gaits"]


def test_start_failure_reaches_main_with_its_cause() -> None:
    program = textwrap.dedent("""
        import asyncio
        from actors.checks import create
        from actors.supervision.running import RunningSupervisor
        from actors.supervision.declarations import Child, Supervisor

        class Encoder:
            async def run(self, started):
                raise OSError("encoder missing")

        class Runtime:
            def life(self, task): return task.entry.spec.factory()
            def report(self, report): print(report)
            def gone(self, path, kept): ...

        tree = Supervisor("robot", children=[Supervisor("legs", children=[Child(Encoder)])])
        asyncio.run(create(RunningSupervisor, tree, Runtime()).run(print))
    """)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "encoder did not start" in done.stderr
    assert "robot/legs/encoder" in done.stderr
    # Python 3.13 shows the source of a program given by -c, between the place and the error.
    assert re.search(r"in run\n(?: .*\n)*OSError: encoder missing", done.stderr)
    assert "start_error" in done.stdout


@virtual
async def test_dynamic_supervisors_start_empty() -> None:
    async with running(World(), DynamicSupervisor("pool", child("worker"))) as pool:
        assert pool.children() == []


@virtual
async def test_a_class_may_be_started_as_a_child() -> None:
    class LateComer:
        """Follows the script of its name."""

    async with running(World(), Supervisor("root")) as supervisor:
        ref = await supervisor.start_child(LateComer)
        assert ref is not None and ref.id == "late_comer"
        assert supervisor.child_spec("late_comer") == Child(LateComer)
