"""The two orders of a seed: which of the steps that are ready together run, and that no step waits for ever."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import Awaitable, Callable
from random import Random
from typing import Any

import pytest

from actors.testing.fuzz import FuzzLoop
from actors.testing.orders import ByPriority, Shuffled, order_of
from actors.time.deadlock import Livelock

EVEN, ODD = range(0, 100, 2), range(1, 100, 2)


def run(main: Callable[[], Awaitable[Any]], seed: int, **options: Any) -> Any:
    loop = FuzzLoop(seed)
    for name, value in options.items():
        setattr(loop, name, value)

    async def body() -> Any:
        return await main()

    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        return runner.run(body())


def test_even_seeds_give_priority_and_odd_ones_shuffle() -> None:
    assert {type(order_of(seed, Random(seed))) for seed in EVEN} == {ByPriority}
    assert {type(order_of(seed, Random(seed))) for seed in ODD} == {Shuffled}


async def late_by_sixty_turns() -> bool:
    """Whether a task that was ready with two others is still where it was when those have had sixty turns each."""
    steps = 0
    there: asyncio.Queue[int] = asyncio.Queue()
    back: asyncio.Queue[int] = asyncio.Queue()

    async def asks() -> None:
        nonlocal steps
        await asyncio.sleep(1.0)
        for number in range(60):
            there.put_nowait(number)
            await back.get()
            steps += 1

    async def answers() -> None:
        for _ in range(60):
            back.put_nowait(await there.get())

    async def other() -> int:
        await asyncio.sleep(1.0)
        await asyncio.sleep(0)
        return steps

    _, _, seen = await asyncio.gather(asks(), answers(), other())
    return seen == 60


def test_one_task_may_be_late_by_many_turns() -> None:
    assert any(run(late_by_sixty_turns, seed) for seed in EVEN)
    assert not any(run(late_by_sixty_turns, seed) for seed in ODD), "which a shuffle does not reach"


def test_the_same_seed_is_the_same_order() -> None:
    async def trace() -> list[int]:
        log: list[int] = []

        async def work(number: int) -> None:
            for _ in range(5):
                log.append(number)
                await asyncio.sleep(0)

        await asyncio.gather(*(work(number) for number in range(4)))
        return log

    for seed in range(20):
        assert run(trace, seed) == run(trace, seed)
    assert len({tuple(run(trace, seed)) for seed in EVEN}) > 20


@pytest.mark.parametrize("players", [1, 2, 3])
def test_who_polls_does_not_keep_the_others_from_what_it_waits_for(players: int) -> None:
    """Neither one that asks again and again, nor some that wake each other in turn."""

    async def polling() -> int:
        ready = False
        turns = 0
        events = [asyncio.Event() for _ in range(players)]

        async def play(number: int) -> None:
            nonlocal turns
            while not ready:
                turns += 1
                if players == 1:
                    await asyncio.sleep(0)
                    continue
                events[(number + 1) % players].set()
                await events[number].wait()
                events[number].clear()
            events[(number + 1) % players].set()

        async def prepare() -> None:
            nonlocal ready
            await asyncio.sleep(0)
            ready = True

        await asyncio.gather(*(play(number) for number in range(players)), prepare())
        return turns

    turns = [run(polling, seed) for seed in range(200)]
    assert max(turns) < 5000
    assert max(turns) > 20


def test_no_livelock_is_invented_where_many_have_much_to_do_at_one_instant() -> None:
    async def crowd() -> None:
        async def work() -> None:
            for _ in range(20):
                await asyncio.sleep(0)

        await asyncio.gather(*(work() for _ in range(100)))

    for seed in range(8):
        run(crowd, seed, max_spins=200)


def test_a_livelock_is_still_found() -> None:
    async def spin() -> None:
        async def for_ever() -> None:
            while True:
                await asyncio.sleep(0)

        await asyncio.gather(*(for_ever() for _ in range(3)))

    for seed in range(4):
        with pytest.raises(Livelock):
            run(spin, seed, max_spins=200)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_task_that_is_over_is_forgotten(seed: int) -> None:
    """Else what it raised, and nobody looked at, would never be told."""

    async def forgetful() -> list[str]:
        told: list[str] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context["message"]))

        async def fail() -> None:
            await asyncio.sleep(0)
            raise ValueError("nobody looks")

        asyncio.create_task(fail())  # noqa: RUF006  # that nobody keeps it is the point
        asyncio.create_task(asyncio.sleep(0))  # noqa: RUF006
        await asyncio.sleep(1.0)
        gc.collect()
        return told

    assert run(forgetful, seed) == ["Task exception was never retrieved"]


@pytest.mark.parametrize("seed", range(6))
def test_what_is_kept_when_the_loop_stops_runs_when_it_goes_on(seed: int) -> None:
    done: list[int] = []

    async def work(number: int) -> None:
        await asyncio.sleep(0)
        done.append(number)

    loop = FuzzLoop(seed)
    tasks = [loop.create_task(work(number)) for number in range(5)]
    loop.call_soon(loop.stop)
    loop.run_forever()
    assert len(done) < 5
    loop.run_until_complete(asyncio.gather(*tasks))
    loop.close()
    assert sorted(done) == [0, 1, 2, 3, 4]
