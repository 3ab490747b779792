"""Callbacks that compute or wait: one after another in the node, and side by side in the pool of worker threads."""

from __future__ import annotations

import asyncio
import threading
import time

from actors import Child, Node, Service, Topic, publishes, run
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Float64
from tests.benchmarks import Row

WORK = 0.01
"""How long a callback blocks, s."""
CALLBACKS = 4
FRAMES = 150
CALLS = 3000
JOBS = Topic(Float64, "jobs", 100)
ADD = Service(AddTwoInts, "add")


class Source(Node):
    """Publishes what it is told to."""

    out = publishes(JOBS)


class Sequential(Node):
    """Blocks its event loop for each message."""

    def __init__(self) -> None:
        self.ages: list[float] = []

    @JOBS.on()
    def work(self, message: Float64) -> None:
        time.sleep(WORK)
        self.ages.append(time.monotonic() - message.data)


class Parallel(Node):
    """Gives each message to a worker thread."""

    def __init__(self) -> None:
        self.ages: list[float] = []

    @JOBS.on(concurrent=CALLBACKS)
    async def work(self, message: Float64) -> None:
        await self.offload(time.sleep, WORK, thread=True)
        self.ages.append(time.monotonic() - message.data)


class Adder(Node):
    """Adds."""

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)


async def _burst(kind: type[Sequential] | type[Parallel]) -> float:
    """Seconds for as many messages as there are callbacks, all at once."""
    async with run(Child(kind), Child(Source), sinks=(), signals=False) as system:
        node, begun = system.node(kind), time.monotonic()
        for _ in range(CALLBACKS):
            system.node(Source).out(Float64(data=begun))
        while len(node.ages) < CALLBACKS:
            await asyncio.sleep(0.0005)
        return max(node.ages)


async def _stream() -> tuple[float, int]:
    """Thirty messages a second into callbacks of `WORK` seconds in the pool: the greatest age, and how many threads there were."""
    async with run(Child(Parallel), Child(Source), sinks=(), signals=False) as system:
        node, threads = system.node(Parallel), 0
        for _ in range(FRAMES):
            system.node(Source).out(Float64(data=time.monotonic()))
            await asyncio.sleep(1 / 30)
            threads = max(threads, threading.active_count())
        return max(node.ages), threads


async def _round_trips() -> list[float]:
    found: list[float] = []
    async with run(Child(Adder), Child(Node, name="client"), sinks=(), signals=False) as system:
        client = system.node("client")
        for number in range(CALLS):
            begun = time.perf_counter()
            await client.call(ADD, AddTwoInts.Request(a=number, b=1))
            found.append((time.perf_counter() - begun) * 1e6)
    return sorted(found)


def rows() -> list[Row]:
    """Sequential and parallel callbacks, the camera with its work in the pool, and round trips of a service."""
    sequential, parallel = asyncio.run(_burst(Sequential)), asyncio.run(_burst(Parallel))
    work = "four callbacks that block for 10 ms each (a multi-threaded executor is 2 to 3 times as fast)"
    age, threads = asyncio.run(_stream())
    pool = "30 Hz into callbacks of 10 ms in worker threads (a parallel executor cures the delay; a thread for each message)"
    trips = asyncio.run(_round_trips())
    service = "a service's round trip in one process (less than 1 s, or milliseconds)"
    return [
        Row(work, "one after another", "ms", sequential * 1e3, "ours"),
        Row(work, "in worker threads", "ms", parallel * 1e3, "ours"),
        Row(pool, "oldest message", "ms", age * 1e3, "ours"),
        Row(pool, "threads at most", "threads", threads, "ours"),
        Row(service, "one at a time", "us p50", trips[len(trips) // 2], "ours"),
        Row(service, "one at a time", "us p99", trips[len(trips) * 99 // 100], "ours"),
        Row(service, "one at a time", "% below 1 ms", 100 * sum(trip < 1000 for trip in trips) / len(trips), "ours"),
    ]
