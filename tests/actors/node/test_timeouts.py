"""A timeout that is no number is refused at once, by every method that takes one, whether or not there is somebody to wait for."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from decimal import Decimal
from typing import Any

import pytest

from actors import Child, Node, Topic, graph_of, publishes, retry, subscribes
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.parameters.client import ParameterClient
from actors.testing import Rig
from actors.tf2 import Buffer, BufferClient
from tests.stage import ADD, COUNT, total

SILENT = Topic(Int32, "silent")
USES: dict[str, Callable[[Node, Any], Awaitable[Any]]] = {
    "call": lambda me, timeout: me.call(ADD, AddTwoInts.Request(a=1, b=2), timeout=timeout),
    "retry": lambda me, timeout: retry(me, ADD, AddTwoInts.Request(a=1, b=2), timeout=timeout),
    "start": lambda me, timeout: me.send_goal(COUNT, Fibonacci.Goal(order=1), timeout=timeout).send(),
    "wait_for": lambda me, timeout: me.wait_for(ADD, timeout=timeout),
    "next": lambda me, timeout: me.subscribe(SILENT).next(timeout),
    "events of a publisher": lambda me, timeout: me.publisher(SILENT).events().next(timeout),
    "events of a stream": lambda me, timeout: me.subscribe(SILENT).events().next(timeout),
    "wait_for_node": lambda me, timeout: graph_of(me).wait_for_node("/nobody", timeout=timeout),
    "wait_for_publishers": lambda me, timeout: graph_of(me).wait_for_publishers("silent", timeout=timeout),
    "parameters": lambda me, timeout: ParameterClient(me, "adder", timeout=timeout).get("x"),
    "lookup": lambda me, timeout: Buffer().lookup_transform_async("a", "b", timeout=timeout),
    "remote lookup": lambda me, timeout: BufferClient(me, timeout_padding=timeout).lookup_transform_async("a", "b"),
}
NO_LIMIT = ("retry", "wait_for", "next", "events", "wait_for_", "lookup")
"""The beginnings of those for which None is no limit, or the default."""


class Adder(Node):
    """Adds at once."""

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total(request.a + request.b)


class Me(Node):
    """Uses what others serve."""

    out = publishes(SILENT)
    numbers = subscribes(SILENT)


@pytest.mark.parametrize("served", [False, True])
@pytest.mark.parametrize("timeout", [None, math.nan, "1", True, Decimal(1), [1.0]])
@pytest.mark.parametrize("use", USES)
async def test_no_number(rig: Rig, use: str, timeout: object, served: bool) -> None:
    if timeout is None and use.startswith(NO_LIMIT):
        return
    await rig.start(Me, *([Adder] if served else []))
    before = rig.now
    with pytest.raises(ValueError, match="must be a number of seconds"):
        await USES[use](rig.node(Me), timeout)
    assert rig.now == before


@pytest.mark.parametrize("timeout", [math.inf, 2, 2.0])
async def test_a_number(rig: Rig, timeout: float) -> None:
    await rig.start(Me)
    waiting = asyncio.create_task(rig.node(Me).call(ADD, AddTwoInts.Request(a=1, b=2), timeout=timeout))
    await rig.advance(1.0)
    await rig.system.supervisor.start_child(Child(Adder))
    assert (await waiting).sum == 3
