"""Participants that meet over the loopback network, several in one process."""

from __future__ import annotations

import asyncio
import ctypes
import uuid
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from actors.transport.dds.config import DdsConfig
from actors.transport.dds.discovery import RemoteEndpoint, RemoteParticipant
from actors.transport.dds.endpoints import Reader, Sample, Status, Writer
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.participant import Participant

STRING = "std_msgs::msg::dds_::String_"
HELLO = b"\0\1\0\0\6\0\0\0hello\0\0\0"


def settings(tag: str) -> str:
    """Domains of different numbers in one process are one domain on the network, which others do not enter."""
    discovery = f"<ExternalDomainId>77</ExternalDomainId><Tag>{tag}</Tag><LeaseDuration>3s</LeaseDuration>"
    return f"<CycloneDDS><Domain><Discovery>{discovery}</Discovery></Domain></CycloneDDS>"


def numbered(text: int) -> bytes:
    return b"\0\1\0\0" + text.to_bytes(4, "little")


def deaf(participant: Participant, is_deaf: bool) -> None:
    """Let a participant hear nothing from the network, or hear again."""
    from cyclonedds.internal import DDS

    within = participant._within
    assert within is not None
    call = DDS._dll_handle.dds_domain_set_deafmute
    call.argtypes = [ctypes.c_int32, ctypes.c_bool, ctypes.c_bool, ctypes.c_int64]
    assert call(within.participant, is_deaf, False, 2**63 - 1) == 0


async def until(condition: Callable[[], object], seconds: float = 10) -> None:
    async with asyncio.timeout(seconds):
        while not condition():
            await asyncio.sleep(0.005)


class Peer:
    """A participant, who it has seen, and what its readers have taken."""

    def __init__(self, domain: int, tag: str) -> None:
        config = DdsConfig(domain=domain, discovery_range="LOCALHOST", uri=settings(tag))
        self.participant = Participant(config, b"enclave=/;")
        self.log: list[str] = []
        self.participants: dict[bytes, RemoteParticipant] = {}
        self.endpoints: dict[bytes, RemoteEndpoint] = {}
        self.statuses: list[Status] = []
        self.batches: list[list[Sample]] = []

    def writer(self, topic: str, qos: EndpointQos, type_name: str = STRING) -> Writer:
        return self.participant.writer(topic, type_name, qos, self.statuses.append)

    def reader(self, topic: str, qos: EndpointQos, type_name: str = STRING, patience: float = 0.0) -> Reader:
        return self.participant.reader(
            topic, type_name, qos, self.batches.append, patience=patience, on_status=self.statuses.append
        )

    @property
    def samples(self) -> list[Sample]:
        return [sample for batch in self.batches for sample in batch]

    @property
    def payloads(self) -> list[bytes]:
        return [sample.payload for sample in self.samples]

    def participant_appeared(self, participant: RemoteParticipant) -> None:
        assert participant.guid not in self.participants
        self.participants[participant.guid] = participant
        self.log.append("participant appeared")

    def participant_vanished(self, participant: RemoteParticipant) -> None:
        del self.participants[participant.guid]
        self.log.append("participant vanished")

    def endpoint_appeared(self, endpoint: RemoteEndpoint) -> None:
        assert endpoint.participant in self.participants and endpoint.guid not in self.endpoints
        self.endpoints[endpoint.guid] = endpoint
        self.log.append(f"{endpoint.topic} appeared")

    def endpoint_changed(self, endpoint: RemoteEndpoint) -> None:
        self.endpoints[endpoint.guid] = endpoint
        self.log.append(f"{endpoint.topic} changed")

    def endpoint_vanished(self, endpoint: RemoteEndpoint) -> None:
        del self.endpoints[endpoint.guid]
        self.log.append(f"{endpoint.topic} vanished")


@asynccontextmanager
async def two_peers(second: int = 8) -> AsyncIterator[tuple[Peer, Peer]]:
    """Two that meet: over the network, or, with 7 as the `second`, within the process."""
    tag = uuid.uuid4().hex
    one, other = Peer(7, tag), Peer(second, tag)
    try:
        await one.participant.open(one)
        await other.participant.open(other)
        yield one, other
    finally:
        await one.participant.close()
        await other.participant.close()


async def matched(writer: Writer, reader: Reader) -> None:
    await until(lambda: writer.matched and reader.matched)
