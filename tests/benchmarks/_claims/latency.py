"""From a publisher to a callback within one process, for small and large messages, and beside a camera's load."""

from __future__ import annotations

import asyncio
import time

from actors import Child, Node, System, Topic, publishes, qos, run
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header
from tests.benchmarks import Row

IMAGES = Topic(Image, "images", qos.SENSOR_DATA)
SIZES = (64, 921_600)
ROUNDS = 2000
SECONDS = 1.0
"""For how long messages are published as fast as possible, s."""


class Source(Node):
    """Publishes what it is told to."""

    out = publishes(IMAGES)


class Sink(Node):
    """Notes when each message arrives."""

    def __init__(self) -> None:
        self.at = 0.0
        self.bytes = 0

    @IMAGES.on()
    def take(self, message: Image) -> None:
        self.at = time.perf_counter()
        self.bytes += len(message.data)


def picture(size: int) -> Image:
    return Image(
        header=Header(frame_id="camera_frame"), height=1, width=size, encoding="mono8", step=size, data=bytes(size)
    )


async def _latencies(system: System, size: int) -> list[float]:
    """From the call of the publisher to the callback, which runs as soon as the loop turns, us."""
    source, sink, message, found = system.node(Source), system.node(Sink), picture(size), list[float]()
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        source.out(message)
        while sink.at < begun:
            await asyncio.sleep(0)
        found.append((sink.at - begun) * 1e6)
    return sorted(found)


async def _throughput(system: System, size: int, seconds: float) -> tuple[float, float]:
    """Messages and megabytes a second, each message made anew, as a camera does."""
    source, sink = system.node(Source), system.node(Sink)
    sink.bytes, sent, begun = 0, 0, time.perf_counter()
    while time.perf_counter() - begun < seconds:
        for _ in range(5):
            source.out(picture(size))
        sent += 5
        await asyncio.sleep(0)
    took = time.perf_counter() - begun
    return sent / took, sink.bytes / took / 1e6


async def _measured() -> list[Row]:
    found: list[Row] = []
    async with run(Child(Source), Child(Sink), sinks=(), signals=False) as system:
        for size in SIZES:
            late = await _latencies(system, size)
            work = f"publisher to callback in one process, {size:,} B (low, predictable latency)"
            found += [
                Row(work, "one message at a time", "us p50", late[len(late) // 2], "ours"),
                Row(work, "one message at a time", "us p99", late[len(late) * 99 // 100], "ours"),
            ]
        for size in SIZES:
            rate, megabytes = await _throughput(system, size, SECONDS)
            work = f"one process, {size:,} B (high throughput; a camera of 30.3 Hz is 27.9 MB/s)"
            found += [
                Row(work, "as fast as possible", "messages/s", rate, "ours"),
                Row(work, "as fast as possible", "MB/s", megabytes, "ours"),
            ]
    return found


def rows() -> list[Row]:
    """Latency and throughput within one process."""
    return asyncio.run(_measured())
