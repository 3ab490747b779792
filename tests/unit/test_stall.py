"""The thread that notices who blocks the loop; its looks are made here by hand, but for one real block."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import anyio.to_thread

from actors import Node, Supervisor, Topic, background, run
from actors.interfaces.std_msgs.msg import Int32
from actors.logs import LogRecord
from actors.places import line_of
from actors.stall import StallWatch
from actors.supervisor import Child
from actors.system import System
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
            assert system.stalls is not None
            while system.stalls.caught is None:
                time.sleep(0.01)  # this blocks the loop: it is what must be caught

        assert state.core is not None
        Careless.blocks = staticmethod(until_caught)
        out = state.core.node.publisher(NUMBERS)
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
        assert system.stalls is not None
        system.stalls.stop()
        self.system = system
        self.watch = StallWatch(system)

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
        core = next(iter(system.nodes.values())).core
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
        core = next(iter(system.nodes.values())).core
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


def test_a_watch_ends_with_a_loop_that_was_closed_under_it() -> None:
    loop = asyncio.new_event_loop()

    async def made() -> StallWatch:
        return StallWatch(System(sinks=()))

    watch = loop.run_until_complete(made())
    loop.close()
    watch._ask()
    watch._run()  # returns at once
    assert line_of(watch._system.thread).startswith(__file__)
    assert line_of(0) == "", "a thread that has ended"
