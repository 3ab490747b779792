"""Topics of DDS as devices use them that are no nodes of ROS: robots, drives and sensors whose makers chose DDS."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import Generic

from actors.checks import NoPublicConstructor, create
from actors.interfaces.cdr import decode, encode
from actors.interfaces.errors import CdrError
from actors.interfaces.message import M
from actors.transport.dds.config import DdsConfig
from actors.transport.dds.discovery import RemoteEndpoint, RemoteParticipant
from actors.transport.dds.endpoints import Sample, Writer
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.participant import Participant
from actors.transport.format.names import write_type


class RawWriter(Generic[M], metaclass=NoPublicConstructor):
    """Writes messages of one topic; no public constructor: it comes from `RawTopics.writer`."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer

    @property
    def matched(self) -> int:
        """How many readers of others hear it now."""
        return self._writer.matched

    def write(self, message: M) -> None:
        """Send one message. Never waits. Raises `CdrError` for a text that no message can carry."""
        self._writer.put(encode(message))


class RawTopics:
    """A participant of one domain that reads and writes topics by their names in DDS, such as ``rt/lowstate``. It has no nodes, and ROS shows none.

    ``async with RawTopics(DdsConfig(domain=1)) as topics:`` enters the domain, and leaves it at the end. It raises `WireUnavailable` where
    Cyclone DDS is not installed (``pip install "robactor[dds]"``) or cannot enter. Everything is called on the loop, and calls back on it.
    """

    def __init__(self, config: DdsConfig | None = None) -> None:
        self._participant = Participant(config or DdsConfig())
        self._others = _Others()
        self.unreadable = 0
        """Messages that were dropped because their bytes are not those of the type."""

    async def __aenter__(self) -> RawTopics:
        await self._participant.open(self._others)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._participant.close()

    def writer(self, topic: str, type: type[M], *, depth: int = 1) -> RawWriter[M]:
        """Write `topic`; reliably for those who ask for that. Raises `ValueError` if Cyclone DDS refuses the name."""
        writer = self._participant.writer(topic, write_type(type.__ros_type__), EndpointQos(depth=depth))
        return create(RawWriter, writer)  # pyright: ignore[reportUnknownVariableType]

    def reader(
        self, topic: str, type: type[M], take: Callable[[M], None], *, depth: int = 1, reliable: bool = False
    ) -> None:
        """Have `take` called with each message of `topic`; it must not raise. Raises `ValueError` if Cyclone DDS refuses the name."""
        qos = EndpointQos(reliable=reliable, depth=depth)
        self._participant.reader(topic, write_type(type.__ros_type__), qos, partial(self._taken, type, take))

    def writers(self, topic: str) -> int:
        """How many writers of `topic` others have, of any type, as far as is discovered by now."""
        return self._others.writers[topic]

    def _taken(self, type: type[M], take: Callable[[M], None], samples: list[Sample]) -> None:
        for sample in samples:
            try:
                message = decode(type, sample.payload)
            except CdrError:
                self.unreadable += 1
            else:
                take(message)


class _Others:
    """Counts the writers of others by topic (`discovery.Events`)."""

    def __init__(self) -> None:
        self.writers: Counter[str] = Counter()

    def participant_appeared(self, found: RemoteParticipant) -> None:
        """Participants do not matter."""

    def participant_vanished(self, found: RemoteParticipant) -> None:
        """They do not matter."""

    def endpoint_appeared(self, found: RemoteEndpoint) -> None:
        self.writers[found.topic] += found.writes

    def endpoint_changed(self, found: RemoteEndpoint) -> None:
        """Its quality of service does not matter."""

    def endpoint_vanished(self, found: RemoteEndpoint) -> None:
        self.writers[found.topic] -= found.writes
