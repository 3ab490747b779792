"""Zenoh's Python binding with what messages between nodes need at least: encoded, numbered, dated and named, decoded on the event loop of the far end."""

from __future__ import annotations

import asyncio
import struct
import time
from collections import deque
from typing import Any

import zenoh

from tests.benchmarks._wire import SMALL, Arrivals, Far, Work, stream
from tests.benchmarks._wire.raw import opened

TEXT = "x" * (SMALL - 9)
HEAD = struct.Struct("<4sI")
"""Of a string in CDR: the encoding and the length."""
ATTACHED = struct.Struct("<qqB16s")
"""Number, time and identity, as in every message of ROS 2."""


async def far(work: Work, port: int) -> None:
    loop, arrivals = asyncio.get_running_loop(), Arrivals(work)
    session = await asyncio.to_thread(opened, work, listen=[f"tcp/127.0.0.1:{port}"])
    waiting: deque[Any] = deque()
    woken = False

    def arrived(sample: Any) -> None:
        nonlocal woken
        waiting.append(sample)
        if not woken:
            woken = True
            loop.call_soon_threadsafe(take)

    def take() -> None:
        nonlocal woken
        woken = False
        while waiting:
            sample = waiting.popleft()
            ATTACHED.unpack(sample.attachment.to_bytes())
            payload = sample.payload.to_bytes()
            _, length = HEAD.unpack_from(payload)
            assert len(payload[8 : 7 + length].decode()) == len(TEXT)
            arrivals.take()

    declared = session.declare_subscriber("texts", arrived)
    arrivals.ready()
    await asyncio.Event().wait()
    del declared


async def near(work: Work, port: int, far: Far) -> list[float]:
    session = await asyncio.to_thread(opened, work, connect=[f"tcp/127.0.0.1:{port}"])
    try:
        publisher = session.declare_publisher("texts", congestion_control=zenoh.CongestionControl.DROP)
        while not publisher.matching_status.matching:
            await asyncio.sleep(0.01)
        number = 0

        def put() -> None:
            nonlocal number
            number += 1
            text = TEXT.encode()
            payload = HEAD.pack(b"\0\1\0\0", len(text) + 1) + text + b"\0"
            publisher.put(payload, attachment=ATTACHED.pack(number, time.time_ns(), 16, b"\1" * 16))

        return await stream(work, far, put)
    finally:
        await asyncio.to_thread(session.close)
