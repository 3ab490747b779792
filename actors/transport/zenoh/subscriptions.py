"""The receiving end of a key: a queue between Zenoh's threads and the loop."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Final

from actors.transport.keyed.protocol import Delivery, Sample
from actors.transport.wakeup import Wakeup
from actors.transport.zenoh import objects
from actors.transport.zenoh.contact import Contacts, Source
from actors.transport.zenoh.traffic import Traffic

_KEEP_ALL: Final = 1000
"""The least number of samples that a KEEP_ALL queue holds before it holds the sender back."""

_PATIENCE: Final = 1.0
"""Seconds for which a full KEEP_ALL queue holds Zenoh's thread back, and so every sender. If the loop hangs for longer, the queue grows."""


class Subscription:
    """A bounded queue of samples, and the callback that gets them on the loop.

    `arrived` is called by Zenoh's threads, everything else by the loop's. The depth of the queue is twice that of the delivery, because what
    arrives in one piece would find the queue of the subscription in the graph just as full. A patient one that asks for no history does not
    wake the loop for its samples, each of which tells when it arrived.

    Invariants: for each sample in the queue a call of `_deliver` waits in the wake-up; after `close`, `take` is not called.
    """

    def __init__(
        self,
        own: str,
        key: str,
        delivery: Delivery,
        take: Callable[[Sample], None],
        wakeup: Wakeup,
        traffic: Traffic,
        declare: Callable[[Subscription], objects.Declared],
        ask: Callable[[Subscription, Source], None],
        forget: Callable[[Subscription], None],
    ) -> None:
        """`own` is this session; `declare` makes Zenoh's subscriber, which calls `arrived`; `ask` asks a publisher for its history, as `Contacts` wants it;
        `forget` is called when the subscription is closed."""
        self._key = key
        self._take = take
        self._wakeup = wakeup
        self._time = wakeup.time
        self._traffic = traffic
        self._queue: deque[tuple[objects.Sample, float]] = deque()
        self._patience = 0.0 if delivery.history else delivery.patience
        self._post = wakeup.post_patiently if self._patience else wakeup.post
        self._holds_back = delivery.keep_all
        self._most = max(delivery.depth, _KEEP_ALL) if delivery.keep_all else 2 * delivery.depth + delivery.history
        self._room = threading.Event()
        self._hangs = False
        self._closed = False
        self._forget = forget
        contacts = Contacts(own, lambda source: ask(self, source), self._pass)
        self.answered, self.complete = contacts.answered, contacts.complete
        self._next = contacts.take if delivery.history else self._pass
        if self._patience:
            wakeup.be_patient(self._patience)
        self._subscriber = declare(self)

    def arrived(self, sample: objects.Sample) -> None:
        """Queue a sample. On a thread of Zenoh; waits if the queue is full and must keep all."""
        if len(self._queue) >= self._most:
            if self._holds_back:
                self._wait_for_room()
            else:
                self._drop_oldest()
        self._queue.append((sample, self._time()))
        self._post(self._deliver, None)

    def close(self) -> None:
        """Take no more samples."""
        if not self._closed:
            self._closed = True
            self._queue.clear()
            self._room.set()
            self._subscriber.undeclare()
            if self._patience:
                self._wakeup.cease(self._patience)
            self._forget(self)

    def _wait_for_room(self) -> None:
        if not self._hangs:
            self._room.clear()
            still_full = len(self._queue) >= self._most and not self._closed  # room may have been made just before
            self._hangs = still_full and not self._room.wait(_PATIENCE)

    def _drop_oldest(self) -> None:
        try:
            oldest, _ = self._queue.popleft()
        except IndexError:  # the loop was faster
            return
        self._traffic.lost(oldest)

    def _deliver(self, _: None) -> None:
        try:
            sample, since = self._queue.popleft()
        except IndexError:  # it was dropped, or the subscription has been closed
            return
        if self._holds_back:
            self._make_room()
        if self._patience:
            self._pass(sample, since)
        else:
            self._next(sample)

    def _pass(self, sample: objects.Sample, since: float | None = None) -> None:
        if self._closed:
            return
        payload = sample.payload.to_bytes()
        attached = sample.attachment
        attachment = b"" if attached is None else attached.to_bytes()
        self._traffic.received(sample, attachment, len(payload))
        self._take(Sample(self._key, payload, attachment, since))

    def _make_room(self) -> None:
        if 2 * len(self._queue) < self._most:
            self._room.set()
            self._hangs = False
