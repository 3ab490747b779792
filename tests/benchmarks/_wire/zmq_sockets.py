"""ZeroMQ by pyzmq: one socket each way."""

from __future__ import annotations

import struct
from typing import Any

import zmq
import zmq.asyncio

from tests.benchmarks._wire import IMAGE, SMALL, Arrivals, Far, Work, calls, stream, ticks

STAMP = struct.Struct("<q")


async def far(work: Work, port: int) -> None:
    arrivals = Arrivals(work)
    socket = zmq.Context().socket(zmq.REP if work == "calls" else zmq.PULL)
    socket.bind(f"tcp://127.0.0.1:{port}")
    arrivals.ready()
    while True:
        data = socket.recv()
        if work == "calls":
            socket.send(data)
        elif work == "latency":
            arrivals.stamped(*STAMP.unpack(data))
        else:
            arrivals.take()


async def near(work: Work, port: int, far: Far) -> list[float]:
    where = f"tcp://127.0.0.1:{port}"
    if work == "calls":
        with zmq.asyncio.Context() as context, context.socket(zmq.REQ) as asking:
            asking.connect(where)

            async def call() -> None:
                await asking.send(b"\0" * 8)
                await asking.recv()

            rate, spent = await calls(far, call, callers=(1,))
            return [rate, float("nan"), spent]  # such a socket has one question at a time
    with zmq.Context() as plain, plain.socket(zmq.PUSH) as socket:
        socket.connect(where)
        if work == "latency":
            return await ticks(far, lambda now: socket.send(STAMP.pack(now)))
        payload: Any = b"\0" * (SMALL if work == "messages" else IMAGE)
        return await stream(work, far, lambda: socket.send(payload))
