"""Tasks that wait to be woken."""

from __future__ import annotations

import asyncio

import pytest

from actors.waiting import Waiters, wake

pytestmark = pytest.mark.virtual


async def parked(waiters: Waiters, count: int, story: list[int]) -> list[asyncio.Task[None]]:
    """So many tasks that wait, and write down their number when they are woken."""

    async def wait(number: int) -> None:
        await waiters.wait()
        story.append(number)

    tasks = [asyncio.create_task(wait(number)) for number in range(count)]
    await asyncio.sleep(0)
    return tasks


async def test_all_are_woken_in_the_order_in_which_they_came() -> None:
    waiters, story = Waiters(), list[int]()
    tasks = await parked(waiters, 3, story)
    assert len(waiters) == 3
    waiters.wake_all()
    assert not waiters
    assert story == []  # they run at their next turn
    await asyncio.wait(tasks)
    assert story == [0, 1, 2]


async def test_to_wake_nobody_is_nothing_and_is_not_remembered() -> None:
    waiters, story = Waiters(), list[int]()
    waiters.wake_all()
    (task,) = await parked(waiters, 1, story)
    await asyncio.sleep(1.0)
    assert not task.done()
    waiters.wake_all()
    await task


async def test_who_is_canceled_takes_itself_out_and_the_others_wait_on() -> None:
    waiters, story = Waiters(), list[int]()
    tasks = await parked(waiters, 3, story)
    tasks[1].cancel()
    await asyncio.sleep(0)
    assert len(waiters) == 2
    waiters.wake_all()
    await asyncio.wait(tasks)
    assert story == [0, 2]
    assert tasks[1].cancelled()


async def test_a_cancellation_just_before_and_just_after_the_wake_up_leaves_nothing_behind() -> None:
    waiters, story = Waiters(), list[int]()
    tasks = await parked(waiters, 3, story)
    tasks[0].cancel()
    waiters.wake_all()
    tasks[1].cancel()
    assert not waiters
    await asyncio.wait(tasks)
    assert [task.cancelled() for task in tasks] == [True, True, False]
    assert story == [2]
    assert not waiters


async def test_who_waits_again_when_it_is_woken_waits_for_the_next_time() -> None:
    waiters = Waiters()
    rounds: list[int] = []

    async def twice() -> None:
        for number in range(2):
            await waiters.wait()
            rounds.append(number)

    task = asyncio.create_task(twice())
    await asyncio.sleep(0)
    waiters.wake_all()
    await asyncio.sleep(1.0)
    assert (rounds, len(waiters)) == ([0], 1)
    waiters.wake_all()
    await task
    assert rounds == [0, 1]


async def test_a_coroutine_that_is_closed_while_it_waits_takes_itself_out() -> None:
    waiters = Waiters()
    waiting = waiters.wait()
    waiting.send(None)
    assert len(waiters) == 1
    waiting.close()
    assert not waiters


async def test_a_future_is_completed_once() -> None:
    loop = asyncio.get_running_loop()
    first, canceled = loop.create_future(), loop.create_future()
    canceled.cancel()
    for value in (1, 2):
        wake(first, value)
        wake(canceled, value)
    assert first.result() == 1
    assert canceled.cancelled()
