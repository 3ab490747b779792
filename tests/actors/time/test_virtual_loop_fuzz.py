"""The fuzzing loop: another legal order for every seed, the same order for the same seed."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Any

import anyio
import pytest

from actors.testing.fuzz import FuzzLoop
from actors.time.deadlock import Deadlock
from actors.time.virtual_loop import VirtualLoop


def run(main: Callable[[], Awaitable[Any]], seed: int | None = None) -> Any:
    """Run `main()` under a seed, or in plain order."""
    factory = VirtualLoop if seed is None else lambda: FuzzLoop(seed)
    return anyio.run(main, backend_options={"loop_factory": factory})


async def four_clocks() -> str:
    """Four periodic tasks, most of whose deadlines coincide."""
    log: list[str] = []

    async def clock(name: str, hz: int) -> None:
        for k in range(1, 6):
            await anyio.sleep_until(k / hz)
            log.append(name)

    async with anyio.create_task_group() as group:
        for name, hz in zip("abcd", (10, 10, 20, 5), strict=True):
            group.start_soon(clock, name, hz)
    return "".join(log)


async def lost_update() -> int:
    """Three tasks increment a counter; one of them yields between reading and writing it."""
    counter = 0

    async def increment(yields: bool) -> None:
        nonlocal counter
        await anyio.sleep(1)
        value = counter
        if yields:
            await anyio.lowlevel.checkpoint()
        counter = value + 1

    async with anyio.create_task_group() as group:
        for yields in (True, False, False):
            group.start_soon(increment, yields)
    return counter


def test_the_same_seed_gives_the_same_trace() -> None:
    for seed in range(100):
        assert run(four_clocks, seed) == run(four_clocks, seed)


def test_two_hundred_seeds_give_many_interleavings_all_of_them_legal() -> None:
    traces = {run(four_clocks, seed) for seed in range(200)}
    assert len(traces) > 150
    for trace in traces:
        assert Counter(trace) == Counter("abcd" * 5)
        assert trace[0] == "c"  # at 0.05 s nobody else is due


def test_a_race_that_plain_order_hides_shows_under_some_seed() -> None:
    assert run(lost_update) == 1
    assert {run(lost_update, seed) for seed in range(100)} == {1, 2, 3}


def test_plain_callbacks_keep_their_order() -> None:
    async def main() -> list[int]:
        log: list[int] = []
        for number in range(20):
            asyncio.get_running_loop().call_soon(log.append, number)
        await asyncio.sleep(1)
        return log

    for seed in range(20):
        assert run(main, seed) == list(range(20))


def test_tasks_woken_together_are_shuffled() -> None:
    async def main() -> tuple[int, ...]:
        log: list[int] = []
        event = asyncio.Event()

        async def waiter(number: int) -> None:
            await event.wait()
            log.append(number)

        async with asyncio.TaskGroup() as group:
            for number in range(5):
                group.create_task(waiter(number))
            await asyncio.sleep(1)
            event.set()
        return tuple(log)

    assert run(main) == (0, 1, 2, 3, 4)
    assert len({run(main, seed) for seed in range(50)}) > 20


def test_equal_deadlines_of_callbacks_are_shuffled_but_not_with_later_ones() -> None:
    async def main() -> tuple[int, ...]:
        loop = asyncio.get_running_loop()
        log: list[int] = []
        for number in range(4):
            loop.call_at(1.0, log.append, number)
            loop.call_at(2.0, log.append, number + 10)
        loop.call_at(0.5, log.append, 99).cancel()
        await asyncio.sleep(3)
        return tuple(log)

    traces = {run(main, seed) for seed in range(50)}
    assert len(traces) > 20
    assert all(max(trace[:4]) < 10 <= min(trace[4:]) for trace in traces)


def test_no_task_gets_ahead_of_a_callback_that_was_ready_before_it() -> None:
    """A future tells its callbacks in order: when the task that awaits it goes on, what was registered before has been done."""

    async def main() -> tuple[str, ...]:
        loop = asyncio.get_running_loop()
        log: list[str] = []
        future: asyncio.Future[None] = loop.create_future()
        future.add_done_callback(lambda _: log.append("told"))

        async def busy(name: str) -> None:
            for _ in range(20):
                log.append(name)
                await asyncio.sleep(0)

        async def waits() -> None:
            await future
            log.append("goes on")

        async with asyncio.TaskGroup() as group:
            for name in "abc":
                group.create_task(busy(name))
            group.create_task(waits())
            for _ in range(5):
                await asyncio.sleep(0)
            future.set_result(None)
            loop.call_soon(log.append, "later")
        return tuple(log)

    traces = {run(main, seed) for seed in range(100)}
    assert len(traces) > 50
    assert all(trace.index("told") < trace.index("goes on") for trace in traces)
    assert all(trace.index("told") < trace.index("later") for trace in traces)


def test_what_waits_for_ever_is_still_reported_and_the_seed_is_shown() -> None:
    loop = FuzzLoop(7, start=5.0)
    assert repr(loop) == "<FuzzLoop at 5 s running=False closed=False seed=7>"
    with pytest.raises(Deadlock), asyncio.Runner(loop_factory=lambda: loop) as runner:
        runner.run(asyncio.Event().wait())
