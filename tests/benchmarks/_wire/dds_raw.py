"""The Python binding of Cyclone DDS by itself: the same bytes, which it neither packs nor unpacks."""

from __future__ import annotations

import asyncio
import struct
import time
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from tests.benchmarks._wire import IMAGE, SMALL, Arrivals, Far, Work, stream, ticks
from tests.benchmarks._wire.dds import joined

KEPT = Qos(Policy.Reliability.Reliable(10**10), Policy.History.KeepAll)
HEAD = b"\0\1\0\0"
STAMP = struct.Struct("<q")


@dataclass
class Raw(IdlStruct, typename="std_msgs.msg.dds_.ByteMultiArray_"):  # type: ignore[call-arg]
    def serialize(self, *_: Any, **__: Any) -> bytes:
        return self.payload  # type: ignore[attr-defined,no-any-return]

    @classmethod
    def deserialize(cls, data: bytes, *_: Any, **__: Any) -> Raw:
        return made(data)


def made(payload: bytes) -> Raw:
    raw = Raw()
    raw.payload = payload  # type: ignore[attr-defined]
    return raw


def reader_of(participant: Any, topic: str, take: Any) -> Any:
    class Taking(Listener):
        def on_data_available(self, reader: Any) -> None:
            for sample in reader.take(N=1000):
                if isinstance(sample, Raw):
                    take(sample)

    return DataReader(participant, Topic(participant, topic, Raw), qos=KEPT, listener=Taking())


async def far(work: Work, port: int) -> None:
    arrivals = Arrivals(work)
    domain, participant = joined(port)
    kept = [
        reader_of(participant, "rt/texts", lambda sample: arrivals.take()),
        reader_of(participant, "rt/stamps", lambda sample: arrivals.stamped(*STAMP.unpack_from(sample.payload, 4))),
    ]
    arrivals.ready()
    await asyncio.Event().wait()
    del domain, kept


async def near(work: Work, port: int, far: Far) -> list[float]:
    domain, participant = joined(port)
    topic = Topic(participant, "rt/stamps" if work == "latency" else "rt/texts", Raw)
    writer = DataWriter(participant, topic, qos=KEPT)
    until = time.monotonic() + 20
    while not writer.get_matched_subscriptions():
        if time.monotonic() > until:
            raise RuntimeError("the two ends of Cyclone DDS have not found each other")
        await asyncio.sleep(0.01)
    if work == "latency":
        return await ticks(far, lambda now: writer.write(made(HEAD + STAMP.pack(now))))
    message = made(HEAD + bytes(SMALL - 4 if work == "messages" else IMAGE))
    figures = await stream(work, far, lambda: writer.write(message))
    del domain
    return figures
