"""Many participants that come and go: ``python -m tests.actors.transport.dds.churn`` prints how long it takes and what is left.

Two processes have 100 participants with 12 endpoints each. Half of the endpoints are closed and opened anew, one process is killed, and the
other one ends. After that a participant is opened and closed a thousand times.
"""

from __future__ import annotations

import asyncio
import gc
import os
import sys
import time
import uuid
from collections.abc import Callable
from pathlib import Path

from actors.transport.dds.format.qos import EndpointQos
from tests.actors.transport.dds.peers import HELLO, Peer, until

PARTICIPANTS = 100
ENDPOINTS = 12
CYCLES = 1000


def left() -> str:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    files, tasks = len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task"))
    return f"{files} file descriptors, {tasks} threads, {pages * 4} KiB"


async def child(domain: int, tag: str) -> None:
    peers = [Peer(domain, tag) for _ in range(PARTICIPANTS)]
    for peer in peers:
        await peer.participant.open(peer)
    names = [f"rt/{domain}_{number}" for number in range(ENDPOINTS // 2)]
    kept = [(peer.writer(name, EndpointQos()), peer.reader(name, EndpointQos())) for peer in peers for name in names]
    await asyncio.to_thread(sys.stdin.readline)
    for peer, (writer, _) in zip([peer for peer in peers for _ in names], kept, strict=True):
        writer.close()
        peer.writer(f"{writer.topic}_again", EndpointQos())
    await asyncio.to_thread(sys.stdin.readline)
    for peer in peers:
        await peer.participant.close()


async def timed(what: str, condition: Callable[[], object]) -> None:
    began, used = time.monotonic(), time.process_time()
    await until(condition, 120)
    print(f"{what}: {time.monotonic() - began:.1f} s, {time.process_time() - used:.2f} s of the processor", flush=True)


async def main() -> None:
    tag = uuid.uuid4().hex
    peer = Peer(7, tag)
    await peer.participant.open(peer)
    words = sys.executable, "-m", "tests.actors.transport.dds.churn"
    children = [
        await asyncio.create_subprocess_exec(*words, str(domain), tag, stdin=asyncio.subprocess.PIPE)
        for domain in (8, 9)
    ]
    everybody, everything = 2 * PARTICIPANTS, 2 * PARTICIPANTS * ENDPOINTS
    await timed(
        f"{everybody} participants with {everything} endpoints have appeared",
        lambda: len(peer.participants) == everybody and len(peer.endpoints) == everything,
    )
    for process in children:
        assert process.stdin is not None
        process.stdin.write(b"\n")
    again = everything // 2
    await timed(
        f"{again} writers have gone and {again} have come",
        lambda: (
            sum(endpoint.topic.endswith("_again") for endpoint in peer.endpoints.values()) == again
            and len(peer.endpoints) == everything
        ),
    )
    children[0].kill()
    await timed("a killed process has vanished (its lease is 3 s)", lambda: len(peer.participants) == PARTICIPANTS)
    assert children[1].stdin is not None
    children[1].stdin.write(b"\n")
    await timed("a process that has ended has vanished", lambda: not peer.participants and not peer.endpoints)
    for process in children:
        await process.wait()
    await peer.participant.close()
    began = time.monotonic()
    for cycle in range(CYCLES + 1):
        peer = Peer(7, tag)
        await peer.participant.open(peer)
        peer.reader("rt/a", EndpointQos())
        peer.writer("rt/a", EndpointQos()).put(HELLO)
        await peer.participant.close()
        if cycle in (100, CYCLES):
            print(f"after {cycle} cycles: {left()}", flush=True)
    print(f"{CYCLES} cycles: {time.monotonic() - began:.1f} s")


if __name__ == "__main__":
    asyncio.run(child(int(sys.argv[1]), sys.argv[2]) if sys.argv[1:] else main())
