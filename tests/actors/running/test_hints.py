"""Hints in the log about topics on which nobody is heard."""

from __future__ import annotations

import asyncio

import pytest

from actors import Node, Topic, open_node, publishes, run
from actors.interfaces.std_msgs.msg import Int32
from actors.logs import LogRecord
from actors.running import hints
from tests.stage import NUMBERS, number

LATER = Topic(Int32, "later")


class Talker(Node):
    """Publishes on /numbers."""

    out = publishes(NUMBERS)


class Ear(Node):
    """Listens to a misspelt topic."""

    @Topic(Int32, "/nubmers").on()
    async def hear(self, message: Int32) -> None: ...


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hints, "AFTER", 0.01)


async def said(lines: list[LogRecord], *, within: float = 5.0) -> list[tuple[str, object]]:
    """The hints, as soon as there is one; what came in the next ten intervals, too."""
    async with asyncio.timeout(within):
        while not lines:
            await asyncio.sleep(0.01)
    await asyncio.sleep(0.1)
    return [(line.event, line.fields.get("subscribed_by")) for line in lines]


async def test_a_misspelt_topic_is_told_once_with_the_name_that_was_meant() -> None:
    lines: list[LogRecord] = []
    async with run(Talker, Ear, sinks=(lines.append,)) as system:
        told = [("nobody publishes /nubmers; did you mean '/numbers'?", "/ear")]
        assert await said(lines) == told
        async with open_node("late", system=system) as late:
            stream = late.subscribe(Topic(Int32, "numbrs"))
            while len(lines) == 1:
                await asyncio.sleep(0.01)
            assert await said(lines) == [*told, ("nobody publishes /numbrs; did you mean '/numbers'?", "/late")]
            stream.close()
    assert len(lines) == 2


async def test_a_script_is_told_too() -> None:
    lines: list[LogRecord] = []
    async with open_node("script", transport=None, sinks=(lines.append,)) as node:
        out = node.publisher(NUMBERS)
        stream = node.subscribe(Topic(Int32, "number"))
        assert await said(lines) == [("nobody publishes /number; did you mean '/numbers'?", "/script")]
        out(number(1))
        stream.close()


@pytest.mark.parametrize(
    ("node", "says"),
    [
        (Talker, "nobody here subscribes to /numbers, and other processes are not reached"),
        (Ear, "nobody here publishes /nubmers, and other processes are not reached"),
    ],
)
async def test_a_program_that_reaches_no_other_process_is_told_of_spin(
    node: type[Node], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RMW_IMPLEMENTATION")
    lines: list[LogRecord] = []
    async with run(node, sinks=(lines.append,)):
        assert await said(lines) == [(says, None)]
    assert "spin(tree)" in lines[0].fields["remedy"]


async def test_nothing_is_said_where_all_is_well_or_in_process_is_meant() -> None:
    lines: list[LogRecord] = []
    async with run(Talker, sinks=(lines.append,)), open_node("ear") as ear:
        heard = [ear.subscribe(topic) for topic in (NUMBERS, LATER, Topic(Int32, "/clock"), Topic(Int32, "/_numbers"))]
        await asyncio.sleep(0.2)
        assert [stream.publisher_count for stream in heard] == [1, 0, 0, 0]
    assert lines == []


class Arbiter(Node):
    """Takes commands of three sources, of which one is there, and publishes what it has chosen."""

    out = publishes(Topic(Int32, "/cmd_vel"))

    @Topic(Int32, "/joy/cmd_vel").on()
    async def joy(self, message: Int32) -> None: ...

    @Topic(Int32, "/autonomy/cmd_vel").on()
    async def autonomy(self, message: Int32) -> None: ...

    @Topic(Int32, "/autonomy/cmd_vel_stamped").on()
    async def stamped(self, message: Int32) -> None: ...


class Navigation(Node):
    """One of the sources."""

    out = publishes(Topic(Int32, "/autonomy/cmd_vel"))


async def test_a_topic_that_the_subscriber_uses_itself_is_not_what_it_meant() -> None:
    lines: list[LogRecord] = []
    async with run(Arbiter, Navigation, Ear, Talker, sinks=(lines.append,)):
        assert await said(lines) == [("nobody publishes /nubmers; did you mean '/numbers'?", "/ear")]
