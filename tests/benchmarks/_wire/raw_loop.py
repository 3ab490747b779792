"""Zenoh's Python binding with what nodes need at least: encoded, numbered, dated and named, decoded and answered on the event loops of both ends."""

from __future__ import annotations

import asyncio
import struct
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh

from actors.transport.zenoh.library import direct
from tests.benchmarks._wire import SMALL, Arrivals, Far, Work, calls, stream
from tests.benchmarks._wire.raw import opened

TEXT = "x" * (SMALL - 9)
HEAD = struct.Struct("<4sI")
"""Of a string in CDR: the encoding and the length."""
ATTACHED = struct.Struct("<qqB16s")
"""Number, time and identity, as in every message of ROS 2."""
REQUEST = b"\0\1\0\0\0"
ANSWER = struct.Struct("<4s?3xI1s")
"""Of a ``Trigger``: whether it succeeded, and an empty text."""


class IntoLoop:
    """Hands what comes on Zenoh's thread to a function on the event loop, many with one wake-up."""

    def __init__(self, take: Callable[[Any], object]) -> None:
        self._loop = asyncio.get_running_loop()
        self._take = take
        self._waiting: deque[Any] = deque()
        self._woken = False

    def __call__(self, item: Any) -> None:
        self._waiting.append(item)
        if not self._woken:
            self._woken = True
            self._loop.call_soon_threadsafe(self._take_all)

    def _take_all(self) -> None:
        self._woken = False
        while self._waiting:
            self._take(self._waiting.popleft())


async def far(work: Work, port: int) -> None:
    arrivals = Arrivals(work)
    session = await asyncio.to_thread(opened, work, listen=[f"tcp/127.0.0.1:{port}"])

    def take(sample: Any) -> None:
        ATTACHED.unpack(sample.attachment.to_bytes())
        payload = sample.payload.to_bytes()
        _, length = HEAD.unpack_from(payload)
        assert len(payload[8 : 7 + length].decode()) == len(TEXT)
        arrivals.take()

    def answer(query: Any) -> None:
        number, _, _, identity = ATTACHED.unpack(query.attachment.to_bytes())
        assert query.payload.to_bytes() == REQUEST
        response = ANSWER.pack(b"\0\1\0\0", True, 1, b"\0")
        query.reply("ask", response, attachment=ATTACHED.pack(number, time.time_ns(), 16, identity))
        query.drop()

    declared = (
        session.declare_queryable("ask", direct(IntoLoop(answer)), complete=True)
        if work == "calls"
        else session.declare_subscriber("texts", IntoLoop(take))
    )
    arrivals.ready()
    await asyncio.Event().wait()
    del declared


async def near(work: Work, port: int, far: Far) -> list[float]:
    session = await asyncio.to_thread(opened, work, connect=[f"tcp/127.0.0.1:{port}"])
    number = 0

    def attachment() -> bytes:
        nonlocal number
        number += 1
        return ATTACHED.pack(number, time.time_ns(), 16, b"\1" * 16)

    try:
        if work == "calls":
            await asyncio.sleep(0.2)
            return await calls(far, lambda: ask(session, attachment()))
        publisher = session.declare_publisher("texts", congestion_control=zenoh.CongestionControl.DROP)
        while not publisher.matching_status.matching:
            await asyncio.sleep(0.01)

        def put() -> None:
            text = TEXT.encode()
            payload = HEAD.pack(b"\0\1\0\0", len(text) + 1) + text + b"\0"
            publisher.put(payload, attachment=attachment())

        return await stream(work, far, put)
    finally:
        await asyncio.to_thread(session.close)


async def ask(session: Any, attachment: bytes) -> None:
    answered: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
    session.get("ask", direct(IntoLoop(answered.set_result)), payload=REQUEST, attachment=attachment)
    reply = (await answered).ok
    ATTACHED.unpack(reply.attachment.to_bytes())
    assert ANSWER.unpack(reply.payload.to_bytes())[1]
