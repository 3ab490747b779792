"""A process with a transport, for tests that end it: ``python -m tests.actors.transport.zenoh.peer PORT NAME``.

It writes what it is told as lines of JSON, and does what it reads: ``announce NUMBER``, ``hang SECONDS``, ``threads``, ``sockets``, ``close``, ``leave``.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
from contextlib import suppress

from actors.transport.keyed.protocol import Delivery, Outlet, Query, Sample
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys


def say(kind: str, **more: object) -> None:
    os.write(1, (json.dumps({"kind": kind, **more}) + "\n").encode())


class Writer:
    """The events of the transport, written down."""

    def appeared(self, token: str) -> None:
        say("appeared", of=token)

    def vanished(self, token: str) -> None:
        say("vanished", of=token)

    def wanted(self, outlet: Outlet) -> None:
        say("wanted" if outlet.wanted else "unwanted")

    def link(self, session: str, up: bool) -> None:
        say("up" if up else "down", of=session)


def threads() -> int:
    return len(os.listdir("/proc/self/task"))


def sockets() -> int:
    number = 0
    for name in os.listdir("/proc/self/fd"):
        with suppress(FileNotFoundError):  # the one by which the folder is read
            number += os.readlink(f"/proc/self/fd/{name}").startswith("socket:")
    return number


def long_token(session: str, number: int) -> str:
    """A token of 250 bytes, as those of endpoints are."""
    return f"@ros2_lv/7/{session}/1/{number}/NN/%/%/".ljust(250, "n")


async def main(port: int, name: str) -> None:
    loop = asyncio.get_running_loop()
    transport = ZenohKeys(ZenohConfig(gossip_port=port))
    kept: list[Query] = []

    def take(sample: Sample) -> None:
        say("sample", key=sample.key, size=len(sample.payload))

    before = sockets()
    await transport.open("@ros2_lv/7/**", Writer())
    transport.serve(f"7/{name}/a::srv::dds_::B_/H", kept.append)
    transport.announce(f"@ros2_lv/7/{transport.session}/0/1/SS/%/%/{name}/%{name}/a::srv::dds_::B_/H/::,10:,:,:,,")
    for number in range(21):
        transport.subscribe(f"7/{name}/{number}/T/H", Delivery(), take)
        transport.outlet(f"7/out/{number}/T/H", Delivery(history=number % 2)).put(b"x" * 100_000, b"")
    say("ready", of=transport.session)
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while line := (await reader.readline()).decode().split():
        match line:
            case ["announce", count]:
                for number in range(int(count)):
                    transport.announce(long_token(transport.session, number))
                say("announced")
            case ["hang", seconds]:
                time.sleep(float(seconds))  # noqa: ASYNC251  # the loop is to hang
            case ["threads"]:
                say("threads", number=threads())
            case ["sockets"]:
                say("sockets", more=sockets() - before)
            case ["close"]:
                await transport.close()
                say("closed")
            case _:
                return


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), sys.argv[2]))
