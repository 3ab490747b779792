"""Readers and writers of serialized samples."""

from __future__ import annotations

import ctypes as c
import struct
from collections import Counter, deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Final, Literal, NamedTuple, TypeAlias

from actors.transport.dds import library as native
from actors.transport.dds.format.qos import EndpointQos
from actors.transport.dds.library import DATA_AVAILABLE, TIMEOUT, Library
from actors.transport.dds.qos import POLICIES, the_qos
from actors.transport.dds.reading import Reading, Report
from actors.transport.dds.sending import Sending
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker

KEEP_ALL: Final = 64 * 1024 * 1024
"""The bytes that wait at most in an endpoint that may not drop, on their way to the loop or from it. Then it drops nevertheless."""

LARGE: Final = 32 * 1024
"""A sample of more bytes is written by the thread: it is cut in pieces, for each of which the socket may have to wait."""

MOST_PAYLOAD: Final = 256 * 1024 * 1024
"""The bytes of the largest sample that is taken."""
_AT_ONCE: Final = 64
"""The most samples that are taken from a reader before the others have their turn."""
_BATCH: Final = 32
"""The most samples that are handed over in one call on the loop."""
_SCRATCH: Final = 16 * 1024
_NOBODY: Final = bytes(16)
_BIG_ENDIAN: Final = b"\0\0\0\0"

Kind: TypeAlias = Literal[
    "matched", "incompatible_qos", "deadline_missed", "liveliness_lost", "liveliness_changed", "sample_lost"
]


class Status(NamedTuple):
    """Something that has happened to an endpoint."""

    kind: Kind
    total: int
    """How often so far; of `matched` and `liveliness_changed`: how many are matched or alive now."""
    change: int
    """By how much `total` has changed since the last time."""
    policy: str = ""
    """Of `incompatible_qos`: the policy of the last peer, as `POLICIES` names it."""
    not_alive: int = 0
    """Of `liveliness_changed`: how many are matched and not alive now."""
    peer: bytes = b""
    """Of `liveliness_changed`: the GUID of the last writer that has changed."""


class Sample(NamedTuple):
    """A sample that has arrived."""

    payload: bytes
    """With the 4 bytes that say how it is serialized."""
    writer: bytes
    """The GUID of its writer, 16 bytes; zeros if that was gone too soon to be looked up."""
    stamp: int
    """When it was written, nanoseconds since 1970 on the clock of its writer."""
    publication: int
    """The instance handle of its writer in this process."""
    since: float
    """When it was taken, in seconds on the loop's clock."""


_Status: TypeAlias = dict[int, tuple[Kind, str]]
_OF_WRITERS: Final[_Status] = {
    1 << 1: ("deadline_missed", "dds_get_offered_deadline_missed_status"),
    1 << 3: ("incompatible_qos", "dds_get_offered_incompatible_qos_status"),
    1 << 9: ("liveliness_lost", "dds_get_liveliness_lost_status"),
    1 << 11: ("matched", "dds_get_publication_matched_status"),
}
_OF_READERS: Final[_Status] = {
    1 << 12: ("matched", "dds_get_subscription_matched_status"),
    1 << 2: ("deadline_missed", "dds_get_requested_deadline_missed_status"),
    1 << 4: ("incompatible_qos", "dds_get_requested_incompatible_qos_status"),
    1 << 5: ("sample_lost", "dds_get_sample_lost_status"),
    1 << 10: ("liveliness_changed", "dds_get_liveliness_changed_status"),
}
"""In the order in which they are told: who is matched comes first."""


@dataclass
class Within:
    """What the endpoints of a participant share."""

    library: Library
    participant: int
    wakeup: Wakeup
    reading: Reading
    sending: Sending
    worker: Worker
    report: Report
    guids: dict[int, bytes] = field(default_factory=dict[int, bytes])
    """The GUID of each endpoint of others, by its instance handle."""
    swapped: set[bytes] = field(default_factory=set[bytes])
    """How the GUIDs begin of participants whose samples are big-endian, though Cyclone DDS says otherwise."""
    endpoints: set[Reader | Writer] = field(default_factory=lambda: set["Reader | Writer"]())

    def forget(self, endpoint: Reader | Writer) -> None:
        """It is being closed."""
        self.endpoints.discard(endpoint)

    def delete(self, entity: int) -> None:
        """Delete an entity of the library, which may wait. From any thread."""
        self.worker.do(lambda: self.library.dds_delete(entity))


class Endpoint:
    """What readers and writers have in common.

    Invariants: after `close` no callback is called; the entity of the library lives until the worker deletes it after that.
    """

    _statuses: _Status
    _enabled: int = 0
    _matched_list: str
    _matched_data: str

    def __init__(
        self,
        within: Within,
        topic: str,
        type_name: str,
        qos: EndpointQos,
        on_status: Callable[[Status], None] | None,
        create: Callable[[int, int, int, None], int],
    ) -> None:
        """Raises ValueError if the library refuses the name or the quality of service."""
        self._within = within
        self._library: Library = within.library
        self.topic = topic
        self.type = type_name
        self.qos = qos
        self._on_status = on_status
        self._closed = False
        self._matched = 0
        self._guids: frozenset[bytes] | None = None
        """Of those that are matched; None: they have changed."""
        self.received = Counter[bytes]()
        """The bytes from each writer of others, by its GUID."""
        self._entity = self._created(create)
        guid, handle = (c.c_ubyte * 16)(), c.c_uint64()
        self._library.dds_get_guid(self._entity, guid)
        self._library.dds_get_instance_handle(self._entity, c.byref(handle))
        self.guid = bytes(guid)
        self.handle: int = handle.value
        self._changes = c.c_uint32()
        self._changes_at = c.byref(self._changes)
        self._library.dds_set_status_mask(self._entity, sum(self._statuses) | self._enabled)

    @property
    def matched(self) -> int:
        """How many endpoints of others it is matched with. Reading it costs nothing."""
        return self._matched

    def matched_guids(self) -> frozenset[bytes]:
        """The GUIDs of the endpoints that it is matched with, as of the last status that says so."""
        if self._guids is None:
            self._guids = self._listed()
        return self._guids

    def _listed(self) -> frozenset[bytes]:
        list_them = getattr(self._library, self._matched_list)
        count: int = max(list_them(self._entity, None, 0), 0)
        handles = (c.c_uint64 * count)()
        count = min(count, max(list_them(self._entity, handles, count), 0))
        return frozenset(self._guid_of(handle) for handle in handles[:count]) - {_NOBODY}

    def sent(self) -> Counter[bytes]:
        """The bytes for each reader of others, by its GUID."""
        return Counter()

    def _created(self, create: Callable[[int, int, int, None], int]) -> int:
        library, participant = self._library, self._within.participant
        if "\0" in self.topic or "\0" in self.type:
            raise ValueError(f"no topic of DDS: {self.topic!r} with type {self.type!r}")
        described = native.the_descriptor(self.type)
        topic: int = library.dds_create_topic(participant, c.byref(described), self.topic.encode(), None, None)
        if topic < 0:
            raise ValueError(
                f"Cyclone DDS refuses the topic {self.topic!r} with type {self.type!r} ({native.reason(topic)})"
            )
        try:
            with the_qos(library, self.qos) as qos:
                entity = create(participant, topic, qos, None)
        finally:
            library.dds_delete(topic)  # it lives as long as the endpoint
        if entity < 0:
            raise ValueError(
                f"Cyclone DDS refuses an endpoint of {self.topic} with {self.qos} ({native.reason(entity)})"
            )
        return entity

    def _guid_of(self, handle: int) -> bytes:
        """The GUID of a matched endpoint of others. From any thread."""
        guids = self._within.guids
        if (known := guids.get(handle)) is not None:
            return known
        found = getattr(self._library, self._matched_data)(self._entity, handle)
        if not found:
            return _NOBODY
        guid = guids[handle] = c.string_at(found, 16)
        self._library.dds_builtintopic_free_endpoint(found)
        return guid

    def _look(self) -> None:
        """Hand over the statuses that have changed. On the reading thread."""
        if self._library.quick.dds_get_status_changes(self._entity, self._changes_at) != 0:
            return  # it is being deleted
        if not (changes := self._changes.value & ~DATA_AVAILABLE):
            return
        for bit, (kind, getter) in self._statuses.items():
            if changes & bit:
                raw = native.Status()
                if getattr(self._library, getter)(self._entity, c.byref(raw)) == 0:
                    self._within.wakeup.post(self._tell, self._status(kind, raw))

    def _status(self, kind: Kind, raw: native.Status) -> Status:
        if kind == "matched":
            return Status(kind, raw.third, raw.fourth)
        if kind == "liveliness_changed":
            return Status(kind, raw.total, raw.third, not_alive=raw.change, peer=self._guid_of(raw.last))
        policy = POLICIES.get(raw.third, "INVALID") if kind == "incompatible_qos" else ""
        return Status(kind, raw.total, raw.change, policy)

    def _tell(self, status: Status) -> None:
        if self._closed:
            return
        if status.kind == "matched":
            self._matched = status.total
            self._guids = None
            self._rematched()
        if self._on_status is not None:
            self._on_status(status)

    def _rematched(self) -> None:
        """It is matched with others than before."""


class Writer(Endpoint):
    """Writes at once what Cyclone DDS takes at once, and by the sending thread what has to wait.

    A writer is full while reliable readers have not acknowledged about half a megabyte. KEEP_LAST then drops the oldest of more samples than its
    depth.

    Invariants: samples are written in their order: none directly while `_with_thread`. The loop sets it, the thread clears it when its queue
    is empty. The loop alone writes `_handed`, the thread alone `_done`; both count bytes.
    """

    _statuses = _OF_WRITERS
    _matched_list, _matched_data = "dds_get_matched_subscriptions", "dds_get_matched_subscription_data"

    def __init__(
        self, within: Within, topic: str, type_name: str, qos: EndpointQos, on_status: Callable[[Status], None] | None
    ) -> None:
        super().__init__(within, topic, type_name, qos, on_status, within.library.dds_create_writer)
        type_here = c.c_void_p()
        self._library.dds_get_entity_sertype(self._entity, c.byref(type_here))
        self._type_here = type_here.value
        self._queue: deque[bytes] = deque()
        self._head: bytes | None = None
        self._head_serialized: int | None = None
        self._with_thread = False
        self._handed = 0
        self._done = 0
        self._gone = False
        self.unsent = 0
        """Samples that this side has dropped."""
        self._bytes = 0
        self._sent = Counter[bytes]()
        self._lost = Counter[bytes]()
        self._since: dict[bytes, tuple[int, int]] = {}
        """The bytes, and the samples that were dropped, before a reader was matched."""
        quick = self._library.quick
        self._serialized, self._write = quick.ddsi_serdata_from_ser_iov, quick.dds_writecdr
        self._vector = native.Vector()
        self._vector_at = c.byref(self._vector)
        within.reading.attach(self._entity, self._taken)

    @property
    def waiting(self) -> int:
        """How many samples wait to be written."""
        return len(self._queue) + (self._head is not None)

    def put(self, payload: bytes) -> None:
        """Write one sample, with the 4 bytes that say how it is serialized. Never waits, never raises."""
        if self._closed:
            return
        size = len(payload)
        if size & 3:
            payload = payload.ljust((size + 3) & ~3, b"\0")
        self._bytes += size
        if size > LARGE or self._with_thread or not self._write_now(payload):
            self._hand_over(payload)

    def sent(self) -> Counter[bytes]:
        """The bytes for each reader of others, by its GUID: what was put while it was matched."""
        return self._sent + Counter({guid: self._bytes - before for guid, (before, _) in self._since.items()})

    def losses(self) -> Counter[bytes]:
        return self._lost + Counter({guid: self.unsent - before for guid, (_, before) in self._since.items()})

    def _rematched(self) -> None:
        guids = self.matched_guids()
        for gone in self._since.keys() - guids:
            written, dropped = self._since.pop(gone)
            self._sent[gone] += self._bytes - written
            self._lost[gone] += self.unsent - dropped
        for new in guids - self._since.keys():
            self._since[new] = self._bytes, self.unsent

    def assert_liveliness(self) -> None:
        """Tell the readers that its owner is alive, with MANUAL_BY_TOPIC."""
        if not self._closed:
            self._library.dds_assert_liveliness(self._entity)

    def close(self) -> None:
        """Write no more samples. Those that wait are written, within a second."""
        if not self._closed:
            self._closed = True
            self._within.reading.detach(self._entity)
            self._within.forget(self)
            self._within.sending.close(self)

    def _taken(self) -> bool:
        self._look()
        return False

    def _write_now(self, payload: bytes) -> bool:
        """Whether it was written, or never will be. On the loop."""
        vector = self._vector
        vector.base, vector.length = payload, len(payload)
        serialized = self._serialized(self._type_here, 2, 1, self._vector_at, len(payload))
        if not serialized:  # nothing that is serialized by XCDR1, or nothing at all
            self.unsent += 1
            return True
        code: int = self._write(self._entity, serialized)
        if code == TIMEOUT:
            return False
        if code != 0:
            self.unsent += 1
        return True

    def _hand_over(self, payload: bytes) -> None:
        if self.qos.keep_all:
            if self._handed - self._done > KEEP_ALL:
                self.unsent += 1
                return
        elif len(self._queue) >= self.qos.depth:
            self._drop_oldest()
        self._handed += len(payload)
        self._queue.append(payload)
        if not self._with_thread:
            self._with_thread = True
            self._within.sending.write(self)

    def _drop_oldest(self) -> None:
        try:
            oldest = self._queue.popleft()
        except IndexError:  # the thread was faster: nothing is dropped
            return
        self._handed -= len(oldest)
        self.unsent += 1

    # what follows is called by the sending thread

    def write_next(self, vector: native.Vector) -> bool:
        """Write what waits, until there is nothing left, or no room. Returns whether nothing is left."""
        library = self._library
        while True:
            if self._head is None:
                try:
                    self._head = self._queue.popleft()
                except IndexError:
                    self._with_thread = False
                    if not self._queue or self._with_thread:  # otherwise the loop has appended one just before
                        return True
                    self._with_thread = True
                    continue
                vector.base, vector.length = self._head, len(self._head)
                self._head_serialized = library.ddsi_serdata_from_ser_iov(
                    self._type_here, 2, 1, c.byref(vector), len(self._head)
                )
            code: int = -1
            if self._head_serialized:
                library.ddsi_serdata_ref(self._head_serialized)  # a write takes one, also if it fails
                code = library.dds_writecdr(self._entity, self._head_serialized)
                if code == TIMEOUT:
                    return False
            self._let_go()
            self._done += len(self._head)
            self._head = None
            if code != 0:
                self.unsent += 1

    def _let_go(self) -> None:
        if self._head_serialized:
            self._library.ddsi_serdata_unref(self._head_serialized)
        self._head_serialized = None

    def wait(self, seconds: float) -> None:
        """Wait until all readers have acknowledged everything, but no longer than `seconds`."""
        self._library.dds_wait_for_acks(self._entity, int(seconds * 1e9))

    def end(self) -> None:
        """Drop what still waits, and have the entity deleted."""
        self.unsent += self.waiting
        self._queue.clear()
        self._head = None
        self._let_go()
        self._within.delete(self._entity)


_INFO: Final = struct.Struct("=12x?3xq8xQ24x")  # valid, stamp, publication
assert _INFO.size == c.sizeof(native.SampleInfo)


class Reader(Endpoint):
    """A bounded queue of samples, and the callback that gets them on the loop.

    The queue is twice as deep as the reader's history, because what arrives in one piece would find the queue of the subscription in the graph
    just as full.

    Invariants: while samples are in the queue, a call of `_deliver` waits in the wake-up; after `close`, `take` is not called.
    """

    _statuses = _OF_READERS
    _enabled = DATA_AVAILABLE
    _matched_list, _matched_data = "dds_get_matched_publications", "dds_get_matched_publication_data"

    def __init__(
        self,
        within: Within,
        topic: str,
        type_name: str,
        qos: EndpointQos,
        take: Callable[[list[Sample]], None] | None,
        patience: float,
        on_status: Callable[[Status], None] | None,
        last: bool = False,
    ) -> None:
        """`take` is called on the loop with the samples that have arrived, in their order. `patience`: see `protocol.Delivery`.

        With `last` it is called after that of other readers to which something was sent before; see `Reading`.
        """
        super().__init__(within, topic, type_name, qos, on_status, within.library.dds_create_reader)
        self._take = take
        self._wakeup = within.wakeup
        self._time = within.wakeup.time
        self._patience = 0.0 if qos.transient_local else patience
        self._post = within.wakeup.post_patiently if self._patience else within.wakeup.post
        self._queue: deque[Sample] = deque()
        self._posted = False
        self._most = 2 * qos.depth
        self._taken_bytes = 0
        self._delivered_bytes = 0
        self._losses = Counter[bytes]()
        self.lost = 0
        """Samples that the network has lost."""
        self._infos = bytearray(_AT_ONCE * _INFO.size)
        self._infos_at = (c.c_char * len(self._infos)).from_buffer(self._infos)
        self._found = (c.c_void_p * _AT_ONCE)()
        self._scratch = bytearray(_SCRATCH)
        self._scratch_at = (c.c_char * _SCRATCH).from_buffer(self._scratch)
        if self._patience:
            self._wakeup.be_patient(self._patience)
        self._held = within.reading.held if last else None
        within.reading.attach(self._entity, self._taken, last=last)

    @property
    def dropped(self) -> int:
        """Samples dropped on the way to the loop, which did not keep up."""
        return self._losses.total()

    def losses(self) -> Counter[bytes]:
        return self._losses.copy()

    def close(self) -> None:
        """Take no more samples."""
        if not self._closed:
            self._closed = True
            self._within.reading.detach(self._entity)
            self._within.forget(self)
            self._queue.clear()
            if self._patience:
                self._wakeup.cease(self._patience)
            self._within.delete(self._entity)

    def _tell(self, status: Status) -> None:
        if status.kind == "sample_lost":
            self.lost = status.total
        super()._tell(status)

    def _taken(self) -> bool:
        """Take what has arrived. On the reading thread. Returns whether there may be more."""
        self._look()
        quick = self._library.quick
        count: int = quick.dds_takecdr(self._entity, self._found, _AT_ONCE, self._infos_at, native.ANY_STATE)
        if count <= 0 or self._closed or self._take is None:
            for serialized in self._found[: max(count, 0)]:
                quick.ddsi_serdata_unref(serialized)
            return count == _AT_ONCE and not self._closed
        now = self._time()
        guids, swapped = self._within.guids, self._within.swapped
        for serialized, (valid, stamp, publication) in zip(
            self._found[:count], _INFO.iter_unpack(memoryview(self._infos)[: count * _INFO.size]), strict=True
        ):
            if valid and (payload := self._payload(serialized)):
                writer = guids.get(publication) or self._guid_of(publication)
                if swapped and writer[:12] in swapped:
                    payload = _BIG_ENDIAN + payload[4:]
                self._keep(Sample(payload, writer, stamp, publication, now))
            quick.ddsi_serdata_unref(serialized)
        if self._queue and not self._posted:
            self._posted = True
            if self._held is None:
                self._post(self._deliver, None)
            else:
                self._held.append(partial(self._post, self._deliver, None))
        return count == _AT_ONCE

    def _payload(self, serialized: int | None) -> bytes:
        quick = self._library.quick
        size: int = quick.ddsi_serdata_size(serialized)
        if size <= _SCRATCH:
            quick.ddsi_serdata_to_ser(serialized, 0, size, self._scratch_at)
            return bytes(self._scratch[:size])
        if size > MOST_PAYLOAD:
            self._within.report.unreadable(f"a sample of {size} bytes on {self.topic}")
            return b""
        region = native.Region()
        held = quick.ddsi_serdata_to_ser_ref(serialized, 0, size, c.byref(region))
        payload = c.string_at(region.base, size)
        quick.ddsi_serdata_to_ser_unref(held, c.byref(region))
        return payload

    def _keep(self, sample: Sample) -> None:
        queue = self._queue
        if self.qos.keep_all:
            if self._taken_bytes - self._delivered_bytes > KEEP_ALL:
                self._losses[sample.writer] += 1
                return
            self._taken_bytes += len(sample.payload)
        elif len(queue) >= self._most:
            with suppress(IndexError):  # the loop was faster
                self._losses[queue.popleft().writer] += 1
        queue.append(sample)

    def _deliver(self, _: None) -> None:
        self._posted = False  # before the first is taken: what comes from here on is seen below, or posted again
        queue, batch = self._queue, list[Sample]()
        while len(batch) < _BATCH:
            try:
                batch.append(queue.popleft())
            except IndexError:
                break
        if queue and not self._posted:
            self._posted = True
            self._wakeup.post(self._deliver, None)
        if batch and not self._closed and self._take is not None:
            self._delivered_bytes += sum(len(sample.payload) for sample in batch)
            for sample in batch:
                self.received[sample.writer] += len(sample.payload)
            self._take(batch)
