"""What `Deadlock`, `Livelock` and `Stalled` say: which task waits for what, at which line, since when, and what to do."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Generator
from typing import Any

import anyio
import pytest

from actors.time.deadlock import Deadlock, Livelock
from actors.time.virtual_loop import VirtualLoop


def failure(main: Callable[[], Awaitable[Any]], kind: type[Exception], **attributes: Any) -> str:
    """The message of the error in which `main` ends."""

    def factory() -> VirtualLoop:
        loop = VirtualLoop()
        for name, value in attributes.items():
            setattr(loop, name, value)
        return loop

    with pytest.raises(kind) as caught:
        anyio.run(main, backend_options={"loop_factory": factory})
    return str(caught.value)


async def stuck_on(event: asyncio.Event) -> None:
    await event.wait()


class TestDeadlock:
    def test_each_waiting_task_is_named_with_its_line_and_since_when(self) -> None:
        async def main() -> None:
            event = asyncio.Event()
            await asyncio.sleep(1.5)
            first = asyncio.create_task(stuck_on(event), name="gripper")
            await asyncio.sleep(2)
            await asyncio.wait_for(first, None)

        text = failure(main, Deadlock)
        assert text.startswith("Nothing is left that could wake a task. The virtual clock shows 3.5 s.")
        assert "gripper (stuck_on) waits since 1.5 s for Event.wait\n" in text
        assert re.search(r"test_virtual_loop_reports\.py:\d+ in stuck_on: await event\.wait\(\)", text)
        assert re.search(r"waits since 3\.5 s for task gripper\n.*await asyncio\.wait_for\(first, None\)", text)
        assert "wait_for_io = True" in text.splitlines()[-1]

    def test_a_bare_future_is_a_future(self) -> None:
        async def main() -> None:
            await asyncio.get_running_loop().create_future()

        text = failure(main, Deadlock)
        assert "waits since 0 s for a future" in text
        assert "create_future()" in text

    def test_the_line_is_found_inside_an_async_generator(self) -> None:
        async def steps(event: asyncio.Event) -> AsyncIterator[int]:
            yield 1
            await event.wait()  # the culprit

        async def main() -> None:
            async for _ in steps(asyncio.Event()):
                pass

        text = failure(main, Deadlock)
        assert re.search(r"in \S+steps: await event\.wait\(\)  # the culprit", text)

    def test_the_line_is_found_behind_a_coroutine_in_disguise(self) -> None:
        class Call:
            def __await__(self) -> Generator[Any, None, None]:
                return stuck_on(asyncio.Event()).__await__()

        async def main() -> None:
            await Call()

        assert "in stuck_on: await event.wait()" in failure(main, Deadlock)

    def test_the_line_is_found_in_an_awaitable_written_as_a_generator(self) -> None:
        class Call:
            def __await__(self) -> Generator[Any, None, None]:
                yield from stuck_on(asyncio.Event()).__await__()

        async def main() -> None:
            await Call()

        assert "in stuck_on: await event.wait()" in failure(main, Deadlock)

    def test_an_awaitable_that_refers_back_does_not_confuse_the_report(self) -> None:
        class Ring:
            """An iterator whose only visible reference is the coroutine that awaits it."""

            __slots__ = ("coroutine", "future")
            coroutine: object
            future: asyncio.Future[None]

            def __await__(self) -> Ring:
                return self

            def __iter__(self) -> Ring:
                return self

            def __next__(self) -> asyncio.Future[None]:
                self.future = asyncio.get_running_loop().create_future()
                self.future._asyncio_future_blocking = True
                return self.future

            def send(self, value: None) -> asyncio.Future[None]:
                return next(self)

        async def main() -> None:
            ring = Ring()
            task = asyncio.current_task()
            assert task is not None
            ring.coroutine = task.get_coro()
            await ring  # type: ignore[misc]

        assert "waits since 0 s for a future" in failure(main, Deadlock)

    def test_a_task_whose_code_is_a_library_has_no_line_of_its_own(self) -> None:
        async def main() -> None:
            tasks = [asyncio.create_task(asyncio.Event().wait(), name="bare")]
            await asyncio.wait(tasks)

        assert re.search(r"bare \(Event\.wait\) waits since 0 s for Event\.wait\n  ", failure(main, Deadlock))

    def test_of_many_tasks_the_first_twenty_are_shown_in_the_order_of_their_numbers(self) -> None:
        async def main() -> None:
            event = asyncio.Event()
            async with asyncio.TaskGroup() as group:
                for number in range(30):
                    group.create_task(stuck_on(event), name=f"node-{number}")

        text = failure(main, Deadlock)
        assert text.index("node-2 ") < text.index("node-10 ")
        assert "and 11 more tasks" in text

    def test_a_loop_with_nothing_to_do_says_so(self) -> None:
        loop = VirtualLoop()
        with pytest.raises(Deadlock, match=r"There are no tasks\."):
            loop.run_forever()
        loop.close()

    def test_times_are_kept_for_living_tasks_only(self) -> None:
        async def main() -> None:
            asyncio.get_running_loop().call_later(0.5, int)
            waiting = asyncio.create_task(stuck_on(asyncio.Event()), name="gripper")
            for _ in range(3000):
                await asyncio.create_task(asyncio.sleep(0.001))
            await waiting

        loop = VirtualLoop()
        with (
            pytest.raises(Deadlock, match=r"gripper \(stuck_on\) waits since 0 s"),
            asyncio.Runner(loop_factory=lambda: loop) as runner,
        ):
            runner.run(main())
        assert len(loop._stamps) < 2000


class TestLivelock:
    def test_tasks_that_spin_are_named_before_those_that_wait(self) -> None:
        async def spinner() -> None:
            while True:
                await asyncio.sleep(0)

        async def main() -> None:
            async with asyncio.TaskGroup() as group:
                group.create_task(stuck_on(asyncio.Event()), name="a-waits")
                group.create_task(spinner(), name="z-spins")

        text = failure(main, Livelock, max_spins=200)
        assert re.match(r"2\d\d iterations of the loop without progress of virtual time", text)
        assert re.search(r"z-spins \(\S+spinner\) runs again and again\n.*await asyncio\.sleep\(0\)", text)
        assert text.index("z-spins") < text.index("a-waits")
        assert "max_spins" in text.splitlines()[-1]

    @pytest.mark.parametrize("debug", [False, True])
    def test_callbacks_that_reschedule_themselves_are_named(self, debug: bool) -> None:
        for schedule in ("call_soon", "call_later"):

            def again(schedule: str = schedule) -> None:
                loop = asyncio.get_running_loop()
                if schedule == "call_soon":
                    loop.call_soon(again)
                else:
                    loop.call_later(0, again)

            async def main(again: Callable[[], None] = again) -> None:
                asyncio.get_running_loop().set_debug(debug)
                again()
                await asyncio.Event().wait()

            text = failure(main, Livelock, max_spins=200)
            assert re.search(r"again\(?.* runs again and again", text)

    def test_a_livelock_beside_an_open_socket_is_found_too(self) -> None:
        async def main() -> None:
            loop = asyncio.get_running_loop()

            def again() -> None:
                loop.call_later(0, again)

            async with await anyio.create_tcp_listener(local_host="127.0.0.1", local_port=0):
                again()
                await asyncio.Event().wait()

        failure(main, Livelock, max_spins=200)

    def test_a_task_that_has_not_run_yet_is_said_to(self) -> None:
        async def main() -> None:
            loop = asyncio.get_running_loop()
            born: list[asyncio.Task[None]] = []

            def again() -> None:
                loop.call_soon(again)
                if not born and loop._spins >= 207:  # type: ignore[attr-defined]
                    born.append(loop.create_task(stuck_on(asyncio.Event()), name="newborn"))

            again()
            await asyncio.Event().wait()

        assert "newborn (stuck_on) has not run yet" in failure(main, Livelock, max_spins=207)
