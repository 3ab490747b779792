"""The loop for the real clock: waits of microseconds, never shorter than asked, awake for sockets, threads and signals."""

from __future__ import annotations

import asyncio
import ctypes
import runpy
import selectors
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from actors.time import real_loop as loops
from actors.time.real_loop import new_event_loop

linux = pytest.mark.skipif(sys.platform != "linux", reason="microsecond timers are made for Linux")


def run(main: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        return runner.run(main())


def timer_slack() -> int:
    return int(ctypes.CDLL(None).prctl(30, 0, 0, 0, 0))


@pytest.mark.parametrize("delay", [0.0, 1e-5, 0.0003, 0.0021, 0.0304])
def test_a_sleep_is_never_shorter_than_asked(delay: float) -> None:
    async def main() -> float:
        begin = time.monotonic()
        await asyncio.sleep(delay)
        return time.monotonic() - begin

    assert run(main) >= delay - 1e-9


@linux
def test_sleeps_below_a_millisecond_are_not_rounded_up_to_one() -> None:
    """A hundred sleeps of 50 us take a tenth of a second if each is rounded up. The best of many tries is looked at."""

    async def main() -> float:
        best = 1.0
        for _ in range(100):
            begin = time.monotonic()
            await asyncio.sleep(50e-6)
            best = min(best, time.monotonic() - begin)
        return best

    assert run(main) < 900e-6


def test_a_socket_wakes_the_loop_in_the_middle_of_a_short_and_of_a_long_wait() -> None:
    async def main() -> list[bytes]:
        received = []
        for timeout in (0.009, 30.0):
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                there.send(b"x")
                async with asyncio.timeout(timeout):
                    received.append(await asyncio.get_running_loop().sock_recv(here, 1))
        return received

    assert run(main) == [b"x", b"x"]


def test_a_thread_wakes_the_loop_in_the_middle_of_a_wait() -> None:
    async def main() -> bool:
        loop = asyncio.get_running_loop()
        event = asyncio.Event()
        threading.Timer(0.01, loop.call_soon_threadsafe, (event.set,)).start()
        async with asyncio.timeout(30):
            return await event.wait()

    assert run(main) is True


def test_a_signal_wakes_the_loop_in_the_middle_of_a_wait() -> None:
    async def main() -> bool:
        loop = asyncio.get_running_loop()
        caught = asyncio.Event()
        loop.add_signal_handler(signal.SIGALRM, caught.set)
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        async with asyncio.timeout(30):
            await caught.wait()
        return loop.remove_signal_handler(signal.SIGALRM)

    assert run(main) is True


def test_the_interrupt_key_ends_a_wait() -> None:
    async def main() -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        await asyncio.sleep(30)

    previous = signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGINT))
    try:
        with pytest.raises(KeyboardInterrupt):
            run(main)
    finally:
        signal.signal(signal.SIGALRM, previous)


@linux
def test_the_timer_slack_of_the_thread_is_restored() -> None:
    async def main() -> int:
        return timer_slack()

    before = timer_slack()
    assert run(main) == 1
    assert timer_slack() == before


@linux
def test_a_process_with_very_many_open_files_gets_asyncios_milliseconds() -> None:
    """`select.select` cannot take a descriptor of 1024 or more."""

    class Far(loops._PreciseSelector):
        def fileno(self) -> int:
            return 1024

    with asyncio.Runner(loop_factory=lambda: asyncio.SelectorEventLoop(Far())) as runner:
        runner.run(asyncio.sleep(0.001))


def test_elsewhere_the_plain_selector_loop_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    elsewhere = runpy.run_path(loops.__file__)
    loop = elsewhere["new_event_loop"]()
    assert type(loop) is asyncio.SelectorEventLoop
    loop.close()


def test_the_loop_is_asyncios_own_apart_from_its_waits() -> None:
    loop = new_event_loop()
    assert isinstance(loop, asyncio.SelectorEventLoop)
    assert isinstance(loop._selector, selectors.DefaultSelector)  # type: ignore[attr-defined]
    loop.close()


# -- the lag of the system is learned ---------------------------------------------------------------------------------------


class LateSystem:
    """A clock and a `select` that ends every wait late, or at once while a descriptor is `ready`. Seconds."""

    def __init__(self, lateness: float) -> None:
        self.now = 100.0
        self.lateness = lateness
        self.ready = False

    def monotonic(self) -> float:
        self.now += 1e-7
        return self.now

    def select(self, *arguments: Any) -> tuple[list[int], list[int], list[int]]:
        timeout = arguments[3]
        if self.ready:
            return arguments[0], [], []
        self.now += timeout + self.lateness if timeout > 0.0 else 1e-6
        return [], [], []


@pytest.fixture
def late_system(monkeypatch: pytest.MonkeyPatch) -> LateSystem:
    system = LateSystem(80e-6)
    monkeypatch.setattr(loops, "time", system)
    monkeypatch.setattr(loops, "select", system)
    return system


def lateness(system: LateSystem, selector: selectors.BaseSelector, timeout: float) -> float:
    due = system.now + timeout
    selector.select(timeout)
    return system.now - due


@linux
@pytest.mark.parametrize("timeout", [0.002, 0.020])
def test_waits_become_exact_where_the_system_is_always_as_late(late_system: LateSystem, timeout: float) -> None:
    with loops._PreciseSelector() as selector:
        seen = [lateness(late_system, selector, timeout) for _ in range(300)]
    assert seen[0] > 80e-6
    assert min(seen) >= 0.0
    assert max(seen[-100:]) < 5e-6


@linux
def test_a_stall_teaches_no_more_than_any_other_late_wait(late_system: LateSystem) -> None:
    with loops._PreciseSelector() as selector:
        for _ in range(300):
            selector.select(0.002)
        late_system.lateness = 20e-3
        selector.select(0.002)
        late_system.lateness = 80e-6
        assert lateness(late_system, selector, 0.002) < 5e-6


@linux
def test_a_system_that_becomes_quicker_is_followed_and_a_wait_below_the_lag_is_made_awake(
    late_system: LateSystem,
) -> None:
    with loops._PreciseSelector() as selector:
        for _ in range(300):
            selector.select(0.002)
        assert 0.0 <= lateness(late_system, selector, 40e-6) < 5e-6
        late_system.lateness = 10e-6
        seen = [lateness(late_system, selector, 0.002) for _ in range(100)]
    assert min(seen) >= 0.0
    assert max(seen) < 15e-6


@linux
def test_on_a_very_late_system_no_more_than_a_fifth_of_a_millisecond_is_made_up_for(late_system: LateSystem) -> None:
    late_system.lateness = 5e-3
    with loops._PreciseSelector() as selector:
        seen = [lateness(late_system, selector, 0.002) for _ in range(400)]
    assert min(seen) > 4.7e-3


@linux
def test_what_is_ready_ends_a_wait_and_teaches_nothing(late_system: LateSystem) -> None:
    with loops._PreciseSelector() as selector:
        for _ in range(300):
            selector.select(0.002)
        late_system.ready = True
        assert all(lateness(late_system, selector, 0.002) < -0.0019 for _ in range(300))
        late_system.ready = False
        assert 0.0 <= lateness(late_system, selector, 0.002) < 5e-6
