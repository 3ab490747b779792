"""Which participants, writers and readers other processes have."""

from __future__ import annotations

import ctypes as c
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, Protocol, TypeVar

from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.library import BuiltinEndpoint, BuiltinParticipant, Library, SampleInfo
from actors.transport.dds.qos import read_property, read_qos, read_user_data
from actors.transport.dds.reading import Report

T = TypeVar("T")

_PARTICIPANTS: Final = 0x7FFF0001
_PUBLICATIONS: Final = 0x7FFF0003
_SUBSCRIPTIONS: Final = 0x7FFF0004
_BUILTIN: Final = ("DCPSParticipant", "DCPSPublication", "DCPSSubscription", "DCPSTopic")
"""The topics that a participant of this process reads to discover the others."""
_ALIVE: Final = 16
_AT_ONCE: Final = 64
_MOST_NAME: Final = 4096
_MOST_GUIDS: Final = 4096


@dataclass(frozen=True, slots=True)
class RemoteParticipant:
    """A participant of another process, or another one of this process."""

    guid: bytes
    """16 bytes, of which 12 are common to all its endpoints."""
    user_data: bytes
    host: str = ""
    """The name of its machine; empty if it does not tell."""
    process: int = 0
    """Its process id there; 0 if it does not tell."""


@dataclass(frozen=True, slots=True)
class RemoteEndpoint:
    """A reader or writer of another participant."""

    guid: bytes
    participant: bytes
    writes: bool
    """Whether it is a writer."""
    topic: str
    """As it was sent; what is no UTF-8 is U+FFFD."""
    type: str
    qos: EndpointQos
    handle: int
    """Its instance handle in this process, by which `Sample.publication` names it."""


class Events(Protocol):
    """Who has come and gone. Called on the loop; must not raise.

    A participant appears before its endpoints and vanishes after them, each once in a life; one that was silent for longer than its lease
    (10 s as a rule) has vanished, and may appear again.
    """

    def participant_appeared(self, found: RemoteParticipant) -> None: ...

    def participant_vanished(self, found: RemoteParticipant) -> None: ...

    def endpoint_appeared(self, found: RemoteEndpoint) -> None: ...

    def endpoint_changed(self, found: RemoteEndpoint) -> None:
        """Its quality of service has changed."""
        ...

    def endpoint_vanished(self, found: RemoteEndpoint) -> None: ...


class Discovery:
    """Reads the built-in topics, and keeps which participants and endpoints are there.

    Everything is taken on the reading thread, which alone touches the tables; `post` calls on the loop.

    Invariants: an endpoint is in `_endpoints` only while its participant is in `_participants`.
    """

    def __init__(
        self,
        library: Library,
        participant: int,
        own: bytes,
        events: Events,
        post: Callable[[Callable[[Any], None], Any], None],
        guids: dict[int, bytes],
        report: Report,
    ) -> None:
        """`guids` gets the GUID of each endpoint by its instance handle. `post` has something called on the loop."""
        self._library = library
        self._own = own[:12]
        self._events = events
        self._post = post
        self._guids = guids
        self._report = report
        self._participants: dict[bytes, tuple[RemoteParticipant, int]] = {}
        """With the count of its lives."""
        self._endpoints: dict[bytes, tuple[RemoteEndpoint, int]] = {}
        self._readers: dict[int, int] = {
            topic: library.dds_create_reader(participant, topic, None, None)
            for topic in (_PARTICIPANTS, _PUBLICATIONS, _SUBSCRIPTIONS)
        }
        for reader in self._readers.values():
            library.dds_set_status_mask(reader, 1 << 8)

    @property
    def participants(self) -> list[RemoteParticipant]:
        """Those that are there now. From any thread."""
        return [participant for participant, _ in list(self._participants.values())]

    def attach(self, attach: Callable[[int, Callable[[], bool]], None]) -> None:
        """Begin."""
        for reader in self._readers.values():
            attach(reader, self._look)

    def _look(self) -> bool:
        """Take what has come and gone. A participant is announced before its endpoints; so those are taken first, and looked at last."""
        endpoints = [
            (writes, *item)
            for topic, writes in ((_PUBLICATIONS, True), (_SUBSCRIPTIONS, False))
            for item in self._taken(topic, BuiltinEndpoint, self._read_endpoint)
        ]
        gone: list[bytes] = []
        for guid, life, _, read in self._taken(_PARTICIPANTS, BuiltinParticipant, self._read_participant):
            known = self._participants.get(guid)
            if read is None:
                gone.append(guid)
            elif known is None or known[1] != life:
                if known is not None:
                    self._lose(guid)
                participant = RemoteParticipant(guid, *read)
                self._participants[guid] = participant, life
                self._post(self._events.participant_appeared, participant)
        for writes, guid, life, handle, seen in endpoints:
            if seen is None:
                self._endpoint(guid, life, None)
            elif seen[1] not in _BUILTIN:
                self._endpoint(guid, life, _endpoint(guid, writes, handle, *seen))
        for guid in gone:
            self._lose(guid)
        return False

    def _endpoint(self, guid: bytes, life: int, endpoint: RemoteEndpoint | None) -> None:
        known = self._endpoints.get(guid)
        if endpoint is None:
            if known is not None:
                del self._endpoints[guid]
                self._post(self._events.endpoint_vanished, known[0])
            return
        if endpoint.participant not in self._participants:  # it is one of ours, or has gone
            return
        if known is not None and known[1] != life:
            self._post(self._events.endpoint_vanished, known[0])
            known = None
        self._endpoints[guid] = endpoint, life
        self._remember(endpoint)
        if known is None:
            self._post(self._events.endpoint_appeared, endpoint)
        elif known[0] != endpoint:
            self._post(self._events.endpoint_changed, endpoint)

    def _lose(self, guid: bytes) -> None:
        if (known := self._participants.pop(guid, None)) is None:
            return
        for lost in [one for one, (endpoint, _) in self._endpoints.items() if endpoint.participant == guid]:
            self._post(self._events.endpoint_vanished, self._endpoints.pop(lost)[0])
        self._post(self._events.participant_vanished, known[0])

    def _remember(self, endpoint: RemoteEndpoint) -> None:
        """A sample may be taken after its writer has gone; so GUIDs are forgotten late."""
        if len(self._guids) > 2 * len(self._endpoints) + _MOST_GUIDS:
            alive = {known.handle for known, _ in self._endpoints.values()}
            for handle in [handle for handle in self._guids if handle not in alive]:
                del self._guids[handle]
        self._guids[endpoint.handle] = endpoint.guid

    def _taken(self, topic: int, kind: Any, read: Callable[[Any], T]) -> Iterator[tuple[bytes, int, int, T | None]]:
        """GUID, count of lives, instance handle, and what `read` makes of it; None: it has gone."""
        library, reader = self._library, self._readers[topic]
        while True:
            found, infos = (c.c_void_p * _AT_ONCE)(), (SampleInfo * _AT_ONCE)()
            count: int = library.dds_take(reader, found, infos, _AT_ONCE, _AT_ONCE)
            if count <= 0:
                return
            try:
                for where, info in zip(found[:count], infos[:count], strict=True):
                    sample = kind.from_address(where or 0)
                    guid = bytes(sample.key)
                    if guid.startswith(self._own):
                        continue
                    life = info.disposed + info.without_writers
                    if not info.valid or info.instance_state != _ALIVE:
                        yield guid, life, info.instance, None
                        continue
                    try:
                        yield guid, life, info.instance, read(sample)
                    except ValueError as error:
                        self._report.unreadable(f"what it announces ({error})")
            finally:
                library.dds_return_loan(reader, found, count)

    def _read_participant(self, sample: Any) -> tuple[bytes, str, int]:
        host, process = (read_property(self._library, sample.qos, name) for name in (b"__Hostname", b"__Pid"))
        return read_user_data(self._library, sample.qos), host, int(process) if process.isdecimal() else 0

    def _read_endpoint(self, sample: Any) -> tuple[bytes, str, str, EndpointQos]:
        qos = read_qos(self._library, sample.qos)
        return bytes(sample.participant), _name(sample.topic), _name(sample.type), qos


def _endpoint(
    guid: bytes, writes: bool, handle: int, participant: bytes, topic: str, type_name: str, qos: EndpointQos
) -> RemoteEndpoint:
    return RemoteEndpoint(guid, participant, writes, topic, type_name, qos, handle)


def _name(where: int | None) -> str:
    text = c.string_at(where) if where else b""
    if len(text) > _MOST_NAME:
        raise ValueError(f"a name of {len(text)} bytes")
    return text.decode(errors="replace")
