"""Fans: what it costs to start and to stop many nodes that share one topic, and how long the event loop is busy at a stretch meanwhile.

A prober task asks for a turn all the time: the longest time between two of its turns is the longest stretch. Python's garbage
collector stops the loop, too, the longer the more objects there are, whoever made them; it does not run while the figures are taken.
The floor are as many nodes without any endpoint.
"""

from __future__ import annotations

import asyncio
import gc
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

from actors import Child, Node, Supervisor, Topic, publishes
from actors import run as run_system
from actors.interfaces.std_msgs.msg import Int32
from tests.benchmarks import Contestant, Row, contest
from tests.benchmarks._peers import clock, on_loop

NUMBERS = Topic(Int32, "numbers", 10)
ALL_TO_ALL = 500
READERS = 4_999


def run() -> list[Row]:
    units = ["ms to start", "ms to stop", "ms at a stretch, longest"]
    return [
        *contest(
            f"{ALL_TO_ALL} nodes that publish and take one topic",
            units,
            [
                Contestant("all to all", "ours", lambda: _measured([Child(Both, name=f"n{k}") for k in range(ALL_TO_ALL)])),
                Contestant("nodes without endpoints", "floor", lambda: _measured(_empty(ALL_TO_ALL))),
            ],
            rounds=3,
        ),
        *contest(
            f"1 publisher, {READERS:,} readers",
            units,
            [
                Contestant(
                    "one to many",
                    "ours",
                    lambda: _measured([Child(Writer), *(Child(Reader, name=f"n{k}") for k in range(READERS))]),
                ),
                Contestant("nodes without endpoints", "floor", lambda: _measured(_empty(READERS + 1))),
            ],
            rounds=3,
        ),
    ]  # fmt: skip


class Writer(Node):
    out = publishes(NUMBERS)


class Reader(Node):
    @NUMBERS.on()
    def take(self, message: Int32) -> None: ...


class Both(Node):
    out = publishes(NUMBERS)

    @NUMBERS.on()
    def take(self, message: Int32) -> None: ...


class Empty(Node):
    pass


def _empty(count: int) -> list[Child]:
    return [Child(Empty, name=f"n{k}") for k in range(count)]


def _measured(children: Sequence[Child]) -> Sequence[float]:
    """Milliseconds to start, to stop, and of the longest stretch."""
    return on_loop(lambda: _started_and_stopped(Supervisor("fan", children=list(children))))


async def _started_and_stopped(tree: Supervisor) -> tuple[float, float, float]:
    async with _probed() as longest:
        begin = clock()
        async with run_system(tree, sinks=()):
            started = clock()
        return (started - begin) * 1e3, (clock() - started) * 1e3, longest[0] * 1e3


@asynccontextmanager
async def _probed() -> AsyncIterator[list[float]]:
    """The longest time in seconds for which the loop gave a task no turn, so far."""
    longest = [0.0]

    async def probe() -> None:
        last = clock()
        while True:
            await asyncio.sleep(0)
            now = clock()
            longest[0] = max(longest[0], now - last)
            last = now

    gc.collect()
    gc.disable()
    task = asyncio.create_task(probe())
    try:
        yield longest
    finally:
        gc.enable()
        task.cancel()
        await asyncio.wait([task])
