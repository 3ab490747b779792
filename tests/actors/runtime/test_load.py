"""How busy a node is: samples of handler times, and of the wait for a turn."""

from __future__ import annotations

import asyncio

import pytest

from actors.inbox.load import HandlerLoad, Load, Meter
from tests.actors.topics.test_inbox import Bench, finish

pytestmark = pytest.mark.virtual


def test_a_meter_keeps_count_mean_and_longest_of_each_handler() -> None:
    meter = Meter()
    assert Load(0, 0, 0.0, 0.0, meter.handlers()).slowest is None
    for seconds in (0.1, 0.3, 0.2):
        meter.took("b", seconds)
    meter.took("a", 0.25)
    first, second = meter.handlers()
    assert first == HandlerLoad("a", samples=1, mean=0.25, longest=0.25)
    assert (second.handler, second.samples, second.longest) == ("b", 3, 0.3)
    assert second.mean == pytest.approx(0.2)
    assert Load(4, 0, 0.0, 0.0, meter.handlers()).slowest == second
    meter.waited(2.0)
    meter.waited(1.0)
    assert meter.longest_wait == 2.0


def test_the_first_items_are_all_measured_later_ones_by_samples_that_fall_into_no_period() -> None:
    measured, handled = [], 0
    while handled < 100_000:
        handled += Meter.interval(handled)
        measured.append(handled)
    assert measured[:16] == list(range(1, 17))
    gaps = {later - earlier for earlier, later in zip(measured[-100:], measured[-99:], strict=False)}
    assert max(gaps) <= Meter.INTERVAL
    for period in range(2, 8):
        assert len({handled % period for handled in measured}) == period


async def test_handler_times_are_seconds_of_the_loops_clock() -> None:
    bench = Bench()
    task = bench.serve()
    assert bench.inbox.load == Load(handled=0, waiting=0, age=0.0, longest_wait=0.0, handlers=())
    for _ in range(200):
        bench.inbox.put(bench.slow("long", 0.25))
        bench.inbox.put(bench.quick("short"))
        await asyncio.sleep(1.0)
    load = bench.inbox.load
    assert load.handled == 400
    long, short = load.handlers
    assert (long.handler, long.mean, long.longest) == ("long", pytest.approx(0.25), pytest.approx(0.25))
    assert (short.handler, short.mean) == ("short", 0.0)
    assert 10 < long.samples < 100
    assert 10 < short.samples < 100
    await finish(task)


async def test_the_wait_for_a_turn_is_measured_and_what_waits_now_is_told() -> None:
    bench = Bench()
    task = bench.serve()
    bench.inbox.put(bench.slow("long", 3.0))
    await asyncio.sleep(1.0)
    bench.inbox.put(bench.quick("behind"))
    bench.inbox.put(bench.quick("behind"))
    await asyncio.sleep(1.0)
    assert (bench.inbox.load.waiting, bench.inbox.load.age) == (2, 1.0)
    await asyncio.sleep(2.0)
    load = bench.inbox.load
    assert (load.handled, load.waiting, load.age, load.longest_wait) == (3, 0, 0.0, 2.0)
    await finish(task)


async def test_what_is_dropped_while_it_is_measured_is_not_measured() -> None:
    bench = Bench()
    task = bench.serve()
    bench.inbox.put(bench.slow("long", 3.0))
    await asyncio.sleep(1.0)
    bench.inbox.put_control(bench.quick("control"))  # goes first, and is not what waits
    assert bench.inbox.load.waiting == 1
    bench.inbox.put(bench.quick("dropped"))
    await asyncio.sleep(1.0)
    assert bench.inbox.load.age > 0.0
    bench.inbox.clear(keep=lambda item: False)
    assert (bench.inbox.load.waiting, bench.inbox.load.age) == (0, 0.0)
    await finish(task)
