"""The inbox: one item after another, control first, and a word about who holds up the rest."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import anyio
import pytest

from actors.inbox.inbox import HOLDING_SECONDS, NOTHING, TURN, Inbox
from actors.places import awaited_in

pytestmark = pytest.mark.virtual


class Job:
    """An item of the tests."""

    def __init__(self, label: str, act: Callable[[], Awaitable[Any] | None] = lambda: None) -> None:
        self.label = label
        self.act = act

    def run(self) -> Awaitable[Any] | None:
        return self.act()


class Bench:
    """An inbox with a story of what ran."""

    def __init__(self) -> None:
        self.inbox = Inbox(asyncio.get_running_loop())
        self.story: list[str] = []
        self.reports: list[tuple[str, float, float]] = []
        self.asked: list[tuple[str, str]] = []

    def on_error(self, error: Exception, handler: str) -> object:
        self.asked.append((str(error), handler))
        return "continue" if handler == "forgiven" else None

    def on_holding(self, item: Any, seconds: float) -> None:
        self.reports.append((item.label, seconds, asyncio.get_running_loop().time()))

    def quick(self, label: str) -> Job:
        return Job(label, lambda: self.story.append(label))

    def slow(self, label: str, seconds: float = 1.0) -> Job:
        async def work() -> None:
            self.story.append(f"begin {label}")
            await asyncio.sleep(seconds)
            self.story.append(f"end {label}")

        return Job(label, work)

    def serve(self) -> asyncio.Task[None]:
        return asyncio.create_task(self.inbox.serve(self))


async def finish(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.wait([task])


async def test_items_run_one_after_another_in_order_and_control_goes_first() -> None:
    bench = Bench()
    for item in (bench.slow("a"), bench.quick("b"), bench.slow("c")):
        bench.inbox.put(item)
    task = bench.serve()
    await asyncio.sleep(0.5)
    bench.inbox.put(bench.quick("d"))
    bench.inbox.put_control(bench.quick("control 1"))
    bench.inbox.put_control(bench.quick("control 2"))
    await asyncio.sleep(5.0)
    assert bench.story == ["begin a", "end a", "control 1", "control 2", "b", "begin c", "end c", "d"]
    assert bench.inbox.handled == 6
    assert bench.inbox.task is task
    await finish(task)
    assert bench.inbox.task is None


async def test_any_number_of_items_is_one_wake_up() -> None:
    bench = Bench()
    task = bench.serve()
    await asyncio.sleep(0)
    waiter = bench.inbox.waiter
    assert waiter is not None
    for index in range(100):
        bench.inbox.put(bench.quick(str(index)))
    assert waiter.done()
    assert bench.inbox.waiter is None
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert len(bench.story) == 100
    await finish(task)


async def test_a_wake_up_that_was_canceled_does_no_harm() -> None:
    bench = Bench()
    task = bench.serve()
    await asyncio.sleep(0)
    task.cancel()
    bench.inbox.put(bench.quick("late"))
    await asyncio.wait([task])
    assert bench.story == []
    assert len(bench.inbox.items) == 1


async def test_a_long_queue_lets_the_loop_turn_now_and_then() -> None:
    bench = Bench()
    turns: list[int] = []

    async def watch() -> None:
        while True:
            turns.append(len(bench.story))
            await asyncio.sleep(0)

    watcher = asyncio.create_task(watch())
    for index in range(3 * TURN):
        bench.inbox.put(bench.quick(str(index)))
    task = bench.serve()
    while len(bench.story) < 3 * TURN:
        await asyncio.sleep(0)
    assert TURN in turns
    assert 2 * TURN in turns
    await finish(task)
    await finish(watcher)


@pytest.mark.parametrize("before", [0, 500])
async def test_an_exception_ends_the_serving_unless_somebody_says_continue(before: int) -> None:
    bench = Bench()
    for _ in range(before):  # the first items are measured, later ones by samples
        bench.inbox.put(Job("earlier"))

    def fail() -> None:
        raise OSError("broken")

    for item in (Job("forgiven", fail), bench.quick("after"), Job("fatal", fail), bench.quick("kept")):
        bench.inbox.put(item)
    with pytest.raises(OSError, match="broken"):
        await bench.inbox.serve(bench)
    assert bench.inbox.handled == before + 2
    assert bench.story == ["after"]
    assert bench.asked == [("broken", "forgiven"), ("broken", "fatal")]
    assert [item.label for item in bench.inbox.items] == ["kept"]
    bench.inbox.put_control(Job("fatal", fail))
    with pytest.raises(OSError):
        await bench.inbox.serve()


async def test_a_cancellation_of_something_else_is_the_items_failure_one_of_the_task_is_the_end() -> None:
    bench = Bench()

    async def careless() -> None:
        other = asyncio.ensure_future(asyncio.sleep(1.0))
        other.cancel()
        await other

    bench.inbox.put(Job("careless", careless))
    with pytest.raises(RuntimeError, match="careless awaited something that was canceled") as caught:
        await bench.inbox.serve()
    assert isinstance(caught.value.__cause__, asyncio.CancelledError)
    bench.inbox.put(bench.slow("a"))
    task = bench.serve()
    await asyncio.sleep(0.5)
    await finish(task)
    assert task.cancelled()


async def test_an_item_that_keeps_others_waiting_is_reported_once_after_half_a_second() -> None:
    bench = Bench()
    task = bench.serve()
    await asyncio.sleep(0)
    bench.inbox.put(bench.slow("long", 10.0))
    await asyncio.sleep(1.0)
    assert bench.reports == []  # it keeps nobody waiting
    bench.inbox.put(bench.slow("long", 10.0))
    await asyncio.sleep(5.0)
    assert bench.reports == [("long", HOLDING_SECONDS, 1.5)]
    bench.inbox.put(bench.quick("late"))
    await asyncio.sleep(30.0)
    assert len(bench.reports) == 1
    await finish(task)


async def test_an_item_that_begins_with_others_behind_it_is_watched_from_its_beginning() -> None:
    bench = Bench()
    for item in (bench.quick("first"), bench.slow("long", 10.0), bench.quick("behind")):
        bench.inbox.put(item)
    task = bench.serve()
    await asyncio.sleep(1.0)
    assert bench.reports == [("long", HOLDING_SECONDS, 0.5)]
    await finish(task)


async def test_many_quick_items_are_no_holding_and_without_a_listener_nothing_is_said() -> None:
    bench = Bench()
    for index in range(10):
        bench.inbox.put(bench.slow(str(index), 0.3))
    task = bench.serve()
    await asyncio.sleep(5.0)
    assert bench.reports == []
    await finish(task)
    task = asyncio.create_task(bench.inbox.serve())
    bench.inbox.put(bench.slow("long", 10.0))
    bench.inbox.put(bench.quick("behind"))
    await asyncio.sleep(5.0)
    assert bench.inbox.reported == set()
    await finish(task)
    assert bench.inbox.watch is None


async def test_what_is_dropped_is_gone_for_who_serves_now_too() -> None:
    bench = Bench()
    for item in (bench.slow("now"), bench.quick("dropped"), bench.quick("kept")):
        bench.inbox.put(item)
    bench.inbox.put_control(bench.quick("control"))
    task = bench.serve()
    await asyncio.sleep(0.5)
    bench.inbox.clear(keep=lambda item: item.label == "kept")
    await asyncio.sleep(5.0)
    assert bench.story == ["control", "begin now", "end now"]
    assert (bench.inbox.waiting, bench.inbox.items[-1].label) == (1, "kept")
    await finish(task)


async def test_who_outstays_its_time_finds_another_one_serving_and_leaves() -> None:
    bench = Bench()
    let_go = asyncio.Event()

    async def resist() -> None:
        while not let_go.is_set():
            try:
                await let_go.wait()
            except asyncio.CancelledError:
                pass

    bench.inbox.put(Job("zombie", resist))
    old = bench.serve()
    await asyncio.sleep(0)
    old.cancel()
    await asyncio.sleep(0)
    bench.inbox.clear(keep=lambda item: True)
    bench.inbox.leave()
    new = bench.serve()
    await asyncio.sleep(0)
    let_go.set()
    await asyncio.wait([old])
    bench.inbox.put(bench.quick("for the new one"))
    await asyncio.sleep(1.0)
    assert bench.story == ["for the new one"]
    assert bench.inbox.task is new
    await finish(new)


async def test_where_a_task_waits_is_told_by_the_users_own_line() -> None:
    async def inner() -> None:
        await asyncio.sleep(5.0)

    async def through_a_library() -> None:
        with anyio.move_on_after(9.0):
            await anyio.sleep(5.0)

    async def outer(way: str) -> None:
        if way == "direct":
            await inner()
        elif way == "library":
            await through_a_library()
        else:
            async for _ in stepping():
                pass

    async def stepping() -> Any:
        await asyncio.sleep(5.0)
        yield

    for way, function in (("direct", "inner"), ("library", "through_a_library"), ("generator", "stepping")):
        task = asyncio.create_task(outer(way))
        await asyncio.sleep(0)
        place = awaited_in(task)
        assert place.startswith(__file__)
        assert place.endswith(f"{function}")
        await finish(task)
    task = asyncio.create_task(asyncio.sleep(5.0))
    await asyncio.sleep(0)
    assert awaited_in(task).endswith(" in sleep")  # nothing but a library
    await finish(task)
    assert awaited_in(task) == ""


def test_an_item_that_would_be_lost_without_a_queue_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="'late' was put into a queue that has not been made"):
        NOTHING.append("late")
    assert not NOTHING


async def test_a_queue_that_is_made_while_an_item_runs_is_served_by_the_same_task() -> None:
    bench = Bench()
    task = bench.serve()
    await asyncio.sleep(0.1)
    bench.inbox.put_control(bench.slow("first"))
    await asyncio.sleep(0.1)
    bench.inbox.put(bench.quick("made the queue"))
    await asyncio.sleep(5.0)
    bench.inbox.put(bench.quick("later"))
    await asyncio.sleep(0.1)
    assert bench.story == ["begin first", "end first", "made the queue", "later"]
    await finish(task)


async def test_an_inbox_without_items_is_cleared_for_who_serves_next_only() -> None:
    """The one who is left behind still has the old control items, not those of its successor."""
    bench = Bench()
    left_behind = bench.serve()
    await asyncio.sleep(0.1)
    bench.inbox.clear(keep=lambda item: False)
    assert bench.inbox.items is NOTHING
    bench.inbox.leave()
    task = bench.serve()
    bench.inbox.put_control(bench.quick("control"))
    bench.inbox.put(bench.quick("first"))
    await asyncio.sleep(0.1)
    assert bench.story == ["control", "first"]
    assert bench.inbox.task is task
    await finish(task)
    await finish(left_behind)
