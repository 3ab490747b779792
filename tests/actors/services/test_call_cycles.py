"""Handlers that wait for themselves by way of tasks and concurrent services: their timeout says so, and no other does."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from actors import CallTimeout, Child, Node, Service, ServiceFailed, Topic
from actors.errors import CallCycle
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Rig
from tests.facts import lacks

Request, Response = AddTwoInts.Request, AddTwoInts.Response
OWN, BACK, CONCURRENT, SLOW, RELAY = (Service(AddTwoInts, name) for name in ("own", "back", "concurrent", "slow", "relay"))  # fmt: skip
GO = Topic(Int32, "go")


class Asker(Node):
    """Serves `own`, and in `go` asks in a way that a test chooses; `said` is what became of it."""

    ask: Callable[[Asker], Awaitable[Any]]
    said: Any = None

    @OWN.serve()
    async def own(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return Response(sum=1)

    @GO.on()
    async def go(self, message: Int32) -> None:
        try:
            self.said = await type(self).ask(self)
        except BaseExceptionGroup as group:
            self.said = group.exceptions[0]
        except Exception as error:
            self.said = error


class Other(Node):
    """Asks back into the asker, or takes its time."""

    @BACK.serve()
    async def back(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return await self.call(OWN, Request())

    @CONCURRENT.serve(concurrent=2)
    async def concurrent(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return await self.call(OWN, Request())

    @RELAY.serve(concurrent=2)
    async def relay(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return await self.call(CONCURRENT, Request())

    @SLOW.serve(concurrent=2)
    async def slow(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await self.clock.sleep(30.0)
        return Response()


async def outcome(rig: Rig, ask: Callable[[Asker], Awaitable[Any]]) -> Any:
    kind = type("Asker", (Asker,), {"ask": ask, "__doc__": "Asks."})
    await rig.start(Child(kind, name="asker"), Child(Other, name="other"))
    rig.publish(GO, Int32())
    await rig.advance(40.0)
    return rig.node(kind).said


async def in_group(node: Asker, asked: Awaitable[Any]) -> None:
    async def work() -> None:
        await asked

    async with asyncio.TaskGroup() as group:
        group.create_task(work())


async def created(node: Asker) -> object:
    said: list[object] = []

    async def work() -> None:
        try:
            said.append(await node.call(OWN, Request()))
        except CallTimeout as late:  # else it would be the node's failure
            said.append(late)

    await node.create_task(work())
    return said[0]


ITSELF: dict[str, Callable[[Asker], Awaitable[Any]]] = {
    "gather": lambda node: asyncio.gather(node.call(OWN, Request())),
    "TaskGroup": lambda node: in_group(node, node.call(OWN, Request())),
    "create_task": lambda node: asyncio.create_task(node.call(OWN, Request())),
    "shield": lambda node: asyncio.shield(node.call(OWN, Request())),
    "Node.create_task": created,
}


@pytest.mark.parametrize("way", ITSELF)
async def test_a_handler_that_waits_for_its_own_node_through_a_task_is_told_so(rig: Rig, way: str) -> None:
    late = await outcome(rig, ITSELF[way])
    assert isinstance(late, CallTimeout)
    assert lacks(str(late), "/asker /own cycle Asker.go concurrent=n") == []


async def test_wait_for_is_named_at_once_or_when_it_is_late(rig: Rig) -> None:
    named = await outcome(rig, lambda node: asyncio.wait_for(node.call(OWN, Request()), 5.0))
    assert isinstance(named, CallCycle) or "a cycle of calls: /asker (Asker.go)" in str(named)


CHAINS: dict[str, tuple[Callable[[Asker], Awaitable[Any]], str]] = {
    "concurrent": (lambda node: node.call(CONCURRENT, Request()), "/concurrent of /other, which waits for /own of /asker"),
    "gathered": (lambda node: asyncio.gather(node.call(BACK, Request())), "/back of /other, which waits for /own of /asker"),
    "two in between": (
        lambda node: asyncio.gather(node.call(RELAY, Request())),
        "/relay of /other, which waits for /concurrent of /other, which waits for /own of /asker",
    ),
}  # fmt: skip


@pytest.mark.parametrize("chain", CHAINS)
async def test_a_cycle_over_other_nodes_is_told_link_by_link(rig: Rig, chain: str) -> None:
    ask, links = CHAINS[chain]
    late = await outcome(rig, ask)
    assert isinstance(late, CallTimeout)
    assert f"a cycle of calls: /asker (Asker.go) waits for {links}, which waits for that handler to end;" in str(late)


async def test_a_start_that_waits_for_its_own_node_is_told_so(rig: Rig) -> None:
    class Starter(Asker):
        """Asks itself before it serves."""

        async def on_start(self) -> None:
            try:
                await asyncio.gather(self.call(OWN, Request()))
            except CallTimeout as late:
                self.said = late

    await rig.start(Starter)
    assert "/starter (its start or end) waits for /own of /starter" in str(rig.node(Starter).said)


async def unawaited(node: Asker) -> str:
    background = asyncio.create_task(node.call(OWN, Request()))
    await node.clock.sleep(2.0)  # holds the inbox, and waits for nobody
    return str(background.exception())


async def in_an_open_group(node: Asker) -> str:
    try:
        async with asyncio.TaskGroup() as group:
            group.create_task(node.call(OWN, Request()))
            await node.clock.sleep(2.0)
    except BaseExceptionGroup as errors:
        return str(errors.exceptions[0])
    return "answered"


async def slow(node: Asker) -> str:
    try:
        await asyncio.gather(node.call(SLOW, Request()))
    except CallTimeout as late:
        return str(late)
    return "answered"


async def many(node: Asker) -> str:
    """Calls that wait for nothing of ours, and one of our own that nobody awaits."""
    others = [asyncio.create_task(node.call(SLOW, Request())) for _ in range(5)]
    done, _ = await asyncio.wait(others)
    return str(next(iter(done)).exception())


@pytest.mark.parametrize("ask", [unawaited, in_an_open_group, slow, many])
async def test_who_is_only_slow_is_not_accused(rig: Rig, ask: Callable[[Asker], Awaitable[str]]) -> None:
    said = await outcome(rig, ask)
    assert said.endswith("in time: give the call more time, or make it an action")


async def test_a_handler_that_awaits_the_call_itself_is_refused_at_once(rig: Rig) -> None:
    assert isinstance(await outcome(rig, lambda node: node.call(OWN, Request())), CallCycle)


async def test_a_call_back_into_a_waiting_caller_is_refused_at_once(rig: Rig) -> None:
    failed = await outcome(rig, lambda node: node.call(BACK, Request()))
    assert isinstance(failed, ServiceFailed)
    assert failed.type == "CallCycle"
