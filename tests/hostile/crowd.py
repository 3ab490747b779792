"""Clients that read, clients that never do, and clients that send garbage, beside a node that has to keep its rate."""

from __future__ import annotations

import asyncio
import contextlib
import json
import resource
import struct
import sys
import time
from asyncio.subprocess import PIPE, create_subprocess_exec
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from actors import Child, Node, Supervisor, Tick, Topic, every, publishes, run
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import UInt64
from cli.web.clients.outbox import MOST_BYTES
from cli.web.server.server import WebServer
from cli.web.server.settings import WebSettings

HZ = 200
COUNTED = Topic(UInt64, "/counted")
PICTURES = Topic(Image, "/pictures")
GROWTH = 32 * 1024
"""Kilobytes by which the process may grow after the first fifth, besides the queues of the clients that never read."""


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
    """How many numbers each reader has heard; each without a gap, or that and a lost connection is counted in `gaps`."""
    gaps: int = 0
    thrown_out: int = 0
    processor: float = 0.0
    """Processor time of the whole process, the node's and the server's, for each second."""
    grown: int = 0
    """By so many kilobytes the process has grown after the first fifth."""
    room: int = 0
    """By so many it may: what waits for clients that never read, and some more."""

    def lateness(self, percent: float) -> float:
        """A percentile of the lateness of ticks, ms."""
        return float(np.percentile(self.late, percent)) * 1e3


async def watch(seconds: float, *, readers: int, sleepers: int, vandals: int) -> CrowdOutcome:
    """Let them come, from a process of their own, and look on."""
    outcome = CrowdOutcome(room=(sleepers * MOST_BYTES) // 1024 + GROWTH)
    async with run(Supervisor("tree", children=[Child(Source)]), signals=False, sinks=()) as system:
        joined = await system.join(Child(WebServer, name="_web", args=(WebSettings(port=0),)))
        server = joined.node
        assert isinstance(server, WebServer)
        command = [
            "-m",
            "tests.hostile.crowd",
            server.url.replace("http", "ws", 1),
            *map(str, (readers, sleepers, vandals)),
        ]
        crowd = await create_subprocess_exec(sys.executable, *command, stdin=PIPE, stdout=PIPE)
        assert crowd.stdin is not None and crowd.stdout is not None
        assert await crowd.stdout.readline() == b"ready\n"
        source = system.node(Source)
        begun, source.lateness, before, spent = source.number, [], system.clock.now(), time.process_time()
        for share in (0.2, 0.8):
            await asyncio.sleep(seconds * share)
            outcome.grown = _memory() - outcome.grown
        outcome.sent, outcome.late = source.number - begun, source.lateness
        took = system.clock.now() - before
        outcome.rate, outcome.processor = outcome.sent / took, (time.process_time() - spent) / took
        crowd.stdin.close()
        told = json.loads(await crowd.stdout.readline())
        outcome.heard, outcome.gaps, outcome.thrown_out = told["heard"], told["gaps"], told["thrown_out"]
        await crowd.wait()
    return outcome


async def _crowd(url: str, readers: int, sleepers: int, vandals: int) -> None:
    """The clients, until the standard input ends. Says when all readers hear something, and at the end what has become of them."""
    outcome = CrowdOutcome(heard=[0] * readers)
    ready = [asyncio.Event() for _ in range(readers)]
    tasks = [asyncio.ensure_future(_reader(url, number, ready[number], outcome)) for number in range(readers)]
    tasks += [asyncio.ensure_future(_sleeper(url)) for _ in range(sleepers)]
    tasks += [asyncio.ensure_future(_vandal(url, outcome)) for _ in range(vandals)]
    for one in ready:
        await one.wait()
    print("ready", flush=True)
    await asyncio.to_thread(sys.stdin.read)
    ended = [task for task in tasks if task.done()]
    print(
        json.dumps({"heard": outcome.heard, "gaps": outcome.gaps + len(ended), "thrown_out": outcome.thrown_out}),
        flush=True,
    )
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


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
    if outcome.grown > outcome.room:
        wrong.append(f"the process has grown by {outcome.grown} kB after the first fifth")
    if not outcome.thrown_out:
        wrong.append("nobody who sends garbage was thrown out")
    return wrong


if __name__ == "__main__":
    address, *numbers = sys.argv[1:]
    asyncio.run(_crowd(address, *map(int, numbers)))
