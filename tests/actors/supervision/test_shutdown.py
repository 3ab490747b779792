"""How a supervisor stops: last child first, one at a time, each within its own time, whatever they do."""

from __future__ import annotations

import asyncio
import math

import anyio
import pytest

from actors.checks import create
from actors.supervision.child_task import GRACE
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import StartFailed
from actors.supervision.policy import Restart, StopTimeout, permanent, rest_for_one, temporary, transient
from actors.supervision.reasons import Killed, Leaked, Skip, Stop, Stopped
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import Script, World, child, failure, launch, running, settle, state, virtual


def now() -> float:
    return asyncio.get_running_loop().time()


async def stop(supervisor: RunningSupervisor, world: World) -> None:
    world.times.clear()
    supervisor.stop()
    await world.host


@virtual
async def test_reverse_order_one_at_a_time() -> None:
    world = World(a=Script(cleanup=1), b=Script(cleanup=2), c=Script(cleanup=3))
    async with running(world, Supervisor("root", children=[child("a"), child("b"), child("c")])) as supervisor:
        await stop(supervisor, world)
        assert world.times == [
            (0, "stop", "c"),
            (3, "end", "c"),
            (3, "stop", "b"),
            (5, "end", "b"),
            (5, "stop", "a"),
            (6, "end", "a"),
        ]


@virtual
async def test_subtrees_stop_as_one_child() -> None:
    world = World(b=Script(cleanup=1), c=Script(cleanup=1))
    tree = Supervisor("root", children=[child("a"), Supervisor("sub", children=[child("b"), child("c")]), child("d")])
    async with running(world, tree) as supervisor:
        await stop(supervisor, world)
        assert world.events("stop", "end") == [
            *("stop d", "end d", "stop c", "end c", "stop b", "end b", "stop a", "end a")
        ]
        assert set(world.reasons) == {"shutdown"}


@virtual
async def test_stop_timeout() -> None:
    world = World(a=Script(cleanup=1.5), b=Script(cleanup=100), c=Script(cleanup=1.5))
    children = [child(name, stop=2.0) for name in "abc"]
    async with running(world, Supervisor("root", children=children)) as supervisor:
        await stop(supervisor, world)
        assert world.times == [
            (0, "stop", "c"),
            (1.5, "end", "c"),
            (1.5, "stop", "b"),
            (3.5, "cancelled", "b"),
            (3.5, "stop", "a"),
            (5, "end", "a"),
        ]
        assert world.errors() == ["shutdown_error b"]
        assert world.reports[-1].reason == Killed(2.0)
        assert supervisor.leaked == []


@virtual
async def test_the_kill_goes_through_shields() -> None:
    class Shielded:
        async def run(self, started: object) -> None:
            started()  # type: ignore[operator]
            with anyio.CancelScope(shield=True):
                await asyncio.sleep(1000)

        def stop(self, reason: str) -> None: ...

    class Runtime(World):
        def life(self, *_: object) -> Shielded:  # type: ignore[override]
            return Shielded()

    world = Runtime()
    async with running(world, Supervisor("root", children=[child("a", stop=2.0)])) as supervisor:
        await stop(supervisor, world)
        assert now() == 2.0
        assert world.reports[-1].reason == Killed(2.0)


@virtual
async def test_a_child_that_refuses_to_die_is_abandoned_and_named() -> None:
    world = World(a=Script(cleanup=1), b=Script(stubborn=True), c=Script(cleanup=1))
    children = [child(name, stop=2.0) for name in "abc"]
    async with running(world, Supervisor("root", children=children)) as supervisor:
        ref = supervisor.which("b")
        assert ref is not None
        await stop(supervisor, world)
        assert now() == 1 + 2 + GRACE + 1
        assert world.events("end", "refused") == ["end c", "refused b", "end a"]
        assert world.errors() == ["shutdown_error b"]
        assert world.reports[-1].reason == Leaked(GRACE)
        (leaked,) = supervisor.leaked
        assert leaked.ref == ref
        assert not leaked.task.done()
        assert "leaked root/b#1" in repr(leaked)
        world.released.set()
        await settle()
        assert supervisor.leaked == [], "it ended after all"


@pytest.mark.parametrize("end", [None, OSError("far too late"), asyncio.CancelledError()])
@virtual
async def test_a_leaked_child_that_ends_or_says_ready_later_harms_nobody(end: BaseException | None) -> None:
    world = World(b=[Script(stubborn=True, end=end), Script()])
    async with running(world, Supervisor("root", children=[child("b", stop="kill")])) as supervisor:
        zombie = world["b"]
        await supervisor.terminate_child("b")
        assert now() == GRACE
        await supervisor.restart_child("b")
        assert [life.incarnation for life in world.alive] == [1, 2]
        zombie.started()
        await settle()
        assert state(supervisor, "b") == "running"
        assert world.errors() == ["shutdown_error b", "unexpected b"]
        world.released.set()
        await settle()
        assert world["b"].incarnation == 2
        assert supervisor.leaked == []


@virtual
async def test_a_supervisor_is_given_the_time_to_give_up_on_its_own_children() -> None:
    world = World(leaf=Script(stubborn=True))
    inner = Supervisor("inner", stop=3.0, children=[child("leaf", stop=math.inf)])
    async with running(world, Supervisor("root", children=[Supervisor("outer", children=[inner])])) as supervisor:
        await stop(supervisor, world)
        assert now() == 3.0 + GRACE
        assert [leaked.ref.id for leaked in supervisor.leaked] == ["leaf"]
        assert world.errors() == ["shutdown_error leaf", "shutdown_error inner"]


@virtual
async def test_brutal_kill() -> None:
    world = World(a=Script(cleanup=1), b=Script(cleanup=1))
    async with running(world, Supervisor("root", children=[child("a", stop="kill"), child("b")])) as supervisor:
        await stop(supervisor, world)
        assert world.times == [(0, "stop", "b"), (1, "end", "b"), (1, "cancelled", "a")]
        assert world.errors() == [], "it was declared so"
    world = World()
    async with running(world, DynamicSupervisor("pool", child("a", stop="kill"))) as pool:
        await pool.spawn()
        await stop(pool, world)
        assert world.events("stop", "cancelled") == ["cancelled a_1"]


@pytest.mark.parametrize("how", ["kill", 1.0])
@virtual
async def test_a_child_that_was_killed_and_has_ended_is_not_given_up_later(how: StopTimeout) -> None:
    world = World(a=Script(cleanup=5))
    async with running(world, Supervisor("root", children=[child("a", stop=how)])) as supervisor:
        await supervisor.terminate_child("a")
        await supervisor.restart_child("a")
        await asyncio.sleep(GRACE + 2.0)
        assert world.names() == ["a"]
        assert state(supervisor, "a") == "running"
        assert supervisor.leaked == []
        world.finish("a")


@virtual
async def test_unlimited_timeout() -> None:
    world = World(a=Script(cleanup=1e6), b=Script(cleanup=1e6))
    tree = Supervisor("root", children=[child("a", stop=math.inf), Supervisor("sub", children=[child("b", stop=2e6)])])
    async with running(world, tree) as supervisor:
        await stop(supervisor, world)
        assert now() == 2e6
        assert world.events("end") == ["end b", "end a"]
        assert world.errors() == []


@pytest.mark.parametrize("restart", [permanent, transient, temporary])
@pytest.mark.parametrize(
    ("end", "unclean"),
    [(None, {"permanent"}), (Stop("bye"), set[str]()), (OSError("broke"), {"permanent", "transient", "temporary"})],
)
@virtual
async def test_children_that_die_by_themselves_meanwhile(
    restart: Restart, end: BaseException | None, unclean: set[str]
) -> None:
    world = World(last=Script(cleanup=1))
    async with running(world, Supervisor("root", children=[child("a", restart=restart), child("last")])) as supervisor:
        supervisor.stop()
        await asyncio.sleep(0.5)
        world["a"].end(end)
        await world.host
        assert world.events("start") == ["start a", "start last"]
        assert world.errors() == (["shutdown_error a"] if restart in unclean else [])


@virtual
async def test_a_child_that_fails_while_it_cleans_up_is_reported() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a"), child("b")])) as supervisor:
        world["b"].fate.set_result(OSError("jammed"))  # it fails in the same instant
        supervisor.stop()
        await world.host
        assert world.errors() == ["shutdown_error b"]
        assert failure(world.reports[-1].reason) == "jammed"


@pytest.mark.parametrize(
    ("refuse", "reports"),
    [(OSError("no"), ["start_error x"]), (Skip("not now"), []), (None, [])],
)
@virtual
async def test_a_start_that_comes_to_its_end_meanwhile(refuse: BaseException | None, reports: list[str]) -> None:
    world = World(x=[Script(), Script(start=0.5, refuse=refuse)], last=Script(cleanup=1))
    async with running(world, Supervisor("root", children=[child("x"), child("last")])) as supervisor:
        await supervisor.terminate_child("x")
        starting = asyncio.ensure_future(supervisor.restart_child("x"))
        await settle()
        supervisor.stop()
        with pytest.raises(StartFailed, match="shutting down"):
            await starting
        await world.host
        assert world.errors() == reports
        assert world.names() == []


@virtual
async def test_dynamic_children_stop_together() -> None:
    world = World(**{f"drone_{n}": Script(cleanup=2) for n in range(1, 101)})
    async with running(world, DynamicSupervisor("pool", child("drone"))) as pool:
        for _ in range(100):
            await pool.spawn()
        await stop(pool, world)
        assert now() == 2.0
        assert len(world.events("end")) == 100
        assert world.events("stop")[:2] == ["stop drone_100", "stop drone_99"]


@pytest.mark.parametrize("ended", [False, True])
@virtual
async def test_a_child_that_hid_from_its_supervisor(ended: bool) -> None:
    world = World(a=Script(hides=True, cleanup=1))
    async with running(world, Supervisor("root", children=[child("a", stop=math.inf), child("b")])) as supervisor:
        if ended:
            world.finish("a")
            await asyncio.sleep(2)
            assert world.names() == ["b"]
            assert state(supervisor, "a") == "running", "it hid well"
        await asyncio.wait_for(supervisor.terminate_child("a"), 10)
        assert state(supervisor, "a") == "stopped"
        assert world.names() == ["b"]
        assert await supervisor.restart_child("a") is not None


@virtual
async def test_a_stop_hook_that_raises_is_a_kill_and_keeps_nobody_waiting() -> None:
    class Unstoppable(World):
        def life(self, *args: object) -> object:  # type: ignore[override]
            life = super().life(*args)  # type: ignore[arg-type]
            if life.name == "b":
                life.stop = self.refuse  # type: ignore[method-assign]
            return life

        def refuse(self, reason: str) -> None:
            raise ValueError("stop? what is that?")

    world = Unstoppable()
    async with running(world, Supervisor("root", children=[child("a"), child("b")])) as supervisor:
        await stop(supervisor, world)
        assert now() == 0
        assert world.errors() == ["shutdown_error b"]
        assert failure(world.reports[-1].reason) == "stop? what is that?"
        assert world.events("cancelled", "end") == ["cancelled b", "end a"]


@virtual
async def test_cancelling_a_supervisor_kills_its_whole_tree_at_once() -> None:
    world = World(a=Script(cleanup=100), b=Script(stubborn=True), c=Script(cleanup=100))
    tree = Supervisor(
        "root", children=[child("a"), Supervisor("sub", children=[child("b"), child("c")]), child("d", stop="kill")]
    )
    async with running(world, tree) as supervisor:
        supervisor.stop()
        world.host.cancel()
        await asyncio.sleep(0.5)
        world.host.cancel()  # no use: it is doing what it can, and will not be long
        await asyncio.wait([world.host])
        assert world.host.cancelled()
        assert now() == GRACE
        assert [leaked.ref.id for leaked in supervisor.leaked] == ["b"]
        assert world.events("cancelled", "end", "refused") == [
            *("cancelled d", "cancelled a", "cancelled c", "refused b")
        ]
        assert "shutdown_error a" in world.errors()


@virtual
async def test_a_supervisor_that_somebody_else_cancels_stops_its_children_in_order_unless_it_is_killed_meanwhile() -> (
    None
):
    for killed_at, end in ((math.inf, "end a"), (1.5, "cancelled a")):
        began = now()
        world = World(a=Script(cleanup=1.0), b=Script(cleanup=1.0))
        supervisor = create(
            RunningSupervisor,
            Supervisor("root", children=[child("a"), child("b")]),
            world,
            killed=lambda since=began, limit=killed_at: now() - since >= limit,  # type: ignore[misc]
        )
        ready = asyncio.Event()
        host = asyncio.create_task(supervisor.run(ready.set))
        await ready.wait()
        host.cancel()
        await asyncio.sleep(1.5)
        host.cancel()
        await asyncio.wait([host])
        assert host.cancelled()
        assert world.events("stop", "end", "cancelled") == ["stop b", "end b", "stop a", end]
        assert world.reasons == ["its task was canceled by somebody else"] * 2


@virtual
async def test_a_child_that_is_being_killed_is_given_up_no_later_when_its_supervisor_is_cancelled() -> None:
    world = World(a=Script(stubborn=True))
    async with running(world, Supervisor("root", children=[child("a", stop=2.0)])) as supervisor:
        supervisor.stop()
        await asyncio.sleep(2.5)
        world.host.cancel()
        await asyncio.wait([world.host])
        assert now() == 2.0 + GRACE
        assert world.events("refused") == ["refused a"]


@virtual
async def test_a_child_that_is_killed_while_it_starts_was_shut_down_and_did_not_fail_to_start() -> None:
    world = World(b=Script(start=5))
    await launch(world, Supervisor("root", children=[child("a"), child("b")]))
    world.host.cancel()
    await asyncio.wait([world.host])
    assert world.events("cancelled") == ["cancelled b", "cancelled a"]
    assert world.errors() == ["shutdown_error b", "shutdown_error a"]


@virtual
async def test_a_supervisor_in_a_cancelled_scope_ends_without_spinning() -> None:
    world = World(a=Script(stubborn=True))
    supervisor = create(RunningSupervisor, Supervisor("root", children=[child("a")]), world)
    ready = asyncio.Event()
    with anyio.move_on_after(5):
        await supervisor.run(ready.set)
    assert now() == 5 + GRACE
    assert len(supervisor.leaked) == 1
    world.released.set()


@pytest.mark.parametrize("turns", range(8))
@virtual
async def test_cancelling_a_supervisor_that_is_just_ending_is_harmless(turns: int) -> None:
    world = World()
    supervisor = await launch(world, Supervisor("root", children=[child("a")]))
    supervisor.stop()
    for _ in range(turns):
        await asyncio.sleep(0)
    world.host.cancel()
    await asyncio.wait([world.host])
    assert world.host.done()
    assert world.names() == []
    assert now() == 0


@virtual
async def test_a_child_whose_start_will_be_broken_off_is_stopping_and_not_running() -> None:
    world = World(x=Script(start=10), z=Script(cleanup=2))
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        starting = asyncio.ensure_future(supervisor.start_child(child("x")))
        await settle()
        await supervisor.start_child(child("z"))
        supervisor.stop()
        await asyncio.sleep(1)
        assert [state(supervisor, name) for name in ("a", "x", "z")] == ["running", "stopping", "stopping"]
        with pytest.raises(StartFailed, match="shutting down"):
            await starting
        await world.host


@virtual
async def test_children_see_the_reason_of_the_stop() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[Supervisor("sub", children=[child("a")])])) as supervisor:
        ref = supervisor.which("sub/a")
        assert ref is not None
        down = supervisor.watch(ref)
        supervisor.stop("SIGTERM")
        supervisor.stop("again")
        assert (await down).reason == Stopped("SIGTERM")
        await world.host


@virtual
async def test_a_leaked_bystander_does_not_hold_up_its_group() -> None:
    world = World(b=[Script(stubborn=True), Script()])
    tree = Supervisor("root", strategy=rest_for_one, children=[child("a"), child("b", stop=2.0)])
    async with running(world, tree):
        world.crash("a")
        await asyncio.sleep(10)
        assert [(life.name, life.incarnation) for life in world.alive] == [("b", 1), ("a", 2), ("b", 2)]
        assert world.errors() == ["child_terminated a", "shutdown_error b"]
        assert world.reports[3].reason == Leaked(GRACE)
