"""Simulated time: events per second of the processor with six periodic handlers at 10 to 500 Hz, synchronous and awaiting ones.

Then six nodes at those rates: how much faster than the clock on the wall they live.
"""

from __future__ import annotations

import asyncio
import heapq
import importlib
import time
from collections.abc import Awaitable, Callable, Generator
from typing import Any

from actors import Child, Node, Supervisor, background, every
from actors import run as run_tree
from actors.time.ticker import Ticker
from actors.time.virtual_loop import VirtualLoop
from tests.benchmarks import Contestant, Row, contest

RATES = (10, 50, 100, 200, 400, 500)
LONG, SHORT = 20.0, 1.0
"""Simulated seconds of a round; the short one is for a peer that needs it."""
WAKES = 5000
"""Of each of the six tasks that wait without a clock."""


def run() -> list[Row]:
    callbacks = [
        Contestant("Ticker on VirtualLoop", "ours", _ticker),
        Contestant("call_at on VirtualLoop", "ours", lambda: _on_loop(_callbacks, VirtualLoop)),
        Contestant("heapq and a function call", "floor", _heap_of_functions),
        Contestant("simpy events with callbacks", "peer", _simpy_callbacks, needs="simpy"),
        Contestant("call_at on aiotools.VirtualClock", "peer", lambda: _on_aiotools(_callbacks), needs="aiotools"),
        Contestant("call_at on looptime", "peer", lambda: _on_looptime(_callbacks), needs="looptime"),
    ]
    awaiting = [
        Contestant("sleep_until on VirtualLoop", "ours", lambda: _on_loop(_sleep_until, VirtualLoop)),
        Contestant("asyncio.sleep on VirtualLoop", "ours", lambda: _on_loop(_sleep, VirtualLoop)),
        Contestant("heapq and generators", "floor", _heap_of_generators),
        Contestant("futures on asyncio's loop, no clock at all", "floor", _futures),
        Contestant("simpy processes", "peer", _simpy_processes, needs="simpy"),
        Contestant("asyncio.sleep on aiotools.VirtualClock", "peer", lambda: _on_aiotools(_sleep), needs="aiotools"),
        Contestant("asyncio.sleep on looptime", "peer", lambda: _on_looptime(_sleep), needs="looptime"),
    ]
    nodes = [
        Contestant("handlers with @every", "ours", lambda: _nodes(_ticking)),
        Contestant("loops that sleep_until", "ours", lambda: _nodes(_sleeping)),
    ]
    return [
        *contest("periodic callbacks in simulated time", ["events per CPU second"], callbacks),
        *contest("periodic tasks in simulated time", ["events per CPU second"], awaiting),
        *contest("six nodes at 10 to 500 Hz", ["simulated seconds per CPU second"], nodes),
    ]


class _Count:
    """Events seen, and the time of the processor since the first possible one: other programs' load does not count."""

    def __init__(self) -> None:
        self.events = 0
        self.begin = time.process_time()

    def rate(self) -> tuple[float]:
        return (self.events / (time.process_time() - self.begin),)


# -------------------------------------------------------------------------------------------------- floor


def _heap_of_functions() -> tuple[float]:
    count = _Count()

    def handler(k: int, due: float) -> None:
        count.events += 1

    heap: list[tuple[float, int, int, int, Callable[[int, float], None]]]
    heap = [(1 / hz, order, hz, 1, handler) for order, hz in enumerate(RATES)]
    heapq.heapify(heap)
    while heap[0][0] <= LONG:
        due, order, hz, k, function = heap[0]
        heapq.heapreplace(heap, ((k + 1) / hz, order, hz, k + 1, function))
        function(k, due)
    return count.rate()


def _heap_of_generators() -> tuple[float]:
    count = _Count()

    def handler(hz: int) -> Generator[float, None, None]:
        k = 0
        while True:
            k += 1
            yield k / hz
            count.events += 1

    heap: list[tuple[float, int, Generator[float, None, None]]] = []
    for order, hz in enumerate(RATES):
        generator = handler(hz)
        heap.append((next(generator), order, generator))
    heapq.heapify(heap)
    while heap[0][0] <= LONG:
        _, order, generator = heap[0]
        heapq.heapreplace(heap, (generator.send(None), order, generator))
    return count.rate()


def _futures() -> tuple[float]:
    """What a task costs that waits for one future after another: the limit of everything that is built on asyncio."""

    async def handler(count: _Count) -> None:
        loop = asyncio.get_running_loop()
        for _ in range(WAKES):
            future = loop.create_future()
            loop.call_soon(future.set_result, None)
            await future
            count.events += 1

    async def main() -> tuple[float]:
        count = _Count()
        await asyncio.gather(*(handler(count) for _ in RATES))
        return count.rate()

    return asyncio.run(main())


# -------------------------------------------------------------------------------------------------- nodes


def _ticking(hz: int) -> type[Node]:
    class Ticking(Node):
        @every(hz=hz)
        def tick(self) -> None: ...

    return Ticking


def _sleeping(hz: int) -> type[Node]:
    class Sleeping(Node):
        @background
        async def work(self) -> None:
            start, k = self.clock.now(), 0
            while True:
                k += 1
                await self.clock.sleep_until(start + k / hz)

    return Sleeping


def _nodes(make: Callable[[int], type[Node]]) -> tuple[float]:
    tree = Supervisor("six", children=[Child(make(hz), name=f"node_{hz}") for hz in RATES])

    async def main() -> tuple[float]:
        async with run_tree(tree, signals=False, sinks=()) as system:
            begin = time.process_time()
            await system.clock.sleep(LONG)
            return (LONG / (time.process_time() - begin),)

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(main())


# -------------------------------------------------------------------------------------------------- event loops


def _ticker() -> tuple[float]:
    async def main() -> tuple[float]:
        count = _Count()

        def handler(k: int, due: float) -> None:
            count.events += 1

        ticker = Ticker(asyncio.get_running_loop())
        for hz in RATES:
            ticker.add(hz, handler)
        await asyncio.sleep(LONG)
        return count.rate()

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(main())


async def _callbacks(count: _Count, seconds: float) -> None:
    loop = asyncio.get_running_loop()
    start = loop.time()

    def handler(hz: int, k: int) -> None:
        count.events += 1
        loop.call_at(start + (k + 1) / hz, handler, hz, k + 1)

    for hz in RATES:
        loop.call_at(start + 1 / hz, handler, hz, 1)
    await asyncio.sleep(seconds)


async def _sleep(count: _Count, seconds: float) -> None:
    async def handler(hz: int) -> None:
        loop = asyncio.get_running_loop()
        start, k = loop.time(), 0
        while True:
            k += 1
            await asyncio.sleep(start + k / hz - loop.time())
            count.events += 1

    await _tasks(handler, seconds)


async def _sleep_until(count: _Count, seconds: float) -> None:
    async def handler(hz: int) -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        start, k = loop.time(), 0
        while True:
            k += 1
            await loop.sleep_until(start + k / hz)
            count.events += 1

    await _tasks(handler, seconds)


async def _tasks(handler: Callable[[int], Any], seconds: float) -> None:
    tasks = [asyncio.ensure_future(handler(hz)) for hz in RATES]
    await asyncio.sleep(seconds)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def _counted(work: Callable[[_Count, float], Awaitable[None]], seconds: float) -> tuple[float]:
    count = _Count()
    await work(count, seconds)
    return count.rate()


def _on_loop(
    work: Callable[[_Count, float], Awaitable[None]], factory: Callable[[], asyncio.AbstractEventLoop]
) -> tuple[float]:
    with asyncio.Runner(loop_factory=factory) as runner:
        return runner.run(_counted(work, LONG))


def _on_looptime(work: Callable[[_Count, float], Awaitable[None]]) -> tuple[float]:
    with asyncio.Runner(loop_factory=importlib.import_module("looptime").new_event_loop) as runner:
        return runner.run(_counted(work, SHORT))


def _on_aiotools(work: Callable[[_Count, float], Awaitable[None]]) -> tuple[float]:
    async def main() -> tuple[float]:
        with importlib.import_module("aiotools").VirtualClock().patch_loop():
            return await _counted(work, LONG)

    return asyncio.run(main())


# -------------------------------------------------------------------------------------------------- simpy


def _simpy_callbacks() -> tuple[float]:
    simpy = importlib.import_module("simpy")
    environment = simpy.Environment()
    count = _Count()

    def arm(hz: int, k: int) -> None:
        event = environment.timeout(k / hz - environment.now)

        def handler(_: Any) -> None:
            count.events += 1
            arm(hz, k + 1)

        event.callbacks.append(handler)

    for hz in RATES:
        arm(hz, 1)
    environment.run(until=LONG)
    return count.rate()


def _simpy_processes() -> tuple[float]:
    simpy = importlib.import_module("simpy")
    environment = simpy.Environment()
    count = _Count()

    def handler(hz: int) -> Generator[Any, None, None]:
        k = 0
        while True:
            k += 1
            yield environment.timeout(k / hz - environment.now)
            count.events += 1

    for hz in RATES:
        environment.process(handler(hz))
    environment.run(until=LONG)
    return count.rate()
