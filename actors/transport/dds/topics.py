"""Publishers and subscriptions of this process on DDS."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from actors.transport.dds.qos import EndpointQos

if TYPE_CHECKING:
    from actors.transport.dds.domain import Domain
    from actors.transport.dds.endpoints import Reader, Sample, Status, Writer
    from actors.transport.dds.format.names import DdsNames
    from actors.transport.dds.nodes import NodeHere
    from actors.transport.protocol import Take

_MOST_WRITERS: Final = 10_000
"""So many writers are counted for one reader, the last ones that were heard."""


class Publisher:
    """A publisher of this process. Invariant: there is a writer from the first `show` or `open` until `close`."""

    def __init__(self, domain: Domain, node: NodeHere | None, names: DdsNames, qos: EndpointQos) -> None:
        self._domain = domain
        self._node = node
        self._names = names
        self._qos = qos
        self._writer: Writer | None = None
        self._opened = False
        self.wanted = False
        self.put: Callable[[bytes, int, int], None] = _unopened

    @property
    def gid(self) -> bytes:
        return b"" if self._writer is None else self._writer.guid

    def show(self) -> None:
        if self._writer is None:
            self._writer = self._domain.engine.writer(*self._names, self._qos, self._changed)
            if self._node is not None:
                self._node.add(writer=self._writer.guid)

    def open(self) -> None:
        self.show()
        if not self._opened and self._writer is not None:
            self._opened = True
            self.wanted = self._writer.matched > 0
            put = self._writer.put

            def put_payload(payload: bytes, number: int, source_time: int) -> None:
                put(payload)

            self.put = put_payload

    def close(self) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            if self._node is not None:
                self._node.remove(writer=writer.guid)
            writer.close()
        self.put = _unopened

    def _changed(self, status: Status) -> None:
        if status.kind == "matched" and self._opened and self._writer is not None:
            wanted = status.total > 0
            if wanted != self.wanted:
                self.wanted = wanted
                self._domain.events.wanted(self)


def _unopened(payload: bytes, number: int, source_time: int) -> None:
    """A publisher that is not open sends nothing."""


class Receiver:
    """A reader, and the takers that it feeds. DDS sends no numbers: the messages of each writer are numbered as they arrive."""

    def __init__(self, domain: Domain, names: DdsNames, qos: EndpointQos, take: Take, patience: float) -> None:
        self._domain = domain
        self._take = take
        self._patient = patience > 0
        self._numbers: OrderedDict[bytes, int] = OrderedDict()
        self.subscriptions: dict[Subscription, object] = {}
        self.takers: tuple[object, ...] = ()
        """Those of the subscriptions, as each message needs them."""
        self.reader: Reader = domain.engine.reader(
            *names, qos, self._arrived, patience=patience, on_status=self._changed
        )

    def _arrived(self, samples: list[Sample]) -> None:
        numbers, take, patient = self._numbers, self._take, self._patient
        for payload, writer, stamp, _, since in samples:
            if not self.takers:  # the last one has gone while others were called
                return
            numbers[writer] = number = numbers.get(writer, 0) + 1
            if number == 1 and len(numbers) > _MOST_WRITERS:
                numbers.popitem(last=False)
            take(self.takers, writer, number, stamp, payload, since if patient else None)

    def _changed(self, status: Status) -> None:
        if status.kind == "sample_lost" and status.change > 0:
            for taker in self.takers:
                self._domain.events.lost(taker, status.change)


class Subscription:
    """A subscription of this process. Several that demand the same have one reader, which then stands under each of their nodes."""

    def __init__(self, domain: Domain, node: NodeHere | None, group: object, receiver: Receiver) -> None:
        self.gid = receiver.reader.guid
        self._domain = domain
        self._node = node
        self._group = group
        if node is not None:
            node.add(reader=self.gid)

    def close(self) -> None:
        if self._domain.unsubscribe(self, self._group) and self._node is not None:
            self._node.remove(reader=self.gid)
