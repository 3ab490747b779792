"""Who waits for a future, as far as asyncio's own means go."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

import anyio
import pytest

from actors.services.cycles import waiting_for

pytestmark = pytest.mark.virtual

AnyFuture = asyncio.Future[Any]


async def _task(future: AnyFuture) -> None:
    await asyncio.create_task(_awaited(future))


async def _gather(future: AnyFuture) -> None:
    await asyncio.gather(asyncio.sleep(100.0), _awaited(future))


async def _shield(future: AnyFuture) -> None:
    await asyncio.shield(_awaited(future))


async def _wait(future: AnyFuture) -> None:
    await asyncio.wait([asyncio.create_task(_awaited(future))])


async def _wait_for(future: AnyFuture) -> None:
    await asyncio.wait_for(_awaited(future), 1000.0)


async def _timeout(future: AnyFuture) -> None:
    async with asyncio.timeout(1000.0):
        await _awaited(future)


async def _task_group(future: AnyFuture) -> None:
    async with asyncio.TaskGroup() as group:
        group.create_task(_awaited(future))


async def _anyio_group(future: AnyFuture) -> None:
    async with anyio.create_task_group() as group:
        group.start_soon(_awaited, future)


async def _awaited(future: AnyFuture) -> None:
    await future


async def _nobody(future: AnyFuture) -> None:
    task = asyncio.create_task(_awaited(future))
    await asyncio.sleep(1000.0)
    await task


async def _open_group(future: AnyFuture) -> None:
    async with asyncio.TaskGroup() as group:
        group.create_task(_awaited(future))
        await asyncio.sleep(1000.0)


async def _done_callback(future: AnyFuture) -> None:
    future.add_done_callback(lambda _: None)
    await asyncio.sleep(1000.0)


async def _partial(future: AnyFuture) -> None:
    waiter: AnyFuture = asyncio.get_running_loop().create_future()
    future.add_done_callback(partial(_pass_on, waiter))
    await waiter


def _pass_on(waiter: AnyFuture, done: AnyFuture) -> None:
    waiter.set_result(done.result())


def reached(future: AnyFuture) -> set[AnyFuture]:
    """Everything that waits for it, by however many steps."""
    found: set[AnyFuture] = set()
    asked = [future]
    while asked:
        for one in waiting_for(asked.pop()):
            if one not in found:
                found.add(one)
                asked.append(one)
    return found


WAYS: dict[str, tuple[Callable[[AnyFuture], Awaitable[None]], bool]] = {
    "await": (_awaited, True),
    "create_task": (_task, True),
    "gather": (_gather, True),
    "shield": (_shield, True),
    "wait": (_wait, True),
    "wait_for": (_wait_for, True),
    "timeout": (_timeout, True),
    "TaskGroup": (_task_group, True),
    "anyio": (_anyio_group, True),
    "a callback that has the waiter": (_partial, True),
    "a task that nobody awaits": (_nobody, False),
    "the block of a group that waits for something else": (_open_group, False),
    "a callback": (_done_callback, False),
}


@pytest.mark.parametrize("way", WAYS)
async def test_who_awaits_is_seen_and_who_does_not_is_not(way: str) -> None:
    waits, seen = WAYS[way]
    future: AnyFuture = asyncio.get_running_loop().create_future()

    async def outer() -> None:
        await waits(future)

    task = asyncio.create_task(outer())
    await asyncio.sleep(1.0)
    assert (task in reached(future)) is seen
    task.cancel()
    future.cancel()
    await asyncio.wait([task])
    assert reached(future) == set()


async def test_a_callback_whose_variables_have_no_value_yet_is_no_obstacle() -> None:
    future: AnyFuture = asyncio.get_running_loop().create_future()

    def callback(done: object) -> None:
        print(later)

    future.add_done_callback(callback)
    task = asyncio.create_task(_awaited(future))
    await asyncio.sleep(0)
    assert reached(future) == {task}
    later = future.remove_done_callback(callback)
    assert later == 1
    future.set_result(None)
    await task
