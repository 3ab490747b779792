"""Graphs of many nodes, and a control loop beside a camera."""

from __future__ import annotations

import asyncio
import gc
import time
import tracemalloc
from itertools import pairwise

from actors import Child, Node, Supervisor, Topic, every, publishes, qos, run
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Float64
from tests.benchmarks import Row

VALUES = Topic(Float64, "values", 1)
PICTURES = Topic(Image, "pictures", qos.SENSOR_DATA)
SIZES = (10, 100, 300)
LOOKED_AT = 3.0
"""For how long the share of a core is measured, s."""
HZ = 500
SECONDS = 10.0


class Member(Node):
    """Publishes ten times a second, as nodes of a graph do."""

    out = publishes(VALUES)

    @every(hz=10)
    def tick(self) -> None:
        self.out(Float64(data=self.clock.now()))


class Control(Node):
    """A control loop that notes when each tick comes."""

    def __init__(self) -> None:
        self.at: list[float] = []

    @every(hz=HZ)
    def tick(self) -> None:
        self.at.append(time.monotonic())


class Camera(Node):
    """Publishes pictures of 921,600 bytes, 30.3 a second."""

    out = publishes(PICTURES)

    @every(period=0.033)
    def shoot(self) -> None:
        self.out(Image(height=480, width=640, encoding="rgb8", step=1920, data=bytes(921_600)))


class Viewer(Node):
    """Takes the pictures."""

    @PICTURES.on()
    def look(self, message: Image) -> None:
        assert len(message.data) == 921_600


async def _graph(size: int) -> tuple[float, float]:
    """Seconds to start so many nodes, and the share of a core in per cent while each publishes 10 times a second."""
    begun = time.perf_counter()
    children = [Child(Member, name=f"member_{number}") for number in range(size)]
    async with run(Supervisor("graph", children=children), sinks=(), signals=False):
        started = time.perf_counter() - begun
        used = time.process_time()
        await asyncio.sleep(LOOKED_AT)
        return started, (time.process_time() - used) / LOOKED_AT * 100


async def _memory(size: int) -> float:
    """Kilobytes of Python objects that each of so many nodes takes."""
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        children = [Child(Member, name=f"member_{number}") for number in range(size)]
        async with run(Supervisor("graph", children=children), sinks=(), signals=False):
            gc.collect()
            return (tracemalloc.get_traced_memory()[0] - before) / size / 1e3
    finally:
        tracemalloc.stop()


async def _control(*others: type[Node]) -> tuple[float, float, float, int]:
    """By how much periods differ from 2 ms, in us: median, 99th percentile and worst; and how many ticks were missed."""
    async with run(Child(Control), *map(Child, others), sinks=(), signals=False) as system:
        await asyncio.sleep(SECONDS)
        at = system.node(Control).at
    errors = sorted(abs(after - before - 1 / HZ) * 1e6 for before, after in pairwise(at))
    missed = round((at[-1] - at[0]) * HZ) + 1 - len(at)
    return errors[len(errors) // 2], errors[len(errors) * 99 // 100], errors[-1], missed


def rows() -> list[Row]:
    """Graphs of 10, 100 and 300 nodes, and a control loop with and without a camera in the same process."""
    found: list[Row] = []
    asyncio.run(_graph(1))  # what the first system of a process imports is not of the nodes
    for size in SIZES:
        started, share = asyncio.run(_graph(size))
        work = "nodes that publish 10 times a second (hundreds of nodes)"
        found += [
            Row(work, f"{size} nodes", "ms to start", started * 1e3, "ours"),
            Row(work, f"{size} nodes", "% of a core", share, "ours"),
            Row(work, f"{size} nodes", "kB each", asyncio.run(_memory(size)), "ours"),
        ]
    for name, others in (("alone", ()), ("beside a camera of 28 MB/s", (Camera, Viewer))):
        figures = asyncio.run(_control(*others))
        work = f"a control loop of {HZ} Hz, {SECONDS:g} s (real-time control at 500 Hz)"
        for unit, value in zip(("us p50", "us p99", "us worst", "ticks missed"), figures, strict=True):
            found.append(Row(work, name, unit, value, "ours"))
    return found
