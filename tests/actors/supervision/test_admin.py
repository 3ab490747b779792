"""What can be asked of a running supervisor."""

from __future__ import annotations

import asyncio
import math

import pytest

from actors.errors import DeclarationError
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import (
    AlreadyPresent,
    AlreadyStarted,
    NotFound,
    Restarting,
    Running,
    StartFailed,
    SupervisorDown,
    TooManyChildren,
)
from actors.supervision.policy import Intensity, rest_for_one, temporary, transient
from actors.supervision.reasons import Skip, Stopped
from actors.supervision.refs import ChildInfo, ChildRef, Counts
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import Script, World, child, running, settle, state, virtual

OFTEN = Intensity(1000, within=1.0)


@virtual
async def test_start_child_on_a_running_id() -> None:
    async with running(World(), Supervisor("root", children=[child("x")])) as supervisor:
        with pytest.raises(AlreadyStarted, match="root already runs x") as refused:
            await supervisor.start_child(child("x"))
        assert refused.value.ref == supervisor.which("x")


@virtual
async def test_start_child_on_a_stopped_id() -> None:
    async with running(World(x=Script(cleanup=1)), Supervisor("root", children=[child("x")])) as supervisor:
        stopping = asyncio.ensure_future(supervisor.terminate_child("x"))
        await settle()
        with pytest.raises(AlreadyPresent, match="it is stopping"):
            await supervisor.start_child(child("x"))
        await stopping
        with pytest.raises(AlreadyPresent, match="it is stopped"):
            await supervisor.start_child(child("x"))


@virtual
async def test_terminate_child_keeps_the_spec() -> None:
    world = World(x=Script(cleanup=1))
    async with running(world, Supervisor("root", children=[child("x")])) as supervisor:
        ref = supervisor.which("x")
        assert ref is not None
        down = supervisor.watch(ref)
        await supervisor.terminate_child("x")
        assert world.names() == []
        assert (await down).reason == Stopped("shutdown")
        await asyncio.sleep(100)
        assert world.events("start") == ["start x"]
        assert supervisor.counts() == Counts(specs=1, active=0, supervisors=0, workers=1)
        assert world.errors() == []


@virtual
async def test_a_temporary_child_is_forgotten() -> None:
    async with running(World(), Supervisor("root", children=[child("x", restart=temporary)])) as supervisor:
        await supervisor.terminate_child("x")
        assert supervisor.children() == []


@virtual
async def test_terminate_child_is_idempotent_and_checks_ids() -> None:
    world = World(x=Script(cleanup=1))
    async with running(world, Supervisor("root", children=[child("x")])) as supervisor:
        await asyncio.gather(supervisor.terminate_child("x"), supervisor.terminate_child("x"))
        await supervisor.terminate_child("x")
        assert world.events("stop") == ["stop x"]
        with pytest.raises(NotFound, match="root has no child 'y'; it has: x"):
            await supervisor.terminate_child("y")


@virtual
async def test_restart_child() -> None:
    world = World(x=Script(start=1))
    async with running(world, Supervisor("root", children=[child("x")])) as supervisor:
        with pytest.raises(Running, match=r"terminate_child\('x'\) first") as refused:
            await supervisor.restart_child("x")
        assert refused.value.ref == supervisor.which("x")
        await supervisor.terminate_child("x")
        restarting = asyncio.ensure_future(supervisor.restart_child("x"))
        await settle()
        assert state(supervisor, "x") == "starting"
        with pytest.raises(Restarting, match="x is starting"):
            await supervisor.restart_child("x")
        assert await restarting == supervisor.which("x")
        assert world["x"].incarnation == 2
        with pytest.raises(NotFound):
            await supervisor.restart_child("y")
    async with running(World(), Supervisor("none")) as supervisor:
        with pytest.raises(NotFound, match="it has: none"):
            await supervisor.restart_child("y")


@virtual
async def test_delete_child_needs_a_stopped_child() -> None:
    world = World(y=[Script(), Script(start=100)])
    async with running(world, Supervisor("root", children=[child("x"), child("y")])) as supervisor:
        with pytest.raises(Running):
            await supervisor.delete_child("x")
        world.crash("y")
        await settle()
        with pytest.raises(Restarting):
            await supervisor.delete_child("y")
        await supervisor.terminate_child("x")
        await supervisor.delete_child("x")
        with pytest.raises(NotFound):
            await supervisor.restart_child("x")
        assert [each.id for each in supervisor.children()] == ["y"]
        assert await supervisor.start_child(child("x")) is not None, "the id is free again"


@virtual
async def test_introspection() -> None:
    world = World(b=[Script(), Script(start=100)], c=Script(cleanup=1), e=Script(refuse=Skip()))
    tree = Supervisor("root", children=[child("a"), child("b"), child("c"), child("d"), child("e"), Supervisor("sub")])
    async with running(world, tree) as supervisor:
        world.crash("b")
        stopping = asyncio.ensure_future(supervisor.terminate_child("c"))
        await supervisor.terminate_child("d")
        await settle()
        sub = supervisor.which("sub")
        assert supervisor.children() == [
            ChildInfo("a", "worker", "running", supervisor.which("a"), 1),
            ChildInfo("b", "worker", "restarting", None, 2),
            ChildInfo("c", "worker", "stopping", None, 1),
            ChildInfo("d", "worker", "stopped", None, 1),
            ChildInfo("e", "worker", "stopped", None, 1),
            ChildInfo("sub", "supervisor", "running", sub, 1),
        ]
        assert supervisor.counts() == Counts(specs=6, active=2, supervisors=1, workers=5)
        assert repr(supervisor) == "<supervisor root: running, 6 children>"
        await stopping


@virtual
async def test_descendants_are_found_by_their_path() -> None:
    world = World()
    tree = Supervisor("root", children=[Supervisor("sub", children=[child("a")]), child("b")])
    async with running(world, tree) as root:
        ref = root.which("sub/a")
        assert ref is not None
        assert (ref.path, ref.id, str(ref), repr(ref)) == (("root", "sub", "a"), "a", "root/sub/a#1", "<root/sub/a#1>")
        assert root.which(("sub", "a")) == ref
        assert root.life("sub/a") is world["a"]
        sub = root.life("sub")
        assert isinstance(sub, RunningSupervisor)
        assert sub.which("a") == ref
        for nowhere in ("x", "sub/x", "b/a"):
            with pytest.raises(NotFound):
                root.which(nowhere)
        await sub.terminate_child("a")
        assert root.which("sub/a") is None
        assert root.life("sub/a") is None
        await root.terminate_child("sub")
        assert root.which("sub/a") is None


@virtual
async def test_references_are_equal_only_to_the_same_incarnation() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("x")])) as supervisor:
        first = supervisor.which("x")
        assert first == supervisor.which("x")
        world.crash("x")
        await settle()
        assert supervisor.which("x") != first
        await supervisor.terminate_child("x")
        await supervisor.delete_child("x")
        again = await supervisor.start_child(child("x"))
        assert str(again) == str(first)
        assert again != first
        assert len({first, again, supervisor.which("x")}) == 2


@virtual
async def test_spec_read_back() -> None:
    declared = child("x", restart=transient)
    async with running(World(), Supervisor("root")) as supervisor:
        await supervisor.start_child(declared)
        spec = supervisor.child_spec("x")
        assert spec == declared
        assert (spec.restart, spec.stop, spec.backoff, spec.significant) == ("transient", 5.0, None, False)
        await supervisor.start_child(Supervisor("sub"))
        assert supervisor.child_spec("sub").stop == math.inf
        with pytest.raises(NotFound):
            supervisor.child_spec("y")


@virtual
async def test_dynamic_supervisor_addressing() -> None:
    world = World()
    tree = Supervisor("root", children=[child("foreign"), DynamicSupervisor("pool", child("drone"))])
    async with running(world, tree) as root:
        pool, foreign = root.life("pool"), root.which("foreign")
        assert isinstance(pool, RunningSupervisor)
        assert foreign is not None
        one, two = await pool.spawn("one"), await pool.spawn("two")
        assert one is not None
        assert two is not None
        with pytest.raises(NotFound, match="names the template"):
            await pool.terminate_child("drone")
        await pool.terminate_child(one)
        assert [each.id for each in pool.children()] == ["drone_2"]
        await pool.terminate_child(one)
        with pytest.raises(NotFound, match="root/foreign#1 is no child of root/pool; ask its own supervisor"):
            await pool.terminate_child(foreign)
        assert world.names() == ["foreign", "drone_2"]
        world.crash("drone_2")
        await settle()
        await pool.terminate_child(two)
        assert world.names() == ["foreign", "drone_2"], "the reference was to the incarnation before"
        await pool.terminate_child("drone_2")
        assert world.names() == ["foreign"]


@virtual
async def test_a_dynamic_supervisor_holds_max_children_and_those_restarting_count() -> None:
    world = World(drone_2=[Script(), Script(start=100)])
    tree = DynamicSupervisor("pool", child("drone", restart=transient), max_children=2, intensity=OFTEN)
    async with running(world, tree) as pool:
        await pool.spawn()
        await pool.spawn()
        world.crash("drone_2")
        await settle()
        assert [each.state for each in pool.children()] == ["running", "restarting"]
        with pytest.raises(TooManyChildren, match="max_children"):
            await pool.spawn()
        world.finish("drone_1")
        await settle()
        assert str(await pool.spawn()) == "pool/drone_3#1"


@virtual
async def test_dynamic_names_pass_over_those_in_use_and_free_themselves() -> None:
    world = World()
    async with running(world, DynamicSupervisor("pool", child("drone", restart=temporary))) as pool:
        await pool.spawn(name="drone_1")
        assert str(await pool.spawn()) == "pool/drone_2#1"
        with pytest.raises(AlreadyStarted):
            await pool.spawn(name="drone_1")
        world.finish("drone_1")
        await settle()
        assert await pool.spawn(name="drone_1") is not None
        world.scripts["late"] = Script(refuse=OSError("no"))
        with pytest.raises(StartFailed):
            await pool.spawn(name="late")
        world.scripts["shy"] = Script(refuse=Skip())
        assert await pool.spawn(name="shy") is None
        assert [each.id for each in pool.children()] == ["drone_2", "drone_1"]


@virtual
async def test_static_and_dynamic_supervisors_say_which_request_is_theirs() -> None:
    async with running(World(), Supervisor("root")) as supervisor:
        with pytest.raises(DeclarationError, match=r"use start_child\(\), not spawn\(\)"):
            await supervisor.spawn()
    async with running(World(), DynamicSupervisor("pool", child("x"))) as pool:
        with pytest.raises(DeclarationError, match=r"use spawn\(\), not start_child\(\)"):
            await pool.start_child(child("x"))
        with pytest.raises(DeclarationError, match="name"):
            await pool.spawn(name="a/b")


@virtual
async def test_terminating_a_child_that_is_starting_tells_who_waits_for_it() -> None:
    world = World(x=Script(start=100))
    async with running(world, Supervisor("root")) as supervisor:
        starting = asyncio.ensure_future(supervisor.start_child(child("x")))
        await asyncio.sleep(1)
        await supervisor.terminate_child("x")
        with pytest.raises(StartFailed, match="terminated before it had started"):
            await starting
        assert state(supervisor, "x") == "stopped"
        assert asyncio.get_running_loop().time() == 1


@virtual
async def test_a_child_terminated_before_its_first_step_never_runs() -> None:
    world = World()
    async with running(world, Supervisor("root")) as supervisor:
        starting = asyncio.ensure_future(supervisor.start_child(child("x")))
        stopping = asyncio.ensure_future(supervisor.terminate_child("x"))
        with pytest.raises(StartFailed):
            await starting
        await stopping
        assert world.log == []


@virtual
async def test_a_caller_that_goes_away_takes_nothing_back() -> None:
    world = World(x=Script(start=10), y=Script(start=10, refuse=OSError("no")), z=Script(start=10, refuse=Skip()))
    async with running(world, Supervisor("root")) as supervisor:
        for name in "xyz":
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(supervisor.start_child(child(name)), 1)
        await asyncio.sleep(20)
        assert [(each.id, each.state) for each in supervisor.children()] == [("x", "running"), ("z", "stopped")]
        world["x"].script.cleanup = 3
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(supervisor.terminate_child("x"), 1)
        await asyncio.sleep(5)
        assert state(supervisor, "x") == "stopped"


@virtual
async def test_stopping_tells_who_waits_for_a_start() -> None:
    world = World(x=Script(start=100))
    async with running(world, Supervisor("root")) as supervisor:
        starting = asyncio.ensure_future(supervisor.start_child(child("x")))
        await asyncio.sleep(1)
        supervisor.stop()
        with pytest.raises(StartFailed, match="root is shutting down"):
            await starting
        with pytest.raises(SupervisorDown, match=r"not running \(it is (stopping|over)\)"):
            await supervisor.start_child(child("y"))


@virtual
async def test_a_new_child_that_is_a_bystander_of_a_group_restart_still_answers_its_caller() -> None:
    world = World(c=Script(start=10))
    async with running(world, Supervisor("root", strategy=rest_for_one, children=[child("a")])) as supervisor:
        starting = asyncio.ensure_future(supervisor.start_child(child("c", restart=temporary)))
        await asyncio.sleep(5)
        world.crash("a")
        assert await starting == supervisor.which("c")
        assert asyncio.get_running_loop().time() == 15
        assert world["c"].incarnation == 2


@virtual
async def test_a_manual_restart_during_a_group_restart_takes_its_place_in_the_order() -> None:
    world = World(a=[Script(), Script(start=5)])
    tree = Supervisor("root", strategy=rest_for_one, children=[child(name) for name in "abcd"])
    async with running(world, tree) as supervisor:
        await supervisor.terminate_child("b")
        world.crash("a")
        await asyncio.sleep(1)
        world.times.clear()
        await supervisor.restart_child("b")
        await settle()
        assert world.events("start") == ["start b", "start c", "start d"]


@virtual
async def test_dead_references_below_are_not_found_as_children() -> None:
    async with running(World(), Supervisor("root", children=[child("a")])) as supervisor:
        await supervisor.terminate_child(ChildRef(("root", "a"), 7))
        await supervisor.terminate_child(ChildRef(("root", "b"), 1))
        assert state(supervisor, "a") == "running"
