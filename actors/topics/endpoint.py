"""What publishers and subscriptions have in common: their place in the graph, and what happens to them besides messages.

Nobody pays for events that nobody asked for: an endpoint counts its peers; everything else is kept in a `Happenings`, which exists
once there is a deadline, a lease, an incompatible peer or a listener.
"""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.errors import CallTimeout, NotStarted
from actors.qos import BEST_AVAILABLE_DURATION

if TYPE_CHECKING:
    from actors.graph.graph import Participant, TopicEntry
    from actors.qos.events import DeadlineWatch, LeaseWatch
    from actors.qos.policies import QoS

__all__ = ["Endpoint", "EventStream", "Happenings", "close_forgotten", "nanoseconds"]

E = TypeVar("E")


def nanoseconds(duration: float | None) -> int | None:
    """A duration of a QoS in whole nanoseconds, rounded up; None for one that never ends."""
    if duration is None or duration in (math.inf, BEST_AVAILABLE_DURATION):
        return None
    return math.ceil(duration * 1e9 - 1e-3)


def close_forgotten(loop: asyncio.AbstractEventLoop, thread: int, close: Callable[[], None]) -> None:
    """Call `close` for something of `loop`, which runs in `thread`, that nobody refers to any more.

    The garbage collector runs in whichever thread needs memory: from a foreign one the call waits for the loop's next turn. With a closed
    loop there is nothing left to be done.
    """
    if loop.is_closed():
        return
    if get_ident() == thread:
        close()
        return
    with suppress(RuntimeError):  # closed meanwhile
        loop.call_soon_threadsafe(close)


class Endpoint(Generic[E]):
    """One end of a topic in one node; `E` is the events it can tell."""

    __slots__ = ("entry", "happenings", "matched_total", "node", "qos")

    def __init__(self, node: Participant, entry: TopicEntry, qos: QoS) -> None:
        self.node = node
        self.entry = entry
        self.qos = qos
        self.matched_total: int = 0
        """How many peers were ever matched."""
        self.happenings: Happenings | None = None

    @property
    def status(self) -> Any:
        """What this endpoint has met so far, in totals."""
        raise NotImplementedError

    def due(self, now: int) -> int | None:
        """When, in nanoseconds after `now`, the next thing happens by silence alone; None for never."""
        raise NotImplementedError

    def happening(self) -> Happenings:
        """The record of what happens here, from now on kept."""
        if self.happenings is None:
            self.happenings = Happenings(self)
        return self.happenings

    def tell(self) -> None:
        """Something happened: let the listeners look."""
        if self.happenings is not None:
            self.happenings.tell()

    def end_events(self) -> None:
        """The endpoint has ended, and with it its events."""
        if self.happenings is not None:
            self.happenings.close()


class Happenings:
    """What has happened to one endpoint besides messages, and who listens. Its timer runs only while somebody listens."""

    __slots__ = (
        "_endpoint", "_loop", "_thread", "_timer", "closed", "deadline", "incompatible_qos", "incompatible_type", "last_policy", "lease",
        "listeners",
    )  # fmt: skip

    def __init__(self, endpoint: Endpoint[Any]) -> None:
        self._endpoint = endpoint
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
        """How many deadlines were missed until now."""
        return 0 if self.deadline is None else self.deadline.advance(self.now())

    def lost(self) -> int:
        """How often the lease ran out until now."""
        if self.lease is None:
            return 0
        self.lease.advance(self.now())
        return self.lease.lost

    def tell(self) -> None:
        """Let the listeners look, and see when the next thing happens by itself."""
        for listener in tuple(self.listeners):  # a listener may be collected, and leave, at any moment
            listener.wake()
        self.arm()

    def arm(self) -> None:
        """Set the timer for what happens next by silence alone; nobody listening, or nothing to come, there is none."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = self._endpoint.due(self.now()) if self.listeners else None
        if due is not None:
            self._timer = self._loop.call_at(due / 1e9, self._look, due)

    def close(self) -> None:
        """The endpoint has ended, and with it what its listeners wait for."""
        self.closed = True
        listeners, self.listeners = self.listeners, []
        for listener in listeners:
            listener.wake()
        self.arm()

    def dismiss(self, listener: _Listener) -> None:
        """A listener has heard enough. Twice is fine."""
        if listener in self.listeners:
            self.listeners.remove(listener)
            listener.wake()
            self.arm()

    def dismiss_forgotten(self, listener: _Listener) -> None:
        """The same, from whichever thread has found that nobody listens any more."""
        if listener in self.listeners:
            close_forgotten(self._loop, self._thread, lambda: self.dismiss(listener))

    def _look(self, due: int) -> None:
        """The timer: if meanwhile a message came, what was due is due later."""
        self._timer = None
        later = self._endpoint.due(due - 1)
        if later is not None and later > self.now():
            self.arm()
        else:
            self.tell()


class _Listener:
    """The inner end of an `EventStream`, so that a stream that is forgotten does not live on in its endpoint."""

    __slots__ = ("waiter",)

    def __init__(self) -> None:
        self.waiter: asyncio.Future[None] | None = None

    def wake(self) -> None:
        if self.waiter is not None and not self.waiter.done():
            self.waiter.set_result(None)


class EventStream(Generic[E]):
    """The QoS events of one endpoint, to iterate: ``async for event in publisher.events()``.

    It tells what happens from the moment it was made; `status` of the endpoint says what was before. Happenings of one kind that nobody
    took are told as one event, so a slow listener falls behind by at most one event of each kind. It ends with `close()`, with its
    endpoint, and when nobody refers to it any more. At most one task may wait on it.

    It has no public constructor: `events()` of an endpoint gives one.
    """

    __slots__ = ("_endpoint", "_happenings", "_kept", "_listener", "_ready", "_told")

    def __init__(self, endpoint: Endpoint[E], kept: object = None) -> None:
        self._endpoint = endpoint
        self._kept = kept  # a stream whose events these are lives as long as somebody listens to them
        self._told = endpoint.status
        self._ready: deque[E] = deque()
        self._listener = _Listener()
        self._happenings = endpoint.happening()
        if not self._happenings.closed:
            self._happenings.listeners.append(self._listener)
            self._happenings.arm()

    def __repr__(self) -> str:
        return f"<events of {self._endpoint!r}>"

    def __aiter__(self) -> EventStream[E]:
        return self

    async def __anext__(self) -> E:
        while not self.waiting():
            if self._listener not in self._happenings.listeners:
                raise StopAsyncIteration
            if self._listener.waiter is not None:
                raise RuntimeError(f"two tasks wait for the {self!r}: give each its own events()")
            self._listener.waiter = asyncio.get_running_loop().create_future()
            try:
                await self._listener.waiter
            finally:
                self._listener.waiter = None
        return self._ready.popleft()

    async def next(self, timeout: float | None = None) -> E:
        """The next event. Raises `CallTimeout` after `timeout` seconds without one, `NotStarted` once the stream has ended."""
        try:
            async with asyncio.timeout(timeout):
                return await self.__anext__()
        except StopAsyncIteration:
            raise NotStarted(f"the {self!r} have ended with it: ask its successor") from None
        except TimeoutError:
            raise CallTimeout(f"no event within {timeout} s from {self._endpoint!r}") from None

    def take(self) -> list[E]:
        """What has happened since the last event was taken, at once: at most one event of each kind."""
        self.waiting()
        taken = list(self._ready)
        self._ready.clear()
        return taken

    def waiting(self) -> bool:
        """Whether an event can be taken without waiting."""
        if not self._ready and self._listener in self._happenings.listeners:
            status = self._endpoint.status
            self._ready.extend(status.since(self._told))
            self._told = status
        return bool(self._ready)

    def close(self) -> None:
        """Listen no more. Closing twice is fine."""
        self._happenings.dismiss(self._listener)

    def __del__(self) -> None:
        if hasattr(self, "_happenings"):
            self._happenings.dismiss_forgotten(self._listener)
