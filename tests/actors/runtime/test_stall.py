"""The thread that notices who blocks the loop; its looks are made here by hand, but for one real block."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import anyio.to_thread
import pytest

from actors import Node, Supervisor, Topic, background, every, run
from actors.checks import create
from actors.inbox.inbox import LOOKS, Inbox
from actors.interfaces.std_msgs.msg import Int32
from actors.logs import LogRecord
from actors.places import line_of
from actors.runtime.stall import StallWatch
from actors.supervision.child import Child
from actors.system import System
from actors.time.lockstep import Lockstep
from actors.time.processor import Share
from tests.facts import lacks
from tests.stage import NUMBERS, events, number

OTHERS = Topic(Int32, "others")


class Careless(Node):
    """Its handlers keep the loop until they are told to let go."""

    blocks: Any = None

    @NUMBERS.on()
    async def compute(self, message: Int32) -> None:
        self.blocks()

    @OTHERS.on()
    async def wait(self, message: Int32) -> None:
        await asyncio.sleep(0)
        self.blocks()


class Restless(Node):
    """Blocks in a task of its own."""

    blocks: Any = None

    @background
    async def dig(self) -> None:
        await asyncio.sleep(0.001)
        self.blocks()
        await asyncio.sleep(3600)


def blocked(records: list[LogRecord]) -> list[LogRecord]:
    return events(records, "blocked the event loop")


async def test_a_handler_that_blocks_the_loop_is_named_once_with_its_node_line_and_remedy() -> None:
    """On the real clock and with the real thread: the handler lets go when it has been caught."""
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless)]), sinks=(records.append,)) as system:
        state = next(iter(system.nodes.values()))

        def until_caught() -> None:
            assert system.runtime.stalls is not None
            while system.runtime.stalls.caught is None:
                time.sleep(0.01)  # this blocks the loop: it is what must be caught

        assert state.running is not None
        Careless.blocks = staticmethod(until_caught)
        out = state.node.publisher(NUMBERS)
        out(number(1))
        while not blocked(records):
            await asyncio.sleep(0.01)
        (told,) = blocked(records)
        assert (told.node, told.fields["handler"]) == ("/careless", "Careless.compute")
        assert str(told.fields["at"]).startswith(__file__)
        assert str(told.fields["at"]).endswith("until_caught")
        assert "self.offload" in str(told.fields["remedy"])


class Stage:
    """A system on the real clock whose watch looks when the test says so, at the time that the test says."""

    def __init__(self, system: System) -> None:
        assert system.runtime.stalls is not None
        system.runtime.stalls.stop()
        self.system = system
        self.watch = system.runtime.stall_watch()
        self.watch.waited = lambda since: 0.0  # type: ignore[method-assign]  # the times of its looks are invented

    def look_on(self) -> None:
        """From within what blocks: a look, one that is too early to say anything, one late enough, and one more."""
        now = time.monotonic()
        for later in (0.0, 0.4, 0.5, 0.6):
            self.watch.look(now + later)
            assert (self.watch.caught is not None) is (later >= 0.5)


async def test_each_handler_is_told_once() -> None:
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless)]), sinks=(records.append,)) as system:
        stage = Stage(system)
        core = next(iter(system.nodes.values())).running
        assert core is not None
        Careless.blocks = staticmethod(stage.look_on)
        numbers, others = core.node.publisher(NUMBERS), core.node.publisher(OTHERS)
        for _ in range(3):
            numbers(number(1))
            others(number(1))
            await anyio.sleep(0.01)
        assert [record.fields["handler"] for record in blocked(records)] == ["Careless.compute", "Careless.wait"]


async def test_a_task_of_a_node_and_one_of_nobody_are_told_by_their_names() -> None:
    records: list[LogRecord] = []
    Restless.blocks = staticmethod(lambda: None)
    tree = Supervisor("s", children=[Child(Restless)])
    async with run(tree, sinks=(records.append,)) as system:
        stage = Stage(system)
        Restless.blocks = staticmethod(stage.look_on)
        while not blocked(records):
            await asyncio.sleep(0.001)
        stage.look_on()
        await asyncio.sleep(0.01)
        node, nobody = blocked(records)
        assert (node.node, node.fields["handler"]) == ("/restless", "/restless dig")
        assert nobody.node == "system"


async def test_a_loop_that_works_much_but_turns_blames_nobody() -> None:
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless)]), sinks=(records.append,)) as system:
        stage = Stage(system)
        core = next(iter(system.nodes.values())).running
        assert core is not None
        now = time.monotonic()
        looks = iter(range(1000))
        Careless.blocks = staticmethod(lambda: stage.watch.look(now + next(looks)))
        out = core.node.publisher(NUMBERS)
        for _ in range(100):  # one turn of the loop for all of them, and a look a second
            out(number(1))
        await asyncio.sleep(0.01)
        assert next(looks) == 100
        assert stage.watch.caught is None
        await anyio.to_thread.run_sync(stage.watch.look, now + 2000.0)  # the loop is idle
        assert blocked(records) == []


# -- blocks of less than half a second: told when a timer had to wait ------------------------------------------------------------


class Fast(Node):
    """Has a timer that others delay."""

    @every(hz=50)
    def tick(self) -> None: ...


class Sleepy(Node):
    """Awaits for longer than a period of the others, and blocks nobody."""

    @every(hz=50, late="catch_up")
    async def rest(self) -> None:
        await asyncio.sleep(0.03)


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(30.0):
        while not condition():
            await asyncio.sleep(0.001)


async def test_a_handler_of_less_than_half_a_second_is_named_with_its_time_and_whom_it_delayed() -> None:
    """On the real clock. Its first items are measured, so the very first block is told; of those that it delayed, the one that lost most."""
    records: list[LogRecord] = []
    tree = Supervisor(
        "s", children=[Child(Sleepy), Child(Fast), Child(Careless)]
    )  # Sleepy's ticks wait, and are not lost
    async with run(tree, sinks=(records.append,)) as system:
        Careless.blocks = staticmethod(lambda: time.sleep(0.15))  # blocks the loop: it is what must be caught
        state = next(state for state in system.nodes.values() if state.path[-1] == "careless")
        assert state.running is not None
        out = state.node.publisher(NUMBERS)
        ticks = system.nodes[("s", "fast")].timers["tick"]
        for _ in range(2):
            await until(lambda: ticks.fired > 1)
            out(number(1))
            before = ticks.missed
            await until(lambda before=before: ticks.missed > before)  # type: ignore[misc]
        await until(lambda: blocked(records))
        (line,) = blocked(records)
        assert (line.node, line.level, line.fields["handler"]) == ("/careless", 30, "Careless.compute")
        seconds = float(line.event.removeprefix("handler blocked the event loop for ").removesuffix(" s"))
        assert 0.15 <= seconds < 0.5
        assert line.fields["delayed"] == "/fast"
        assert line.fields["ticks_lost"] >= 6
        assert "self.offload" in line.fields["remedy"]


async def test_what_blocks_after_an_await_or_in_a_task_is_caught_by_the_close_look() -> None:
    """On the real clock and with the real thread, which looks closely once a delay has no explanation."""
    records: list[LogRecord] = []
    Restless.blocks = staticmethod(lambda: time.sleep(0.1))  # blocks the loop: it is what must be caught
    tree = Supervisor("s", children=[Child(Fast), Child(Restless, restart="permanent")])
    async with run(tree, sinks=(records.append,)) as system:
        core = system.nodes[("s", "restless")].running
        assert core is not None

        def pause() -> None:
            time.sleep(0.1)  # the same, in a task of its own

        async def dig() -> None:
            while True:
                await asyncio.sleep(0.05)
                pause()

        core.create_task(dig(), name="dig")
        await until(lambda: blocked(records))
        (line,) = blocked(records)
        assert (line.node, line.fields["handler"], line.fields["delayed"]) == ("/restless", "/restless dig", "/fast")
        assert line.fields["at"].startswith(__file__) and line.fields["at"].endswith("<locals>.pause")


class Judge:
    """A watch without a thread, at whose door the test knocks; time is what the test says."""

    def __init__(self, system: System, monkeypatch: pytest.MonkeyPatch) -> None:
        assert system.runtime.stalls is not None
        system.runtime.stalls.stop()
        self.watch = system.runtime.stalls
        self.now = 1000.0
        self.waited = 0.0
        monkeypatch.setattr("actors.runtime.stall.monotonic", lambda: self.now)
        monkeypatch.setattr(self.watch, "waited", lambda since: self.waited)

    def ran(self, system: System, node: str, seconds: float) -> None:
        self.now += seconds
        self.watch.ran(system.nodes[("s", node)].inbox, f"{node}.work", seconds)


async def test_what_ran_for_a_node_that_has_gone_since_is_to_blame_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless, name="a")]), sinks=(records.append,)) as system:
        judge = Judge(system, monkeypatch)
        judge.now += 0.05
        judge.watch.ran(Inbox(system.loop), "gone.work", 0.05)
        judge.watch.delayed("/fast", 0.02, 0.045, 1)
    assert blocked(records) == []


@pytest.mark.parametrize(
    ("seconds", "period", "late", "told"),
    [
        (0.05, 0.02, 0.045, True),
        (0.05, 0.06, 0.065, False),  # it ran for less than a period
        (0.008, 0.001, 0.007, False),  # nor is anything told below 10 ms
        (0.02, 0.001, 0.015, True),
        (0.05, 0.02, 0.0, False),  # it had ended before the tick was due
    ],
)
async def test_only_a_step_of_a_whole_period_that_the_tick_waited_for_is_to_blame(
    monkeypatch: pytest.MonkeyPatch, seconds: float, period: float, late: float, told: bool
) -> None:
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless, name="a")]), sinks=(records.append,)) as system:
        judge = Judge(system, monkeypatch)
        judge.ran(system, "a", seconds)
        judge.now += 0.001
        judge.watch.delayed("/fast", period, late, 1)
        judge.watch.tell_harm()
        assert len(blocked(records)) == told


async def test_the_one_that_lost_most_is_told_and_each_handler_once(monkeypatch: pytest.MonkeyPatch) -> None:
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless, name="a")]), sinks=(records.append,)) as system:
        judge = Judge(system, monkeypatch)
        for _ in range(2):
            judge.ran(system, "a", 0.3)
            for node, lost in (("/one", 1), ("/three", 3), ("/two", 2)):
                judge.watch.delayed(node, 0.1, 0.3, lost)
            judge.watch.tell_harm()
        (line,) = blocked(records)
        assert line.event == "handler blocked the event loop for 0.30 s"
        assert {key: line.fields[key] for key in ("handler", "delayed", "ticks_lost")} == {
            "handler": "a.work", "delayed": "/three", "ticks_lost": 3,
        }  # fmt: skip
        assert "at" not in line.fields


async def test_the_thread_looks_closely_for_five_seconds_of_thirty(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run(Supervisor("s", children=[Child(Careless, name="a")]), sinks=()) as system:
        judge = Judge(system, monkeypatch)
        caught: list[bool] = []

        def look_twice() -> None:
            for later in (0.0, 0.06):
                judge.watch.look(judge.now + later)
            caught.append(judge.watch.caught is not None)

        Careless.blocks = staticmethod(look_twice)
        core = system.nodes[("s", "a")].running
        assert core is not None
        out = core.node.publisher(NUMBERS)

        async def block() -> None:
            out(number(1))
            done = len(caught)
            await until(lambda: len(caught) > done)
            await asyncio.sleep(0)

        await block()  # nobody was late
        judge.watch.delayed("/fast", 0.05, 0.06, 1)
        await block()
        judge.now += 4.9
        await block()
        judge.now += 0.1
        judge.watch.delayed("/fast", 0.05, 0.06, 1)
        await block()  # five seconds are over, and the rest has not ended
        judge.now += 25.0
        judge.watch.delayed("/fast", 0.05, 0.06, 1)
        await block()
        assert caught == [False, True, True, False, True]


async def test_a_handler_that_awaits_is_not_blamed_for_the_time_in_which_another_blocked() -> None:
    """On the real clock: it holds its inbox for 30 ms, which is less than the period of its own timer."""
    records: list[LogRecord] = []

    class Innocent(Node):
        ticks = 0

        @OTHERS.on()
        async def other(self, message: Int32) -> None:
            await asyncio.sleep(0.03)

        @every(hz=10)
        def tick(self) -> None:
            self.ticks += 1

    tree = Supervisor("s", children=[Child(Innocent), Child(Careless)])
    async with run(tree, sinks=(records.append,)) as system:
        Careless.blocks = staticmethod(lambda: time.sleep(0.35))  # blocks the loop: it is what must be caught
        node = next(state for state in system.nodes.values() if state.path[-1] == "innocent").node  # type: ignore[union-attr]
        begun = node.ticks
        await until(lambda: node.ticks > begun)
        await asyncio.sleep(0.08)
        node.publisher(OTHERS)(number(1))
        await asyncio.sleep(0.021)  # its next tick waits in its inbox
        node.publisher(NUMBERS)(number(1))
        begun = node.ticks
        await until(lambda: node.ticks > begun + 1)
    assert [record.fields["handler"] for record in records if "holds the inbox" in record.event] == []


async def test_a_process_without_a_processor_blames_no_handler_and_one_line_tells_its_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless, name="a")]), sinks=(records.append,)) as system:
        judge = Judge(system, monkeypatch)
        ran = 5.0
        monkeypatch.setattr("actors.runtime.stall.process_time", lambda: ran)
        for waited, told in ((0.1, 0), (1.5, 1), (1.5, 1)):
            judge.waited = 0.25
            judge.ran(system, "a", 0.3)  # it took 50 ms, and had to wait for the rest
            for _ in range(2):
                judge.watch.delayed("/fast", 0.02, 0.3, 15)
            judge.now += 2.0
            judge.waited, ran = 0.25 + waited, ran + 0.44
            if judge.watch._starving is not None:
                judge.watch.tell_starved()
            assert len(events(records, "of a core")) == told
        judge.watch.tell_harm()
        assert blocked(records) == []
        (line,) = events(records, "of a core")
        assert lacks(line.event, "22% core timers late") == []
        assert line.fields["waited_for_a_processor"] == "75% of the time"
        judge.watch._told_starved = False
        judge.watch.delayed("/fast", 0.02, 0.3, 15)  # the measurement ends with the system
        Lockstep.of(system.loop)
        judge.watch._starving = None
        judge.watch.delayed("/fast", 0.02, 0.3, 15)
        assert judge.watch._starving is None, "a world that is simulated goes slower, and has its own line"


async def test_a_handler_that_had_no_processor_is_not_caught_and_holds_nothing_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    records: list[LogRecord] = []
    async with run(Supervisor("s", children=[Child(Careless)]), sinks=(records.append,)) as system:
        stage = Stage(system)
        stage.watch.waited = lambda since: 0.4  # type: ignore[method-assign]
        assert system.runtime.stalls is not None
        monkeypatch.setattr(system.runtime.stalls, "waited", lambda since: 0.4)
        life = next(iter(system.nodes.values())).running
        assert life is not None
        looked: list[bool] = []

        def look() -> None:
            for later in (0.0, 0.6):
                stage.watch.look(time.monotonic() + later)
            looked.append(stage.watch.caught is None)
            assert life.inbox.current is not None
            life.on_holding(life.inbox.current, 0.5)

        Careless.blocks = staticmethod(look)
        life.node.publisher(NUMBERS)(number(1))
        await until(lambda: looked)
        assert looked == [True]
        assert [record for record in records if record.level >= 30] == []


async def test_time_for_which_the_process_was_stopped_counts_as_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The checks of the thread are made here: one comes in time, one a minute later, and in between the loop's thread has not run."""
    async with run(Supervisor("s", children=[Child(Careless)]), sinks=()) as system:
        watch = system.runtime.stall_watch()
        now = 1000.0
        monkeypatch.setattr("actors.runtime.stall.monotonic", lambda: now)
        monkeypatch.setattr(watch.processor, "share", lambda: Share(0.0, 0.0))
        watch._samples[0] = (now, 0.0)
        waits = iter([0.2, 60.2, 0.2])

        class End:
            def wait(self, seconds: float) -> bool:
                nonlocal now
                now += next(waits, 0.0)
                return now > 1060.5

        watch._end = End()  # type: ignore[assignment]
        watch._run()
        assert watch.waited(1000.1) == pytest.approx(60.0)
        assert watch.waited(now) == 0.0
        assert watch.waited(0.0) == pytest.approx(60.0), "since the first check"
        watch.processor.close()


def test_a_watch_ends_with_a_loop_that_was_closed_under_it() -> None:
    loop = asyncio.new_event_loop()

    async def made() -> StallWatch:
        return create(System, sinks=()).runtime.stall_watch()

    watch = loop.run_until_complete(made())
    loop.close()
    watch._ask()
    watch._run()  # returns at once
    assert line_of(watch._loop_thread).startswith(__file__)
    assert line_of(0) == "", "a thread that has ended"


async def test_a_step_is_made_known_only_if_the_loop_did_not_turn_meanwhile() -> None:
    """On the real clock: the first items of an inbox are all measured."""
    heard: list[str] = []
    done = asyncio.Event()

    class Job:
        def __init__(self, label: str, act: Callable[[], Any]) -> None:
            self.label, self.run = label, act

    async def blocks() -> None:
        time.sleep(0.02)  # noqa: ASYNC251

    async def awaits() -> None:
        await asyncio.sleep(0.02)

    loop = asyncio.get_running_loop()
    inbox = Inbox(loop, lambda inbox, label, seconds: heard.append(f"{label} {seconds >= 0.02}"))
    jobs: dict[str, Callable[[], Any]] = {"plain": lambda: time.sleep(0.02), "blocks": blocks, "awaits": awaits}
    for label, act in jobs.items():
        inbox.put(Job(label, act))
    inbox.put(Job("last", done.set))
    serving = asyncio.create_task(inbox.serve())
    await done.wait()
    serving.cancel()
    await asyncio.wait([serving])
    assert [line for line in heard if not line.startswith("last")] == ["plain True", "blocks True"]


class SteppingLoop(asyncio.SelectorEventLoop):
    """A loop whose clock stands still but for what the test puts it forward, as a step of so many seconds would."""

    now = 0.0

    def time(self) -> float:
        return self.now


@pytest.mark.parametrize("blocks", [True, False])
def test_a_handler_that_takes_long_only_after_many_quick_runs_is_told_the_second_time_and_only_if_it_blocks(
    blocks: bool,
) -> None:
    """After `LOOKS` runs nobody looks whether the loop turns while it is awaited. The first long run makes the next ones looked at."""
    heard: list[tuple[str, int]] = []
    runs: list[int] = []
    done = asyncio.Event()

    class Work:
        label = "work"

        async def run(self) -> None:
            runs.append(len(runs) + 1)
            if runs[-1] > LOOKS:
                loop.now += 0.02
                if not blocks:
                    await asyncio.sleep(0)
            if runs[-1] == LOOKS + 3:
                done.set()

    async def main() -> None:
        inbox = Inbox(loop, lambda inbox, label, seconds: heard.append((label, runs[-1])))
        inbox.clock = loop.time
        for _ in range(LOOKS + 3):
            inbox.put(Work())
        serving = asyncio.create_task(inbox.serve())
        await done.wait()
        serving.cancel()
        await asyncio.wait([serving])
        assert [(load.handler, load.samples) for load in inbox.load.handlers] == [("work", LOOKS + 3)], "all measured"

    with asyncio.Runner(loop_factory=SteppingLoop) as runner:
        loop = runner.get_loop()
        assert isinstance(loop, SteppingLoop)
        runner.run(main())
    assert heard == ([("work", LOOKS + 2), ("work", LOOKS + 3)] if blocks else [])
