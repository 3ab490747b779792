"""Timeouts of many futures with one timer for each value."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from actors.time.deadlines import Deadlines

pytestmark = pytest.mark.virtual


class Late(Exception):
    pass


class Caller:
    """Waits for its future."""

    due = 0.0

    def __init__(self, name: object = "") -> None:
        self.future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self.name = name

    def late(self) -> Late:
        return Late(self.name)


async def outcome(watched: Caller) -> tuple[float, str]:
    await asyncio.wait([watched.future])
    return asyncio.get_running_loop().time(), repr(watched.future.exception())


async def test_each_future_fails_at_its_own_time_with_its_own_error() -> None:
    loop = asyncio.get_running_loop()
    deadlines = Deadlines(loop)
    callers: list[Caller] = []
    for index, timeout in enumerate((2.0, 1.0, 2.0, 1.0)):
        await asyncio.sleep(0.25)
        callers.append(Caller(index))
        deadlines.watch(callers[-1], timeout)
    outcomes = await asyncio.gather(*(outcome(each) for each in callers))
    assert outcomes == [(2.25, "Late(0)"), (1.5, "Late(1)"), (2.75, "Late(2)"), (2.0, "Late(3)")]


async def test_an_answered_future_is_left_alone_and_its_error_never_made() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    answered, canceled, late = Caller(), Caller(), Caller()
    for each in (answered, canceled, late):
        deadlines.watch(each, 1.0)
    answered.future.set_result(42)
    canceled.future.cancel()
    await asyncio.wait([late.future])
    assert answered.future.result() == 42
    assert canceled.future.cancelled()
    assert isinstance(late.future.exception(), Late)


async def test_a_thousand_answered_calls_do_not_pile_up() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    for _ in range(1000):
        answered = Caller()
        deadlines.watch(answered, 60.0)
        answered.future.set_result(None)
    assert len(deadlines._queues[60.0].waiting) <= 66  # pyright: ignore[reportPrivateUsage]
    last = Caller()
    deadlines.watch(last, 60.0)
    assert await outcome(last) == (60.0, "Late('')")


async def test_nor_do_they_behind_one_that_is_never_answered() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    waits = Caller("the first")
    deadlines.watch(waits, 60.0)
    for _ in range(1000):
        answered = Caller()
        deadlines.watch(answered, 60.0)
        answered.future.set_result(None)
    assert len(deadlines._queues[60.0].waiting) <= 68  # pyright: ignore[reportPrivateUsage]
    assert await outcome(waits) == (60.0, "Late('the first')")


async def test_what_is_left_of_an_early_timer_is_waited_for() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    first, second = Caller(), Caller()
    deadlines.watch(first, 1.0)
    await asyncio.sleep(0.5)
    deadlines.watch(second, 1.0)
    assert await outcome(second) == (1.5, "Late('')")
    third = Caller()
    deadlines.watch(third, 1.0)  # the queue of this value was given up meanwhile
    assert await outcome(third) == (2.5, "Late('')")
    assert first.future.exception() is not None


async def test_after_closing_nothing_fails_any_more() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    watched = Caller()
    deadlines.watch(watched, 1.0)
    deadlines.close()
    await asyncio.sleep(5.0)
    assert not watched.future.done()


@pytest.mark.parametrize("timeout", [None, math.nan, "1"])
async def test_a_timeout_that_is_no_number_is_refused(timeout: Any) -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    with pytest.raises(ValueError, match="must be a number of seconds"):
        deadlines.watch(Caller(), timeout)


async def test_a_limit_may_lie_beyond_all_times() -> None:
    deadlines = Deadlines(asyncio.get_running_loop())
    watched = Caller()
    deadlines.watch(watched, math.inf)
    await asyncio.sleep(1e6)
    assert not watched.future.done()
    deadlines.close()
