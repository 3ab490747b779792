"""Periodic handlers: an exact grid, a late policy, and a record of how late they were."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from actors import Tick
from actors.errors import TickMissed
from actors.inbox.inbox import Inbox
from actors.runtime.timers import BACKLOG, KEPT, Lateness, NodeTimer, TimerRecord, Timers
from actors.time.ticker import Ticker

pytestmark = pytest.mark.virtual


def lone(inbox: Inbox, ticker: Ticker) -> Timers:
    """Timers of no node, whose late ticks nobody watches."""
    return Timers(cast("Any", SimpleNamespace(inbox=inbox)), ticker, None, ())


class Bench:
    """A timer on an inbox of its own."""

    def __init__(self, handler: Callable[..., Any], hz: float, late: Any = "skip", on_error: Any = None) -> None:
        loop = asyncio.get_running_loop()
        self.inbox = Inbox(loop)
        self.record = TimerRecord(hz)
        self.ticker = Ticker(loop)
        self.item = NodeTimer(self.inbox, handler, hz, late, "Node.tick", self.record, lone(self.inbox, self.ticker))
        life: Any = None if on_error is None else SimpleNamespace(on_error=on_error)
        self.task = asyncio.create_task(self.inbox.serve(life))

    async def run(self, seconds: float) -> None:
        self.item.begin(self.ticker)
        await asyncio.sleep(seconds)
        self.item.stop()
        await asyncio.sleep(0)

    async def close(self) -> None:
        self.task.cancel()
        await asyncio.wait([self.task])


async def test_a_hundred_thousand_ticks_are_on_the_grid_to_the_last_bit() -> None:
    ticks: list[Tick] = []
    bench = Bench(lambda tick: ticks.append(tick), 300.0)
    begun = asyncio.get_running_loop().time()
    await bench.run(100_000 / 300.0)
    assert len(ticks) == 100_000
    assert all(tick.k == k and tick.due == begun + k / 300.0 for k, tick in enumerate(ticks, 1))
    assert max(abs(tick.late) for tick in ticks) < 1e-9
    assert (bench.record.fired, bench.record.missed) == (100_000, 0)
    assert bench.record.lateness.quantiles() == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    await bench.close()


async def test_a_tick_shows_itself() -> None:
    bench = Bench(lambda: None, 10.0)
    await bench.run(1.0)
    assert repr(bench.item) == "<Node.tick at 10 Hz: 10 ticks, 0 missed>"
    assert repr(Tick(3, 0.3, 0.001)) == "Tick(3, due=0.300000, late=0.001000)"
    await bench.close()


async def test_skip_lets_go_what_is_due_while_the_last_one_waits_and_never_queues_up() -> None:
    begun: list[tuple[int, float]] = []

    async def slow(tick: Tick) -> None:
        begun.append((tick.k, asyncio.get_running_loop().time()))
        await asyncio.sleep(0.25)

    bench = Bench(slow, 10.0, "skip")
    await bench.run(1.0)
    assert [k for k, _ in begun] == [1, 2, 4, 7]
    assert bench.record.fired + bench.record.missed <= 10
    assert len(bench.inbox.items) <= 1
    await bench.close()


async def test_catch_up_does_every_tick_later_in_order() -> None:
    begun: list[tuple[int, float]] = []

    async def stumbling(tick: Tick) -> None:
        begun.append((tick.k, round(tick.late, 6)))
        if tick.k == 2:
            await asyncio.sleep(0.35)

    bench = Bench(stumbling, 10.0, "catch_up")
    await bench.run(1.0)
    assert begun == [(1, 0.0), (2, 0.0), (3, 0.25), (4, 0.15), (5, 0.05), *((k, 0.0) for k in range(6, 11))]
    assert bench.record.missed == 0
    assert bench.record.overdue == 2, "the third and the fourth began a whole period late, although none was missed"
    await bench.close()


async def test_catch_up_is_bounded_and_counts_what_it_loses() -> None:
    async def never(tick: Tick) -> None:
        await asyncio.sleep(1e6)

    bench = Bench(never, 1000.0, "catch_up")
    await bench.run(2.0)
    assert len(bench.item.backlog or ()) == BACKLOG
    assert bench.record.missed == 2000 - 1 - 1 - BACKLOG  # one runs, one waits, a thousand wait behind it
    await bench.close()


async def test_fault_raises_when_the_next_tick_begins_too_late() -> None:
    async def slow() -> None:
        await asyncio.sleep(0.25)

    bench = Bench(slow, 10.0, "fault")
    bench.item.begin(bench.ticker)
    with pytest.raises(
        TickMissed, match=r"Node\.tick: 1 more tick\(s\) were due before tick 2 had begun, 150\.0 ms late"
    ):
        await bench.task
    bench.item.stop()


async def test_after_a_fault_that_is_forgiven_the_timer_ticks_on_and_each_further_miss_is_a_fault_of_its_own() -> None:
    """A `TickMissed` that `on_error` let pass used to be the timer's last tick."""
    work = [0.25, 0.0, 0.0, 0.0, 0.35]
    ticks: list[int] = []
    faults: list[str] = []

    async def slow(tick: Tick) -> None:
        ticks.append(tick.k)
        await asyncio.sleep(work.pop(0) if work else 0.0)

    def forgive(error: Exception, label: str) -> str:
        assert isinstance(error, TickMissed)
        faults.append(str(error))
        return "continue"

    bench = Bench(slow, 10.0, "fault", on_error=forgive)
    await bench.run(2.0)
    assert [text.partition(" before")[0] for text in faults] == [
        "Node.tick: 1 more tick(s) were due",
        "Node.tick: 2 more tick(s) were due",
    ]
    assert ticks[-1] == 20
    assert (bench.record.fired, bench.record.missed) == (len(ticks) + 2, 3)
    await bench.close()


async def test_a_handler_that_is_late_but_not_too_late_is_no_fault() -> None:
    async def nearly() -> None:
        await asyncio.sleep(0.09)

    bench = Bench(nearly, 10.0, "fault")
    await bench.run(5.0)
    assert bench.record.fired == 50
    await bench.close()


async def test_the_record_counts_the_time_of_ticking_over_all_starts_and_stopping_twice_is_fine() -> None:
    bench = Bench(lambda: None, 10.0)
    now = asyncio.get_running_loop().time
    assert (bench.record.seconds(now()), bench.record.rate(now())) == (0.0, 0.0)
    bench.item.begin(bench.ticker)
    await asyncio.sleep(2.05)
    assert bench.record.seconds(now()) == 2.0
    bench.item.stop()
    bench.item.stop()
    await asyncio.sleep(5.0)
    assert bench.record.seconds(now()) == 2.0
    bench.item.begin(bench.ticker)
    await asyncio.sleep(1.05)
    bench.item.stop()
    assert bench.record.seconds(now()) == pytest.approx(3.0)
    assert bench.record.fired == 30
    assert bench.record.rate(now()) == pytest.approx(10.0)
    await bench.close()


def test_lateness_has_quantiles_and_keeps_the_newest() -> None:
    lateness = Lateness()
    assert (len(lateness), lateness.quantiles()) == (0, (0.0, 0.0, 0.0))
    for value in range(101):
        lateness.add(float(value))
    assert lateness.quantiles() == (50.0, 99.0, 100.0)
    for _ in range(KEPT):
        lateness.add(7.0)
    assert (len(lateness), lateness.quantiles()) == (KEPT, (7.0, 7.0, 7.0))


async def test_what_a_handler_takes_is_seen_through_decorators_and_callables() -> None:
    class Host:
        def plain(self) -> None: ...
        def ticked(self, tick: Tick) -> None: ...

        @functools.wraps(ticked)
        def decorated(self, *args: Any) -> None: ...

    class Callable_:
        def __call__(self) -> None: ...

    host = Host()
    expected: list[tuple[Callable[..., Any], bool]] = [
        (host.plain, False), (host.ticked, True), (host.decorated, True), (lambda: None, False), (lambda tick: None, True), (Callable_(), False),
    ]  # fmt: skip
    for handler, takes in expected:
        bench = Bench(handler, 1.0)
        assert bench.item.takes_tick is takes
        await bench.close()


def test_a_loop_that_was_held_up_drops_the_ticks_it_missed_and_keeps_the_grid() -> None:
    """On the real clock: something blocks the loop for a while; afterwards one tick comes, not a burst of old ones."""

    async def story() -> None:
        loop = asyncio.get_running_loop()
        inbox, record, ticker = Inbox(loop), TimerRecord(1000.0), Ticker(loop)
        begun: list[int] = []
        item = NodeTimer(
            inbox, lambda tick: begun.append(tick.k), 1000.0, "skip", "T.tick", record, lone(inbox, ticker)
        )
        item.begin(ticker)
        server = loop.create_task(inbox.serve())
        while not begun:
            await asyncio.sleep(0)
        hold_until = loop.time() + 0.05
        while loop.time() < hold_until:
            pass
        before = len(begun)
        while len(begun) < before + 2:
            await asyncio.sleep(0)
        item.stop()
        server.cancel()
        await asyncio.wait([server])
        assert record.missed >= 40
        assert begun[before + 1] > begun[before - 1] + 40
        assert record.fired + record.missed >= begun[-1]

    with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
        runner.run(story())
