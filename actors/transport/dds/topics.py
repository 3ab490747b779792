"""Publishers and subscriptions of this process on DDS."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from actors.transport.dds.format.qos import EndpointQos
from actors.transport.protocol import Take, TakesTogether

if TYPE_CHECKING:
    from actors.transport.dds.domain import Domain
    from actors.transport.dds.endpoints import Reader, Sample, Status, Writer
    from actors.transport.dds.format.names import DdsNames
    from actors.transport.dds.known import NodeHere

_MOST_WRITERS: Final = 10_000
"""So many writers are counted for one reader, the last ones that were heard."""
_MOST_KEPT: Final = 10_000
"""So many messages of writers that keep some are not taken twice."""


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

    drained = None  # the engine holds back who writes

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

    def assert_liveliness(self) -> None:
        if self._writer is not None:
            self._writer.assert_liveliness()

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
    """A reader, and the takers that it feeds. DDS sends no numbers: the messages of each writer are numbered as they arrive.

    A writer that was lost, as its lease was over, and is found again sends all that it keeps once more; what has been taken is not taken again.
    """

    def __init__(self, domain: Domain, names: DdsNames, qos: EndpointQos, take: Take, patience: float) -> None:
        self._domain = domain
        self._take = take
        self._patient = patience > 0
        self._numbers: OrderedDict[bytes, int] = OrderedDict()
        self._kept: deque[tuple[bytes, int]] | None = deque(maxlen=_MOST_KEPT) if qos.transient_local else None
        """Writer and time of the last messages, if writers keep some."""
        self._repeated: frozenset[tuple[bytes, int]] = frozenset()
        """Those that came before a writer was lost."""
        self._together: Callable[..., bool] | None = None
        if self._kept is None and not self._patient and isinstance(take, TakesTogether):
            self._together = take.together
        self._names = names
        self._qos = qos
        self.heir: Subscription | None = None
        """The subscription that the reader belongs to."""
        self.subscriptions: dict[Subscription, object] = {}
        self.takers: tuple[object, ...] = ()
        """Those of the subscriptions, as each message needs them."""
        self.reader: Reader = domain.engine.reader(
            *names, qos, self._arrived, patience=patience, on_status=self._changed
        )

    def silent(self) -> Reader:
        """A reader of the same that others see, and that hands over nothing."""
        return self._domain.engine.reader(*self._names, self._qos, None)

    def forget(self, subscription: Subscription) -> None:
        """Feed a subscription no more. The reader goes on to another one."""
        del self.subscriptions[subscription]
        self.takers = tuple(self.subscriptions.values())
        if subscription is self.heir:
            self.heir = next(iter(self.subscriptions), None)
            if self.heir is not None:
                self.heir.inherit(self.reader)

    def _arrived(self, samples: list[Sample]) -> None:
        numbers, take, patient, kept = self._numbers, self._take, self._patient, self._kept
        if self._together is not None and self._take_together(self._together, samples):
            return
        for payload, writer, stamp, _, since in samples:
            if not self.takers:  # the last one has gone while others were called
                return
            if kept is not None:
                if (writer, stamp) in self._repeated:
                    continue
                kept.append((writer, stamp))
            numbers[writer] = number = numbers.get(writer, 0) + 1
            if number == 1 and len(numbers) > _MOST_WRITERS:
                numbers.popitem(last=False)
            take(self.takers, writer, number, stamp, payload, since if patient else None)

    def _take_together(self, together: Callable[..., bool], samples: list[Sample]) -> bool:
        """Hand over several samples of one writer that is known. Whether it was done."""
        writer, takers = samples[0].writer, self.takers
        number = self._numbers.get(writer)
        if number is None or not takers or len(samples) == 1 or any(sample.writer != writer for sample in samples):
            return False
        if not together(takers, writer, number + 1, [sample.payload for sample in samples]):
            return False
        self._numbers[writer] = number + len(samples)
        return True

    def _changed(self, status: Status) -> None:
        if status.kind == "matched" and status.change <= 0 and self._kept is not None:
            self._repeated = frozenset(self._kept)
        if status.kind == "liveliness_changed":
            self._domain.known.judged(self.reader.matched_guids(), status)
        if status.kind == "sample_lost" and status.change > 0:
            for taker in self.takers:
                self._domain.events.lost(taker, status.change)


class Subscription:
    """A subscription of this process. Several that demand the same have one reader that is heard, and each other one a silent one of its own,
    so that others count and list them one by one, as those of ROS 2.
    """

    def __init__(self, domain: Domain, node: NodeHere | None, group: object, receiver: Receiver) -> None:
        self._domain = domain
        self._node = node
        self._group = group
        self._silent: Reader | None = None
        if receiver.heir is None:
            receiver.heir = self
            self.gid = receiver.reader.guid
        else:
            self._silent = receiver.silent()
            self.gid = self._silent.guid
        self._shown(True)

    def inherit(self, reader: Reader) -> None:
        """Have the reader that is heard, in place of the silent one."""
        silent, self._silent = self._silent, None
        assert silent is not None
        self._shown(False)
        silent.close()
        self.gid = reader.guid
        self._shown(True)

    def close(self) -> None:
        if self._domain.unsubscribe(self, self._group):
            self._shown(False)
            if self._silent is not None:
                self._silent.close()

    def _shown(self, shown: bool) -> None:
        if self._node is not None:
            (self._node.add if shown else self._node.remove)(reader=self.gid)
