"""Topics: one publisher and one or four readers, message by message (the next is sent when all have it) and in bursts of ten.

What is counted are deliveries. The floor is a deque and a future per reader, the least that hands a value to a task.
"""

from __future__ import annotations

import asyncio
import importlib
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from typing import Any, TypeAlias

from actors import Child, Node, Supervisor, Topic, publishes
from actors.interfaces.std_msgs.msg import Int32
from tests.benchmarks import Contestant, Row, contest
from tests.benchmarks._peers import Span, living, node_of, on_loop, pykka_actors, xoscar_pool

NUMBERS = Topic(Int32, "numbers", 100)
MESSAGE = Int32(data=1)
DELIVERIES = 8_000
"""Of each round, one message at a time; the dearer peers do a tenth. Bursts do three times as many."""

Measure: TypeAlias = Callable[[int, int, int], tuple[float]]
"""(readers, burst, deliveries) -> deliveries per second."""


def run() -> list[Row]:
    rows: list[Row] = []
    for readers, burst in ((1, 1), (4, 1), (1, 10), (4, 10)):
        how = "one in flight" if burst == 1 else f"bursts of {burst}"
        contestants = [
            _contestant("plain handlers of nodes", "ours", _handlers(_Plain), readers, burst),
            _contestant("async handlers of nodes", "ours", _handlers(_Async), readers, burst),
            _contestant("streams of nodes", "ours", _handlers(_Streaming), readers, burst),
            _contestant("deque and future", "floor", _bare, readers, burst),
            _contestant("asyncio.Queue", "peer", _queues, readers, burst),
            _contestant("anyio memory stream", "peer", _streams, readers, burst, needs="anyio"),
            _contestant("xoscar, tell", "peer", _xoscar, readers, burst, needs="xoscar", share=10),
            _contestant(
                "pykka, ask" if burst == 1 else "pykka, tell", "peer", _pykka, readers, burst, needs="pykka", share=10
            ),
        ]
        rows += contest(f"topic 1->{readers}, {how}", ["deliveries per CPU second"], contestants)
    return rows


def _contestant(
    name: str, kind: Any, measure: Measure, readers: int, burst: int, *, needs: str = "", share: int = 1
) -> Contestant:
    deliveries = DELIVERIES * (1 if burst == 1 else 3) // share
    return Contestant(name, kind, lambda: measure(readers, burst, deliveries), needs)


class _Reading:
    """What readers have got so far."""

    def __init__(self) -> None:
        self.count = 0

    async def drive(self, send: Callable[[], object], readers: int, burst: int, deliveries: int) -> tuple[float]:
        """Send bursts, each when the one before has arrived everywhere."""
        span = Span()
        while self.count < deliveries:
            wanted = self.count + readers * burst
            for _ in range(burst):
                send()
            while self.count < wanted:
                await asyncio.sleep(0)
        return span.rate(self.count)


# -------------------------------------------------------------------------------------------------- ours


class _Source(Node):
    out = publishes(NUMBERS)


class _Plain(Node):
    def __init__(self, reading: _Reading) -> None:
        self.reading = reading

    @NUMBERS.on()
    def take(self, message: Int32) -> None:
        self.reading.count += message.data


class _Async(Node):
    def __init__(self, reading: _Reading) -> None:
        self.reading = reading

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        self.reading.count += message.data


class _Streaming(Node):
    def __init__(self, reading: _Reading) -> None:
        self.reading = reading

    async def on_start(self) -> None:
        self.create_task(self.read())

    async def read(self) -> None:
        async for message in self.subscribe(NUMBERS):
            self.reading.count += message.data


def _handlers(kind: Callable[[_Reading], Node]) -> Measure:
    def measure(readers: int, burst: int, deliveries: int) -> tuple[float]:
        async def main() -> tuple[float]:
            reading = _Reading()
            sinks = [Child(kind, name=f"sink_{index}", args=[reading]) for index in range(readers)]
            async with living(Supervisor("topics", children=[*sinks, Child(_Source, name="source")])) as system:
                await asyncio.sleep(0)
                out = node_of(system, _Source, "/source").out
                return await reading.drive(lambda: out.publish(MESSAGE), readers, burst, deliveries)

        return on_loop(main)

    return measure


# -------------------------------------------------------------------------------------------------- floor


class _Cell:
    """A deque and the future of the task that waits for it."""

    def __init__(self) -> None:
        self.messages: deque[Int32] = deque()
        self.waiter: asyncio.Future[None] | None = None

    def put(self, message: Int32) -> None:
        self.messages.append(message)
        if self.waiter is not None:
            self.waiter.set_result(None)
            self.waiter = None

    async def read(self, reading: _Reading) -> None:
        loop = asyncio.get_running_loop()
        messages = self.messages
        while True:
            while messages:
                reading.count += messages.popleft().data
            self.waiter = waiter = loop.create_future()
            await waiter


def _bare(readers: int, burst: int, deliveries: int) -> tuple[float]:
    async def main() -> tuple[float]:
        reading = _Reading()
        cells = [_Cell() for _ in range(readers)]

        def send() -> None:
            for cell in cells:
                cell.put(MESSAGE)

        return await _with_tasks([cell.read(reading) for cell in cells], reading, send, readers, burst, deliveries)

    return on_loop(main)


# -------------------------------------------------------------------------------------------------- peers


async def _with_tasks(
    works: list[Any], reading: _Reading, send: Callable[[], object], readers: int, burst: int, deliveries: int
) -> tuple[float]:
    tasks = [asyncio.ensure_future(work) for work in works]
    await asyncio.sleep(0)
    try:
        return await reading.drive(send, readers, burst, deliveries)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _queues(readers: int, burst: int, deliveries: int) -> tuple[float]:
    async def main() -> tuple[float]:
        reading = _Reading()
        queues: list[asyncio.Queue[Int32]] = [asyncio.Queue(100) for _ in range(readers)]

        async def read(queue: asyncio.Queue[Int32]) -> None:
            while True:
                message = await queue.get()
                reading.count += message.data

        def send() -> None:
            for queue in queues:
                queue.put_nowait(MESSAGE)

        return await _with_tasks([read(queue) for queue in queues], reading, send, readers, burst, deliveries)

    return on_loop(main)


def _streams(readers: int, burst: int, deliveries: int) -> tuple[float]:
    anyio: Any = importlib.import_module("anyio")

    async def main() -> tuple[float]:
        reading = _Reading()
        pairs: list[Any] = [anyio.create_memory_object_stream(100) for _ in range(readers)]

        async def read(stream: Any) -> None:
            async for message in stream:
                reading.count += message.data

        def send() -> None:
            for sender, _ in pairs:
                sender.send_nowait(MESSAGE)

        async with AsyncExitStack() as ends:
            for pair in pairs:
                for end in pair:
                    await ends.enter_async_context(end)
            works = [read(receiver) for _, receiver in pairs]
            return await _with_tasks(works, reading, send, readers, burst, deliveries)

    return on_loop(main)


def take(self: Any, message: Int32, reading: _Reading) -> None:
    """The one method of the actors of peers."""
    reading.count += message.data


def _xoscar(readers: int, burst: int, deliveries: int) -> tuple[float]:
    async def main() -> tuple[float]:
        reading = _Reading()
        async with xoscar_pool(readers, take) as (_, _, actors):
            span = Span()
            while reading.count < deliveries:
                wanted = reading.count + readers * burst
                for _ in range(burst):
                    told: list[Awaitable[None]] = [actor.take.tell(MESSAGE, reading) for actor in actors]
                    for one in told:
                        await one
                while reading.count < wanted:
                    await asyncio.sleep(0)
            return span.rate(reading.count)

    return on_loop(main)


def _pykka(readers: int, burst: int, deliveries: int) -> tuple[float]:
    reading = _Reading()
    with pykka_actors(readers, on_receive) as actors:
        span = Span()
        done = 0
        while done < deliveries:
            for _ in range(burst - 1):
                for actor in actors:
                    actor.tell((MESSAGE, reading))
            for answer in [actor.ask((MESSAGE, reading), block=False) for actor in actors]:
                answer.get()
            done += readers * burst
        return span.rate(done)


def on_receive(self: Any, message: tuple[Int32, _Reading]) -> None:
    """The handler of Pykka's actors: they are threads, so what they count together is not exact and not used."""
    message[1].count += message[0].data
