"""The clock that nodes meet: one for durations, stamps and waiting, real or virtual."""

from __future__ import annotations

import asyncio
import math
import time

import pytest

from actors.checks import create
from actors.testing import VirtualLoop
from actors.time.clock import Clock

pytestmark = pytest.mark.virtual


def clock() -> Clock:
    return create(Clock, asyncio.get_running_loop(), virtual=True)


async def test_it_shows_seconds_since_it_was_made() -> None:
    await asyncio.sleep(5.0)
    ours = clock()
    assert (ours.now(), ours.now_ns()) == (0.0, 0)
    await ours.sleep(0.1)
    assert ours.now() == pytest.approx(0.1)
    assert ours.now_ns() == 100_000_000
    assert ours.loop_time(2.0) == 7.0
    assert repr(ours) == "<virtual clock at 0.100000 s>"


async def test_virtual_time_of_day_is_the_time_since_the_start() -> None:
    ours = clock()
    await ours.sleep(12.5)
    assert (ours.wall(), ours.wall_ns(), ours.wall_ns_at(1.0)) == (12.5, 12_500_000_000, 1_000_000_000)
    stamp = ours.stamp()
    assert (stamp.sec, stamp.nanosec) == (12, 500_000_000)


async def test_the_nanoseconds_of_a_stamp_are_always_less_than_a_second() -> None:
    ours = clock()
    for _ in range(200):
        await ours.sleep(0.0999999999)
        stamp = ours.stamp()
        assert 0 <= stamp.nanosec < 1_000_000_000
        assert stamp.sec + stamp.nanosec * 1e-9 == pytest.approx(ours.now())


async def test_sleep_takes_a_turn_of_the_loop_at_least() -> None:
    ours = clock()
    for seconds in (0.0, -1.0):
        turns: list[str] = []
        asyncio.get_running_loop().call_soon(turns.append, "another")
        await ours.sleep(seconds)
        assert turns == ["another"]
    assert ours.now() == 0.0


async def test_sleep_until_meets_its_instant_exactly_and_passes_at_once_when_it_is_over() -> None:
    ours = clock()
    await ours.sleep_until(3.25)
    assert ours.now() == 3.25
    turns: list[str] = []
    asyncio.get_running_loop().call_soon(turns.append, "another")
    await ours.sleep_until(1.0)
    assert (ours.now(), turns) == (3.25, ["another"])


async def test_a_sleeper_that_is_canceled_wakes_and_leaves_no_timer_behind() -> None:
    ours = clock()
    sleeper = asyncio.create_task(ours.sleep_until(100.0))
    await asyncio.sleep(1.0)
    sleeper.cancel()
    with pytest.raises(asyncio.CancelledError):
        await sleeper
    assert ours.now() == 1.0


async def test_an_instant_and_a_cancellation_together_do_no_harm() -> None:
    ours = clock()
    sleeper = asyncio.create_task(ours.sleep_until(1.0))
    await asyncio.sleep(0)
    asyncio.get_running_loop().call_at(1.0, sleeper.cancel)
    await asyncio.wait([sleeper])
    assert ours.now() == 1.0


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
async def test_what_is_no_duration_is_refused(odd: float) -> None:
    ours = clock()
    with pytest.raises(ValueError, match="the duration must be a finite number of seconds"):
        await ours.sleep(odd)
    with pytest.raises(ValueError, match="the instant must be a finite number of seconds"):
        await ours.sleep_until(odd)


def test_the_real_clock_tells_the_time_of_day() -> None:
    loop = asyncio.new_event_loop()
    before = time.time()
    ours = create(Clock, loop, virtual=False)
    assert before - 1e-3 <= ours.wall() <= time.time() + 1e-3  # the sum of an epoch and a difference is rounded
    assert before - 1 <= ours.stamp().sec <= time.time()
    assert repr(ours).startswith("<real clock at 0.")
    loop.close()


def test_a_cancellation_that_came_first_is_not_overtaken_by_the_instant() -> None:
    async def program() -> None:
        ours = clock()
        sleeper = asyncio.create_task(ours.sleep_until(1.0))
        asyncio.get_running_loop().call_at(1.0, sleeper.cancel)  # scheduled before the sleeper's own timer
        await asyncio.wait([sleeper])
        assert sleeper.cancelled()

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(program())


def test_on_the_real_clock_sleep_until_is_never_early_and_leaves_no_timer_when_canceled() -> None:
    async def main() -> tuple[float, int, bool]:
        loop = asyncio.get_running_loop()
        ours = create(Clock, loop, virtual=False)
        await ours.sleep_until(0.002)
        woken = ours.now()
        sleeper = asyncio.create_task(ours.sleep_until(100.0))
        await asyncio.sleep(0)
        sleeper.cancel()
        await asyncio.gather(sleeper, return_exceptions=True)
        timers = [timer for timer in loop._scheduled if not timer.cancelled()]  # type: ignore[attr-defined]
        return woken, len(timers), sleeper.cancelled()

    woken, timers, canceled = asyncio.run(main())
    assert woken >= 0.002
    assert (timers, canceled) == (0, True)


def test_on_the_real_clock_an_instant_and_a_cancellation_together_do_no_harm() -> None:
    async def main() -> bool:
        loop = asyncio.get_running_loop()
        ours = create(Clock, loop, virtual=False)
        sleeper = asyncio.create_task(ours.sleep_until(100.0))
        await asyncio.sleep(0)
        (timer,) = loop._scheduled  # type: ignore[attr-defined]
        sleeper.cancel()
        timer._run()
        return isinstance((await asyncio.gather(sleeper, return_exceptions=True))[0], asyncio.CancelledError)

    assert asyncio.run(main())
