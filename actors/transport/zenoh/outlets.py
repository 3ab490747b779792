"""The sending end of a key."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final, NamedTuple

from actors.transport.keyed.protocol import Delivery
from actors.transport.protocol import Wait
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker
from actors.transport.zenoh import objects
from actors.transport.zenoh.library import direct, import_zenoh
from actors.transport.zenoh.memory import LARGE
from actors.transport.zenoh.traffic import Traffic

KEEP_ALL: Final = 64 * 1024 * 1024
"""The most bytes that are queued for the worker in an outlet that may not drop. Beyond that it drops, because `put` cannot wait."""

FULL: Final = 1024 * 1024
"""The bytes that are queued for the worker in an outlet that may not drop, beyond which a sender that can wait has to."""


class Publishers(NamedTuple):
    """Zenoh's publishers of an outlet. The plain one reports whether anybody listens; the advanced one, which keeps samples, does not."""

    plain: objects.Matching
    sends: objects.Publisher
    blocks: bool = False
    """Whether a put waits until every link has taken the sample."""


class Outlet:
    """Sends at once what Zenoh takes at once, and by the worker what may have to wait.

    Zenoh waits for a receiver that does not read: up to 50 ms if the payload is large, without a limit if nothing may be dropped. Such samples go
    through a queue. KEEP_LAST drops the oldest sample when the queue is longer than its depth.

    Invariants: `_direct` is true while samples are wanted and small ones need not wait. Samples are put in their order: none directly while the
    worker has one, that is while `_handed != _done`. Only the loop writes `_handed`, and only the worker `_done`; they count the bytes, and one
    more for each sample.
    """

    def __init__(
        self,
        delivery: Delivery,
        publishers: Publishers,
        wakeup: Wakeup,
        worker: Worker,
        traffic: Traffic,
        wanted: Callable[[Outlet], None],
        soon: Callable[[Callable[[], None]], None],
        forget: Callable[[Outlet], None],
        share: Callable[[bytes], Any] | None = None,
    ) -> None:
        """`wanted` is called on the loop when `Outlet.wanted` has changed, `forget` when the outlet is closed.

        `soon` calls its argument after the loss of a process has been reported, which may be why nobody listens any more. `share` puts a large
        payload into shared memory.
        """
        self._publishers = publishers
        self._send = publishers.sends.put
        self._worker = worker
        self._traffic = traffic
        self._tell = wanted
        self._soon = soon
        self._forget = forget
        self._share = share
        self._keep_all = delivery.keep_all
        self._waits = publishers.blocks
        self._depth = delivery.depth
        self._queue: deque[tuple[bytes, bytes]] = deque()
        self._handed = 0
        self._done = 0
        self._closed = False
        handler = direct(lambda status: wakeup.post(self._matched, status.matching))
        self._listener = publishers.plain.declare_matching_listener(handler)
        # Asked after the listener was declared: what changes later is told.
        self._matching: bool = publishers.plain.matching_status.matching
        self._wanted: bool = self._matching
        self._direct = self._wanted and not self._waits

    @property
    def wanted(self) -> bool:
        """Whether a subscription of another process is known for the key."""
        return self._wanted

    def put(self, payload: bytes, attachment: bytes) -> None:
        """Send one sample to all subscriptions of the key in other processes, and keep it if the outlet has history."""
        if self._direct and self._handed == self._done and len(payload) < LARGE:
            self._traffic.sent += len(payload)
            try:
                self._send(payload, attachment=attachment)
            except import_zenoh().ZError:
                self._traffic.unsent += 1
            return
        if self._closed:
            return
        may_wait = False
        # Zenoh may know of a reader of which the loop has yet to be told: it waits for that one already.
        if self._wanted or (self._waits and self._publishers.plain.matching_status.matching):
            self._traffic.sent += len(payload)
            may_wait = self._waits or len(payload) >= LARGE
        if may_wait or self._handed != self._done:
            self._hand_over(payload, attachment)
        else:
            self._put(payload, attachment)

    @property
    def drained(self) -> Wait | None:
        """See `PublisherHere.drained`."""
        return self._drained if self._keep_all and self._handed - self._done > FULL else None

    async def _drained(self) -> None:
        await self._worker.result(lambda: None)

    def close(self) -> None:
        """Put no more samples. Those that wait for the worker are sent."""
        if not self._closed:
            self._closed = True
            self._direct = False
            self._listener.undeclare()
            self._worker.do(self._undeclare)
            self._forget(self)

    def _matched(self, matching: bool) -> None:
        self._matching = matching
        if matching:
            self._show()
        else:
            self._soon(self._show)

    def _show(self) -> None:
        if self._wanted != self._matching and not self._closed:
            self._wanted = self._matching
            self._direct = self._wanted and not self._waits
            self._tell(self)

    def _hand_over(self, payload: bytes, attachment: bytes) -> None:
        if self._keep_all:
            if self._handed - self._done > KEEP_ALL:
                self._traffic.unsent += 1
                return
        elif len(self._queue) >= self._depth:
            self._drop_oldest()
        self._handed += 1 + len(payload)
        self._queue.append((payload, attachment))
        self._worker.do(self._put_next)

    def _drop_oldest(self) -> None:
        with suppress(IndexError):  # the worker was faster: nothing is dropped
            payload, _ = self._queue.popleft()
            self._handed -= 1 + len(payload)
            self._traffic.unsent += 1

    def _put_next(self) -> None:
        with suppress(IndexError):  # it was dropped
            payload, attachment = self._queue.popleft()
            try:
                self._put(payload, attachment)
            finally:
                self._done += 1 + len(payload)

    def _put(self, payload: bytes, attachment: bytes) -> None:
        shared = payload if self._share is None or len(payload) < LARGE else self._share(payload)
        try:
            self._send(shared, attachment=attachment)
        except import_zenoh().ZError:  # the session has been closed, or a limit of the user's access control forbids it
            self._traffic.unsent += 1

    def _undeclare(self) -> None:
        for publisher in {self._publishers.sends, self._publishers.plain}:
            publisher.undeclare()
