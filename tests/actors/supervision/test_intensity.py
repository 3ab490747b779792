"""How often a supervisor tries: restart intensity, retries, backoff."""

from __future__ import annotations

import asyncio
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.supervision.children import Window
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import AlreadyPresent, Restarting, SupervisorGaveUp
from actors.supervision.policy import Backoff, Intensity, Strategy, one_for_all, one_for_one, rest_for_one, transient
from actors.supervision.reasons import Failed
from actors.supervision.refs import Counts
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import Script, World, child, running, settle, state, virtual

EVERY = [one_for_one, one_for_all, rest_for_one]
OFTEN = Intensity(1000, within=1.0)


@pytest.mark.parametrize("strategy", EVERY)
@virtual
async def test_giving_up(strategy: Strategy) -> None:
    world = World()
    tree = Supervisor(
        "root", strategy=strategy, intensity=Intensity(2, within=100), children=[child("a"), child("b"), child("c")]
    )
    async with running(world, tree):
        for _ in range(2):
            world.crash("b")
            await settle()
        world.times.clear()
        broken = OSError("the last straw")
        world.crash("b", broken)
        with pytest.raises(SupervisorGaveUp, match="restart intensity reached") as gave_up:
            await world.host
        assert world.events("stop", "end") == ["end b", "stop c", "end c", "stop a", "end a"]
        error = gave_up.value
        assert (error.path, error.child, error.restarts, error.within) == (("root",), "b", 2, 100)
        assert error.reason == Failed(broken)
        assert error.__cause__ is broken
        assert world.reports[-1].context == "shutdown"
        assert world.reports[-1].note == "restart intensity reached"


@virtual
async def test_a_supervisor_that_allows_no_restart_tells_of_the_end_and_not_of_a_number() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a")], intensity=Intensity(0, within=1.0))):
        world.crash("a", OSError("unplugged"))
        with pytest.raises(
            SupervisorGaveUp, match=r"^supervisor root gave up: a has ended, .*: it raised OSError: unplugged$"
        ):
            await world.host


@virtual
async def test_an_orderly_end_can_be_the_last_straw_too() -> None:
    world = World()
    async with running(world, Supervisor("root", intensity=Intensity(0), children=[child("a")])):
        world.finish("a")
        with pytest.raises(SupervisorGaveUp, match="it returned") as gave_up:
            await world.host
        assert gave_up.value.__cause__ is None


@virtual
async def test_spaced_failures_never_trip_it() -> None:
    world = World(a=Script(after=2.1, end=OSError("again")))
    async with running(world, Supervisor("root", intensity=Intensity(1, within=1.0), children=[child("a")])):
        await asyncio.sleep(2.1 * 500 + 1)
        assert world["a"].incarnation == 501


@pytest.mark.parametrize("strategy", EVERY)
@virtual
async def test_zero_tolerance(strategy: Strategy) -> None:
    world = World()
    async with running(world, Supervisor("root", strategy=strategy, intensity=Intensity(0), children=[child("a")])):
        world.crash("a")
        with pytest.raises(SupervisorGaveUp):
            await world.host
        assert world.events("start") == ["start a"]


@pytest.mark.parametrize("strategy", EVERY)
@virtual
async def test_failed_attempts_count(strategy: Strategy) -> None:
    world = World(b=[Script(), Script(start=0.1, refuse=OSError("dead"))])
    tree = Supervisor("root", strategy=strategy, intensity=Intensity(4), children=[child("a"), child("b"), child("c")])
    async with running(world, tree):
        world.crash("b")
        with pytest.raises(SupervisorGaveUp, match="dead"):
            await world.host
        assert world.events("start").count("start b") == 1 + 4
        assert world.names() == []
        assert [each for each in world.errors() if each.endswith(" b")] == [
            "child_terminated b",
            *["start_error b"] * 4,
            "shutdown b",
        ]


@virtual
async def test_failed_attempts_count_for_instances_of_a_template() -> None:
    world = World(a_1=[Script(), Script(refuse=OSError("dead"))])
    async with running(world, DynamicSupervisor("pool", child("a"), intensity=Intensity(4))) as pool:
        await pool.spawn()
        await pool.spawn()
        world.crash("a_1")
        with pytest.raises(SupervisorGaveUp):
            await world.host
        assert world.events("start").count("start a_1") == 1 + 4
        assert world.events("stop") == ["stop a_2"]


def fits(window: Window, now: float, intensity: Intensity) -> bool:
    """Count a restart at `now`; whether it was still within the intensity."""
    full = window.full(now, intensity)
    window.add(now, intensity)
    return not full


def test_sliding_window() -> None:
    window, intensity = Window(), Intensity(2, within=5.0)
    assert fits(window, 0.1, intensity)
    assert fits(window, 3.0, intensity)
    assert not fits(window, 5.1, intensity), "5 s old counts"
    assert not fits(window, 8.0, intensity)
    assert fits(window, 10.2, intensity), "those of 0.1 s, 3 s and 5.1 s are older than 5 s"


@virtual
async def test_a_restart_exactly_as_old_as_the_period_counts() -> None:
    for last, survives in ((5.0, False), (5.000001, True)):
        world = World()
        async with running(world, Supervisor("root", intensity=Intensity(1, within=5.0), children=[child("a")])):
            world.crash("a")
            await asyncio.sleep(last)
            world.crash("a")
            await settle()
            assert world.host.done() is not survives
            if not survives:
                assert isinstance(world.host.exception(), SupervisorGaveUp)


@given(st.lists(st.integers(0, 20), max_size=40), st.integers(0, 5), st.integers(1, 15))
def test_the_window_counts_what_a_full_list_would(gaps: list[int], restarts: int, within: int) -> None:
    window, intensity, times, now = Window(), Intensity(restarts, within), list[float](), 0.0
    for gap in gaps:
        now += gap / 10
        times.append(now)
        expected = sum(round(now - time, 9) <= within for time in times) <= restarts
        assert fits(window, now, intensity) is expected


@virtual
async def test_one_for_all_retry() -> None:
    world = World(b=[Script(), Script(refuse=OSError("not yet")), Script()])
    async with running(world, Supervisor("root", strategy=one_for_all, children=[child("a"), child("b"), child("c")])):
        world.times.clear()
        world.crash("a")
        await settle()
        assert world.events("stop", "start") == [
            *("stop c", "stop b", "start a", "start b"),
            *("stop a", "start a", "start b", "start c"),
        ]
        assert [life.incarnation for life in world.alive] == [3, 3, 2]


@virtual
@pytest.mark.parametrize("strategy", [one_for_all, rest_for_one])
async def test_who_had_ended_for_good_is_started_again_only_when_those_before_it_are_ready(strategy: Strategy) -> None:
    world = World(a=[Script(), Script(start=1.0, refuse=OSError("not yet")), Script(start=1.0)])
    children = [child("a"), child("b", restart=transient)]
    async with running(world, Supervisor("root", strategy=strategy, children=children)):
        world["b"].end()
        await settle()
        world.times.clear()
        world.crash("a")
        await asyncio.sleep(3.0)
        assert world.events("start", "ready", "stop") == ["start a", "start a", "ready a", "start b", "ready b"]


@virtual
async def test_rest_for_one_retry() -> None:
    world = World(b=[Script(), Script(refuse=OSError("not yet")), Script()])
    async with running(world, Supervisor("root", strategy=rest_for_one, children=[child("a"), child("b"), child("c")])):
        world.times.clear()
        world.crash("a")
        await settle()
        assert world.events("stop", "start") == ["stop c", "stop b", "start a", "start b", "start b", "start c"]
        assert [life.incarnation for life in world.alive] == [2, 3, 2]


def broken_after_the_first(start: float) -> list[Script]:
    return [Script(), Script(refuse=OSError("still broken"), start=start)]


async def check_responsive(supervisor: RunningSupervisor, name: str) -> None:
    """The state of a child that is restarting, and the answers to requests for it: all without time passing."""
    before = asyncio.get_running_loop().time()
    assert state(supervisor, name) == "restarting"
    assert supervisor.which(name) is None
    assert supervisor.counts().active == supervisor.counts().specs - 1
    with pytest.raises(Restarting, match="is restarting"):
        await supervisor.restart_child(name)
    with pytest.raises(Restarting, match="is restarting"):
        await supervisor.delete_child(name)
    assert asyncio.get_running_loop().time() == before


@pytest.mark.parametrize("strategy", EVERY)
@pytest.mark.parametrize("slow", [False, True])
@virtual
async def test_responsive_while_retrying(slow: bool, strategy: Strategy) -> None:
    world = World(b=broken_after_the_first(start=10.0 if slow else 0.0))
    retrying = child("b", backoff=None if slow else Backoff(10.0, 10.0))
    tree = Supervisor("root", strategy=strategy, intensity=OFTEN, children=[child("a"), retrying])
    async with running(world, tree) as supervisor:
        world.crash("b")
        for _ in range(3):
            await asyncio.sleep(25)
            if strategy != one_for_all:
                await check_responsive(supervisor, "b")
                assert supervisor.counts() == Counts(specs=2, active=1, supervisors=0, workers=2)
            assert state(supervisor, "b") == "restarting"
            with pytest.raises(AlreadyPresent, match="it is restarting"):
                await supervisor.start_child(child("b"))


@virtual
async def test_responsive_while_an_instance_of_a_template_retries() -> None:
    world = World(b_1=broken_after_the_first(start=10.0))
    async with running(world, DynamicSupervisor("pool", child("b"), intensity=OFTEN)) as pool:
        await pool.spawn()
        await pool.spawn()
        world.crash("b_1")
        await asyncio.sleep(25)
        await check_responsive(pool, "b_1")
        with pytest.raises(AlreadyPresent):
            await pool.spawn(name="b_1")
        assert await pool.spawn() is not None, "others can start meanwhile"


@pytest.mark.parametrize("strategy", EVERY)
@pytest.mark.parametrize("backoff", [None, Backoff(100.0, 100.0)])
@virtual
async def test_retry_can_be_cancelled(backoff: Backoff | None, strategy: Strategy) -> None:
    world = World(a=broken_after_the_first(start=100.0))
    tree = Supervisor("root", strategy=strategy, intensity=OFTEN, children=[child("a", backoff=backoff), child("b")])
    async with running(world, tree) as supervisor:
        world.crash("a")
        await asyncio.sleep(50)
        await supervisor.terminate_child("a")
        assert asyncio.get_running_loop().time() == 50
        assert state(supervisor, "a") == "stopped"
        await settle()
        assert world.names() == ["b"], "who waited behind it goes on"
        await asyncio.sleep(1000)
        assert state(supervisor, "a") == "stopped"


@pytest.mark.parametrize("strategy", EVERY)
@pytest.mark.parametrize("backoff", [None, Backoff(100.0, 100.0)])
@virtual
async def test_stop_drops_pending_retries(backoff: Backoff | None, strategy: Strategy) -> None:
    world = World(a=broken_after_the_first(start=100.0))
    tree = Supervisor("root", strategy=strategy, intensity=OFTEN, children=[child("a", backoff=backoff), child("b")])
    async with running(world, tree) as supervisor:
        world.crash("a")
        await asyncio.sleep(50)
        supervisor.stop()
        await world.host
        assert asyncio.get_running_loop().time() == 50
        assert state(supervisor, "a") == "stopped"
        assert world.errors() == ["child_terminated a"]


@virtual
async def test_backoff_spreads_the_attempts_and_begins_anew_after_a_long_enough_life() -> None:
    world = World(a=[Script()] + [Script(start=0.5, refuse=OSError("no"))] * 4 + [Script()])
    backoff = Backoff(1.0, 6.0, jitter=0.0)
    async with running(world, Supervisor("root", intensity=OFTEN, children=[child("a", backoff=backoff)])):
        world.crash("a")
        await asyncio.sleep(40)
        starts = [time for time, event, _ in world.times if event == "start"]
        assert starts == [0, 1.0, 3.5, 8.0, 14.5, 21.0]  # waits of 1, 2, 4, 6, 6 s, and failed starts of 0.5 s
        world.times.clear()
        world.crash("a")  # after a life of 19 s
        await asyncio.sleep(2)
        world.crash("a")  # after a life of 1 s
        await asyncio.sleep(10)
        assert [time for time, event, _ in world.times if event == "start"] == [41.0, 44.0]


@virtual
async def test_backoff_begins_anew_after_a_life_of_just_the_mean_of_its_first_and_longest_wait() -> None:
    world = World()
    backoff = Backoff(1.0, 6.0, jitter=0.0)
    async with running(world, Supervisor("root", intensity=OFTEN, children=[child("a", backoff=backoff)])):
        for life in (0.0, 3.5, 3.25):
            await asyncio.sleep(life)
            world.crash("a")
            await asyncio.sleep(1.0)
        await asyncio.sleep(1.5)
        assert [time for time, event, _ in world.times if event == "start"] == [0.0, 1.0, 5.5, 10.75]


@virtual
async def test_backoff_draws_its_jitter_from_the_seeded_source() -> None:
    times = []
    for _ in range(2):
        world, begin = World(), asyncio.get_running_loop().time()
        tree = Supervisor("root", intensity=OFTEN, children=[child("a", restart=transient, backoff=Backoff(1.0, 9.0))])
        async with running(world, tree):
            for _ in range(5):
                world.crash("a")
                await asyncio.sleep(20)
            times.append([round(time - begin, 5) % 20 for time, event, _ in world.times if event == "start"])
    assert times[0] == times[1]
    assert len({math.floor(1000 * time) for time in times[0]}) == 6, "and no two waits are the same"
    assert all(1.0 <= time <= 1.2 for time in times[0][1:])


@virtual
async def test_a_child_that_declines_a_restart_is_stopped() -> None:
    from actors.supervision.reasons import Skip

    world = World(a=[Script(), Script(refuse=Skip("enough"))])
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        world.crash("a")
        await settle()
        assert state(supervisor, "a") == "stopped"
        assert await supervisor.restart_child("a") is None


@virtual
async def test_giving_up_while_still_starting_is_a_failed_start_of_the_subtree() -> None:
    world = World(a=Script(after=1.0, end=OSError("short-lived")), b=Script(start=100))
    subtree = Supervisor("sub", intensity=Intensity(1, within=10), children=[child("a"), child("b")])
    async with running(world, Supervisor("root", children=[subtree])):
        error = world.host.exception()
        assert error is not None
        assert "sub did not start" in str(error)
        assert isinstance(error.__cause__, SupervisorGaveUp)
        assert world.names() == []
