"""A participant: the process in one domain of DDS."""

from __future__ import annotations

import asyncio
import ctypes as c
import threading
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from actors.transport.dds.config import DdsConfig, domain_settings
from actors.transport.dds.discovery import Discovery, Events, RemoteParticipant
from actors.transport.dds.endpoints import Reader, Sample, Status, Within, Writer
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.library import Library, load, reason
from actors.transport.dds.reading import Reading, Report
from actors.transport.dds.sending import Sending
from actors.transport.protocol import WireUnavailable
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker

_PRECONDITION: Final = -4


class Traffic(NamedTuple):
    """What has been exchanged with another participant, in bytes of samples, and how many samples this side has dropped."""

    participant: RemoteParticipant
    sent_bytes: int
    received_bytes: int
    dropped: int


class Participant:
    """Readers, writers and discovery in one domain. Everything is called on the loop, and calls back on it.

    It has three threads: one reads, one writes what has to wait, one opens and closes. Cyclone DDS has its own, which last until the last
    participant of its domain in this process is closed.
    """

    def __init__(self, config: DdsConfig, user_data: bytes = b"") -> None:
        """`user_data` is told to all other participants."""
        self._config = config
        self._user_data = user_data
        self._within: Within | None = None
        self._discovery: Discovery | None = None
        self._report = Report()
        self.guid = b""
        """16 bytes; known after `open`."""

    async def open(self, events: Events) -> None:
        """Enter the domain, and begin to tell `events` who is there. Raises WireUnavailable."""
        library = load()
        worker = Worker("dds worker")
        entered: list[tuple[int, bytes]] = []
        try:
            await worker.result(lambda: entered.append(_entered(library, self._config, self._user_data)))
        except BaseException:  # also if the waiting is cancelled, and the worker enters nevertheless
            worker.do(lambda: _leave(library, entered, self._config))
            worker.close()
            raise
        participant, self.guid = entered[0]
        wakeup = Wakeup(asyncio.get_running_loop())
        report = self._report
        reading = Reading(library, participant, report)
        within = self._within = Within(library, participant, wakeup, reading, Sending(), worker, report)
        self._discovery = discovery = Discovery(
            library, participant, self.guid, events, wakeup.post, within.guids, report
        )
        discovery.attach(reading.attach)

    async def close(self) -> None:
        """Withdraw everything and leave the domain; what waits to be written is written within a second. Never raises."""
        within, self._within = self._within, None
        if within is None:
            return
        within.wakeup.close()
        for endpoint in list(within.endpoints):
            endpoint.close()

        def leave() -> None:
            within.reading.close()
            within.sending.end()
            _leave(within.library, [(within.participant, self.guid)], self._config)

        try:
            await within.worker.result(leave)
        finally:  # also if the waiting is cancelled
            within.worker.close()

    @property
    def unreadable(self) -> int:
        """How much was dropped because it was malformed or too large."""
        return self._report.count

    def writer(
        self,
        topic: str,
        type_name: str,
        qos: EndpointQos,
        on_status: Callable[[Status], None] | None = None,
    ) -> Writer:
        """Open a writer of `topic`, as DDS names it. Raises ValueError if Cyclone DDS refuses the name or the quality of service."""
        within = self._open_within()
        writer = Writer(within, topic, type_name, qos, on_status)
        within.endpoints.add(writer)
        return writer

    def reader(
        self,
        topic: str,
        type_name: str,
        qos: EndpointQos,
        take: Callable[[list[Sample]], None] | None,
        *,
        patience: float = 0.0,
        on_status: Callable[[Status], None] | None = None,
        last: bool = False,
    ) -> Reader:
        """Open a reader of `topic`, as DDS names it. `take` gets what has arrived; None: it is dropped. Raises ValueError as `writer` does.

        With `last` it gets something after what others have got that was sent before it.
        """
        within = self._open_within()
        reader = Reader(within, topic, type_name, qos, take, patience, on_status, last)
        within.endpoints.add(reader)
        return reader

    def swap(self, guid: bytes, swapped: bool) -> None:
        """Take the samples of a participant as big-endian from now on, or as they come."""
        known = self._open_within().swapped
        (known.add if swapped else known.discard)(guid[:12])

    def report(self) -> tuple[Traffic, ...]:
        """What the endpoints that are open now have exchanged with each participant that is there."""
        if self._within is None or self._discovery is None:
            return ()
        sums = sent, received, dropped = Counter[bytes](), Counter[bytes](), Counter[bytes]()
        for endpoint in self._within.endpoints:
            for into, counts in zip(sums, (endpoint.sent(), endpoint.received, endpoint.losses()), strict=True):
                for guid, count in counts.items():
                    into[guid[:12]] += count
        return tuple(
            Traffic(participant, sent[prefix], received[prefix], dropped[prefix])
            for participant in self._discovery.participants
            for prefix in (participant.guid[:12],)
        )

    def _open_within(self) -> Within:
        if self._within is None:
            raise RuntimeError("the participant is not open")
        return self._within


@dataclass
class _Domain:
    handle: int
    settings: str
    users: int = 0


_domains: Final[dict[int, _Domain]] = {}
_lock: Final = threading.Lock()


def _entered(library: Library, config: DdsConfig, user_data: bytes) -> tuple[int, bytes]:
    """The participant and its GUID. Raises WireUnavailable."""
    settings = domain_settings(config)
    with _lock:
        domain = _domains.get(config.domain) or _opened_domain(library, config, settings)
        if domain.settings != settings:
            raise WireUnavailable(
                f"this process is in DDS domain {config.domain} with another discovery range, peers or CYCLONEDDS_URI:"
                " give both the same, or use another domain"
            )
        qos = library.dds_create_qos()
        library.dds_qset_userdata(qos, user_data, len(user_data))
        participant: int = library.dds_create_participant(config.domain, qos, None)
        library.dds_delete_qos(qos)
        if participant < 0:
            if not domain.users:
                _close_domain(library, config.domain)
            raise WireUnavailable(f"Cyclone DDS cannot enter domain {config.domain} ({reason(participant)})")
        domain.users += 1
    guid = (c.c_ubyte * 16)()
    library.dds_get_guid(participant, guid)
    return participant, bytes(guid)


def _opened_domain(library: Library, config: DdsConfig, settings: str) -> _Domain:
    handle: int = library.dds_create_domain(config.domain, settings.encode())
    if handle < 0 and handle != _PRECONDITION:  # then somebody else in this process has opened it
        check = f"CYCLONEDDS_URI={config.uri}" if config.uri else "the network interfaces"
        raise WireUnavailable(
            f"Cyclone DDS cannot open domain {config.domain}, for the reason that it has written above: check {check},"
            " and whether more than 32 participants run on this host"
        )
    domain = _domains[config.domain] = _Domain(handle, settings)
    return domain


def _leave(library: Library, participants: list[tuple[int, bytes]], config: DdsConfig) -> None:
    for participant, _ in participants:
        with _lock:
            library.dds_delete(participant)
            _domains[config.domain].users -= 1
            if not _domains[config.domain].users:
                _close_domain(library, config.domain)


def _close_domain(library: Library, number: int) -> None:
    domain = _domains.pop(number)
    if domain.handle >= 0:
        library.dds_delete(domain.handle)
