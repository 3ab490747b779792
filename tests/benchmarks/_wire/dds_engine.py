"""Readers and writers of `actors.transport.dds`, without nodes: the same bytes, into the loop."""

from __future__ import annotations

import asyncio
import struct

from actors.transport.dds.config import DdsConfig
from actors.transport.dds.endpoints import Reader, Sample, Writer
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.participant import Participant
from tests.benchmarks._wire import IMAGE, SMALL, Arrivals, Far, Work, calls, stream, ticks

KEPT = EndpointQos(keep_all=True)
HEAD = b"\0\1\0\0"
STAMP = struct.Struct("<q")
TYPE = "std_msgs::msg::dds_::ByteMultiArray_"


class Nobody:
    """Who comes and goes does not matter."""

    def __getattr__(self, name: str) -> object:
        return lambda _: None


async def joined(port: int) -> Participant:
    participant = Participant(DdsConfig(domain=port % 200, discovery_range="LOCALHOST"))
    await participant.open(Nobody())  # type: ignore[arg-type]
    return participant


async def far(work: Work, port: int) -> None:
    arrivals, participant = Arrivals(work), await joined(port)
    replies = participant.writer("rr/ask", TYPE, KEPT)

    def take(batch: list[Sample]) -> None:
        for _ in batch:
            arrivals.take()

    def stamp(batch: list[Sample]) -> None:
        for sample in batch:
            arrivals.stamped(*STAMP.unpack_from(sample.payload, 4))

    def answer(batch: list[Sample]) -> None:
        for sample in batch:
            replies.put(sample.payload)

    participant.reader("rt/texts", TYPE, KEPT, take)
    participant.reader("rt/stamps", TYPE, KEPT, stamp)
    participant.reader("rq/ask", TYPE, KEPT, answer)
    arrivals.ready()
    await asyncio.Event().wait()


async def near(work: Work, port: int, far: Far) -> list[float]:
    participant = await joined(port)
    try:
        if work == "calls":
            return await asked(participant, far)
        writer = participant.writer("rt/stamps" if work == "latency" else "rt/texts", TYPE, KEPT)
        await matched(writer)
        if work == "latency":
            return await ticks(far, lambda now: writer.put(HEAD + STAMP.pack(now)))
        payload = HEAD + bytes(SMALL - 4 if work == "messages" else IMAGE)
        return await stream(work, far, lambda: writer.put(payload))
    finally:
        await participant.close()


async def asked(participant: Participant, far: Far) -> list[float]:
    open_calls: dict[bytes, asyncio.Future[None]] = {}
    numbers = iter(range(10**9))

    def done(batch: list[Sample]) -> None:
        for sample in batch:
            open_calls.pop(sample.payload).set_result(None)

    async def ask() -> None:
        request = HEAD + STAMP.pack(next(numbers)) + bytes(8)
        answered = open_calls[request] = asyncio.get_running_loop().create_future()
        writer.put(request)
        await answered

    writer, reader = participant.writer("rq/ask", TYPE, KEPT), participant.reader("rr/ask", TYPE, KEPT, done)
    await matched(writer)
    await matched(reader)
    return await calls(far, ask)


async def matched(endpoint: Reader | Writer) -> None:
    async with asyncio.timeout(20):
        while not endpoint.matched:
            await asyncio.sleep(0.01)
