"""Nodes of two processes."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import Any, TypeAlias

import numpy as np

from actors import Action, Child, Done, Node, Service, Steps, System, Topic, qos, run
from actors.actions import parallel
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Int64, String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.transport import Transport
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.benchmarks._wire import IMAGE, SMALL, Arrivals, Far, Work, calls, stream, ticks

DEEP = qos.DEFAULT.replace(depth=4_000)
TEXTS, STAMPS = Topic(String, "texts", DEEP), Topic(Int64, "stamps", DEEP)
IMAGES = Topic(
    Image, "images", qos.DEFAULT.replace(history=qos.History.KEEP_ALL)
)  # as the others: it waits and loses nothing
ASK, COUNT = Service(Trigger, "ask"), Action(Fibonacci, "count")
SHARED = 48
"""MiB; Zenoh has 16 if it is not told."""
TEXT = String(data="x" * (SMALL - 9))
PICTURE = Image(height=480, width=640, encoding="rgb8", step=1920, data=np.zeros(IMAGE, np.uint8))


Joined: TypeAlias = Callable[[int, Work], Transport]
"""Makes a transport of both ends."""


def zenoh(port: int, work: Work) -> Transport:
    return ZenohTransport(ZenohConfig(gossip_port=port, shared_memory=SHARED if work == "shared" else 0))


@asynccontextmanager
async def system(transport: Transport, kind: Any, *args: object) -> AsyncGenerator[System]:
    async with run(
        Child(kind, name=kind.__name__.lower(), args=args), transport=transport, signals=False, sinks=()
    ) as it:
        yield it


class Near(Node):
    """Sends and asks."""


class Taker(Node):
    """Takes everything."""

    def __init__(self, arrivals: Arrivals, work: Work) -> None:
        self._arrivals = arrivals
        self._work = work

    async def on_start(self) -> None:
        self._take = self._arrivals.take if self._work == "messages" else self._arrivals.first

    @TEXTS.on()
    def text(self, message: String) -> None:
        self._take()

    @IMAGES.on()
    def image(self, message: Image) -> None:
        self._arrivals.take()

    @STAMPS.on()
    def stamp(self, message: Int64) -> None:
        self._arrivals.stamped(message.data)


class Server(Node):
    """Serves."""

    @ASK.serve()
    async def answer(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True)

    @COUNT.serve(arrivals=parallel(16))
    async def count(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        yield Done(Fibonacci.Result(sequence=[0, 1]))


async def far(work: Work, port: int, joined: Joined = zenoh) -> None:
    arrivals = Arrivals(work)
    of_server = work in ("calls", "goals")
    async with system(joined(port, work), *((Server,) if of_server else (Taker, arrivals, work))) as running:
        if work != "first":
            arrivals.ready()
        await running.wait()


async def near(work: Work, port: int, far: Far, joined: Joined = zenoh) -> list[float]:
    async with system(joined(port, work), Near) as running:
        node = running.node("near")
        match work:
            case "messages":
                texts = node.publisher(TEXTS)
                await heard(texts)
                return await stream(work, far, lambda: texts.publish(TEXT))
            case "images" | "shared":
                images = node.publisher(IMAGES)
                await heard(images)
                return await stream(work, far, lambda: images.publish(PICTURE))
            case "latency":
                stamps = node.publisher(STAMPS)
                await heard(stamps)
                return await ticks(far, lambda now: stamps.publish(Int64(data=now)))
            case "calls":
                await node.wait_for(ASK, timeout=20.0)
                return await calls(far, lambda: node.call(ASK, Trigger.Request()))
            case _:
                await node.wait_for(COUNT, timeout=20.0)
                return await calls(far, lambda: goal(node), "goals")


async def goal(node: Node) -> None:
    async with node.send_goal(COUNT, Fibonacci.Goal(order=1)) as running:
        await running


async def heard(publisher: Any) -> None:
    while not publisher.subscription_count:
        await asyncio.sleep(0.01)
    await asyncio.sleep(0.1)


async def until_first(port: int, started: Any, joined: Joined = zenoh) -> float:
    """Seconds from the start of a second process until the first message has arrived there."""
    async with system(joined(port, "first"), Near) as running:
        texts = running.node("near").publisher(TEXTS)
        await asyncio.sleep(0.3)
        began = time.monotonic()
        async with started() as far:
            task = asyncio.ensure_future(far.line())
            while not task.done():
                texts.publish(TEXT)
                await asyncio.sleep(0.001)
            first: float = task.result()
            return first - began
