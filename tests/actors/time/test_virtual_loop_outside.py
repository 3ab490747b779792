"""The virtual loop and the real world: threads, processes, sockets, signals. Virtual time stands still for whom a task waits."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import anyio
import anyio.from_thread
import anyio.to_process
import anyio.to_thread
import pytest

from actors.time.deadlock import Deadlock, Livelock, Stalled
from actors.time.virtual_loop import VirtualLoop

PYTHON = sys.executable


def run(main: Callable[..., Awaitable[Any]], **attributes: Any) -> Any:
    """Run `main()` on a new virtual loop with attributes such as `patience` set."""

    def factory() -> VirtualLoop:
        loop = VirtualLoop()
        for name, value in attributes.items():
            setattr(loop, name, value)
        return loop

    return anyio.run(main, backend_options={"loop_factory": factory})


def now() -> float:
    return asyncio.get_running_loop().time()


def be_patient() -> None:
    """Clean-up after a stall takes the real time it takes."""
    asyncio.get_running_loop().patience = 30.0  # type: ignore[attr-defined]


class Gate:
    """A thread's work: it ends when the test, or the virtual program, lets it; in real time."""

    def __init__(self) -> None:
        self.open = threading.Event()

    def wait(self, result: int = 7) -> int:
        assert self.open.wait(30)
        return result


async def ticking(log: list[float]) -> None:
    while True:
        log.append(now())
        await asyncio.sleep(0.01)


async def in_executor(function: Callable[[], int]) -> int:
    with ThreadPoolExecutor(1) as pool:
        return await asyncio.get_running_loop().run_in_executor(pool, function)


async def limited(function: Callable[[], int]) -> int:
    return await anyio.to_thread.run_sync(function, limiter=anyio.CapacityLimiter(1))


class TestThreads:
    @pytest.mark.parametrize("call", [asyncio.to_thread, anyio.to_thread.run_sync, limited, in_executor])
    def test_time_stands_still_while_a_task_waits_for_a_thread(self, call: Callable[..., Awaitable[int]]) -> None:
        async def main() -> tuple[int, list[float]]:
            log: list[float] = []
            gate = Gate()
            # Real time opens the gate, when the loop has long been waiting for the thread.
            threading.Timer(0.05, gate.open.set).start()
            async with anyio.create_task_group() as group:
                group.start_soon(ticking, log)
                with anyio.fail_after(0.001):
                    result = await call(gate.wait)
                group.cancel_scope.cancel()
            return result, log

        assert run(main) == (7, [0.0])

    def test_threads_and_timers_take_turns(self) -> None:
        async def main() -> list[float]:
            log = []
            for _ in range(3):
                log.append(await anyio.to_thread.run_sync(now_of, asyncio.get_running_loop()))
                await anyio.sleep(1)
                log.append(await asyncio.to_thread(now_of, asyncio.get_running_loop()))
            return log

        def now_of(loop: asyncio.AbstractEventLoop) -> float:
            return loop.time()

        assert run(main) == [0.0, 1.0, 1.0, 2.0, 2.0, 3.0]

    def test_a_thread_may_call_into_the_loop(self) -> None:
        async def main() -> tuple[int, float]:
            async def answer() -> int:
                await asyncio.sleep(0)
                return 42

            return await anyio.to_thread.run_sync(anyio.from_thread.run, answer), now()

        assert run(main) == (42, 0.0)

    def test_a_thread_whose_caller_was_cancelled_no_longer_holds_the_clock(self) -> None:
        async def main() -> float:
            gate = Gate()
            async with anyio.create_task_group() as group:
                group.start_soon(functools.partial(anyio.to_thread.run_sync, gate.wait, abandon_on_cancel=True))
                future = asyncio.get_running_loop().run_in_executor(None, gate.wait)
                await asyncio.sleep(0)
                await asyncio.sleep(0)
                group.cancel_scope.cancel()
            future.cancel()
            await anyio.sleep(100)
            gate.open.set()
            return now()

        assert run(main) == 100.0

    def test_a_thread_unknown_to_the_loop_may_wake_it_at_the_last_moment(self) -> None:
        """The callback arrives after the loop has looked for work and before it gives up."""

        class LateCaller(VirtualLoop):
            def _wait_without_timers(self) -> None:
                thread = threading.Thread(target=self.call_soon_threadsafe, args=(woken.set,))
                thread.start()
                thread.join()
                super()._wait_without_timers()

        woken = asyncio.Event()
        with asyncio.Runner(loop_factory=LateCaller) as runner:
            assert runner.run(woken.wait())

    def test_a_thread_that_never_answers_is_named(self) -> None:
        gate = Gate()

        async def main() -> None:
            try:
                await asyncio.to_thread(gate.wait)
            finally:
                be_patient()
                gate.open.set()

        with pytest.raises(Stalled) as caught:
            run(main, patience=0.01)
        assert "thread running Gate.wait" in str(caught.value)
        assert "asyncio.to_thread(gate.wait)" in str(caught.value)

    def test_a_task_that_polls_for_a_thread_is_no_livelock(self) -> None:
        async def main() -> tuple[int, float]:
            gate = Gate()
            call = asyncio.ensure_future(asyncio.to_thread(gate.wait))
            spins = 0
            while not call.done():
                spins += 1
                if spins == 300:
                    gate.open.set()
                await asyncio.sleep(0)
            return await call, now()

        assert run(main, max_spins=100) == (7, 0.0)

    def test_sockets_are_heard_while_a_task_polls_for_a_thread(self) -> None:
        async def main() -> tuple[bytes, int]:
            gate = Gate()
            call = asyncio.ensure_future(asyncio.to_thread(gate.wait))
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                receiving = asyncio.ensure_future(asyncio.get_running_loop().sock_recv(here, 10))
                spins = 0
                while not receiving.done():
                    spins += 1
                    if spins == 300:
                        there.send(b"news")
                    await asyncio.sleep(0)
            gate.open.set()
            return receiving.result(), await call

        assert run(main, max_spins=100) == (b"news", 7)

    def test_a_task_that_polls_for_a_thread_that_never_answers_is_reported(self) -> None:
        gate = Gate()

        async def main() -> None:
            call = asyncio.ensure_future(asyncio.to_thread(gate.wait))
            try:
                while not call.done():
                    await asyncio.sleep(0)
            finally:
                be_patient()
                gate.open.set()

        with pytest.raises(Stalled, match=r"Gate\.wait"):
            run(main, max_spins=100, patience=0.02)

    def test_a_callable_object_is_named_as_well_as_can_be(self) -> None:
        gate = Gate()

        class Job:
            def __call__(self) -> int:
                return gate.wait()

            def __repr__(self) -> str:
                return "<my job>"

        async def main() -> None:
            try:
                await asyncio.gather(
                    asyncio.get_running_loop().run_in_executor(None, functools.partial(Job())),
                    anyio.to_thread.run_sync(functools.partial(gate.wait, 3)),
                )
            finally:
                be_patient()
                gate.open.set()

        with pytest.raises(Stalled, match=r"thread running <my job>; thread running Gate\.wait"):
            run(main, patience=0.01)


class TestProcesses:
    def test_time_stands_still_while_a_process_runs(self) -> None:
        async def main() -> tuple[bytes, float]:
            with anyio.fail_after(0.001):
                process = await anyio.run_process([PYTHON, "-c", "print('hi')"])
            return process.stdout, now()

        assert run(main) == (b"hi\n", 0.0)

    def test_a_process_may_be_talked_to_and_killed(self) -> None:
        async def main() -> tuple[bytes, int, float]:
            process = await asyncio.create_subprocess_exec(
                PYTHON, "-c", "print(input(), flush=True); input()", stdin=-1, stdout=-1
            )
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write(b"hello\n")
            line = await process.stdout.readline()
            process.kill()
            code = await process.wait()
            await asyncio.sleep(5)
            return line, code, now()

        assert run(main) == (b"hello\n", -signal.SIGKILL, 5.0)

    def test_a_process_that_does_not_exist_leaves_the_clock_free(self) -> None:
        async def main() -> float:
            with pytest.raises(FileNotFoundError):
                await asyncio.create_subprocess_exec("/no/such/program")
            await asyncio.sleep(5)
            return now()

        assert run(main) == 5.0

    def test_a_process_that_never_ends_is_named(self) -> None:
        async def main() -> None:
            process = await asyncio.create_subprocess_shell("read line", stdin=-1)
            try:
                await process.wait()
            finally:
                be_patient()
                process.kill()
                with anyio.CancelScope(shield=True):
                    await process.wait()

        with pytest.raises(Stalled, match=r"process \d+ \(.*read line\)"):
            run(main, patience=0.05)

    def test_a_worker_process_of_anyio_holds_the_clock_only_while_it_works(self) -> None:
        async def main() -> tuple[int, float]:
            with anyio.fail_after(0.001):
                result = await anyio.to_process.run_sync(abs, -3)
            await anyio.sleep(60)
            return result, now()

        assert run(main) == (3, 60.0)


class TestSocketsAndSignals:
    def test_without_timers_a_socket_is_waited_for_but_not_for_ever(self) -> None:
        async def main() -> None:
            async with await anyio.create_tcp_listener(local_host="127.0.0.1", local_port=0) as listener:
                try:
                    await listener.serve(anyio.abc.SocketStream.aclose)
                finally:
                    be_patient()

        with pytest.raises(Stalled, match=r"no socket or signal .* within 0\.01 real seconds"):
            run(main, patience=0.01)

    def test_a_peer_outside_the_loop_is_waited_for(self) -> None:
        async def main() -> tuple[bytes, float]:
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                threading.Timer(0.02, there.send, (b"late",)).start()
                return await asyncio.get_running_loop().sock_recv(here, 10), now()

        assert run(main) == (b"late", 0.0)

    def test_busy_tasks_do_not_keep_sockets_waiting(self) -> None:
        async def main() -> tuple[bytes, float]:
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                receiving = asyncio.ensure_future(asyncio.get_running_loop().sock_recv(here, 10))
                await asyncio.sleep(0)
                there.send(b"now")
                while not receiving.done():
                    await asyncio.sleep(0)
                return receiving.result(), now()

        assert run(main, max_spins=1000) == (b"now", 0.0)

    def test_a_task_that_connects_again_at_once_for_ever_is_reported(self) -> None:
        async def reconnect(port: int) -> None:
            while True:
                with contextlib.suppress(ConnectionError):
                    await asyncio.open_connection("127.0.0.1", port)

        async def main() -> None:
            with socket.socket() as free:
                free.bind(("127.0.0.1", 0))  # nobody listens
                with anyio.move_on_after(3600):
                    await reconnect(free.getsockname()[1])

        with pytest.raises(Livelock) as caught:
            run(main, socket_patience=0.05)
        report = str(caught.value)
        assert report.startswith("Sockets or signals have kept the loop busy for 0.05 real seconds at one instant.")
        assert "reconnect" in report
        assert "let it sleep between two attempts" in report

    def test_the_clean_up_after_that_may_use_sockets(self) -> None:
        cleaned: list[bytes] = []

        async def talk(times: int | None, heard: list[bytes]) -> None:
            """Send a byte again and again, and wait for each."""
            loop = asyncio.get_running_loop()
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                there.setblocking(False)
                while times is None or len(heard) < times:
                    received = asyncio.ensure_future(loop.sock_recv(here, 1))
                    await asyncio.sleep(0)
                    await loop.sock_sendall(there, b"x")
                    heard.append(await received)

        async def main() -> None:
            try:
                await talk(None, [])
            finally:
                await talk(20, cleaned)

        with pytest.raises(Livelock):
            run(main, socket_patience=0.05)
        assert len(cleaned) == 20

    def test_traffic_at_one_instant_may_last_while_a_thread_is_waited_for(self) -> None:
        async def main() -> tuple[int, float]:
            loop, over = asyncio.get_running_loop(), threading.Event()
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                there.setblocking(False)
                waiting = loop.run_in_executor(None, over.wait)
                began, told = time.perf_counter(), 0
                while time.perf_counter() - began < 0.2:
                    await loop.sock_sendall(there, b"x")
                    told += len(await loop.sock_recv(here, 1))
                    await asyncio.sleep(0)
                over.set()
                await waiting
                return told, now()

        told, at = run(main, socket_patience=0.05)
        assert (told > 100, at) == (True, 0.0)

    @pytest.mark.parametrize("live", [True, False])
    def test_a_signal_wakes_the_loop(self, live: bool) -> None:
        async def main() -> float:
            loop = asyncio.get_running_loop()
            caught = asyncio.Event()
            loop.add_signal_handler(signal.SIGALRM, caught.set)
            signal.setitimer(signal.ITIMER_REAL, 0.02)
            await caught.wait()
            loop.remove_signal_handler(signal.SIGALRM)
            await asyncio.sleep(1)
            return now()

        assert run(main, wait_for_io=live, patience=30.0) == 1.0

    def test_a_signal_is_seen_while_time_flies(self) -> None:
        async def main() -> bool:
            loop = asyncio.get_running_loop()
            caught = asyncio.Event()
            loop.add_signal_handler(signal.SIGUSR1, caught.set)
            os.kill(os.getpid(), signal.SIGUSR1)
            for _ in range(3):
                await asyncio.sleep(100)
            loop.remove_signal_handler(signal.SIGUSR1)
            return caught.is_set()

        assert run(main) is True

    def test_live_input_is_waited_for_without_limit(self) -> None:
        async def main() -> tuple[bytes, float]:
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                threading.Timer(0.05, there.send, (b"key",)).start()
                return await asyncio.get_running_loop().sock_recv(here, 10), now()

        assert run(main, wait_for_io=True, patience=0.001) == (b"key", 0.0)

    def test_the_interrupt_key_ends_a_run_that_waits(self) -> None:
        async def main() -> None:
            signal.setitimer(signal.ITIMER_REAL, 0.02)
            await asyncio.Event().wait()

        previous = signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGINT))
        try:
            loop = VirtualLoop()
            loop.wait_for_io = True
            with pytest.raises(KeyboardInterrupt), asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(main())
        finally:
            signal.signal(signal.SIGALRM, previous)

    def test_a_closed_socket_is_forgotten(self) -> None:
        async def main() -> None:
            here, there = socket.socketpair()
            with here, there:
                here.setblocking(False)
                with anyio.move_on_after(1):
                    await asyncio.get_running_loop().sock_recv(here, 1)
            await asyncio.Event().wait()

        with pytest.raises(Deadlock):
            run(main)
