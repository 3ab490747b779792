"""A router of its own port beside the gossip point: it may come first or later, end, and come again. The router is ours, and ROS 2's if there is one."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Literal

import pytest

from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import ALL_OF_IT, Changes, Party
from tests.actors.transport.zenoh.wires import free_port
from tests.interop.ros2.bench import NoRos, find_ros

pytestmark = pytest.mark.realtime

KEY = "7/chatter/T/H"


class Place:
    """Where programs meet, and what runs there."""

    def __init__(self, router: Literal["ours", "rmw_zenohd"]) -> None:
        self.gossip, self.port = free_port(), free_port()
        self.endpoint = f"tcp/127.0.0.1:{self.port}"
        self.changes = Changes()
        self._ros = find_ros().router if router == "rmw_zenohd" else ""

    @asynccontextmanager
    async def router(self) -> AsyncIterator[asyncio.subprocess.Process]:
        """A router in a process of its own, which is killed in the end. It has to find its port free."""
        words = (self._ros,) if self._ros else (sys.executable, "-m", "robot", "router", "--listen", self.endpoint)
        settings = {"ZENOH_CONFIG_OVERRIDE": f'listen/endpoints=["{self.endpoint}"]', "RUST_LOG": "off"}
        process = await asyncio.create_subprocess_exec(
            *words, env={**os.environ, **settings}, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.DEVNULL
        )
        try:
            while not await self._answers():
                assert process.returncode is None, "the router has ended"
                await asyncio.sleep(0.05)
            yield process
        finally:
            if process.returncode is None:
                process.kill()
            await process.wait()

    async def _answers(self) -> bool:
        try:
            _, writer = await asyncio.open_connection("127.0.0.1", self.port)
        except OSError:
            return False
        writer.close()
        return True

    @asynccontextmanager
    async def program(self) -> AsyncIterator[Party]:
        """A program of ours: it looks for the gossip point and for the router."""
        async with self._open(ZenohConfig(gossip_port=self.gossip, connect=(self.endpoint,))) as one:
            yield one

    @asynccontextmanager
    async def stranger(self) -> AsyncIterator[Party]:
        """One that knows the router only, as a program of ROS 2 does."""
        async with self._open(ZenohConfig(gossip_port=0, connect=(self.endpoint,))) as one:
            yield one

    @asynccontextmanager
    async def neighbour(self) -> AsyncIterator[Party]:
        """One that looks for the gossip point only, and does not offer to be it."""
        async with self._open(ZenohConfig(gossip_port=0, connect=(f"tcp/127.0.0.1:{self.gossip}",))) as one:
            yield one

    @asynccontextmanager
    async def _open(self, config: ZenohConfig) -> AsyncIterator[Party]:
        party = Party(ZenohKeys(config), self.changes)
        await party.open()
        try:
            yield party
        finally:
            await party.transport.close()


@pytest.fixture(params=["ours", "rmw_zenohd"])
def place(request: pytest.FixtureRequest) -> Place:
    try:
        return Place(request.param)
    except NoRos as missing:
        pytest.skip(f"there is no rmw_zenohd: {missing}")


async def all_linked(*parties: Party) -> None:
    for one in parties:
        for other in parties:
            if one is not other:
                await one.until(lambda one=one, other=other: one.is_linked(other.session), "all are linked")  # type: ignore[misc]


async def reaches_each_once(sender: Party, *others: Party) -> None:
    """Each of 100 samples arrives, and the last one is not followed by one of them."""
    heard = [other.listen(KEY, ALL_OF_IT) for other in others]
    for other in others:
        await other.told_to(sender)
    outlet = await sender.outlet(KEY, ALL_OF_IT)
    for number in range(101):
        outlet.put(str(number).encode(), b"")
    for got, subscription in heard:
        await sender.until(lambda got=got: 100 in got.numbers, "the last one has arrived")  # type: ignore[misc]
        assert got.numbers == list(range(101))
        subscription.close()
    outlet.close()


def appeared_once(one: Party) -> bool:
    texts = [happened.of for happened in one.told("appeared")]
    return len(texts) == len(set(texts))


async def test_a_router_that_is_started_later_finds_its_port_free_and_joins_those_who_know_only_it(
    place: Place,
) -> None:
    async with place.program() as a, place.program() as b:
        await all_linked(a, b)

        async with place.router(), place.stranger() as stranger:
            await all_linked(a, b, stranger)
            await reaches_each_once(a, b, stranger)
            await reaches_each_once(stranger, a, b)


async def test_a_router_that_runs_already_joins_them_and_newcomers_without_it_as_well(place: Place) -> None:
    async with place.router(), place.stranger() as stranger, place.program() as a, place.neighbour() as neighbour:
        await all_linked(a, stranger)
        await all_linked(a, neighbour)

        await reaches_each_once(a, stranger, neighbour)
        await reaches_each_once(stranger, a)


async def test_a_router_that_ends_and_comes_again_costs_no_link_and_nothing_comes_twice(place: Place) -> None:
    async with place.program() as a, AsyncExitStack() as later:
        async with place.router():
            first = await later.enter_async_context(place.stranger())
            await all_linked(a, first)
        await reaches_each_once(a, first)
        async with place.router():
            second = await later.enter_async_context(place.stranger())
            await all_linked(a, first, second)
            await reaches_each_once(a, first, second)

            for one in (a, first, second):
                assert one.told("down", "vanished") == []
                assert appeared_once(one)


async def test_the_gossip_point_is_taken_over_although_a_router_is_there(place: Place) -> None:
    async with place.router():
        async with place.program() as holder, place.program() as other:
            await all_linked(holder, other)
            await holder.transport.close()

            async with place.neighbour() as newcomer:
                await all_linked(other, newcomer)


@pytest.mark.parametrize("stopped", ["theirs", "the router"])
async def test_a_process_of_ros2_that_has_stood_still_is_a_peer_again(place: Place, stopped: str) -> None:
    token = f"@ros2_lv/7/{'e' * 32}/0/0/NN/%/%/theirs"
    program = ("-m", "tests.actors.transport.zenoh.like_ros2", place.endpoint, KEY, token)
    async with place.router() as router, place.program() as a:
        got, _ = a.listen(f"{KEY}/theirs", ALL_OF_IT)
        theirs = await asyncio.create_subprocess_exec(sys.executable, *program, stdout=asyncio.subprocess.PIPE)
        try:
            await a.until(lambda: got.numbers, "they are heard")
            outlet = await a.outlet(f"{KEY}/ours", ALL_OF_IT)
            still = theirs if stopped == "theirs" else router
            for _ in range(2):
                still.send_signal(signal.SIGSTOP)
                await asyncio.sleep(3)  # longer than the lease of 2 s that was
                still.send_signal(signal.SIGCONT)
                last = got.numbers[-1]
                await a.until(lambda last=last: got.numbers[-1] > last + 40, "they are heard for two seconds more")  # type: ignore[misc]
                await a.until(lambda: outlet.wanted, "they listen")
                outlet.put(b"0", b"")
                assert theirs.stdout is not None
                assert await asyncio.wait_for(theirs.stdout.readline(), timeout=5) == b"heard\n"
            assert a.told("vanished") == []
        finally:
            theirs.kill()
            await theirs.wait()


async def test_a_link_with_a_process_of_ros2_that_is_not_used_outlives_a_stop_as_its_routers_does(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the link with us it says something every half of its lease only. Its router has heard it just before the stop."""
    monkeypatch.setattr("actors.transport.zenoh.connection.QUESTIONS", 1)
    token = f"@ros2_lv/7/{'e' * 32}/0/0/NN/%/%/theirs"
    program = ("-m", "tests.actors.transport.zenoh.like_ros2", place.endpoint, KEY, token, "6000")
    pipe = asyncio.subprocess.PIPE
    async with place.router(), place.program() as a, place.stranger() as stranger:
        got, _ = a.listen(f"{KEY}/theirs", ALL_OF_IT)
        beside, _ = stranger.listen(f"{KEY}/beside", ALL_OF_IT)
        theirs = await asyncio.create_subprocess_exec(sys.executable, *program, stdin=pipe, stdout=pipe)
        assert theirs.stdin is not None
        try:
            await a.until(lambda: a.has("appeared", token), "they appear")
            await stranger.until(lambda: stranger.has("appeared", token), "they appear there, too")
            theirs.stdin.write(b"theirs\n")
            await a.until(lambda: got.numbers, "they are heard")
            await asyncio.sleep(2.7)
            theirs.stdin.write(b"beside\n")
            await stranger.until(lambda: beside.numbers, "somebody else hears them")
            theirs.send_signal(signal.SIGSTOP)
            await asyncio.sleep(4.5)
            theirs.send_signal(signal.SIGCONT)
            theirs.stdin.write(b"theirs\n")
            await a.until(lambda: len(got.numbers) > 1, "they are heard again")
            assert a.told("vanished") == []
        finally:
            theirs.kill()
            await theirs.wait()
