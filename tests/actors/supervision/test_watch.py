"""Monitors and links."""

from __future__ import annotations

import asyncio

import pytest

from actors.supervision.declarations import Supervisor
from actors.supervision.errors import LinkBroken, NotFound
from actors.supervision.policy import transient
from actors.supervision.reasons import Failed, Gone, Returned, Skip, Stop, Stopped
from actors.supervision.refs import ChildRef, Down
from tests.actors.supervision.kit import Script, World, child, running, settle, state, virtual


@pytest.mark.parametrize("end", [None, Stop("bye"), OSError("broken")])
@virtual
async def test_a_watched_child_gives_notice_of_its_end_with_the_reason(end: BaseException | None) -> None:
    world = World()
    tree = Supervisor("root", children=[Supervisor("sub", children=[child("a", restart=transient)])])
    async with running(world, tree) as root:
        ref = root.which("sub/a")
        assert ref is not None
        one, two = root.watch(ref), root.watch(ref)
        world["a"].end(end)
        reason = Returned() if end is None else Stopped("bye") if isinstance(end, Stop) else Failed(end)
        assert await one == await two == Down(ref, reason)
        assert await root.watch(ref) == Down(ref, Gone())
        assert await root.watch(ChildRef(("root", "nobody"), 1)) == Down(ChildRef(("root", "nobody"), 1), Gone())
        for stranger in (("other", "a"), ("root",)):
            with pytest.raises(NotFound, match="is not below root"):
                root.watch(ChildRef(stranger, 1))


@virtual
async def test_a_watch_can_be_taken_back() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        ref = supervisor.which("a")
        assert ref is not None
        kept, dropped = asyncio.ensure_future(supervisor.watch(ref)), asyncio.ensure_future(supervisor.watch(ref))
        dropped.cancel()
        await settle()
        also_dropped = asyncio.ensure_future(supervisor.watch(ref))
        world.crash("a")
        also_dropped.cancel()
        assert (await kept).ref == ref
        assert dropped.cancelled()
        assert also_dropped.cancelled()


@virtual
async def test_linked_children_fail_together_each_under_its_own_supervisor() -> None:
    world = World(b=Script(cleanup=1))
    tree = Supervisor("root", children=[Supervisor("sub", children=[child("a")]), child("b"), child("c")])
    async with running(world, tree) as root:
        a, b = root.which("sub/a"), root.which("b")
        assert a is not None
        assert b is not None
        root.link(a, b)
        down = root.watch(b)
        world.crash("a")
        await settle()
        assert state(root, "b") == "stopping"
        reason = (await down).reason
        assert isinstance(reason, Failed)
        assert isinstance(reason.error, LinkBroken)
        assert reason.error.down.ref == a
        assert str(reason.error) == "linked to root/sub/a#1: it raised OSError: a broke"
        await settle()
        assert {(life.name, life.incarnation) for life in world.alive} == {("a", 2), ("b", 2), ("c", 1)}
        assert world.errors() == ["child_terminated a", "child_terminated b"]
        with pytest.raises(NotFound, match="root/sub/a#1 has ended"):
            root.link(a, b)
        c = root.which("c")
        assert c is not None
        with pytest.raises(NotFound, match="root/b#1 has ended"):
            root.link(c, b)


@pytest.mark.parametrize("end", [None, Stop()])
@virtual
async def test_an_orderly_end_breaks_no_link_but_ends_it(end: BaseException | None) -> None:
    world = World()
    tree = Supervisor("root", children=[child("a", restart=transient), child("b", restart=transient)])
    async with running(world, tree) as root:
        a, b = root.which("a"), root.which("b")
        assert a is not None
        assert b is not None
        root.link(a, b)
        world["b"].end(end)
        await settle()
        assert world.names() == ["a"]
        world.crash("a")
        await settle()
        assert world.names() == ["a"]


@virtual
async def test_a_link_to_a_child_that_is_ending_anyway_changes_nothing() -> None:
    world = World(b=Script(cleanup=3))
    async with running(world, Supervisor("root", children=[child("a"), child("b")])) as root:
        a, b = root.which("a"), root.which("b")
        assert a is not None
        assert b is not None
        root.link(a, b)
        stopping = asyncio.ensure_future(root.terminate_child("b"))
        await settle()
        world.crash("a")
        await stopping
        assert world.errors() == ["child_terminated a"]
        assert state(root, "b") == "stopped"


@virtual
async def test_a_linked_child_that_is_still_failing_can_be_stopped() -> None:
    world = World(b=Script(cleanup=3))
    async with running(world, Supervisor("root", children=[child("a"), child("b")])) as root:
        a, b = root.which("a"), root.which("b")
        assert a is not None
        assert b is not None
        root.link(a, b)
        world.crash("a")
        await asyncio.sleep(1)
        await root.terminate_child("b")
        assert asyncio.get_running_loop().time() == 3
        assert state(root, "b") == "stopped"
        assert world.errors() == ["child_terminated a", "shutdown_error b"]
        assert world.events("stop").count("stop b") == 1, "it is told once, however many have a reason to"


@virtual
async def test_a_child_that_is_killed_without_ado_gives_notice_of_just_that() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a", stop="kill")])) as root:
        ref = root.which("a")
        assert ref is not None
        down = root.watch(ref)
        await root.terminate_child("a")
        assert str((await down).reason) == "it was killed"


def test_the_word_of_who_stops_or_declines_is_the_text_of_the_exception() -> None:
    assert str(Stop("battery empty")) == Stop("battery empty").reason == "battery empty"
    assert str(Skip("no camera")) == Skip("no camera").reason == "no camera"
