"""Who is restarted, and with whom: restart types and strategies."""

from __future__ import annotations

import asyncio

import pytest

from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.policy import (
    Backoff,
    Intensity,
    Restart,
    Strategy,
    one_for_all,
    one_for_one,
    permanent,
    rest_for_one,
    temporary,
    transient,
)
from actors.supervision.reasons import Stop
from tests.actors.supervision.kit import Script, World, child, running, settle, state, virtual

OFTEN = Intensity(1000, within=1.0)


@pytest.mark.parametrize("end", [None, Stop("asked by a peer"), OSError("broken")])
@virtual
async def test_permanent(end: BaseException | None) -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a", restart=permanent)])) as supervisor:
        world["a"].end(end)
        await settle()
        assert world["a"].incarnation == 2
        assert state(supervisor, "a") == "running"
        assert world.errors() == ["child_terminated a"]


@pytest.mark.parametrize("end", [None, Stop(), Stop("done for today")])
@virtual
async def test_transient_is_not_restarted_after_an_orderly_end(end: BaseException | None) -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a", restart=transient)])) as supervisor:
        world["a"].end(end)
        await settle()
        assert state(supervisor, "a") == "stopped"
        assert world.names() == []
        assert world.errors() == []


@virtual
async def test_transient_is_restarted_after_a_failure() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a", restart=transient)])):
        world.crash("a")
        await settle()
        assert world["a"].incarnation == 2
        task = world["a"].task
        assert task is not None
        task.cancel()  # by somebody who is not its supervisor
        await settle()
        assert world["a"].incarnation == 3
        assert world.errors() == ["child_terminated a"] * 2


@pytest.mark.parametrize("end", [None, Stop(), OSError("broken")])
@virtual
async def test_temporary(end: BaseException | None) -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a", restart=temporary), child("b")])) as supervisor:
        world["a"].end(end)
        await settle()
        assert [each.id for each in supervisor.children()] == ["b"]
        assert world.events("start") == ["start a", "start b"]
        assert world.errors() == (["child_terminated a"] if isinstance(end, OSError) else [])


@pytest.mark.parametrize("strategy", [one_for_all, rest_for_one])
@virtual
async def test_temporary_bystander(strategy: Strategy) -> None:
    world = World()
    children = [child("a"), child("b", restart=temporary), child("c")]
    tree = Supervisor("root", strategy=strategy, intensity=Intensity(1, within=10), children=children)
    async with running(world, tree) as supervisor:
        world.crash("a")
        await settle()
        assert [(each.id, each.incarnation) for each in supervisor.children()] == [("a", 2), ("c", 2)]
        await asyncio.sleep(10.1)
        world.crash("a")  # the one restart that the intensity allows is still there
        await settle()
        assert world["c"].incarnation == 3


@virtual
async def test_one_for_one() -> None:
    world = World()
    async with running(world, Supervisor("root", strategy=one_for_one, children=[child("a"), child("b")])):
        bystander = world["b"]
        world.crash("a")
        await settle()
        assert world["a"].incarnation == 2
        assert world["b"] is bystander


@virtual
async def test_one_for_all() -> None:
    world = World(a=Script(cleanup=1), c=Script(cleanup=1))
    tree = Supervisor("root", strategy=one_for_all, children=[child("a"), child("b"), child("c")])
    async with running(world, tree):
        world.crash("b")
        await asyncio.sleep(3)
        assert world.log[6:] == [
            ("end", "b"),
            ("stop", "c"),
            ("end", "c"),
            ("stop", "a"),
            ("end", "a"),
            ("start", "a"),
            ("ready", "a"),
            ("start", "b"),
            ("ready", "b"),
            ("start", "c"),
            ("ready", "c"),
        ]
        assert [life.incarnation for life in world.alive] == [2, 2, 2]


@virtual
async def test_rest_for_one() -> None:
    world = World()
    tree = Supervisor("root", strategy=rest_for_one, children=[child("a"), child("b"), child("c")])
    async with running(world, tree):
        earlier = world["a"]
        world.crash("b")
        await settle()
        assert world.names() == ["a", "b", "c"]
        assert world["a"] is earlier
        assert (world["b"].incarnation, world["c"].incarnation) == (2, 2)
        assert world.events("stop") == ["stop c"]


@virtual
async def test_order_inside_a_group_restart() -> None:
    names = ["one", "two", "three", "four", "five"]
    world = World(**{name: Script(start=0.1, cleanup=0.1) for name in names})
    tree = Supervisor("root", strategy=rest_for_one, children=[child(name) for name in names])
    async with running(world, tree):
        world.times.clear()
        world.crash("three")
        await asyncio.sleep(1)
        assert world.events("stop", "end", "start", "ready") == [
            "end three",
            "stop five",
            "end five",
            "stop four",
            "end four",
            "start three",
            "ready three",
            "start four",
            "ready four",
            "start five",
            "ready five",
        ]


@virtual
async def test_dynamic_restart_keeps_its_own_arguments() -> None:
    world = World()
    async with running(world, DynamicSupervisor("pool", child("drone", args=["fleet"]))) as pool:
        await pool.spawn("red", parameters={"speed": 1.0})
        await pool.spawn("blue", name="leader")
        bystander = world["leader"]
        world.crash("drone_1")
        await settle()
        again = world["drone_1"]
        assert again.incarnation == 2
        assert again.child.args == ("fleet", "red")
        assert again.child.parameters == {"speed": 1.0}
        assert world["leader"] is bystander
        assert bystander.child.args == ("fleet", "blue")


@virtual
async def test_failure_climbs_the_tree() -> None:
    world = World()
    subtree = Supervisor("sub", intensity=Intensity(1, within=10), children=[child("helper"), child("worker")])
    async with running(world, Supervisor("root", children=[child("other"), subtree])) as root:
        ref = root.which("sub")
        assert ref is not None
        down = root.watch(ref)
        world.crash("worker")
        await settle()
        world.crash("worker")
        reason = (await down).reason
        assert str(reason).startswith("it stopped: shutdown (supervisor root/sub gave up")
        await settle()
        assert world.errors() == ["child_terminated worker"] * 2 + ["shutdown worker", "child_terminated sub"]
        assert root.which("sub") != ref
        assert [(life.name, life.incarnation) for life in world.alive] == [("other", 1), ("helper", 1), ("worker", 1)]
        assert world.events("stop") == ["stop helper"]


@virtual
async def test_a_transient_subtree_that_gives_up_has_ended_in_order() -> None:
    world = World()
    subtree = Supervisor("sub", intensity=Intensity(0), restart=transient, children=[child("worker")])
    async with running(world, Supervisor("root", children=[subtree])) as root:
        world.crash("worker")
        await settle()
        assert state(root, "sub") == "stopped"
        assert world.errors() == ["child_terminated worker", "shutdown worker"]


@virtual
async def test_children_that_ended_for_good_begin_anew_with_their_group_unless_they_were_terminated() -> None:
    world = World()
    children = [child("a"), child("once", restart=transient), child("parked")]
    async with running(world, Supervisor("root", strategy=one_for_all, children=children)) as supervisor:
        world.finish("once")
        await supervisor.terminate_child("parked")
        world.crash("a")
        await settle()
        assert [(each.id, each.state) for each in supervisor.children()] == [
            ("a", "running"),
            ("once", "running"),
            ("parked", "stopped"),
        ]


@virtual
async def test_a_second_failure_during_a_group_restart_merges_with_it() -> None:
    world = World(b=[Script(), Script(start=10), Script()], c=Script(cleanup=1))
    tree = Supervisor("root", strategy=rest_for_one, children=[child(name) for name in "abcd"])
    async with running(world, tree):
        world.times.clear()
        world.crash("b")
        await asyncio.sleep(2)  # d and c have stopped, b is starting
        world.crash("a")
        await asyncio.sleep(20)
        assert [entry for entry in world.times if entry[1] in ("stop", "start")] == [
            (0, "stop", "d"),
            (0, "stop", "c"),
            (1, "start", "b"),
            (2, "stop", "b"),
            (2, "start", "a"),
            (2, "start", "b"),
            (2, "start", "c"),
            (2, "start", "d"),
        ]
        assert world.names() == ["a", "b", "c", "d"]
        assert world.errors() == ["child_terminated b", "child_terminated a"]


@virtual
async def test_a_second_failure_while_the_group_still_stops_restarts_everything_once() -> None:
    world = World(d=Script(cleanup=2))
    tree = Supervisor("root", strategy=rest_for_one, children=[child(name) for name in "abcd"])
    async with running(world, tree):
        world.times.clear()
        world.crash("c")
        await asyncio.sleep(1)  # d is stopping
        world.crash("a")
        await asyncio.sleep(5)
        assert world.events("stop", "start") == ["stop d", "stop b", "start a", "start b", "start c", "start d"]


@pytest.mark.parametrize(
    ("restart", "end", "reports"),
    [
        (permanent, OSError("too"), ["child_terminated a", "shutdown_error b"]),
        (temporary, OSError("too"), ["child_terminated a", "shutdown_error b"]),
        (transient, None, ["child_terminated a"]),
    ],
)
@virtual
async def test_a_bystander_that_ends_by_itself_before_it_is_asked_is_no_second_failure(
    restart: Restart, end: BaseException | None, reports: list[str]
) -> None:
    world = World(c=Script(cleanup=2))
    children = [child("a"), child("b", restart=restart), child("c")]
    tree = Supervisor("root", strategy=rest_for_one, intensity=Intensity(1), children=children)
    async with running(world, tree) as supervisor:
        world.crash("a")
        await asyncio.sleep(1)  # c is stopping, b is next
        world["b"].end(end)
        await asyncio.sleep(5)
        assert world.errors() == reports
        assert world.names() == (["a", "c"] if restart == temporary else ["a", "b", "c"])
        assert supervisor.counts().active == len(world.alive)


@virtual
async def test_two_failures_of_a_group_with_backoff_wait_for_the_longer_one() -> None:
    world = World()
    slow, quick = Backoff(5.0, 10.0, jitter=0.0), Backoff(1.0, 10.0, jitter=0.0)
    children = [child("a", backoff=quick), child("b", backoff=slow), child("c", backoff=quick)]
    tree = Supervisor("root", strategy=rest_for_one, intensity=OFTEN, children=children)
    async with running(world, tree) as supervisor:
        world.times.clear()
        world.crash("b")
        await asyncio.sleep(1)
        assert [each.state for each in supervisor.children()] == ["running", "restarting", "restarting"]
        world.crash("a")
        await asyncio.sleep(10)
        assert world.events("stop") == ["stop c"]
        assert [entry for entry in world.times if entry[1] == "start"] == [
            (5, "start", "a"),
            (5, "start", "b"),
            (5, "start", "c"),
        ]
        world.times.clear()
        world.crash("c")
        world.crash("b")
        await asyncio.sleep(30)
        assert [entry[0] for entry in world.times if entry[1] == "start"] == [21, 21]
