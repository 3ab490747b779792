"""How long it takes to know a large graph: ``python -m tests.tools.wire_scale [--sessions 200] [--rounds 5]``, and what it costs to change: ``--churn``.

Two helper processes hold Zenoh sessions, clients of one router, each with 5 nodes and 50 endpoints. In each round a newcomer, a process of its
own, opens a system and measures the seconds until its snapshot of the graph has the last endpoint, and its memory for each.

With ``--churn SECONDS``, nodes with a publisher and a subscription come and go, 100 a second, each under a new name, and every ten seconds it
prints how much memory the process has and how many objects of Python, and the same of a second process that sees them. What grows is
Zenoh's: for each token, subscription and server under a key that a link has not seen before it keeps 2 to 4 kB at both ends of the link, and the
gossip point is one more end. The objects do not grow.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import json
import os
import statistics
import subprocess
import sys
import time
from collections import deque
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Any

from actors import Child, Node, System, Topic, publishes, run
from actors.interfaces.hashes import type_hash
from actors.interfaces.std_msgs.msg import String
from actors.qos import DEFAULT
from actors.runtime.joined import JoinedNode
from actors.transport.format.tokens import EndpointKind, EndpointToken, NodeToken, write_token
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from actors.transport.zenoh.library import import_zenoh
from tests.actors.transport.zenoh.wires import free_port

NODES = 5
ENDPOINTS = 50
"""Of each session."""
HOLDERS = 2
CHURN_RATE = 100
CHURN_TURN = 10
"""Nodes a second, and seconds from one figure to the next."""
CHATTER = Topic(String, "chatter")


def tokens_of(session: str, name: str) -> list[str]:
    """The tokens of one session: its nodes and their endpoints, half of them publishers, half subscriptions, each with a topic of its own."""
    nodes = [NodeToken(0, session, number, f"{name}_{number}", "/") for number in range(NODES)]
    kinds = (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION)
    hashed = type_hash(String)
    endpoints = [
        EndpointToken(
            nodes[number % NODES],
            NODES + number,
            kinds[number % 2],
            f"/{name}/topic_{number}",
            "std_msgs/msg/String",
            hashed,
            DEFAULT,
            (),
        )
        for number in range(ENDPOINTS)
    ]
    return [write_token(token) for token in (*nodes, *endpoints)]


def hold(port: int, sessions: int, name: str) -> None:
    """Hold so many sessions until the standard input ends."""
    zenoh = import_zenoh()
    kept: list[Any] = []
    for number in range(sessions):
        config = zenoh.Config()
        for path, value in {
            "mode": "client", "connect/endpoints": [f"tcp/127.0.0.1:{port}"], "scouting/multicast/enabled": False,
        }.items():  # fmt: skip
            config.insert_json5(path, json.dumps(value))
        session = zenoh.open(config)
        liveliness = session.liveliness()
        kept.append(session)
        kept += [liveliness.declare_token(token) for token in tokens_of(str(session.zid()), f"{name}_{number}")]
    print("held", flush=True)
    sys.stdin.read()
    os._exit(0)


def memory() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class Passing(Node):
    """A node that comes and goes."""

    chatter = publishes(CHATTER)

    @CHATTER.on()
    def heard(self, message: String) -> None:
        """Nobody publishes."""


@asynccontextmanager
async def churning(port: int, name: str) -> AsyncGenerator[System]:
    transport = ZenohTransport(ZenohConfig(gossip_port=port))
    async with run(Child(Node, name=name), transport=transport, signals=False, sinks=()) as system:
        yield system


async def observe(port: int) -> None:
    """Write down memory and objects for each line of the standard input, and how many nodes are seen."""
    async with churning(port, "observer") as system:
        while await asyncio.to_thread(sys.stdin.readline):
            print(json.dumps((*measure(), len(system.snapshot().nodes))), flush=True)


def measure() -> tuple[int, int]:
    gc.collect()
    return memory(), len(gc.get_objects())


async def churn(seconds: int) -> int:
    """Nodes come and go. 0 if the objects of Python do not grow."""
    port = free_port()
    words = (sys.executable, "-m", "tests.tools.wire_scale", "--observer", str(port))
    pipe = asyncio.subprocess.PIPE
    observer = await asyncio.create_subprocess_exec(*words, stdin=pipe, stdout=pipe)
    assert observer.stdin is not None and observer.stdout is not None
    try:
        async with churning(port, "churning") as system:
            while len(system.snapshot().nodes) < 2:
                await asyncio.sleep(0.05)
            before: list[tuple[int, ...]] = []
            here = there = (0, 0)
            for turn in range(seconds // CHURN_TURN + 1):
                await come_and_go(system, turn)
                observer.stdin.write(b"\n")
                here, (*there, seen) = measure(), json.loads(await observer.stdout.readline())
                before = before or [here, tuple(there)]
                grown = [(now[0] - then[0]) / 1024 for now, then in zip((here, there), before, strict=True)]
                count = CHURN_TURN * CHURN_RATE
                print(
                    f"{turn * count:6} nodes: here {here[0] / 2**20:.0f} MiB, {grown[0] / max(turn * count, 1):.1f} kB a node, "
                    f"{here[1]} objects; elsewhere {there[0] / 2**20:.0f} MiB, {grown[1] / max(turn * count, 1):.1f} kB a node, "
                    f"{there[1]} objects, {seen} nodes seen",
                    flush=True,
                )
            return 0 if here[1] - before[0][1] < 1000 and there[1] - before[1][1] < 1000 else 1
    finally:
        observer.kill()
        await observer.wait()


async def come_and_go(system: System, turn: int) -> None:
    """Ten seconds of it; the nodes of the last second are still there when the next ones come."""
    loop = asyncio.get_running_loop()
    begun, there = loop.time(), deque[JoinedNode]()
    for number in range(CHURN_TURN * CHURN_RATE):
        await asyncio.sleep(begun + number / CHURN_RATE - loop.time())
        there.append(await system.join(Child(Passing, name=f"node_{turn}_{number}")))
        if len(there) > CHURN_RATE:
            await system.leave(there.popleft())
    while there:
        await system.leave(there.popleft())
    await asyncio.sleep(1)


async def newcomer(port: int, wanted: int) -> None:
    """Print the seconds until all endpoints are known, and the bytes for each."""
    config = ZenohConfig(mode="client", connect=(f"tcp/127.0.0.1:{port}",), gossip_port=0)
    transport = ZenohTransport(config)
    import_zenoh()
    before, began = memory(), time.perf_counter()
    async with run(Child(Node, name="newcomer"), transport=transport, signals=False, sinks=()) as system:
        topics = system.graph.topics

        def known() -> int:
            return sum(1 for name in list(topics) if name.startswith("/held_"))

        async with asyncio.timeout(60):
            while known() < wanted:
                await asyncio.sleep(0.005)
        snapshot = system.snapshot()
        seconds = time.perf_counter() - began
        found = sum(
            len(one.publishers) + len(one.subscriptions) for one in snapshot.topics if one.name.startswith("/held_")
        )
        print(json.dumps({"seconds": seconds, "endpoints": found, "bytes": (memory() - before) / wanted}))


def main(sessions: int, rounds: int) -> int:
    port, wanted = free_port(), sessions * ENDPOINTS
    here = [sys.executable, "-m", "tests.tools.wire_scale"]
    piped: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    router = subprocess.Popen([sys.executable, "-m", "robot", "router", "--listen", f"tcp/127.0.0.1:{port}"], **piped)
    helpers = [router]
    try:
        router.stdout.readline()  # type: ignore[union-attr]
        each = [str(sessions // HOLDERS + (number < sessions % HOLDERS)) for number in range(HOLDERS)]
        holders = [
            subprocess.Popen([*here, "--hold", str(port), number, f"held_{index}"], **piped)
            for index, number in enumerate(each)
        ]
        helpers += holders
        for holder in holders:
            holder.stdout.readline()  # type: ignore[union-attr]
        figures = []
        for _ in range(rounds):
            done = subprocess.run(
                [*here, "--newcomer", str(port), str(wanted)], capture_output=True, text=True, check=True
            )
            figures.append(json.loads(done.stdout))
            print(
                f"{figures[-1]['endpoints']} endpoints after {figures[-1]['seconds']:.2f} s, {figures[-1]['bytes']:.0f} bytes each",
                flush=True,
            )
    finally:
        for helper in helpers:
            helper.kill()
            helper.wait()
    print(f"median of {rounds}: {statistics.median(one['seconds'] for one in figures):.2f} s")
    return 0 if all(one["endpoints"] == wanted for one in figures) else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m tests.tools.wire_scale", description=__doc__)
    parser.add_argument("--sessions", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--churn", type=int, metavar="SECONDS")
    parser.add_argument("--observer", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--hold", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--newcomer", nargs=2, type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.churn:
        sys.exit(asyncio.run(churn(options.churn)))
    elif options.observer:
        asyncio.run(observe(options.observer))
    elif options.hold:
        hold(int(options.hold[0]), int(options.hold[1]), options.hold[2])
    elif options.newcomer:
        asyncio.run(newcomer(*options.newcomer))
    else:
        sys.exit(main(options.sessions, options.rounds))
