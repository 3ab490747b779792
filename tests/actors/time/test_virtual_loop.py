"""The virtual loop: the pitfalls of virtual time (C3), timers, order and the rest of an event loop's duties."""

from __future__ import annotations

import asyncio
import contextvars
import gc
import logging
import math
import sys
import time
import weakref
from collections.abc import Awaitable, Callable
from typing import Any

import anyio
import anyio.to_thread
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actors.time.deadlock import Deadlock, Livelock, Stalled
from actors.time.virtual_loop import VirtualLoop


def run(main: Callable[..., Awaitable[Any]], *args: Any, start: float = 0.0, **attributes: Any) -> Any:
    """Run `main(*args)` on a new virtual loop, as anyio would, with attributes such as `patience` set."""

    def factory() -> VirtualLoop:
        loop = VirtualLoop(start)
        for name, value in attributes.items():
            setattr(loop, name, value)
        return loop

    return anyio.run(main, *args, backend_options={"loop_factory": factory})


def now() -> float:
    return asyncio.get_running_loop().time()


def virtual() -> VirtualLoop:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualLoop)
    return loop


class TestPitfalls:
    """Section C3 of the study of virtual clocks: each pitfall is one test."""

    def test_C3_01_sleeping_for_ever_is_no_timer(self) -> None:
        async def main() -> float:
            async with anyio.create_task_group() as group:
                group.start_soon(anyio.sleep_forever)
                await anyio.sleep(3600)
                group.cancel_scope.cancel()
            return now()

        assert run(main) == 3600.0

    def test_C3_01_sleeping_for_ever_alone_is_a_deadlock_and_time_stays(self) -> None:
        loop = VirtualLoop()
        with pytest.raises(Deadlock), asyncio.Runner(loop_factory=lambda: loop) as runner:
            runner.run(anyio.sleep_forever())
        assert loop.time() == 0.0

    def test_C3_02_the_clock_may_start_at_the_epoch(self) -> None:
        async def main() -> list[float]:
            times = []
            for _ in range(10):
                await asyncio.sleep(0.01)
                times.append(now())
            return times

        times = run(main, start=1.7e9)
        assert times == sorted(set(times))
        assert times[-1] == pytest.approx(1.7e9 + 0.1, abs=1e-5)

    def test_C3_03_deadlines_that_differ_by_a_rounding_error_are_one_instant(self) -> None:
        assert 3 * 0.1 != 30 * 0.01

        async def main() -> list[str]:
            log: list[str] = []
            woken = asyncio.Event()
            loop = asyncio.get_running_loop()

            async def task() -> None:
                await woken.wait()
                log.append("task woken at the first deadline")

            async with anyio.create_task_group() as group:
                group.start_soon(task)
                await asyncio.sleep(0)
                loop.call_at(3 * 0.1, log.append, "scheduled first")
                loop.call_at(30 * 0.01, woken.set)
                loop.call_at(3 * 0.1, log.append, "scheduled last")
            return log

        assert run(main) == ["scheduled first", "scheduled last", "task woken at the first deadline"]

    def test_C3_03_delays_add_up(self) -> None:
        async def main() -> float:
            for _ in range(10):
                await asyncio.sleep(0.1)
            return now()

        assert run(main) == 1.0

    def test_C3_03_no_timer_fires_early_not_even_by_a_rounding_error(self) -> None:
        async def main() -> tuple[float, float]:
            deadline = 3 * 0.1
            await anyio.sleep(0.2)
            while now() < deadline:  # would spin for ever if 0.3 s counted as the deadline
                await asyncio.sleep(deadline - now())
            first = now()
            with anyio.CancelScope(deadline=0.1 + 0.7):  # 0.7999999999999999
                await anyio.sleep_forever()
            return first, now()

        assert run(main) == (3 * 0.1, 0.8)

    def test_C3_04_equal_deadlines_fire_in_the_order_of_scheduling(self) -> None:
        async def main() -> list[int]:
            log: list[int] = []
            loop = asyncio.get_running_loop()
            for number in range(1000):
                loop.call_at(1.0 + (number % 3), log.append, number)
            await asyncio.sleep(10)
            return log

        assert run(main) == sorted(range(1000), key=lambda number: number % 3)

    def test_C3_05_of_a_scope_and_a_sleep_that_end_together_the_one_entered_first_wins(self) -> None:
        async def main() -> tuple[bool, bool, float]:
            with anyio.move_on_after(1) as outer:
                await anyio.sleep(1)
            inner = False
            with anyio.move_on_after(0.1) as scope:  # at 1 + 0.1, which is not a round binary number
                await asyncio.sleep(0.1)
                inner = True
            assert scope.cancelled_caught is not inner
            return outer.cancelled_caught, scope.cancelled_caught, now()

        assert run(main) == (True, True, 1.1)

    def test_C3_06_tasks_cancelled_in_an_order_stop_in_that_order(self) -> None:
        async def main() -> list[int]:
            stopped: list[int] = []

            async def child(number: int) -> None:
                try:
                    await anyio.sleep_forever()
                finally:
                    stopped.append(number)

            tasks = [asyncio.create_task(child(number)) for number in range(50)]
            await asyncio.sleep(1)
            for task in reversed(tasks):
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            return stopped

        assert run(main) == list(reversed(range(50)))

    def test_C3_07_a_thread_that_waits_for_virtual_time_is_reported(self) -> None:
        async def main() -> None:
            await anyio.to_thread.run_sync(anyio.from_thread.run, anyio.sleep, 1, abandon_on_cancel=True)

        with pytest.raises(Stalled, match=r"thread running run\b"):
            run(main, patience=0.05)

    def test_C3_08_the_shutdown_of_the_executor_is_no_deadlock(self) -> None:
        async def main() -> int:
            return await asyncio.to_thread(lambda: 8)

        with asyncio.Runner(loop_factory=VirtualLoop) as runner:
            assert runner.run(main()) == 8

    def test_C3_09_the_exit_of_a_process_without_pipes_is_awaited(self) -> None:
        async def main() -> tuple[int | None, float]:
            with anyio.fail_after(0.001):
                process = await anyio.open_process(
                    [sys.executable, "-c", "raise SystemExit(3)"], stdin=-3, stdout=-3, stderr=-3
                )
                await process.wait()
            return process.returncode, now()

        assert run(main) == (3, 0.0)

    def test_C3_10_after_a_deadlock_the_loop_still_cleans_up(self) -> None:
        log: list[tuple[str, float]] = []

        async def child() -> None:
            try:
                await asyncio.Event().wait()
            finally:
                with anyio.CancelScope(shield=True):
                    await anyio.sleep(2)
                log.append(("cleaned up", now()))

        async def main() -> None:
            async with anyio.create_task_group() as group:
                group.start_soon(child)
                await anyio.sleep(1)

        with pytest.raises(Deadlock):
            run(main)
        assert log == [("cleaned up", 3.0)]

    def test_C3_11_debug_mode_reports_slow_callbacks_by_the_real_clock(self, caplog: pytest.LogCaptureFixture) -> None:
        async def main() -> None:
            loop = virtual()
            loop.set_debug(True)
            loop.slow_callback_duration = -1.0  # everything is slow
            loop.call_later(1, int)
            await asyncio.sleep(2)
            assert any("int()" in record.getMessage() and "seconds" in record.getMessage() for record in caplog.records)
            loop.slow_callback_duration = math.inf  # nothing is, however far virtual time jumps
            caplog.clear()
            await asyncio.sleep(3600)

        with caplog.at_level(logging.WARNING, logger="asyncio"):
            run(main)
        assert not caplog.records

    def test_C3_12_the_clocks_of_the_computer_stay_real(self) -> None:
        async def main() -> tuple[float, float]:
            real = time.monotonic()
            await asyncio.sleep(86400.0)
            return now(), time.monotonic() - real

        virtual_seconds, real_seconds = run(main)
        assert virtual_seconds == 86400.0
        assert real_seconds < 86400.0

    def test_C3_13_virtual_time_needs_asyncios_own_selector_loop(self) -> None:
        assert issubclass(VirtualLoop, asyncio.SelectorEventLoop)

    def test_C3_14_what_one_task_started_another_may_end_if_a_third_hosts_it(self) -> None:
        """Fixtures run their two halves in different tasks; scopes must be entered and left in one."""

        async def main() -> list[str]:
            log: list[str] = []
            end = asyncio.Event()

            async def host() -> None:
                async with anyio.create_task_group() as group:
                    group.start_soon(anyio.sleep_forever)
                    log.append("up")
                    await end.wait()
                    group.cancel_scope.cancel()
                log.append("down")

            async def first_half() -> asyncio.Task[None]:
                return asyncio.create_task(host())

            async def second_half(hosting: asyncio.Task[None]) -> None:
                end.set()
                await hosting

            hosting = await asyncio.create_task(first_half())
            await asyncio.sleep(5)
            await asyncio.create_task(second_half(hosting))
            return log

        assert run(main) == ["up", "down"]

    def test_C3_15_a_listening_socket_does_not_freeze_the_clock(self) -> None:
        async def main() -> float:
            async with await anyio.create_tcp_listener(local_host="127.0.0.1", local_port=0):
                await anyio.sleep(60)
            return now()

        assert run(main) == 60.0

    def test_C3_15_data_that_has_arrived_comes_before_the_next_jump(self) -> None:
        async def main() -> tuple[bytes, float]:
            async def echo(stream: anyio.abc.SocketStream) -> None:
                async with stream:
                    await stream.send(await stream.receive())

            async with await anyio.create_tcp_listener(local_host="127.0.0.1", local_port=0) as listener:
                port = listener.extra(anyio.abc.SocketAttribute.local_port)
                async with anyio.create_task_group() as group:
                    group.start_soon(listener.serve, echo)
                    async with await anyio.connect_tcp("127.0.0.1", port) as stream:
                        with anyio.fail_after(0.001):
                            await stream.send(b"x")
                            reply = await stream.receive()
                    group.cancel_scope.cancel()
            return reply, now()

        assert run(main) == (b"x", 0.0)


class TestTimers:
    def test_time_jumps_exactly_onto_the_next_deadline(self) -> None:
        async def main() -> list[float]:
            times = []
            for delay in (1e-9, 0.25, 3600.0, 86400.0 * 30):
                await asyncio.sleep(delay)
                times.append(now())
            return times

        assert run(main) == [1e-9, 0.250000001, 3600.250000001, 2595600.250000001]

    @pytest.mark.parametrize("start", [-1.0, math.inf, math.nan])
    def test_an_impossible_start_is_refused(self, start: float) -> None:
        with pytest.raises(ValueError, match="start"):
            VirtualLoop(start)

    def test_a_deadline_that_is_no_number_is_refused(self) -> None:
        async def main() -> None:
            with pytest.raises(ValueError, match="NaN"):
                asyncio.get_running_loop().call_at(math.nan, print)

        run(main)

    def test_a_deadline_that_has_passed_counts_as_now_and_does_not_turn_time_back(self) -> None:
        async def main() -> list[tuple[str, float]]:
            loop = asyncio.get_running_loop()
            log: list[tuple[str, float]] = []
            await asyncio.sleep(5)
            loop.call_at(3.0, lambda: log.append(("late by two", now())))
            loop.call_at(2.0, lambda: log.append(("late by three", now())))
            loop.call_soon(lambda: log.append(("soon", now())))
            await asyncio.sleep(1)
            return log

        assert run(main) == [("soon", 5.0), ("late by two", 5.0), ("late by three", 5.0)]

    def test_timers_due_now_wait_their_turn_behind_what_is_ready(self) -> None:
        async def main() -> list[str]:
            loop = virtual()
            log: list[str] = []
            loop.call_soon(log.append, "soon")
            loop.call_later(0, log.append, "timer")
            sleeper = loop.sleep_until(0.0)
            sleeper.add_done_callback(lambda _: log.append("sleeper"))
            cancelled = loop.sleep_until(0.0)
            cancelled.cancel()
            await asyncio.sleep(1)
            return log

        assert run(main) == ["soon", "timer", "sleeper"]

    def test_cancelled_timers_neither_fire_nor_hold_the_clock(self) -> None:
        async def main() -> float:
            loop = virtual()
            handle = loop.call_at(3.0, pytest.fail)
            assert not handle.cancelled()
            handle.cancel()
            handle.cancel()
            assert handle.cancelled()
            assert handle.when() == 3.0
            sleeper = loop.sleep_until(4.0)
            sleeper.cancel()
            loop.call_soon(pytest.fail).cancel()
            await loop.sleep_until(9.0)
            return now()

        assert run(main) == 9.0

    def test_a_timer_may_cancel_another_one_of_the_same_instant(self) -> None:
        async def main() -> None:
            loop = asyncio.get_running_loop()
            handles: list[asyncio.TimerHandle] = []
            loop.call_at(1.0, lambda: handles[0].cancel())
            handles.append(loop.call_at(1.0, pytest.fail))
            await asyncio.sleep(2)

        run(main)

    def test_timers_that_are_set_and_cancelled_again_and_again_take_no_memory(self) -> None:
        class Payload:
            pass

        async def main() -> int:
            loop = virtual()
            payloads: weakref.WeakSet[Payload] = weakref.WeakSet()
            for _ in range(200):
                for _ in range(50):
                    payload = Payload()
                    payloads.add(payload)
                    loop.call_at(1e6, id, payload).cancel()
                    loop.sleep_until(1e6).cancel()
                await asyncio.sleep(1)
            del payload
            assert len(loop._timers) < 5000
            gc.collect()
            return len(payloads)

        assert run(main) == 0

    def test_sleep_until_is_the_cheap_way_to_sleep(self) -> None:
        async def main() -> list[tuple[str, float]]:
            loop = virtual()
            log: list[tuple[str, float]] = []

            async def sleeper(name: str, when: float) -> None:
                await loop.sleep_until(when)
                log.append((name, now()))

            async with anyio.create_task_group() as group:
                group.start_soon(sleeper, "b", 2.0)
                group.start_soon(sleeper, "a", 1.0)
                group.start_soon(sleeper, "past", -5.0)
                group.start_soon(sleeper, "never", math.inf)
                await anyio.sleep(3)
                group.cancel_scope.cancel()
            return log

        assert run(main) == [("past", 0.0), ("a", 1.0), ("b", 2.0)]

    def test_sleepers_and_timers_of_one_instant_keep_their_common_order(self) -> None:
        async def main() -> list[str]:
            loop = virtual()
            log: list[str] = []

            async def sleeps(name: str, awaitable: Callable[[], Awaitable[None]]) -> None:
                await awaitable()
                log.append(name)

            async with anyio.create_task_group() as group:
                group.start_soon(sleeps, "asyncio", lambda: asyncio.sleep(1))
                group.start_soon(sleeps, "loop", lambda: loop.sleep_until(1.0))
                group.start_soon(sleeps, "anyio", lambda: anyio.sleep(1))
            return log

        assert run(main) == ["asyncio", "loop", "anyio"]

    def test_time_moves_on_by_hand_only_if_nothing_can_happen_before(self) -> None:
        async def main() -> list[bool]:
            loop = virtual()
            moved = [loop.advance_to(1.0)]
            loop.call_soon(int)
            moved.append(loop.advance_to(2.0))
            await loop.sleep_until(1.5)
            timer = loop.call_at(3.0, int)
            moved += [loop.advance_to(3.0), loop.advance_to(2.5), loop.advance_to(2.0)]
            timer.cancel()
            assert now() == 2.5
            return moved

        assert run(main) == [True, False, False, True, False]

    @settings(max_examples=50, deadline=None)
    @given(st.lists(st.floats(0, 1e5, allow_nan=False), max_size=30))
    def test_timers_fire_in_order_at_their_time_never_early(self, deadlines: list[float]) -> None:
        async def main() -> list[tuple[float, float]]:
            loop = asyncio.get_running_loop()
            fired: list[tuple[float, float]] = []

            def fire(when: float) -> None:
                fired.append((when, now()))

            for when in deadlines:
                loop.call_at(when, fire, when)
            await asyncio.sleep(2e5)
            return fired

        fired = run(main)
        assert sorted(when for when, _ in fired) == sorted(deadlines)
        assert [time for _, time in fired] == sorted(time for _, time in fired)
        assert all(when <= time <= when + 1.1e-9 for when, time in fired)


class TestLoop:
    """The duties of any event loop, which replacing `_run_once` must not lose."""

    def test_an_exception_in_a_callback_goes_to_the_handler_and_the_loop_goes_on(self) -> None:
        async def main() -> list[str]:
            loop = asyncio.get_running_loop()
            seen: list[str] = []
            loop.set_exception_handler(lambda _, context: seen.append(f"{context['message']} {context['exception']!r}"))
            loop.call_soon(int, "one")
            loop.call_later(1, int, "two")
            await asyncio.sleep(2)
            return seen

        first, second = run(main)
        assert "Exception in callback" in first
        assert "'one'" in first
        assert "'two'" in second

    def test_leaving_the_interpreter_leaves_the_loop(self) -> None:
        for schedule in ("call_soon", "call_later"):

            async def main(schedule: str = schedule) -> None:
                loop = asyncio.get_running_loop()
                arguments = (sys.exit, 7) if schedule == "call_soon" else (1, sys.exit, 7)
                getattr(loop, schedule)(*arguments)
                await asyncio.sleep(2)

            with pytest.raises(SystemExit), asyncio.Runner(loop_factory=VirtualLoop) as runner:
                runner.run(main())

    def test_debug_mode_finds_wrong_callbacks_and_keeps_tracebacks(self) -> None:
        async def main() -> None:
            loop = virtual()
            loop.set_debug(True)
            with pytest.raises(TypeError, match="callable"):
                loop.call_at(1.0, "not callable")  # type: ignore[arg-type]
            handle = loop.call_at(1.0, int)
            assert "when=1.0" in repr(handle)
            handle.cancel()
            loop.call_soon(int).cancel()
            assert not loop.advance_to(5.0)
            with anyio.move_on_after(1):
                await anyio.sleep(5)
            assert now() == 1.0

        run(main)

    def test_a_closed_loop_refuses_work(self) -> None:
        loop = VirtualLoop()
        loop.close()
        for use in (loop.call_soon, lambda callback: loop.call_at(1.0, callback), lambda _: loop.sleep_until(1.0)):
            with pytest.raises(RuntimeError, match="closed"):
                use(int)
        assert repr(loop) == "<VirtualLoop at 0 s running=False closed=True>"

    def test_a_loop_that_is_stopped_before_it_runs_makes_one_turn(self) -> None:
        loop = VirtualLoop()
        log: list[str] = []
        loop.call_at(0.0, log.append, "due now")
        loop.call_at(1.0, log.append, "due later")
        loop.stop()
        loop.run_forever()
        assert (log, loop.time()) == (["due now"], 0.0)
        loop.close()

    def test_handles_are_worth_reading_and_carry_their_context(self) -> None:
        variable: contextvars.ContextVar[str] = contextvars.ContextVar("variable", default="unset")

        async def main() -> list[str]:
            loop = asyncio.get_running_loop()
            seen: list[str] = []
            context = contextvars.copy_context()
            context.run(variable.set, "from the context given")
            variable.set("from the caller")
            soon = loop.call_soon(lambda: seen.append(variable.get()))
            timer = loop.call_later(1.5, lambda: seen.append(variable.get()), context=context)
            assert "lambda" in repr(soon)
            assert "when=1.5" in repr(timer)
            soon_in_context = loop.call_soon(lambda: seen.append(variable.get()), context=context)
            assert not soon_in_context.cancelled()
            await asyncio.sleep(2)
            return seen

        assert run(main) == ["from the caller", "from the context given", "from the context given"]

    def test_anyio_works_as_on_any_loop(self) -> None:
        async def main() -> tuple[float, float]:
            event = anyio.Event()
            with pytest.raises(TimeoutError):
                with anyio.fail_after(5):
                    await anyio.sleep_forever()
            async with anyio.create_task_group() as group:
                group.start_soon(event.wait)
                await anyio.wait_all_tasks_blocked()
                event.set()
            blocked = now()
            with anyio.move_on_after(1):
                try:
                    await anyio.sleep(50)
                finally:
                    with anyio.move_on_after(2, shield=True) as scope:
                        await anyio.sleep(10)
                    assert scope.cancelled_caught
            return blocked, now()

        blocked, end = run(main)
        assert end == blocked + 3.0

    def test_asyncio_timeouts_work(self) -> None:
        async def main() -> float:
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(3):
                    await asyncio.sleep(math.inf)
            return now()

        assert run(main) == 3.0

    def test_work_at_one_instant_is_unlimited_if_asked_for(self) -> None:
        async def main() -> None:
            for _ in range(500):
                await asyncio.sleep(0)

        with pytest.raises(Livelock):
            run(main, max_spins=100)
        run(main, max_spins=1000)

    def test_spins_are_counted_anew_when_time_has_moved(self) -> None:
        async def main() -> None:
            for _ in range(10):
                for _ in range(90):
                    await asyncio.sleep(0)
                await asyncio.sleep(1)

        run(main, max_spins=100)
