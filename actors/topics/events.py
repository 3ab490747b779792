"""QoS events of one endpoint: what has happened to it besides messages, counted and told.

Counting costs nothing until there is something to count: an endpoint makes its `EndpointEvents` when there is a deadline, a lease, an
incompatible peer or an `EventStream`.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from actors.errors import CallTimeout, Ended
from actors.waiting import Waiters

if TYPE_CHECKING:
    from actors.qos.events import DeadlineWatch, LeaseWatch

__all__ = ["EndpointEvents", "EventSource", "EventStream", "close_forgotten"]

E = TypeVar("E")


def close_forgotten(loop: asyncio.AbstractEventLoop, thread: int, close: Callable[[], None]) -> None:
    """Call `close` for an object of `loop`, which runs in `thread`, that has been garbage-collected.

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


class EndpointEvents:
    """What has happened to one endpoint besides messages, and the streams that tell of it.

    Invariants:

    * The timer is set exactly while there is a listener and the endpoint's `due` names an instant; nobody listening, nothing runs.
    * After `close` there are no listeners and no timer, and none comes again; the counts stay.
    * Counts never shrink.
    """

    __slots__ = (
        "_due", "_loop", "_thread", "_timer", "closed", "deadline", "incompatible_qos", "incompatible_type", "last_policy", "lease", "listeners",
    )  # fmt: skip

    def __init__(self, due: Callable[[int], int | None]) -> None:
        self._due = due
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

    def notify(self) -> None:
        """Wake the listeners, and set the timer for the next event that silence causes."""
        for listener in tuple(self.listeners):  # a listener may be collected, and leave, at any moment
            listener.waiters.wake_all()
        self.arm()

    def arm(self) -> None:
        """Set the timer for the next event that silence causes; without listeners, or such an event, there is no timer."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = self._due(self.now()) if self.listeners else None
        if due is not None:
            self._timer = self._loop.call_at(due / 1e9, self._look, due)

    def close(self) -> None:
        """The endpoint has ended: wake the listeners, which end with it."""
        self.closed = True
        listeners, self.listeners = self.listeners, []
        for listener in listeners:
            listener.waiters.wake_all()
        self.arm()

    def remove(self, listener: _Listener) -> None:
        """End one listener. Twice is fine."""
        if listener in self.listeners:
            self.listeners.remove(listener)
            listener.waiters.wake_all()
            self.arm()

    def remove_forgotten(self, listener: _Listener) -> None:
        """As `remove`, from whichever thread has collected the listener's stream."""
        if listener in self.listeners:
            close_forgotten(self._loop, self._thread, lambda: self.remove(listener))

    def _look(self, due: int) -> None:
        """The timer: if a message came meanwhile, what was due is due later."""
        self._timer = None
        later = self._due(due - 1)
        if later is not None and later > self.now():
            self.arm()
        else:
            self.notify()


class _Listener:
    """The inner end of an `EventStream`, so that a stream that is forgotten does not live on in its endpoint."""

    __slots__ = ("waiters",)

    def __init__(self) -> None:
        self.waiters = Waiters()


class EventSource(Protocol):
    """An endpoint, as its event streams see it."""

    @property
    def status(self) -> Any:
        """What the endpoint has met so far, in totals; its `since(earlier)` gives the events between two of them."""
        ...

    def keep_events(self) -> EndpointEvents:
        """The endpoint's events, kept from now on."""
        ...


class EventStream(Generic[E]):
    """The QoS events of one endpoint, to iterate: ``async for event in publisher.events()``.

    It tells what happens from the moment it was made; `status` of the endpoint says what was before. Events of one kind that have not been
    taken are merged into one, so a slow reader falls behind by at most one event of each kind. It ends with `close()`, with its
    endpoint, and when nobody refers to it any more. At most one task may wait on it.

    It has no public constructor: `events()` of an endpoint gives one.
    """

    # Invariants:
    # * `_told` is the status up to which events have been put into `_ready`; events are made of the difference to the status of now.
    # * The stream is open exactly as long as its listener is among those of the endpoint.

    __slots__ = ("_endpoint", "_events", "_kept", "_listener", "_ready", "_told")

    def __init__(self, endpoint: EventSource, kept: object = None) -> None:
        self._endpoint = endpoint
        self._kept = kept  # the stream of messages whose events these are lives as long as its events are read
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
        try:
            async with asyncio.timeout(timeout):
                return await self.__anext__()
        except StopAsyncIteration:
            raise Ended(f"the {self!r} have ended with it: ask its successor") from None
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
        if not self._ready and self._listener in self._events.listeners:
            status = self._endpoint.status
            self._ready.extend(status.since(self._told))
            self._told = status
        return bool(self._ready)

    def close(self) -> None:
        """Listen no more. Closing twice is fine."""
        self._events.remove(self._listener)

    def __del__(self) -> None:
        if hasattr(self, "_events"):
            self._events.remove_forgotten(self._listener)
