"""Significant children: their end can be the end of their supervisor."""

from __future__ import annotations

import asyncio

import pytest

from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.policy import (
    AutoShutdown,
    Backoff,
    Restart,
    Strategy,
    all_significant,
    any_significant,
    never,
    one_for_all,
    rest_for_one,
    temporary,
    transient,
)
from actors.supervision.reasons import Stop, Stopped
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import Script, World, child, launch, running, settle, state, virtual

MODES = [any_significant, all_significant]
ENDS = [None, Stop("done"), OSError("broken")]


def significant(name: str, restart: Restart = temporary) -> Child:
    return child(name, restart=restart, significant=True)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("restart", [temporary, transient])
@pytest.mark.parametrize("end", ENDS)
@virtual
async def test_non_significant_exits_are_ignored(
    mode: AutoShutdown, restart: Restart, end: BaseException | None
) -> None:
    world = World()
    tree = Supervisor("root", auto_shutdown=mode, children=[child("a", restart=restart), significant("b")])
    async with running(world, tree):
        world["a"].end(end)
        await settle()
        assert not world.host.done()


@pytest.mark.parametrize("end", [*ENDS, "killed"])
@virtual
async def test_any_temporary_significant(end: BaseException | str | None) -> None:
    world = World()
    sub = Supervisor("sub", auto_shutdown=any_significant, children=[child("a"), significant("b"), child("c")])
    async with running(world, Supervisor("root", children=[sub])) as root:
        ref = root.which("sub")
        assert ref is not None
        down = root.watch(ref)
        if isinstance(end, str):
            task = world["b"].task
            assert task is not None
            task.cancel()
        else:
            world["b"].end(end)
        assert (await down).reason == Stopped("shutdown")
        assert world.events("stop") == ["stop c", "stop a"]


@virtual
async def test_the_root_returns_and_tells_why() -> None:
    world = World()
    async with running(world, Supervisor("root", auto_shutdown=any_significant, children=[significant("a")])):
        world.finish("a")
        await world.host
        (report,) = [each for each in world.reports if each.context == "shutdown"]
        assert report.note == "auto_shutdown=any_significant"
        assert str(report) == "root: shutdown: a (incarnation 1): it returned; auto_shutdown=any_significant"


@virtual
async def test_any_transient_significant() -> None:
    world = World()
    tree = Supervisor("root", auto_shutdown=any_significant, children=[significant("a", transient), child("b")])
    async with running(world, tree):
        world.crash("a")
        await settle()
        assert world["a"].incarnation == 2
        assert not world.host.done()
        world.finish("a")
        await world.host
        assert world.events("stop") == ["stop b"]


@virtual
async def test_a_significant_child_that_waits_for_its_restart_has_not_ended() -> None:
    world = World()
    waits = significant("a", transient).replace(backoff=Backoff(5.0, 5.0, jitter=0.0))
    async with running(world, Supervisor("root", auto_shutdown=all_significant, children=[waits, significant("b")])):
        world.crash("a")
        await settle()
        world.finish("b")
        await asyncio.sleep(6.0)
        assert world.names() == ["a"]
        world.finish("a")
        await world.host


@pytest.mark.parametrize("restart", [temporary, transient])
@virtual
async def test_all(restart: Restart) -> None:
    world = World()
    children = [significant("a", restart), significant("b", restart), child("c")]
    async with running(world, Supervisor("root", auto_shutdown=all_significant, children=children)):
        world.finish("a")
        await settle()
        assert not world.host.done()
        world.finish("b")
        await world.host
        assert world.events("stop") == ["stop c"]


@virtual
async def test_one_that_is_restarting_has_not_ended() -> None:
    world = World(a=[Script(), Script(start=10)])
    children = [significant("a", transient), significant("b", transient)]
    async with running(world, Supervisor("root", auto_shutdown=all_significant, children=children)):
        world.crash("a")
        await settle()
        world.finish("b")
        await asyncio.sleep(20)
        assert world.names() == ["a"]
        assert not world.host.done()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("restart", [temporary, transient])
@virtual
async def test_administrative_stop_does_not_count(mode: AutoShutdown, restart: Restart) -> None:
    world = World()
    tree = Supervisor("root", auto_shutdown=mode, children=[significant("a", restart), child("b")])
    async with running(world, tree) as supervisor:
        await supervisor.terminate_child("a")
        await settle()
        assert world.names() == ["b"]
        assert not world.host.done()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("restart", [temporary, transient])
@pytest.mark.parametrize("strategy", [one_for_all, rest_for_one])
@virtual
async def test_bystanders_do_not_count(mode: AutoShutdown, restart: Restart, strategy: Strategy) -> None:
    world = World()
    children = [child("a"), significant("b", restart)]
    async with running(world, Supervisor("root", strategy=strategy, auto_shutdown=mode, children=children)):
        world.crash("a")
        await settle()
        assert not world.host.done()
        assert world["a"].incarnation == 2


@pytest.mark.parametrize("marked", [True, False])
@virtual
async def test_escalation_follows_significance(marked: bool) -> None:
    world = World()
    inner = Supervisor(
        "inner",
        restart=transient,
        significant=marked,
        auto_shutdown=any_significant,
        children=[significant("worker", transient)],
    )
    async with running(world, Supervisor("outer", auto_shutdown=any_significant, children=[inner])) as outer:
        world.finish("worker")
        await settle()
        assert world.host.done() is marked
        assert state(outer, "inner") == "stopped"


@pytest.mark.parametrize("mode", MODES)
@virtual
async def test_dynamic_supervisors(mode: AutoShutdown) -> None:
    world = World()
    async with running(world, DynamicSupervisor("pool", significant("a"), auto_shutdown=mode)) as pool:
        await pool.spawn()
        await pool.spawn()
        world.finish("a_1")
        await settle()
        assert world.host.done() is (mode == any_significant)
        if mode == all_significant:
            world.finish("a_2")
        await world.host


@virtual
async def test_live_change_of_auto_shutdown() -> None:
    world = World()
    tree = Supervisor("root", auto_shutdown=any_significant, children=[significant("a", transient), child("b")])
    async with running(world, tree) as supervisor:
        await supervisor.reconfigure(
            tree.replace(auto_shutdown=never, children=[child("a", restart=transient), child("b")])
        )
        world.finish("a")
        await settle()
        assert not world.host.done()
        await supervisor.restart_child("a")
        await supervisor.reconfigure(tree)
        world.finish("a")
        await world.host


@virtual
async def test_live_change_of_significance() -> None:
    world = World()
    tree = Supervisor("root", auto_shutdown=any_significant, children=[child("a", restart=transient), child("b")])
    async with running(world, tree) as supervisor:
        await supervisor.reconfigure(tree.replace(children=[significant("a", transient), child("b")]))
        world.finish("a")
        await world.host


@virtual
async def test_a_significant_end_during_the_start_counts_once_all_are_ready() -> None:
    world = World(a=Script(after=1), b=Script(start=5))
    children = [significant("a"), child("b"), child("c")]
    supervisor = await launch(world, Supervisor("root", auto_shutdown=any_significant, children=children))
    assert isinstance(supervisor, RunningSupervisor)
    await world.host
    assert world.ready.is_set()
    assert world.events("start", "stop") == ["start a", "start b", "start c", "stop c", "stop b"]


@virtual
async def test_of_two_significant_children_that_end_while_the_others_start_the_first_is_named() -> None:
    world = World(slow=Script(start=10))
    tree = Supervisor(
        "root", auto_shutdown=any_significant, children=[significant("a"), significant("b"), child("slow")]
    )
    await launch(world, tree)
    for name in ("a", "b"):
        await asyncio.sleep(1)
        world.finish(name)
    await world.host
    assert world.events("ready", "stop") == ["ready a", "ready b", "ready slow", "stop slow"]
    assert [each.child.id for each in world.reports if each.context == "shutdown"] == ["a"]
