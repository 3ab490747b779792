"""Changing what runs while it runs: replaced factories, new declarations."""

from __future__ import annotations

import asyncio

import pytest

from actors.errors import DeclarationError
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import (
    NotFound,
    StartFailed,
    TooManyChildren,
)
from actors.supervision.policy import Backoff, Intensity, rest_for_one
from actors.supervision.refs import Counts
from tests.actors.supervision.kit import Script, World, child, launch, node, running, settle, state, virtual


@virtual
async def test_replace_puts_the_new_in_the_place_of_the_old() -> None:
    def better() -> None: ...

    world = World(x=Script(start=1, cleanup=1))
    tree = Supervisor("root", strategy=rest_for_one, intensity=Intensity(0), children=[child("x"), child("y")])
    async with running(world, tree) as supervisor:
        world.times.clear()
        ref = await supervisor.replace("x", better)
        assert ref == supervisor.which("x")
        assert world.events("stop", "end", "start", "ready") == ["stop x", "end x", "start x", "ready x"]
        assert world.reasons == ["replaced"]
        assert world["x"].child.factory is better
        assert world["x"].incarnation == 2
        assert world.errors() == []
        await supervisor.terminate_child("x")
        assert await supervisor.replace("x", node) is None
        assert state(supervisor, "x") == "stopped"
        await supervisor.restart_child("x")
        assert world["x"].child.factory is node


@virtual
async def test_replace_serves_the_next_attempt_of_a_child_that_is_restarting() -> None:
    def better() -> None: ...

    world = World(x=[Script(), Script(start=100), Script()], y=[Script(), Script(start=100), Script()])
    children = [child("x"), child("y", backoff=Backoff(10.0, 10.0))]
    async with running(world, Supervisor("root", children=children)) as supervisor:
        world.crash("x")
        world.crash("y")
        await asyncio.sleep(1)
        assert await supervisor.replace("x", better) is None
        assert await supervisor.replace("y", better) is None
        await settle()
        assert world["x"].incarnation == 3, "the attempt with the old one was broken off"
        assert state(supervisor, "y") == "restarting"
        await asyncio.sleep(20)
        assert world["y"].child.factory is better


@virtual
async def test_replace_during_a_group_restart() -> None:
    def better() -> None: ...

    world = World(a=[Script(), Script(start=5), Script()], c=Script(cleanup=1))
    tree = Supervisor("root", strategy=rest_for_one, children=[child(name) for name in "abc"])
    async with running(world, tree) as supervisor:
        world.crash("a")
        await asyncio.sleep(0.5)  # c is stopping, b is about to
        assert await supervisor.replace("b", better) is None
        await asyncio.sleep(2)  # a is starting
        assert await supervisor.replace("a", better) is None
        await asyncio.sleep(10)
        assert world.events("start")[3:] == ["start a", "start a", "start b", "start c"]
        assert [life.child.factory is better for life in world.alive] == [True, True, False]
        assert world.errors() == ["child_terminated a"]


@virtual
async def test_replace_while_the_supervisor_still_starts_waits_for_its_turn() -> None:
    world = World(b=Script(start=10))
    supervisor = await launch(world, Supervisor("root", children=[child("a"), child("b"), child("c")]))
    assert await supervisor.replace("a", World) == supervisor.which("a")
    await world.ready.wait()
    assert world.events("start")[2:] == ["start a", "start c"]
    supervisor.stop()
    await world.host


@virtual
async def test_replace_while_the_supervisor_still_starts_starts_a_child_that_has_been_restarted_late() -> None:
    world = World(b=Script(start=10))
    late = child("a", backoff=Backoff(1.0, 1.0, jitter=0.0))
    supervisor = await launch(world, Supervisor("root", children=[late, child("b")]))
    world.crash("a")
    await asyncio.sleep(2)
    replaced = asyncio.ensure_future(supervisor.replace("a", World))
    await world.ready.wait()
    assert await replaced == supervisor.which("a")
    assert [time for time, event, name in world.times if (event, name) == ("start", "a")] == [0, 1, 10]
    supervisor.stop()
    await world.host


@virtual
async def test_reconfiguration_while_the_supervisor_still_starts_brings_no_restart_forward() -> None:
    world = World(b=Script(start=10))
    late = child("a", backoff=Backoff(20.0, 20.0, jitter=0.0))
    tree = Supervisor("root", children=[late, child("b")])
    supervisor = await launch(world, tree)
    world.crash("a")
    await asyncio.sleep(1)
    await supervisor.reconfigure(tree)
    await asyncio.sleep(24)
    assert [(time, name) for time, event, name in world.times if event == "start"] == [(0, "a"), (0, "b"), (20, "a")]
    assert world.ready.is_set()
    supervisor.stop()
    await world.host


@virtual
async def test_a_replacement_that_does_not_start_leaves_the_child_stopped() -> None:
    world = World(x=[Script(), Script(refuse=OSError("worse"))])
    async with running(world, Supervisor("root", children=[child("x")])) as supervisor:
        with pytest.raises(StartFailed, match="worse"):
            await supervisor.replace("x", World)
        assert state(supervisor, "x") == "stopped"
        with pytest.raises(DeclarationError, match="factory"):
            await supervisor.replace("x", None)  # type: ignore[arg-type]
        with pytest.raises(NotFound):
            await supervisor.replace("y", World)
        await supervisor.start_child(Supervisor("sub"))
        with pytest.raises(DeclarationError, match="reconfigure"):
            await supervisor.replace("sub", World)


@virtual
async def test_live_reconfiguration() -> None:
    world = World()
    old = Supervisor("root", children=[child("a"), child("gone"), child("b")])
    new = Supervisor("root", strategy=rest_for_one, children=[child("new"), child("a", args=(7,)), child("b")])
    async with running(world, old) as supervisor:
        lives = list(world.alive)
        await supervisor.reconfigure(new)
        assert world.alive == lives, "running children keep running"
        assert [(each.id, each.state) for each in supervisor.children()] == [
            ("new", "stopped"),
            ("a", "running"),
            ("gone", "running"),
            ("b", "running"),
        ]
        assert supervisor.child_spec("a") == new.children[1]
        world.times.clear()
        world.crash("a")
        await settle()
        assert world["a"].child.args == (7,)
        assert world.events("stop", "start") == ["stop b", "stop gone", "start a", "start gone", "start b"]
        await supervisor.terminate_child("gone")
        await supervisor.delete_child("gone")
        await supervisor.restart_child("new")
        assert supervisor.counts() == Counts(specs=3, active=3, supervisors=0, workers=3)
        assert await supervisor.start_child(child("last")) is not None
        assert [each.id for each in supervisor.children()] == ["new", "a", "b", "last"]


@pytest.mark.parametrize("invalid", [Supervisor("other"), DynamicSupervisor("root", child("a")), 42, None])
@virtual
async def test_an_invalid_replacement_is_refused_and_nothing_changes(invalid: Supervisor) -> None:
    tree = Supervisor("root", children=[child("a")])
    async with running(World(), tree) as supervisor:
        before = supervisor.children()
        with pytest.raises(DeclarationError, match="is a Supervisor named 'root', and cannot become"):
            await supervisor.reconfigure(invalid)
        assert supervisor.spec is tree
        assert supervisor.children() == before


@virtual
async def test_a_new_template_serves_the_next_restart_with_the_instances_own_arguments() -> None:
    world = World()
    async with running(world, DynamicSupervisor("pool", child("drone", args=["old"]))) as pool:
        await pool.spawn("red", parameters={"speed": 1.0})
        await pool.reconfigure(DynamicSupervisor("pool", child("drone", args=["new"], stop=1.0), max_children=1))
        assert world["drone_1"].child.args == ("old", "red")
        world.crash("drone_1")
        await settle()
        assert world["drone_1"].child.args == ("new", "red")
        assert world["drone_1"].child.parameters == {"speed": 1.0}
        with pytest.raises(TooManyChildren):
            await pool.spawn()


@virtual
async def test_reconfiguration_during_a_group_restart_keeps_the_new_order() -> None:
    world = World(c=Script(cleanup=1))
    old = Supervisor("root", strategy=rest_for_one, children=[child(name) for name in "abc"])
    async with running(world, old) as supervisor:
        world.crash("a")
        await settle()  # c is stopping
        await supervisor.reconfigure(old.replace(children=[child(name) for name in "acb"]))
        await asyncio.sleep(2)
        assert world.events("start")[3:] == ["start a", "start c", "start b"]
