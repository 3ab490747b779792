"""What a simulated process declares to the others: tokens, subscriptions, servers; and its outlets, with what they send."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import TypeAlias

from actors.transport.keyed.protocol import Delivery, Query, Sample, Take
from actors.transport.simulated.link import Flow, Message, Stream


class Announcement:
    """A token, until it is closed."""

    def __init__(self, token: str, withdraw: Callable[[Declared], None]) -> None:
        self.token = token
        self.closed = False
        self._withdraw = withdraw

    def close(self) -> None:
        if not self.closed:
            self.closed = True
            self._withdraw(self)


class Subscription:
    """Invariants: `take` gets the samples of an outlet in the order of their numbers, each at most once, and none after `close`."""

    def __init__(self, key: str, history: int, take: Take, withdraw: Callable[[Declared], None]) -> None:
        self.key = key
        self.history = history
        self.closed = False
        self._take = take
        self._withdraw = withdraw
        self._latest: dict[Outlet, int] = {}

    def receive(self, outlet: Outlet, number: int, sample: Sample) -> bool:
        """Take it, unless it comes late or again. Whether it did not."""
        if number <= self._latest.get(outlet, 0):
            return False
        if not self.closed:
            self._latest[outlet] = number
            self._take(sample)
        return True

    def close(self) -> None:
        if not self.closed:
            self.closed = True
            self._latest.clear()
            self._withdraw(self)


class Server:
    """The server that answers the questions on a key."""

    def __init__(self, key: str, take: Callable[[Query], None], withdraw: Callable[[Declared], None]) -> None:
        self.key = key
        self.take = take
        self.closed = False
        self._withdraw = withdraw

    def close(self) -> None:
        if not self.closed:
            self.closed = True
            self._withdraw(self)


Declared: TypeAlias = Announcement | Subscription | Server
"""What a process shows to the others, in the order in which it was declared."""


class Outlet:
    """The sending end of a key.

    Invariants: there is a flow to each connected process of which a subscription is known, and to no other; a subscription gets what is
    put from the moment it is known here, and before that what was kept. The samples are numbered from 1.
    """

    def __init__(
        self,
        key: str,
        delivery: Delivery,
        known: Iterable[tuple[Stream, Iterable[Subscription]]],
        changed: Callable[[Outlet], None],
        closes: Callable[[Outlet], None],
    ) -> None:
        self.key = key
        self.delivery = delivery
        self._flows: dict[Stream, tuple[Flow, tuple[Subscription, ...]]] = {}
        self._kept: deque[tuple[int, Sample]] = deque(maxlen=delivery.history)
        self._number = 0
        self._closed = False
        self._changed = changed
        self._closes = closes
        for stream, subscriptions in known:
            self._flows[stream] = self._flow(stream), tuple(subscriptions)

    drained = None  # what is sent waits on the link

    @property
    def wanted(self) -> bool:
        return bool(self._flows)

    def put(self, payload: bytes, attachment: bytes) -> None:
        self._number = number = self._number + 1
        if not (self._flows or self._kept.maxlen):
            return
        sample = Sample(self.key, payload, attachment)
        self._kept.append((number, sample))
        for flow, subscriptions in self._flows.values():
            flow.stream.send(_Published(flow, self, subscriptions, number, sample))

    def join(self, stream: Stream, subscription: Subscription) -> None:
        """A subscription of the process at the end of `stream` has become known."""
        if self._closed:
            return
        wanted = self.wanted
        if count := min(self.delivery.history, subscription.history):
            kept = list(self._kept)[-count:]
            stream.send(_Kept(stream, self, subscription, kept))
        flow, others = self._flows.get(stream) or (self._flow(stream), ())
        self._flows[stream] = flow, (*others, subscription)
        if not wanted:
            self._changed(self)

    def leave(self, stream: Stream, subscriptions: Iterable[Subscription]) -> None:
        """These subscriptions of the process at the end of `stream` are gone."""
        if stream not in self._flows:  # closed while all outlets of the key are gone through
            return
        flow, known = self._flows[stream]
        if left := tuple(one for one in known if one not in subscriptions):
            self._flows[stream] = flow, left
            return
        del self._flows[stream]
        if not self._flows:
            self._changed(self)

    def _flow(self, stream: Stream) -> Flow:
        return Flow(stream, 0 if self.delivery.keep_all else self.delivery.depth)

    def close(self) -> None:
        self._closed = True
        self._flows.clear()
        self._kept.clear()
        self._closes(self)


class _Published(Message):
    """One sample, for those subscriptions of a process that were known when it was put."""

    __slots__ = ("_number", "_outlet", "_sample", "_subscriptions")

    def __init__(
        self, flow: Flow, outlet: Outlet, subscriptions: tuple[Subscription, ...], number: int, sample: Sample
    ) -> None:
        delivery = outlet.delivery
        size = len(sample.payload) + len(sample.attachment)
        super().__init__(flow.stream, size, delivery.priority, delivery.reliable, flow)
        self._outlet = outlet
        self._subscriptions = subscriptions
        self._number = number
        self._sample = sample

    def deliver(self) -> None:
        for subscription in self._subscriptions:
            if not subscription.receive(self._outlet, self._number, self._sample):
                self.stream.late += 1


class _Kept(Message):
    """Samples that were put before their subscription was known. What it has got in an earlier connection does not count as dropped."""

    __slots__ = ("_outlet", "_samples", "_subscription")

    def __init__(
        self, stream: Stream, outlet: Outlet, subscription: Subscription, samples: list[tuple[int, Sample]]
    ) -> None:
        size = sum(len(sample.payload) + len(sample.attachment) for _, sample in samples)
        super().__init__(stream, size, outlet.delivery.priority)
        self._outlet = outlet
        self._subscription = subscription
        self._samples = samples

    def deliver(self) -> None:
        for number, sample in self._samples:
            self._subscription.receive(self._outlet, number, sample)
