"""From other threads into the loop, and from the loop to a thread."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from actors.time.real_loop import new_event_loop
from actors.transport.protocol import PATIENCE
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker


class CountingLoop(asyncio.SelectorEventLoop):
    """A loop that counts how often it is woken."""

    woken = 0

    def call_soon_threadsafe(self, *args: Any, **kwargs: Any) -> asyncio.Handle:
        self.woken += 1
        return super().call_soon_threadsafe(*args, **kwargs)


def in_a_thread(call: Callable[[], object]) -> None:
    thread = threading.Thread(target=call)
    thread.start()
    thread.join()


def run(test: Callable[[CountingLoop], Any]) -> None:
    loop = CountingLoop()
    try:
        loop.run_until_complete(test(loop))
    finally:
        loop.close()


def test_many_calls_of_a_thread_are_made_in_order_with_one_wake_up() -> None:
    made: list[int] = []

    async def test(loop: CountingLoop) -> None:
        wakeup = Wakeup(loop)
        in_a_thread(lambda: [wakeup.post(made.append, number) for number in range(3000)])
        assert made == []
        while len(made) < 3000:
            await asyncio.sleep(0)
        assert loop.woken == 1

    run(test)
    assert made == list(range(3000))


def test_others_have_their_turn_between_many_calls() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), [0]

        def call(_: None) -> None:
            made[0] += 1

        for _ in range(5000):
            wakeup.post(call, None)
        seen = [0]
        while made[0] < 5000:
            await asyncio.sleep(0)
            seen.append(made[0])
        assert max(after - before for before, after in pairwise(seen)) <= 512

    run(test)


def test_a_call_that_takes_long_gives_others_their_turn() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), []

        def slow(number: int) -> None:
            threading.Event().wait(0.003)
            made.append(number)

        for number in range(3):
            wakeup.post(slow, number)
        seen = [0]
        while len(made) < 3:
            await asyncio.sleep(0)
            seen.append(len(made))
        assert max(after - before for before, after in pairwise(seen)) == 1

    run(test)


def test_no_call_is_forgotten_while_a_thread_goes_on_posting() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), []
        thread = threading.Thread(target=lambda: [wakeup.post(made.append, number) for number in range(50_000)])
        thread.start()
        while len(made) < 50_000:
            await asyncio.sleep(0.001)
        thread.join()
        assert made == list(range(50_000))

    run(test)


def test_a_call_that_raises_is_reported_and_the_others_are_made() -> None:
    async def test(loop: CountingLoop) -> None:
        reported: list[BaseException] = []
        loop.set_exception_handler(lambda _, context: reported.append(context["exception"]))
        wakeup, made = Wakeup(loop), []
        wakeup.post(lambda _: 1 / 0, None)
        wakeup.post(made.append, 1)
        while not made:
            await asyncio.sleep(0)
        assert [type(error) for error in reported] == [ZeroDivisionError]

    run(test)


def test_calls_that_may_wait_wake_nobody_and_are_made_in_time() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), list[float]()
        wakeup.be_patient(PATIENCE)
        for _ in range(5):
            begun = loop.time()
            in_a_thread(lambda: [wakeup.post_patiently(lambda _: made.append(loop.time()), None) for _ in range(3)])
            while not made:
                await asyncio.sleep(PATIENCE / 10)
            assert len(made) == 3, "all together"
            assert begun // PATIENCE < made[0] // PATIENCE
            made.clear()
        assert loop.woken == 0
        wakeup.cease(PATIENCE)
        wakeup.close()

    run(test)


def test_calls_that_may_wait_keep_their_place_before_one_that_does_not() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), list[int]()
        wakeup.post_patiently(made.append, 1)
        wakeup.post_patiently(made.append, 2)
        wakeup.post(made.append, 3)
        while not made:
            await asyncio.sleep(0)
        assert made == [1, 2, 3]

    run(test)


def test_nobody_looks_when_the_last_patient_one_has_gone_or_the_connection_is_closed() -> None:
    async def test(loop: CountingLoop) -> None:
        for close in (False, True):
            wakeup, made = Wakeup(loop), list[int]()
            wakeup.be_patient(PATIENCE)
            wakeup.be_patient(PATIENCE)
            wakeup.cease(PATIENCE)
            wakeup.post_patiently(made.append, 1)
            while not made and not close:
                await asyncio.sleep(0.001)
            if close:
                wakeup.close()
            wakeup.cease(PATIENCE)
            made.clear()
            wakeup.post_patiently(made.append, 2)
            await asyncio.sleep(3 * PATIENCE)
            assert made == []

    run(test)


def test_nothing_is_called_after_close_also_not_what_was_posted_before() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), []
        wakeup.post(made.append, 1)
        wakeup.close()
        wakeup.post(made.append, 2)
        await asyncio.sleep(0.01)
        assert made == []

        closing = Wakeup(loop)
        closing.post(lambda _: closing.close(), None)
        closing.post(made.append, 3)
        await asyncio.sleep(0.01)
        assert made == []

    run(test)


def test_posting_to_a_loop_that_was_closed_is_harmless() -> None:
    loop = CountingLoop()
    wakeup = Wakeup(loop)
    loop.close()

    wakeup.post(print, "never")


async def test_a_worker_makes_calls_in_order_and_tells_their_results() -> None:
    worker, made = Worker("test"), []
    worker.do(lambda: made.append(threading.current_thread().name))

    assert await worker.result(lambda: len(made)) == 1
    with pytest.raises(ZeroDivisionError):
        await worker.result(lambda: 1 / 0)
    worker.close()

    assert made == ["test"]


async def test_a_call_whose_waiting_was_cancelled_is_made_nevertheless() -> None:
    worker, go, made = Worker("test"), threading.Event(), []

    def call() -> None:
        go.wait()
        made.append(1)

    waiting = asyncio.create_task(worker.result(call))
    await asyncio.sleep(0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    go.set()
    await worker.result(lambda: None)
    worker.close()

    assert made == [1]


async def test_no_thread_is_left_of_a_closed_worker() -> None:
    worker = Worker("soon gone")
    worker.close()

    (thread,) = [one for one in threading.enumerate() if one.name == "soon gone"] or [threading.Thread()]
    if thread.ident is not None:
        thread.join(10)
    assert not thread.is_alive()


def test_calls_that_may_wait_are_made_when_somebody_looks() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), list[int]()
        in_a_thread(lambda: wakeup.post_patiently(made.append, 1))
        await asyncio.sleep(0)
        assert made == []
        wakeup.look()
        assert made == [1]
        wakeup.post(made.append, 2)
        wakeup.look()  # what has woken the loop is made in its turn
        assert made == [1]
        while made == [1]:
            await asyncio.sleep(0)
        wakeup.close()

    run(test)


def test_the_least_patient_is_looked_for_in_time() -> None:
    async def test(loop: CountingLoop) -> None:
        wakeup, made = Wakeup(loop), list[float]()
        wakeup.be_patient(30.0)
        wakeup.be_patient(PATIENCE)
        wakeup.be_patient(30.0)
        for _ in range(2):
            wakeup.post_patiently(lambda _: made.append(loop.time()), None)
            while not made:
                await asyncio.sleep(PATIENCE / 10)
            made.clear()
        wakeup.close()
        wakeup.be_patient(PATIENCE)
        wakeup.close()

    run(test)


@pytest.mark.skipif(sys.platform != "linux", reason="only the loop for Linux tells when it wakes")
def test_a_loop_that_wakes_for_something_else_makes_the_calls_that_may_wait_first() -> None:
    async def test() -> list[str]:
        loop = asyncio.get_running_loop()
        wakeup, made = Wakeup(loop), list[str]()
        wakeup.be_patient(30.0)
        await asyncio.sleep(0.001)  # the loop wakes, and nothing waits
        in_a_thread(lambda: wakeup.post_patiently(made.append, "sample"))
        timers: asyncio.Future[None] = loop.create_future()

        def due() -> None:
            made.append("timer")
            timers.set_result(None)

        loop.call_later(0.002, due)
        await timers
        wakeup.cease(30.0)
        in_a_thread(lambda: wakeup.post_patiently(made.append, "after"))
        wakeup.close()
        await asyncio.sleep(0.002)
        return made

    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        assert runner.run(test()) == ["sample", "timer"]
