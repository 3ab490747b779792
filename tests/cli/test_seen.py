"""What a command waits for before it says that something is not there."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, Topic, run
from actors.interfaces.std_msgs.msg import String
from actors.time.processor import Processor, Share
from cli.graph.looking import QUIET, SLOW, settle
from cli.graph.seen import Seen

pytestmark = pytest.mark.virtual

TOPIC = Topic(String, "/late")


class Watcher(Node):
    pass


def waited(monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
    """Have the command wait for a processor for so many seconds in each that it runs."""
    monkeypatch.setattr(Processor, "share", lambda self: Share(1.0, seconds))


@pytest.fixture(autouse=True)
def quiet_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    waited(monkeypatch, 0.0)


async def test_what_shows_itself_late_is_waited_for_a_second_or_as_long_as_the_options_say() -> None:
    async with run(Child(Watcher), signals=False) as system:
        loop, node, begun = asyncio.get_running_loop(), system.node(Watcher), asyncio.get_running_loop().time()
        seen = Seen(system, node)

        def published() -> bool:
            return "/late" in system.graph.topics and bool(system.graph.topics["/late"].publishers)

        assert not await seen.late(published, 0.5)
        assert loop.time() - begun == pytest.approx(1.0)
        loop.call_later(1.5, node.publisher, TOPIC)
        assert await seen.late(published, 2.0)
        assert loop.time() - begun == pytest.approx(2.5)
        assert await seen.late(published, 0.0)
        assert loop.time() - begun == pytest.approx(2.5)


async def test_news_that_come_when_the_time_is_just_over_are_news() -> None:
    """A process that was held up finds both at once: that the time is over, and what has come meanwhile."""
    loop, news = asyncio.get_running_loop(), asyncio.Event()
    loop.call_later(QUIET, news.set)
    begun = loop.time()
    await settle(news, lambda: True, lambda: True, 1.0)
    assert loop.time() - begun == pytest.approx(2 * QUIET)


async def test_the_graph_of_a_command_that_finds_nobody_is_looked_at_for_as_long_as_the_options_say() -> None:
    loop, news = asyncio.get_running_loop(), asyncio.Event()
    loop.call_later(0.2, news.set)
    begun = loop.time()
    await settle(news, lambda: False, lambda: True, 0.5)
    assert loop.time() - begun == pytest.approx(0.5)


@pytest.mark.parametrize(("busy", "looked"), [(2.0, 1.5), (100.0, SLOW)])
async def test_on_a_busy_machine_it_is_looked_at_for_longer(
    busy: float, looked: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited(monkeypatch, busy)
    loop = asyncio.get_running_loop()
    begun = loop.time()
    await settle(asyncio.Event(), lambda: False, lambda: True, 0.5)
    assert loop.time() - begun == pytest.approx(looked)


async def test_those_that_are_found_and_tell_slowly_are_waited_for_but_not_for_ever() -> None:
    """A command beside Fast DDS, which tells of its nodes with its heartbeats."""
    loop, news, told = asyncio.get_running_loop(), asyncio.Event(), asyncio.Event()
    loop.call_later(0.1, news.set)
    loop.call_later(3.0, told.set)
    loop.call_later(3.0, news.set)
    begun = loop.time()
    await settle(news, lambda: True, told.is_set, 0.5)
    assert loop.time() - begun == pytest.approx(3.0 + QUIET)
    await settle(news, lambda: True, lambda: False, 0.5)
    assert loop.time() - begun == pytest.approx(3.0 + QUIET + SLOW)
