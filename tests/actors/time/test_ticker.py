"""The ticker: many periodic callbacks on one timer, on any event loop."""

from __future__ import annotations

import asyncio
import functools
import math
from collections.abc import Callable, Coroutine
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actors.testing.fuzz import FuzzLoop
from actors.time.deadlock import Deadlock
from actors.time.handles import is_dead
from actors.time.real_loop import new_event_loop
from actors.time.ticker import Ticker, TickHandle
from actors.time.virtual_loop import VirtualLoop


def run(
    main: Callable[[], Coroutine[Any, Any, Any]], factory: Callable[[], asyncio.AbstractEventLoop] = VirtualLoop
) -> Any:
    with asyncio.Runner(loop_factory=factory) as runner:
        return runner.run(main())


def ticker() -> Ticker:
    return Ticker(asyncio.get_running_loop())


def now() -> float:
    return asyncio.get_running_loop().time()


def uvloop_factory() -> asyncio.AbstractEventLoop:
    uvloop = pytest.importorskip("uvloop")
    loop: asyncio.AbstractEventLoop = uvloop.new_event_loop()
    return loop


class TestGrid:
    def test_the_kth_tick_is_due_at_start_plus_k_over_hz_exactly(self) -> None:
        async def main() -> list[tuple[int, float, float]]:
            ticks: list[tuple[int, float, float]] = []
            await asyncio.sleep(0.1)
            ticker().add(30, lambda k, due: ticks.append((k, due, now())))
            await asyncio.sleep(100)
            return ticks

        ticks = run(main)
        assert [k for k, _, _ in ticks] == list(range(1, 3001))
        assert all(due == 0.1 + k / 30 for k, due, _ in ticks)
        assert all(time == due for _, due, time in ticks)

    def test_a_start_may_be_given(self) -> None:
        async def main() -> list[tuple[int, float]]:
            ticks: list[tuple[int, float]] = []
            ticker().add(2, lambda k, due: ticks.append((k, due)), start=10.0)
            await asyncio.sleep(11)
            return ticks

        assert run(main) == [(1, 10.5), (2, 11.0)]

    def test_equal_deadlines_fire_in_the_order_of_adding_whatever_the_rounding_errors(self) -> None:
        async def main() -> list[str]:
            log: list[str] = []
            ticks = ticker()
            ticks.add(10, lambda k, due: log.append("a"), start=0.1)  # 0.1 + 2/10 is 0.30000000000000004
            ticks.add(10, lambda k, due: log.append("b"), start=0.0)  # 3/10 is 0.3
            ticks.add(100, lambda k, due: log.append("c") if k % 10 == 0 else None)
            await asyncio.sleep(0.35)
            return log

        assert run(main) == ["b", "c", "a", "b", "c", "a", "b", "c"]

    def test_tasks_woken_by_a_tick_run_before_the_next_instant(self) -> None:
        async def main() -> list[str]:
            log: list[str] = []
            ticks = ticker()
            woken = asyncio.Event()

            async def task() -> None:
                while True:
                    await woken.wait()
                    woken.clear()
                    await asyncio.sleep(0)
                    log.append(f"task at {now()}")

            def tick(k: int, due: float) -> None:
                log.append(f"tick {k}")
                woken.set()

            def other(k: int, due: float) -> None:
                log.append(f"other {k}")

            running = asyncio.create_task(task())
            ticks.add(2, tick)
            ticks.add(2, other)
            await asyncio.sleep(1.25)
            running.cancel()
            return log

        assert run(main) == ["tick 1", "other 1", "task at 0.5", "tick 2", "other 2", "task at 1.0"]

    def test_timers_of_the_loop_keep_their_place_between_ticks(self) -> None:
        async def main() -> list[float]:
            log: list[float] = []
            loop = asyncio.get_running_loop()
            ticker().add(1, lambda k, due: log.append(due))
            for when in (0.5, 1.5, 2.5):
                loop.call_at(when, log.append, when)
            await asyncio.sleep(3.25)
            return log

        assert run(main) == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]

    @settings(max_examples=30, deadline=None)
    @given(st.lists(st.integers(1, 500), min_size=1, max_size=8), st.integers(1, 5))
    def test_no_tick_is_lost_or_out_of_order(self, rates: list[int], seconds: int) -> None:
        async def main() -> list[tuple[Fraction, int]]:
            log: list[tuple[Fraction, int]] = []

            def tick(number: int, hz: int, k: int, due: float) -> None:
                log.append((Fraction(k, hz), number))

            ticks = ticker()
            for number, hz in enumerate(rates):
                ticks.add(hz, functools.partial(tick, number, hz))
            await asyncio.sleep(seconds + 1e-6)
            return log

        log = run(main)
        assert log == sorted(log)
        assert len(log) == seconds * sum(rates)


class TestHandles:
    def test_a_cancelled_tick_comes_no_more_and_does_not_hold_the_clock(self) -> None:
        async def main() -> None:
            ticks = ticker()
            handle = ticks.add(0.001, lambda k, due: pytest.fail("cancelled ticks must not come"))
            handle.cancel()
            handle.cancel()
            assert repr(ticks) == "<Ticker with 0 periodic callbacks>"
            assert handle.skip_missed() == 0
            await asyncio.Event().wait()

        loop = VirtualLoop()
        with pytest.raises(Deadlock), asyncio.Runner(loop_factory=lambda: loop) as runner:
            runner.run(main())
        assert loop.time() == 0.0

    def test_ticks_may_be_added_and_cancelled_by_ticks_of_the_same_instant(self) -> None:
        async def main() -> list[str]:
            log: list[str] = []
            ticks = ticker()
            late: list[TickHandle] = []

            def first(k: int, due: float) -> None:
                log.append("first")
                victim.cancel()
                own.cancel()
                late.append(ticks.add(4, lambda k, due: log.append(f"added, due {due}")))

            own = ticks.add(1, first)
            victim = ticks.add(1, lambda k, due: log.append("never"))
            await asyncio.sleep(1.5)
            late[0].cancel()
            await asyncio.sleep(10)
            return log

        assert run(main) == ["first", "added, due 1.25", "added, due 1.5"]

    def test_a_tick_may_end_itself(self) -> None:
        async def main() -> list[int]:
            log: list[int] = []

            def once(k: int, due: float) -> None:
                log.append(k)
                handle.cancel()

            handle = ticker().add(1, once)
            await asyncio.sleep(5)
            return log

        assert run(main) == [1]

    def test_only_the_next_due_time_holds_a_timer_of_the_loop(self) -> None:
        async def main() -> int:
            loop = asyncio.get_running_loop()
            assert isinstance(loop, VirtualLoop)
            ticks = ticker()
            handles = [ticks.add(hz, lambda k, due: None) for hz in range(1, 101)]
            await asyncio.sleep(1)
            live = [entry for entry in loop._timers if not is_dead(entry[3])]
            for handle in handles:
                handle.cancel()
            return len(live)

        assert run(main) == 1

    def test_handles_are_worth_reading(self) -> None:
        async def main() -> tuple[str, str]:
            def steer(k: int, due: float) -> None: ...

            ticks = ticker()
            handle = ticks.add(50, steer)
            await asyncio.sleep(0.1)
            return repr(handle), repr(ticks)

        handle, ticks = run(main)
        assert "steer at 50 Hz from 0.000000 s, " in handle
        assert ticks == "<Ticker with 1 periodic callbacks>"

    @pytest.mark.parametrize("hz", [0.0, -1.0, math.inf, math.nan, 1.1e6])
    def test_an_impossible_rate_is_refused(self, hz: float) -> None:
        async def main() -> None:
            with pytest.raises(ValueError, match="Hz"):
                ticker().add(hz, lambda k, due: None)

        run(main)

    @pytest.mark.parametrize("start", [math.inf, math.nan])
    def test_an_impossible_start_is_refused(self, start: float) -> None:
        async def main() -> None:
            with pytest.raises(ValueError, match="start"):
                ticker().add(1, lambda k, due: None, start=start)

        run(main)


class TestErrors:
    def test_an_exception_is_reported_and_all_go_on_ticking(self) -> None:
        async def main() -> tuple[list[str], list[int]]:
            reports: list[str] = []
            healthy: list[int] = []
            loop = asyncio.get_running_loop()
            loop.set_exception_handler(
                lambda _, context: reports.append(f"{context['message']}: {context['exception']}")
            )
            ticks = ticker()

            def sick(k: int, due: float) -> None:
                raise ValueError(f"tick {k}")

            ticks.add(1, sick)
            ticks.add(1, lambda k, due: healthy.append(k))
            await asyncio.sleep(2.5)
            return reports, healthy

        reports, healthy = run(main)
        assert healthy == [1, 2]
        assert ["tick 1" in reports[0], "tick 2" in reports[1], "sick at 1 Hz" in reports[0]] == [True] * 3

    def test_what_ends_the_program_ends_the_delivery_but_not_the_ticker(self) -> None:
        loop = VirtualLoop()
        ticks = Ticker(loop)
        seen: list[int] = []

        def tick(k: int, due: float) -> None:
            seen.append(k)
            if k == 1:
                raise SystemExit(3)
            loop.stop()

        ticks.add(1, tick)
        with pytest.raises(SystemExit):
            loop.run_forever()
        loop.run_forever()
        assert (seen, loop.time()) == ([1, 2], 2.0)
        loop.close()


class BusyLoop(VirtualLoop):
    """A virtual loop on which callbacks may take time, as they do on the real clock."""

    advance_to = None  # type: ignore[assignment]  # as on a real loop

    def take(self, seconds: float) -> None:
        self._now += seconds
        self._instant = self._now


def take(seconds: float) -> None:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, BusyLoop)
    loop.take(seconds)


class TestLateness:
    def test_ticks_that_are_due_already_come_one_after_the_other(self) -> None:
        async def main() -> list[int]:
            ticks: list[int] = []
            third = asyncio.Event()

            def tick(k: int, due: float) -> None:
                ticks.append(k)
                if k == 3:
                    third.set()

            handle = ticker().add(100, tick, start=now() - 0.0301)
            await third.wait()
            handle.cancel()
            return ticks

        assert run(main, new_event_loop)[:3] == [1, 2, 3]

    def test_ticks_that_were_due_before_the_beginning_come_now(self) -> None:
        async def main() -> list[tuple[int, float]]:
            log: list[tuple[int, float]] = []
            await asyncio.sleep(10)
            ticker().add(1, lambda k, due: log.append((k, now())), start=7.5)
            await asyncio.sleep(1.75)
            return log

        assert run(main) == [(1, 10.0), (2, 10.0), (3, 10.5), (4, 11.5)]

    def test_missed_ticks_are_counted_and_may_be_skipped(self) -> None:
        async def main() -> list[tuple[int, int, int, int]]:
            log: list[tuple[int, int, int, int]] = []

            def tick(k: int, due: float) -> None:
                if k == 2:
                    take(10.0)  # five hundred periods
                log.append((k, handle.missed, handle.skip_missed(), handle.missed))

            handle = ticker().add(50, tick)
            await asyncio.sleep(10.07)
            return log

        assert run(main, BusyLoop) == [(1, 0, 0, 0), (2, 500, 500, 0), (503, 0, 0, 0)]

    def test_a_tick_that_never_catches_up_leaves_the_loop_its_turns(self) -> None:
        async def main() -> int:
            handle = ticker().add(1000, lambda k, due: take(1.0))
            for _ in range(20):
                await asyncio.sleep(0.001)
            return handle.k

        assert run(main, BusyLoop) >= 20


@pytest.mark.parametrize("factory", [asyncio.new_event_loop, new_event_loop, uvloop_factory, VirtualLoop])
def test_C3_13_the_ticker_runs_on_any_loop(factory: Callable[[], asyncio.AbstractEventLoop]) -> None:
    async def main() -> list[tuple[int, bool]]:
        log: list[tuple[int, bool]] = []
        done = asyncio.Event()
        start = now()

        def tick(k: int, due: float) -> None:
            log.append((k, due == start + k / 200))
            if k == 5:
                done.set()

        handle = ticker().add(200, tick, start=start)
        await done.wait()
        handle.cancel()
        return log

    assert run(main, factory) == [(k, True) for k in range(1, 6)]


def test_the_ticker_runs_on_the_fuzzing_loop() -> None:
    async def main() -> list[int]:
        log: list[int] = []
        ticker().add(10, lambda k, due: log.append(k))
        await asyncio.sleep(1.05)
        return log

    assert run(main, lambda: FuzzLoop(3)) == list(range(1, 11))
