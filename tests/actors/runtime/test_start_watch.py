"""A node that does not get ready is named once, with the line where it waits; one that does costs nothing."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, StartFailed, Supervisor, every, execute, publishes, run
from actors.logs import LogRecord
from actors.testing import Deadlock, Rig
from tests.stage import NUMBERS, events, number


class Greedy(Node):
    """Waits in its start for a message of a sibling that comes after it."""

    async def on_start(self) -> None:
        await self.subscribe(NUMBERS).next()


class Teller(Node):
    out = publishes(NUMBERS)

    @every(hz=10)
    def tick(self) -> None:
        self.out(number(1))


class Sleeper(Node):
    """Takes as long as it is told to."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds

    async def on_start(self) -> None:
        await self.clock.sleep(self.seconds)


def test_a_hung_start_is_named_once_with_the_line_where_it_waits() -> None:
    told: list[LogRecord] = []

    async def main() -> None:
        tree = Supervisor("s", children=[Child(Greedy), Child(Teller)])
        async with asyncio.timeout(60), run(tree, sinks=(told.append,), level=0):
            raise AssertionError("it can never be ready")

    with pytest.raises(TimeoutError):
        execute(main, clock="virtual")
    (line,) = events(told, "still starting")
    assert (line.node, line.event, line.time, line.level) == ("/greedy", "still starting after 5 s", 5.0, 30)
    assert line.fields["awaits"].startswith(f"{__file__}:") and line.fields["awaits"].endswith(" in Greedy.on_start")
    assert "has to come before it" in line.fields["remedy"]


async def test_slow_starts_side_by_side_and_in_a_row_are_told_each_at_its_own_time(rig: Rig) -> None:
    left = Supervisor("left", children=[Child(Sleeper, name="a", args=(7.0,)), Child(Sleeper, name="b", args=(5.5,))])
    start = asyncio.create_task(rig.start(left))
    await start
    assert [(line.time, line.node) for line in events(rig.logs, "still starting")] == [(5.0, "/a"), (12.0, "/b")]
    one, other = (asyncio.create_task(rig.system.join(Child(Sleeper, name=name, args=(6.0,)))) for name in "cd")
    await rig.advance(1.0)
    third = asyncio.create_task(rig.system.join(Child(Sleeper, name="e", args=(6.0,))))
    await asyncio.wait([one, other, third])
    told = [(line.time, line.node) for line in events(rig.logs, "still starting")][2:]
    assert told == [(17.5, "/c"), (17.5, "/d"), (18.5, "/e")]


async def test_a_quick_start_and_one_that_fails_leave_no_timer(rig: Rig) -> None:
    class Broken(Node):
        async def on_start(self) -> None:
            await self.clock.sleep(1.0)
            raise OSError("no device")

    await rig.start(Child(Teller))
    assert rig.system.runtime.starts._timer is None
    with pytest.raises(OSError, match="no device"):
        await rig.system.join(Child(Broken))
    assert rig.system.runtime.starts._timer is None
    rig.crash(Teller)
    await rig.advance(10.0)
    assert events(rig.logs, "still starting") == []


def test_a_program_that_waits_for_ever_is_found_at_once_when_nothing_starts() -> None:
    async def main() -> None:
        async with run(Supervisor("s", children=[Child(Node)]), sinks=()):
            await asyncio.get_running_loop().create_future()

    with pytest.raises(Deadlock, match="The virtual clock shows 0 s"):
        execute(main, clock="virtual")


def test_a_start_that_can_never_end_is_a_deadlock_right_after_it_was_named() -> None:
    told: list[LogRecord] = []

    async def main() -> None:
        async with run(Supervisor("s", children=[Child(Greedy)]), sinks=(told.append,)):
            pass

    with pytest.raises(Deadlock, match="The virtual clock shows 5 s"):
        execute(main, clock="virtual")
    assert len(events(told, "still starting")) == 1


def test_on_the_real_clock_one_timer_serves_all_starts_and_ends_with_the_system() -> None:
    async def main() -> None:
        async with run(Supervisor("s", children=[Child(Teller)]), sinks=()) as system:
            timer = system.runtime.starts._timer
            assert timer is not None and not timer.cancelled()
            await system.leave(await system.join(Child(Node, name="guest")))
            assert system.runtime.starts._timer is timer
        assert timer.cancelled()

    execute(main)


async def test_a_node_that_was_given_up_in_its_start_is_not_told_and_a_watch_without_starts_says_nothing(
    rig: Rig,
) -> None:
    await rig.start(Child(Node, name="given_up"))
    core = rig.state("given_up").running
    assert core is not None
    rig.system.runtime.starts.begin(core)
    rig.system.runtime.starts.end(core)
    await rig.advance(6.0)
    rig.system.runtime.starts._look()
    assert events(rig.logs, "still starting") == []
    assert rig.system.runtime.starts._timer is None


def test_a_tree_that_does_not_start_is_as_it_was() -> None:
    class Broken(Node):
        async def on_start(self) -> None:
            raise OSError("no device")

    async def main() -> None:
        async with run(Supervisor("s", children=[Child(Broken)]), sinks=()):
            raise AssertionError("it does not start")

    with pytest.raises(StartFailed, match="no device"):
        execute(main, clock="virtual")
