"""What the benchmark of the wire does with each contestant: this process is the near end, a second one the far end.

A contestant is a module of this package with two functions, `near` and `far`, which know all works of `Work`. The two ends also have the
pipes of the far end's process: it writes a line when it is ready, for each window of messages that has arrived, and with its figures.
"""

from __future__ import annotations

import asyncio
import importlib
import json
import math
import os
import socket
import statistics
import sys
import time
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Literal, TypeAlias

__all__ = ["COUNTS", "IMAGE", "SMALL", "Arrivals", "Far", "Work", "calls", "far_end", "measure", "stream", "ticks"]

Work: TypeAlias = Literal["messages", "latency", "images", "shared", "calls", "goals", "first"]

SMALL = 64
"""Bytes of a message, the head of its format and its length included."""
IMAGE = 921_600
COUNTS: dict[Work, int] = {
    "messages": 60_000,
    "latency": 2_000,
    "images": 400,
    "shared": 2_000,
    "calls": 3_000,
    "goals": 600,
    "first": 1,
}
WINDOWS: dict[Work, int] = {"messages": 500, "images": 4, "shared": 4}
"""So many messages are sent at once; so many are confirmed with one line."""
AHEAD = 4
"""So many windows may be under way, so that nothing is lost and nobody waits for a line."""


class Far:
    """The process of the far end."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    async def line(self) -> Any:
        """The next line that it writes."""
        assert self._process.stdout is not None
        async with asyncio.timeout(20):
            line = await self._process.stdout.readline()
        if not line:
            raise RuntimeError("the far end has ended")
        return json.loads(line)

    @property
    def processor(self) -> float:
        """Seconds of processor time that it has used; NaN where the system does not tell."""
        try:
            text = Path(f"/proc/{self._process.pid}/stat").read_text(encoding="ascii")
        except OSError:
            return math.nan
        fields = text.rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@asynccontextmanager
async def far_end(name: str, work: Work, port: int, *, wait: bool = True) -> AsyncGenerator[Far]:
    """The far end of a contestant, ready unless it is not to be waited for. It is ended with the block."""
    words = (sys.executable, "-m", "tests.benchmarks._wire.far", name, work, str(port))
    process = await asyncio.create_subprocess_exec(
        *words, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE
    )
    try:
        far = Far(process)
        if wait:
            await far.line()
        yield far
    finally:
        process.kill()
        await process.wait()


async def measure(name: str, work: Work) -> list[float]:
    """The figures of one round of a contestant."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
    module = importlib.import_module(f"tests.benchmarks._wire.{name}")
    if work == "first":
        return [1e3 * await module.until_first(port, lambda: far_end(name, work, port, wait=False))]
    async with asyncio.timeout(120), far_end(name, work, port) as far:
        figures: list[float] = await module.near(work, port, far)
        return figures


class Spent:
    """The processor time of both ends from its making on."""

    def __init__(self, far: Far) -> None:
        self._far = far
        self._before = self._now()

    def each(self, count: int) -> float:
        """Microseconds for each of so many."""
        return 1e6 * (self._now() - self._before) / count

    def _now(self) -> float:
        return time.process_time() + self._far.processor


class Arrivals:
    """What the far end says of what arrives. From any thread, one at a time."""

    def __init__(self, work: Work) -> None:
        self._window = WINDOWS.get(work, 0)
        self._count = COUNTS[work]
        self._arrived = 0
        self._late: list[int] = []

    def ready(self) -> None:
        self._say("ready")

    def take(self) -> None:
        """A message has arrived."""
        self._arrived += 1
        if self._arrived % self._window == 0:
            self._say(self._arrived)

    def first(self, _: object = None) -> None:
        """The first message has arrived."""
        if not self._arrived:
            self._say(time.monotonic())
        self._arrived += 1

    def stamped(self, sent_ns: int) -> None:
        """A message has arrived that says when it was sent."""
        self._late.append(time.monotonic_ns() - sent_ns)
        if len(self._late) == self._count:
            cut = statistics.quantiles(self._late, n=100)
            self._say([statistics.median(self._late) / 1e3, cut[98] / 1e3])

    def _say(self, what: object) -> None:
        os.write(1, json.dumps(what).encode() + b"\n")


async def stream(work: Work, far: Far, put: Callable[[], object]) -> list[float]:
    """Messages per second, all of them arrived, and the processor time of both ends for each, in microseconds."""
    window, count = WINDOWS[work], COUNTS[work]
    spent = Spent(far)
    began, sent, arrived = time.perf_counter(), 0, 0
    while arrived < count:
        while sent < count and sent - arrived < AHEAD * window:
            for _ in range(window):
                put()
            sent += window
            await asyncio.sleep(0)
        arrived = await far.line()
    return [count / (time.perf_counter() - began), spent.each(count)]


async def ticks(far: Far, put: Callable[[int], object]) -> list[float]:
    """Messages at 1 kHz: the median and the 99th percentile of their way, microseconds."""
    loop = asyncio.get_running_loop()
    begun = loop.time()
    for number in range(COUNTS["latency"]):
        await asyncio.sleep(begun + number / 1000 - loop.time())
        put(time.monotonic_ns())
    figures: list[float] = await far.line()
    return figures


async def calls(
    far: Far, call: Callable[[], Awaitable[object]], work: Work = "calls", callers: tuple[int, ...] = (1, 16)
) -> list[float]:
    """Answered calls per second, for each number of calls under way at once, and the processor time of both ends for each, in microseconds."""
    rates: list[float] = []
    spent, answered = Spent(far), 0
    for number in callers:
        each = COUNTS[work] // number

        async def ask(times: int = each) -> None:
            for _ in range(times):
                await call()

        began = time.perf_counter()
        await asyncio.gather(*(ask() for _ in range(number)))
        rates.append(each * number / (time.perf_counter() - began))
        answered += each * number
    return [*rates, spent.each(answered)]
