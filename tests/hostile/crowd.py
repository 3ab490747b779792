"""Clients that read, clients that never do, and clients that send garbage, beside a node that has to keep its rate."""

from __future__ import annotations

import asyncio
import contextlib
import resource
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from actors import Child, Node, Supervisor, Tick, Topic, every, publishes, run
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import UInt64
from cli.web.server import WebServer
from cli.web.settings import WebSettings

__all__ = ["CrowdOutcome", "findings", "watch"]

HZ = 200
COUNTED = Topic(UInt64, "/counted")
PICTURES = Topic(Image, "/pictures")
GROWTH = 48 * 1024
"""Kilobytes by which the process may grow after the first fifth: each client that never reads holds 16 MiB at most, which takes a while to fill."""


class Source(Node):
    """Publishes a number 200 times a second and a picture ten times."""

    counted = publishes(COUNTED)
    pictures = publishes(PICTURES)

    def __init__(self) -> None:
        self.number = 0
        self.lateness: list[float] = []

    @every(hz=HZ)
    def count(self, tick: Tick) -> None:
        self.lateness.append(tick.late)
        self.counted(UInt64(data=self.number))
        self.number += 1

    @every(hz=10)
    def shoot(self) -> None:
        self.pictures(Image(width=320, height=240, data=np.zeros(320 * 240 * 3, np.uint8)))


@dataclass
class CrowdOutcome:
    """What has become of it."""

    sent: int = 0
    rate: float = 0.0
    late: list[float] = field(default_factory=list[float])
    heard: list[int] = field(default_factory=list[int])
    """How many numbers each reader has heard; each without a gap, or it is counted in `gaps`."""
    gaps: int = 0
    thrown_out: int = 0
    grown: int = 0
    """Kilobytes."""

    def lateness(self, percent: float) -> float:
        """A percentile of the lateness of ticks, ms."""
        return float(np.percentile(self.late, percent)) * 1e3


async def watch(seconds: float, *, readers: int, sleepers: int, vandals: int) -> CrowdOutcome:
    """Let them come, and look on."""
    outcome = CrowdOutcome(heard=[0] * readers)
    async with run(Supervisor("tree", children=[Child(Source)]), signals=False, sinks=()) as system:
        joined = await system.join(Child(WebServer, name="_web", args=(WebSettings(port=0),)))
        server = joined.node
        assert isinstance(server, WebServer)
        url = server.url.replace("http", "ws", 1)
        ready = [asyncio.Event() for _ in range(readers)]
        tasks = [asyncio.ensure_future(_reader(url, number, ready[number], outcome)) for number in range(readers)]
        tasks += [asyncio.ensure_future(_sleeper(url)) for _ in range(sleepers)]
        tasks += [asyncio.ensure_future(_vandal(url, outcome)) for _ in range(vandals)]
        for one in ready:
            await one.wait()
        source = system.node(Source)
        begun, source.lateness = source.number, []
        before = system.clock.now()
        for share in (0.2, 0.8):
            await asyncio.sleep(seconds * share)
            used = _memory()
            outcome.grown = used - outcome.grown
        outcome.sent = source.number - begun
        outcome.rate = outcome.sent / (system.clock.now() - before)
        outcome.late = source.lateness
        for task in tasks:
            task.cancel()
        for found in await asyncio.gather(*tasks, return_exceptions=True):
            if isinstance(found, Exception):
                raise found
    return outcome


def _memory() -> int:
    """What the process has needed at most, kilobytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


SUBSCRIBE = '{"op":"subscribe","subscriptions":[{"id":1,"channelId":1},{"id":2,"channelId":2}]}'


async def _reader(url: str, number: int, ready: asyncio.Event, outcome: CrowdOutcome) -> None:
    """Reads everything. The number before the first one that it hears does not count."""
    last: int | None = None
    async with connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:  # type: ignore[list-item]
        await socket.send(SUBSCRIBE)
        async for frame in socket:
            if isinstance(frame, bytes) and len(frame) < 100:
                (found,) = struct.unpack("<Q", frame[-8:])
                outcome.gaps += last is not None and found != last + 1
                last = found
                outcome.heard[number] += 1
                ready.set()


async def _sleeper(url: str) -> None:
    """Asks for everything, and never reads it."""
    while True:
        with contextlib.suppress(ConnectionClosed, InvalidHandshake, OSError):
            async with connect(url, subprotocols=["foxglove.sdk.v1"], ping_interval=None, close_timeout=0.1) as socket:  # type: ignore[list-item]
                await socket.send(SUBSCRIBE)
                transport: Any = socket.transport
                transport.pause_reading()
                await socket.wait_closed()


async def _vandal(url: str, outcome: CrowdOutcome) -> None:
    """Sends garbage, is thrown out, and comes again."""
    while True:
        try:
            async with connect(url, close_timeout=0.1) as socket:
                while True:
                    await socket.send(b"\xff" * 1000)
                    await asyncio.sleep(0.001)
        except ConnectionClosed:
            outcome.thrown_out += 1
        except (InvalidHandshake, OSError):
            pass


def findings(outcome: CrowdOutcome) -> list[str]:
    """Which promises are broken, one line each."""
    wrong: list[str] = []
    if outcome.gaps:
        wrong.append(f"readers have missed messages {outcome.gaps} times")
    if abs(outcome.rate / HZ - 1) > 0.01:
        wrong.append(f"the node has published at {outcome.rate:.2f} Hz, not {HZ}")
    if outcome.grown > GROWTH:
        wrong.append(f"the process has grown by {outcome.grown} kB after the first fifth")
    if not outcome.thrown_out:
        wrong.append("nobody who sends garbage was thrown out")
    return wrong
