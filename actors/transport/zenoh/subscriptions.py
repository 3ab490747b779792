"""The receiving end of a key: a queue between Zenoh's threads and the loop."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from math import inf
from time import perf_counter
from typing import Any, ClassVar, Final

from actors.transport.keyed.protocol import Delivery, Sample, Take, TakesTogether
from actors.transport.protocol import Wait
from actors.transport.wakeup import Wakeup
from actors.transport.zenoh import objects
from actors.transport.zenoh.contact import Contacts, Source
from actors.transport.zenoh.library import keep_thread_state
from actors.transport.zenoh.memory import LARGE
from actors.transport.zenoh.traffic import GID, Traffic

_KEEP_ALL: Final = 1000
"""The least number of samples that a KEEP_ALL queue holds before it holds the sender back."""

_PATIENCE: Final = 1.0
_PAUSE: Final = 0.001
"""Seconds for which a full KEEP_ALL queue holds Zenoh's thread back, and so every sender: at first, and for each sample after that. So what comes from
others on the link is late, but not held back for as long as a reader hangs; the queue grows meanwhile."""

_BEYOND: Final = 64 * 1024 * 1024
"""By so many bytes it grows at most, as that of an outlet: then it drops the oldest sample nevertheless."""
_OF_A_SAMPLE: Final = 1000
"""The bytes that a sample takes besides its payload, about."""

_TOGETHER: Final = 64
"""The most samples that are passed on together; all of them have about as many bytes as a large one, at most."""

_sample: Final[Callable[[tuple[str, bytes, bytes, float | None]], Sample]] = partial(tuple.__new__, Sample)  # pyright: ignore[reportUnknownMemberType]
"""Makes a `Sample` in half the time that its class takes."""


class Subscription:
    """A bounded queue of samples, and the callback that gets them on the loop.

    `arrived` is called by Zenoh's threads, everything else by the loop's. The depth of the queue is twice that of the delivery, because what
    arrives in one piece would find the queue of the subscription in the graph just as full. A patient one that asks for no history does not
    wake the loop for its samples, each of which tells when it arrived.

    Invariants: while a sample is in the queue a call of `_deliver` waits in the wake-up, and `_posted` if it has not begun; after `close`, `take`
    is not called. A call takes what is in the queue when it begins, so that others have their turn before what comes meanwhile.
    """

    held_back: ClassVar[float] = -inf
    """When a subscription of this process last held back Zenoh's threads, which all sessions share, on the loop's clock: nothing was read meanwhile."""

    def __init__(
        self,
        own: str,
        key: str,
        delivery: Delivery,
        take: Take,
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
        self._queue: deque[Any] = deque()
        """Samples; those of a patient one in pairs with the times of their arrival."""
        self._posted = False
        self._patience = 0.0 if delivery.history else delivery.patience
        self._post = wakeup.post_patiently if self._patience else wakeup.post
        self._holds_back = delivery.keep_all
        self._most = max(delivery.depth, _KEEP_ALL) if delivery.keep_all else 2 * delivery.depth + delivery.history
        self._room = threading.Event()
        self._hangs = False
        self._beyond = 0
        """The bytes that have come since the reader hangs."""
        self._size = 0
        """Of the last sample. A large one is handled before the next one is copied, so that its memory is still in the processor's cache then."""
        plain = not (self._patience or delivery.history or delivery.keep_all)
        self._together = take.together if plain and isinstance(take, TakesTogether) else None
        self._held = False
        """Whether a thread waits for room, or has given it up."""
        self._paused: asyncio.Task[None] | None = None
        """What waits until the next sample may be passed on."""
        self._closed = False
        self._forget = forget
        contacts = Contacts(own, lambda source: ask(self, source), self._pass)
        self.answered, self.complete = contacts.answered, contacts.complete
        self._contacts = contacts if delivery.history else None
        if self._patience:
            wakeup.be_patient(self._patience)
        self._subscriber = declare(self)

    def arrived(self, sample: objects.Sample) -> None:
        """Queue a sample. On a thread of Zenoh; waits if the queue is full and must keep all."""
        if len(self._queue) >= self._most:
            if self._holds_back:
                self._wait_for_room(sample)
            else:
                self._drop_oldest()
        self._queue.append((sample, self._time()) if self._patience else sample)
        if not self._posted:
            keep_thread_state()
            self._posted = True
            self._post(self._deliver, None)

    def close(self) -> None:
        """Take no more samples."""
        if not self._closed:
            self._closed = True
            self._queue.clear()
            self._room.set()
            if self._paused is not None:
                self._paused.cancel()
            self._subscriber.undeclare()
            if self._patience:
                self._wakeup.cease(self._patience)
            self._forget(self)

    def _wait_for_room(self, sample: objects.Sample) -> None:
        self._room.clear()
        self._held = True
        full = len(self._queue) >= self._most and not self._closed  # room may have been made just before
        Subscription.held_back = self._time()
        self._beyond = _OF_A_SAMPLE + len(sample.payload) + (self._beyond if self._hangs else 0)
        self._hangs = full and not self._room.wait(_PAUSE if self._hangs else _PATIENCE)
        Subscription.held_back = self._time()
        if self._hangs and self._beyond > _BEYOND:
            self._drop_oldest()

    def _drop_oldest(self) -> None:
        try:
            oldest = self._queue.popleft()
        except IndexError:  # the loop was faster
            return
        self._traffic.lost(oldest[0] if self._patience else oldest)

    def _deliver(self, left: int | None) -> None:
        """Pass on so many samples, or all that are there now."""
        queue, end = self._queue, self._wakeup.end
        if left is None:
            self._posted = False  # before they are counted: what is appended from here on is counted, or posts again
            left = len(queue)
        if self._paused is not None:
            return  # it posts again
        try:
            while left:
                left -= 1
                try:
                    sample = queue.popleft()
                except IndexError:  # some were dropped, or the subscription has been closed
                    left = 0
                    break
                if self._held:
                    self._make_room()
                if self._patience:
                    self._pass(*sample)
                elif self._contacts is None:
                    self._pass(sample)
                else:
                    self._contacts.take(sample)
                if self._paused is not None:
                    left = 0
                elif self._size >= LARGE or perf_counter() > end:
                    break
                elif self._together is not None and (most := min(left, _TOGETHER, LARGE // (self._size + 1))) > 1:
                    left -= self._pass_together(most)
        finally:  # also after a `take` that raised, which the loop reports
            if left:
                self._wakeup.go_on(self._deliver, left)

    def _pass(self, sample: objects.Sample, since: float | None = None) -> None:
        if self._closed:
            return
        attached = sample.attachment
        self._pass_bytes(sample, sample.payload.to_bytes(), b"" if attached is None else attached.to_bytes(), since)

    def _pass_together(self, most: int) -> int:
        """Pass on so many samples, or all that are there. Returns how many there were."""
        assert self._together is not None
        queue = self._queue
        samples: list[objects.Sample] = []
        with suppress(IndexError):  # some were dropped
            for _ in range(most):
                samples.append(queue.popleft())
        payloads = [sample.payload.to_bytes() for sample in samples]
        attachments = [b"" if (one := sample.attachment) is None else one.to_bytes() for sample in samples]
        if len({one[GID.start - 1 :] for one in attachments}) == 1 and self._together(payloads, attachments):
            self._traffic.received(samples[0], attachments[0], sum(map(len, payloads)))
        else:
            for sample, payload, attachment in zip(samples, payloads, attachments, strict=True):
                if not self._closed:
                    self._pass_bytes(sample, payload, attachment, None)
        return len(samples)

    def _pass_bytes(self, sample: objects.Sample, payload: bytes, attachment: bytes, since: float | None) -> None:
        self._size = len(payload)
        self._traffic.received(sample, attachment, self._size)
        wait = self._take(_sample((self._key, payload, attachment, since)))
        if wait is not None and self._holds_back and self._paused is None:
            self._paused = asyncio.get_running_loop().create_task(self._pause(wait), name=f"room for {self._key}")

    async def _pause(self, wait: Wait) -> None:
        """Pass on nothing until this is over."""
        try:
            await wait()
        finally:
            self._paused = None
        self._wakeup.post(self._deliver, None)

    def _make_room(self) -> None:
        if 2 * len(self._queue) < self._most:
            self._held = False
            self._room.set()
            self._hangs = False
