"""Eclipse Cyclone DDS by its Python binding."""

import asyncio
import time
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int64, sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from tests.benchmarks._wire import IMAGE, SMALL, Arrivals, Far, Work, stream, ticks

CONFIG = """<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
KEPT = Qos(Policy.Reliability.Reliable(10**9), Policy.History.KeepAll)


@dataclass
class Data(IdlStruct, typename="Data"):  # type: ignore[call-arg]
    stamp: int64  # type: ignore[valid-type]
    data: sequence[uint8]  # type: ignore[valid-type]


def joined(port: int) -> tuple[Any, Any]:
    number = port % 200
    return Domain(number, CONFIG), DomainParticipant(number)


async def far(work: Work, port: int) -> None:
    arrivals = Arrivals(work)
    domain, participant = joined(port)

    class Taking(Listener):
        def on_data_available(self, reader: Any) -> None:
            for sample in reader.take(N=1000):
                if not isinstance(sample, Data):  # it tells of a writer that has gone
                    continue
                if work == "latency":
                    arrivals.stamped(sample.stamp)
                else:
                    arrivals.take()

    reader = DataReader(participant, Topic(participant, "data", Data), qos=KEPT, listener=Taking())
    arrivals.ready()
    await asyncio.Event().wait()
    del domain, reader


async def near(work: Work, port: int, far: Far) -> list[float]:
    domain, participant = joined(port)
    writer = DataWriter(participant, Topic(participant, "data", Data), qos=KEPT)
    until = time.monotonic() + 20
    while not writer.get_matched_subscriptions():
        if time.monotonic() > until:
            raise RuntimeError("the two ends of Cyclone DDS have not found each other")
        await asyncio.sleep(0.01)
    if work == "latency":
        return await ticks(far, lambda now: writer.write(Data(now, [])))
    message = Data(0, [0] * (SMALL - 16) if work == "messages" else bytes(IMAGE))  # type: ignore[arg-type]
    figures = await stream(work, far, lambda: writer.write(message))
    del domain
    return figures
