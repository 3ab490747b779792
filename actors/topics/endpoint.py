"""Publishers and subscriptions as ends of a topic: their node, topic and quality of service, and their QoS events.

The events (missed deadlines, lost liveliness, incompatible peers, matches) are read as totals and as a stream. An endpoint creates its
`EndpointEvents` only when it has a deadline, a lease, an incompatible peer or an `EventStream`. Until then, events cost nothing.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from contextvars import copy_context
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.checks import NoPublicConstructor
from actors.errors import CallTimeout, Ended
from actors.qos import BEST_AVAILABLE_DURATION
from actors.time.deadlines import check_timeout
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.qos.watches import DeadlineWatch, LeaseWatch
    from actors.topics.peers import Participant, TopicRegistry

E = TypeVar("E")


def close_forgotten(loop: asyncio.AbstractEventLoop, thread: int, close: Callable[[], None]) -> None:
    """Call `close` on behalf of an object that has been garbage-collected and belonged to `loop`, which runs in `thread`.

    The garbage collector may run in any thread. In another thread than the loop's, the call is handed over to the loop. If the loop is
    closed, nothing is called.
    """
    if loop.is_closed():
        return
    if get_ident() == thread:
        close()
        return
    with suppress(RuntimeError):  # the loop was closed in the meantime
        loop.call_soon_threadsafe(close)


class EndpointEvents:
    """The QoS event counters of one endpoint, and the event streams that read them.

    Invariants:

    * A timer is set only while there is a listener and the endpoint's `due` returns a time. Without listeners no timer runs.
    * After `close` there are no listeners and no timer, and none are added; the counters keep their values.
    * The timer runs in the context of the node that the endpoint belongs to, also if another one sets it.
    * No counter ever decreases.
    """

    __slots__ = (
        "_context", "_due", "_loop", "_thread", "_timer", "closed", "deadline", "incompatible_qos", "incompatible_type", "last_policy", "lease", "listeners",
    )  # fmt: skip

    def __init__(self, due: Callable[[int], int | None]) -> None:
        self._due = due
        self._context = copy_context()
        self._loop = asyncio.get_running_loop()
        self._thread = get_ident()
        self._timer: asyncio.TimerHandle | None = None
        self.deadline: DeadlineWatch | None = None
        self.lease: LeaseWatch | None = None
        self.incompatible_qos = 0
        self.incompatible_type = 0
        self.last_policy = "INVALID"
        self.listeners: list[_Listener] = []
        self.closed = False

    def now(self) -> int:
        """The loop's time in nanoseconds."""
        return round(self._loop.time() * 1e9)

    def missed(self) -> int:
        """The number of deadlines missed so far."""
        return 0 if self.deadline is None else self.deadline.advance(self.now())

    def lost(self) -> int:
        """The number of times the lease has run out so far."""
        if self.lease is None:
            return 0
        self.lease.advance(self.now())
        return self.lease.lost

    def notify(self) -> None:
        """Wake the listeners, and set the timer for the next event that a lack of messages causes."""
        for listener in tuple(self.listeners):  # the garbage collector may remove a listener during this loop
            listener.waiters.wake_all()
        self.arm()

    def arm(self) -> None:
        """Set the timer for the next event that a lack of messages causes. Without listeners, or without such an event, clear it."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = self._due(self.now()) if self.listeners else None
        if due is not None:
            self._timer = self._loop.call_at(due / 1e9, self._look, due, context=self._context)

    def close(self) -> None:
        """End all listeners, because the endpoint has ended. Their tasks are woken."""
        self.closed = True
        listeners, self.listeners = self.listeners, []
        for listener in listeners:
            listener.waiters.wake_all()
        self.arm()

    def remove(self, listener: _Listener) -> None:
        """End one listener. Calling it twice is harmless."""
        if listener in self.listeners:
            self.listeners.remove(listener)
            listener.waiters.wake_all()
            self.arm()

    def remove_forgotten(self, listener: _Listener) -> None:
        """Like `remove`, but callable from any thread: used when the listener's stream has been garbage-collected."""
        if listener in self.listeners:
            close_forgotten(self._loop, self._thread, lambda: self.remove(listener))

    def _look(self, due: int) -> None:
        """Handle the timer: wake the listeners, or set the timer again if a message has postponed the event."""
        self._timer = None
        later = self._due(due - 1)
        if later is not None and later > self.now():
            self.arm()
        else:
            self.notify()


class _Listener:
    """The part of an `EventStream` that its endpoint refers to. The endpoint does not refer to the stream, so an unused stream can be
    collected."""

    __slots__ = ("waiters",)

    def __init__(self) -> None:
        self.waiters = Waiters()


def nanoseconds(duration: float | None) -> int | None:
    """Convert a duration of a QoS profile from seconds to whole nanoseconds, rounded up; None for an infinite or unspecified one."""
    if duration is None or duration in (math.inf, BEST_AVAILABLE_DURATION):
        return None
    return math.ceil(duration * 1e9 - 1e-3)


class Endpoint:
    """One end of a topic, owned by one node of this process.

    Invariants:

    * `kept_events` is None until the endpoint has a deadline, a lease, an incompatible peer or an event stream, and never None again after
      that.
    * `matched_total` never decreases.
    """

    __slots__ = ("entry", "kept_events", "matched_total", "node", "qos")

    def __init__(self, node: Participant, entry: TopicRegistry, qos: QoS) -> None:
        self.node = node
        self.entry = entry
        self.qos = qos
        self.matched_total: int = 0
        """The number of peers matched so far, including those that have left."""
        self.kept_events: EndpointEvents | None = None

    @property
    def here(self) -> bool:
        return True

    @property
    def checks_qos(self) -> bool:
        return True

    @property
    def status(self) -> Any:
        """The running totals of this endpoint's QoS events."""
        raise NotImplementedError  # each kind of endpoint has its own

    def due(self, now: int) -> int | None:
        """The time, in nanoseconds and later than `now`, of the next event that a lack of messages causes; None if there is none."""
        raise NotImplementedError  # each kind of endpoint has its own

    def keep_events(self) -> EndpointEvents:
        """Return the record of this endpoint's QoS events, creating it at the first call."""
        if self.kept_events is None:
            self.kept_events = EndpointEvents(self.due)
        return self.kept_events

    def notify(self) -> None:
        """Wake the tasks that wait for QoS events, because the status may have changed."""
        if self.kept_events is not None:
            self.kept_events.notify()

    def count_incompatible_qos(self, policy: str) -> None:
        """Record a peer that is not matched because of its quality of service. `policy` is the last policy that is incompatible."""
        events = self.keep_events()
        events.incompatible_qos += 1
        events.last_policy = policy
        events.notify()

    def count_incompatible_type(self) -> None:
        """Record a peer that is not matched because its type differs."""
        events = self.keep_events()
        events.incompatible_type += 1
        events.notify()

    def end_events(self) -> None:
        """End the endpoint's event streams, because the endpoint has ended."""
        if self.kept_events is not None:
            self.kept_events.close()


class EventStream(Generic[E], metaclass=NoPublicConstructor):
    """The QoS events of one endpoint, as an async iterator: ``async for event in publisher.events()``.

    The stream reports events from the moment it is created; the endpoint's `status` holds the totals before that. Events of the same kind
    that have not been read are merged into one, so a slow reader is at most one event of each kind behind. The stream ends with `close()`,
    with its endpoint, or when it is no longer referenced. At most one task may wait on it.

    It has no public constructor: `events()` of an endpoint gives one.
    """

    # Invariants:
    # * `_told` is the status up to which events have been put into `_ready`. Later events are computed from the difference to the current
    #   status.
    # * The stream is open exactly as long as `_listener` is among the listeners of the endpoint.

    __slots__ = ("_endpoint", "_events", "_kept", "_listener", "_ready", "_told")

    def __init__(self, endpoint: Endpoint, kept: object = None) -> None:
        self._endpoint = endpoint
        # The events of a stream of messages keep that stream alive.
        self._kept = kept
        self._told = endpoint.status
        self._ready: deque[E] = deque()
        self._listener = _Listener()
        self._events = endpoint.keep_events()
        if not self._events.closed:
            self._events.listeners.append(self._listener)
            self._events.arm()

    def __repr__(self) -> str:
        return f"<events of {self._endpoint!r}>"

    def __aiter__(self) -> EventStream[E]:
        return self

    async def __anext__(self) -> E:
        waiters = self._listener.waiters
        while not self.waiting():
            if self._listener not in self._events.listeners:
                raise StopAsyncIteration
            if waiters:
                raise RuntimeError(f"two tasks wait for the {self!r}: give each its own events()")
            await waiters.wait()
        return self._ready.popleft()

    async def next(self, timeout: float | None = None) -> E:
        """The next event. Raises `CallTimeout` after `timeout` seconds without one, `Ended` once the stream has ended."""
        if timeout is not None:
            check_timeout(f"the {self!r}", timeout)
        try:
            async with asyncio.timeout(timeout):
                return await self.__anext__()
        except StopAsyncIteration:
            raise Ended(f"the {self!r} have ended with it: ask its successor") from None
        except TimeoutError:
            raise CallTimeout(f"no event within {timeout} s from {self._endpoint!r}") from None

    def take(self) -> list[E]:
        """Return, without waiting, the events since the last one was taken: at most one of each kind."""
        self.waiting()
        taken = list(self._ready)
        self._ready.clear()
        return taken

    def waiting(self) -> bool:
        """Whether an event can be taken without waiting."""
        if not self._ready and self._listener in self._events.listeners:
            status = self._endpoint.status
            self._ready.extend(status.since(self._told))
            self._told = status
        return bool(self._ready)

    def close(self) -> None:
        """End the stream. Closing twice is harmless."""
        self._events.remove(self._listener)

    def __del__(self) -> None:
        if hasattr(self, "_events"):
            self._events.remove_forgotten(self._listener)
