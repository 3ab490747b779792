"""Timeouts of many futures with one timer for each value."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from actors.deadlines import Deadlines

pytestmark = pytest.mark.virtual


class Late(Exception):
    pass


def future() -> asyncio.Future[Any]:
    return asyncio.get_running_loop().create_future()


async def outcome(watched: asyncio.Future[Any]) -> tuple[float, str]:
    await asyncio.wait([watched])
    return asyncio.get_running_loop().time(), repr(watched.exception())


async def test_each_future_fails_at_its_own_time_with_its_own_error() -> None:
    loop = asyncio.get_running_loop()
    deadlines = Deadlines(loop)
    futures: list[asyncio.Future[Any]] = []
    for index, timeout in enumerate((2.0, 1.0, 2.0, 1.0)):
        await asyncio.sleep(0.25)
        futures.append(future())
        deadlines.watch(futures[-1], timeout, lambda index=index: Late(index))  # type: ignore[misc]
    outcomes = await asyncio.gather(*(outcome(each) for each in futures))
    assert outcomes == [(2.25, "Late(0)"), (1.5, "Late(1)"), (2.75, "Late(2)"), (2.0, "Late(3)")]


async def test_an_answered_future_is_left_alone_and_its_error_never_made() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    answered, canceled, late = future(), future(), future()
    for each in (answered, canceled, late):
        deadlines.watch(each, 1.0, Late)
    answered.set_result(42)
    canceled.cancel()
    await asyncio.wait([late])
    assert answered.result() == 42
    assert canceled.cancelled()
    assert isinstance(late.exception(), Late)


async def test_a_thousand_answered_calls_do_not_pile_up() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    for _ in range(1000):
        answered = future()
        deadlines.watch(answered, 60.0, Late)
        answered.set_result(None)
    assert len(deadlines._queues[60.0]) <= 66  # pyright: ignore[reportPrivateUsage]
    last = future()
    deadlines.watch(last, 60.0, Late)
    assert await outcome(last) == (60.0, "Late()")


async def test_what_is_left_of_an_early_timer_is_waited_for() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    first, second = future(), future()
    deadlines.watch(first, 1.0, Late)
    await asyncio.sleep(0.5)
    deadlines.watch(second, 1.0, Late)
    assert await outcome(second) == (1.5, "Late()")
    third = future()
    deadlines.watch(third, 1.0, Late)  # the queue of this value was given up meanwhile
    assert await outcome(third) == (2.5, "Late()")
    assert first.exception() is not None


async def test_after_closing_nothing_fails_any_more() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    watched = future()
    deadlines.watch(watched, 1.0, Late)
    deadlines.close()
    await asyncio.sleep(5.0)
    assert not watched.done()


@pytest.mark.parametrize("timeout", [None, math.nan, "1"])
async def test_a_timeout_that_is_no_number_is_refused(timeout: Any) -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    with pytest.raises(ValueError, match="every call has a limit, a number of seconds"):
        deadlines.watch(future(), timeout, Late)


async def test_a_limit_may_lie_beyond_all_times() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    watched = future()
    deadlines.watch(watched, math.inf, Late)
    await asyncio.sleep(1e6)
    assert not watched.done()
    deadlines.close()
